// Rapier (WebAssembly, single precision) in its own loop: the scene as engine/peers/rapier.py describes it.
import { serve } from "./loop.mjs";

serve(async (task) => {
  const { default: R } = await import(task.module);
  await R.init();

  const vec = ([x, y, z]) => ({ x, y, z });
  const quat = ([w, x, y, z]) => ({ w, x, y, z });
  const upright = quat([1, 0, 0, 0]);
  const pointInertia = vec([1e-6, 1e-6, 1e-6]); // kg m²: every moving body wants one; a particle that turns is not seen to

  const world = new R.World(vec(task.gravity));
  world.timestep = task.time_step;
  world.integrationParameters.numSolverIterations = task.options.sweeps;

  function shapeOf(shape) {
    if (shape.kind === "sphere") return new R.Ball(shape.radius);
    if (shape.kind === "box") return new R.Cuboid(...shape.half);
    if (shape.kind === "capsule") return new R.Capsule(shape.half, shape.radius); // along y
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
    if (given.shape && task.contacts) {
      const collider = new R.ColliderDesc(shapeOf(given.shape)).setDensity(0).setRestitution(given.restitution);
      collider.setRestitutionCombineRule(R.CoefficientCombineRule.Max);
      collider.setFriction(Math.sqrt(given.friction)).setFrictionCombineRule(R.CoefficientCombineRule.Multiply);
      if (given.shape.kind === "capsule") collider.setRotation(quat([Math.SQRT1_2, Math.SQRT1_2, 0, 0])); // y to z
      if (task.contacts_of.length > 0)
        collider.setActiveEvents(R.ActiveEvents.CONTACT_FORCE_EVENTS).setContactForceEventThreshold(0);
      bodyOfCollider.set(world.createCollider(collider, body).handle, place);
    }
    return body;
  }

  const bodies = task.bodies.map(bodyOf);

  for (const given of task.constraints) {
    const ends = given.ends.map((end) =>
      typeof end === "number" ? bodies[end] : world.createRigidBody(R.RigidBodyDesc.fixed()),
    );
    const [a, b] = given.points.map(vec);
    let joint = R.JointData.spherical(a, b);
    if (given.kind === "lock") joint = R.JointData.fixed(a, quat(given.turns[0]), b, quat(given.turns[1]));
    if (given.kind === "prismatic") joint = R.JointData.prismatic(a, b, vec(given.axis));
    if (given.kind === "hinge") joint = R.JointData.revolute(a, b, vec(given.axis));
    world.createImpulseJoint(joint, ends[0], ends[1], true).setContactsEnabled(false);
  }
  for (const load of task.loads) {
    bodies[load.body].addForce(vec(load.force), true); // stays until it is taken away
    bodies[load.body].addTorque(vec(load.torque), true);
  }

  const column = new Map(task.contacts_of.map(([i, j], place) => [`${i} ${j}`, 3 * place]));
  const forces = new Float64Array(3 * column.size); // of the last step, N, on the first of each pair
  const events = column.size > 0 ? new R.EventQueue(true) : undefined;

  function step() {
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
