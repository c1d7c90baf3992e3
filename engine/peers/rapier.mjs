// Rapier (WebAssembly, single precision) in its own loop: the scene as engine/peers/rapier.py describes it.
import { serve } from "./loop.mjs";

serve(async (task) => {
  const { default: R } = await import(task.module);
  await R.init();

  const vec = ([x, y, z]) => ({ x, y, z });
  const quat = ([w, x, y, z]) => ({ w, x, y, z });
  const upright = quat([1, 0, 0, 0]);
  const pointInertia = vec([1e-6, 1e-6, 1e-6]); // kg m²: every moving body wants one; a particle that turns is not seen to

  const product = ([a, b, c, d], [w, x, y, z]) => [
    a * w - b * x - c * y - d * z,
    a * x + b * w + c * z - d * y,
    a * y - b * z + c * w + d * x,
    a * z + b * y - c * x + d * w,
  ];

  const world = new R.World(vec(task.gravity));
  world.timestep = task.time_step;
  world.integrationParameters.numSolverIterations = task.options.sweeps;

  function shapeOf(shape) {
    if (shape.kind === "sphere") return new R.Ball(shape.radius);
    if (shape.kind === "box") return new R.Cuboid(...shape.half);
    if (shape.kind === "capsule") return new R.Capsule(shape.half, shape.radius); // along y
    if (shape.kind === "cylinder") return new R.Cylinder(shape.half, shape.radius); // along y
    if (shape.kind === "hull") return new R.ConvexPolyhedron(new Float32Array(shape.corners.flat()), null);
    if (shape.kind === "mesh") {
      const sides = [new Float32Array(shape.corners.flat()), new Uint32Array(shape.faces.flat())];
      return new R.TriMesh(...sides, R.TriMeshFlags?.FIX_INTERNAL_EDGES);
    }
    return new R.HalfSpace(vec(shape.normal));
  }

  const bodyOfCollider = new Map(); // handle → place among the bodies
  const KINDS = {
    static: R.RigidBodyDesc.fixed,
    kinematic: R.RigidBodyDesc.kinematicVelocityBased,
    dynamic: R.RigidBodyDesc.dynamic,
    particle: R.RigidBodyDesc.dynamic,
  };
  function bodyOf(given, place) {
    const kind = KINDS[given.motion]();
    const described = kind.setTranslation(...given.position).setRotation(quat(given.orientation)).setCanSleep(false);
    const body = world.createRigidBody(
      described.setLinvel(...given.velocity).setAngvel(vec(given.spin)).setLinearDamping(0).setAngularDamping(0),
    );
    const inertia = given.motion === "particle" ? pointInertia : vec(given.inertia);
    if (given.mass > 0) body.setAdditionalMassProperties(given.mass, vec([0, 0, 0]), inertia, upright, true);
    const none = { at: [0, 0, 0], turn: [1, 0, 0, 0] };
    const parts = given.shape?.kind === "compound" ? given.shape.parts : [{ ...none, shape: given.shape }];
    for (const part of given.shape && task.contacts ? parts : []) {
      const collider = new R.ColliderDesc(shapeOf(part.shape)).setDensity(0).setRestitution(given.restitution);
      collider.setRestitutionCombineRule(R.CoefficientCombineRule.Max);
      collider.setFriction(Math.sqrt(given.friction)).setFrictionCombineRule(R.CoefficientCombineRule.Multiply);
      const upright = part.shape.kind === "capsule" || part.shape.kind === "cylinder";
      const turn = upright ? product(part.turn, [Math.SQRT1_2, Math.SQRT1_2, 0, 0]) : part.turn; // y to z
      collider.setTranslation(...part.at).setRotation(quat(turn));
      if (task.contacts_of.length > 0)
        collider.setActiveEvents(R.ActiveEvents.CONTACT_FORCE_EVENTS).setContactForceEventThreshold(0);
      bodyOfCollider.set(world.createCollider(collider, body).handle, place);
    }
    return body;
  }

  const bodies = task.bodies.map(bodyOf);

  const fixed = () => world.createRigidBody(R.RigidBodyDesc.fixed());
  for (const given of task.constraints) {
    const ends = given.ends.map((end) => (typeof end === "number" ? bodies[end] : fixed()));
    const [a, b] = given.points.map(vec);
    const turns = given.turns.map(quat);
    const x = vec(given.axis ?? [1, 0, 0]); // in the axes of both
    let made = R.JointData.spherical(a, b);
    if (given.kind === "lock") made = R.JointData.fixed(a, turns[0], b, turns[1]);
    if (given.kind === "prismatic") made = R.JointData.prismatic(a, b, x);
    if (given.kind === "hinge") made = R.JointData.revolute(a, b, x);
    const joint = world.createImpulseJoint(made, ends[0], ends[1], true);
    joint.setContactsEnabled(false);
    if (given.axis === null) {
      joint.setLocalFrame1(a, turns[0]);
      joint.setLocalFrame2(b, turns[1]);
    }
    if (given.motor) {
      joint.configureMotorModel(R.MotorModel.ForceBased);
      joint.configureMotorVelocity(given.motor.speed, given.motor.damping);
      if (given.motor.most !== null) joint.setMotorMaxForce(given.motor.most);
    }
  }
  for (const [one, two] of task.parted) {
    // kept apart by a joint that holds nothing
    const zero = vec([0, 0, 0]);
    const free = R.JointData.generic(zero, zero, vec([1, 0, 0]), 0);
    world.createImpulseJoint(free, bodies[one], bodies[two], true).setContactsEnabled(false);
  }
  for (const spring of task.springs) {
    const ends = spring.ends.map((end) => (typeof end === "number" ? bodies[end] : fixed()));
    const points = spring.ends.map((end, k) => vec(typeof end === "number" ? spring.anchors[k] : end));
    const made = R.JointData.spring(spring.rest, spring.stiffness, spring.viscosity, ...points);
    world.createImpulseJoint(made, ends[0], ends[1], true).setContactsEnabled(true);
  }
  for (const { body, force, torque } of task.loads) {
    bodies[body].addForce(vec(force), true); // stays until it is taken away
    bodies[body].addTorque(vec(torque), true);
  }
  // Fields push at once, and not through all iterations of a step, which would give energy.
  function pull() {
    for (const { centre, strength } of task.fields)
      task.bodies.forEach(({ mass }, index) => {
        if (!(mass > 0)) return;
        const p = bodies[index].translation();
        const [x, y, z] = [p.x - centre[0], p.y - centre[1], p.z - centre[2]];
        const size = (-mass * strength * task.time_step) / (x * x + y * y + z * z) ** 1.5;
        bodies[index].applyImpulse(vec([size * x, size * y, size * z]), true);
      });
  }

  const column = new Map(task.contacts_of.map(([i, j], place) => [`${i} ${j}`, 3 * place]));
  const forces = new Float64Array(3 * column.size); // of the last step, N, on the first of each pair
  const events = column.size > 0 ? new R.EventQueue(true) : undefined;

  function step() {
    if (task.fields.length > 0) pull();
    world.step(events);
    forces.fill(0);
    events?.drainContactForceEvents((event) => {
      const [i, j] = [event.collider1(), event.collider2()].map((handle) => bodyOfCollider.get(handle));
      const force = event.totalForce(); // on the second
      const [place, sign] = i < j ? [column.get(`${i} ${j}`), -1] : [column.get(`${j} ${i}`), 1];
      [force.x, force.y, force.z].forEach((part, axis) => {
        forces[place + axis] += sign * part;
      });
    });
  }

  function state() {
    const all = bodies.flatMap((body) => {
      const [p, q, v, w] = [body.translation(), body.rotation(), body.linvel(), body.angvel()];
      return [p.x, p.y, p.z, q.w, q.x, q.y, q.z, v.x, v.y, v.z, w.x, w.y, w.z];
    });
    return column.size > 0 ? all.concat(...forces) : all;
  }

  function free() {
    events?.free();
    world.free();
  }

  return { step, state, free };
});
