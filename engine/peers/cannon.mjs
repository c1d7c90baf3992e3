// cannon-es in its own loop: the scene as engine/peers/cannon.py describes it.
import { serve } from "./loop.mjs";

serve(async (task) => {
  const C = await import(task.module);

  const vec = (v) => new C.Vec3(...v);
  const quat = ([w, x, y, z]) => new C.Quaternion(x, y, z, w);

  const world = new C.World({ gravity: vec(task.gravity), allowSleep: false });
  world.solver.iterations = task.options.sweeps;
  world.solver.tolerance = task.options.tolerance;
  const contact = world.defaultContactMaterial;
  contact.contactEquationStiffness = task.options.stiffness;
  contact.frictionEquationStiffness = task.options.stiffness;
  contact.contactEquationRelaxation = task.options.relaxation;
  contact.frictionEquationRelaxation = task.options.relaxation;
  contact.restitution = 0;

  function shapeOf(shape) {
    if (shape.kind === "sphere") return new C.Sphere(shape.radius);
    if (shape.kind === "box") return new C.Box(vec(shape.half));
    return new C.Plane();
  }

  function bodyOf(given) {
    const body = new C.Body({
      mass: given.mass, linearDamping: 0, angularDamping: 0, position: vec(given.position),
      velocity: vec(given.velocity), quaternion: quat(given.orientation), angularVelocity: vec(given.spin),
    });
    if (given.shape) body.addShape(shapeOf(given.shape), new C.Vec3(), quat(given.shape.turn));
    if (given.mass > 0) {
      // cannon takes the inertia from the bounding box of the shapes; ours is that of the scene.
      body.inertia.copy(vec(given.inertia));
      const inverse = given.inertia.map((i) => (i > 0 ? 1 / i : 0));
      body.invInertia.copy(vec(inverse));
      body.updateInertiaWorld(true);
    }
    // cannon multiplies the two coefficients; the scene wants their geometric mean.
    body.material = new C.Material({ friction: Math.sqrt(given.friction), restitution: 0 });
    return body;
  }

  const bodies = task.bodies.map(bodyOf);
  bodies.forEach((body) => world.addBody(body));
  const fixedAt = (point) => new C.Body({ mass: 0, position: vec(point) });
  const local = (body, point) => body.pointToLocalFrame(vec(point));
  const turned = (body, axis) => body.vectorToLocalFrame(vec(axis));

  function constraintOf(given) {
    const [a, b] = given.ends.map((end) => (typeof end === "number" ? bodies[end] : fixedAt(end)));
    if (given.kind === "distance") return new C.DistanceConstraint(a, b, given.length, task.force);
    if (given.kind === "ball")
      return new C.PointToPointConstraint(a, local(a, given.at), b, local(b, given.at), task.force);
    if (given.kind === "lock") return new C.LockConstraint(a, b, { maxForce: task.force });
    return new C.HingeConstraint(a, b, {
      pivotA: local(a, given.at), pivotB: local(b, given.at), maxForce: task.force,
      axisA: turned(a, given.axis), axisB: turned(b, given.axis),
    });
  }

  const rods = new Map();
  for (const given of task.constraints) {
    const made = constraintOf(given);
    rods.set(given.name, made.equations[0]);
    world.addConstraint(made);
    for (const row of made.equations)
      row.setSpookParams(task.options.stiffness, task.options.relaxation, task.time_step);
  }
  const apart = new Map(bodies.map((body) => [body, new Set()]));
  for (const [a, b] of task.apart) {
    apart.get(bodies[a]).add(bodies[b]);
    apart.get(bodies[b]).add(bodies[a]);
  }
  const meet = world.broadphase.needBroadphaseCollision.bind(world.broadphase);
  world.broadphase.needBroadphaseCollision = (a, b) =>
    task.contacts && !apart.get(a)?.has(b) && meet(a, b);

  function push() {
    for (const load of task.loads) {
      bodies[load.body].force.vadd(vec(load.force), bodies[load.body].force);
      bodies[load.body].torque.vadd(vec(load.torque), bodies[load.body].torque);
    }
    for (const field of task.fields)
      for (const body of bodies) {
        const away = body.position.vsub(vec(field.centre));
        const size = (-body.mass * field.strength) / away.length() ** 3;
        body.force.vadd(away.scale(size), body.force);
      }
  }

  // A rod's row pushes its ends apart where it is positive; the force of a row is its multiplier. None before a step.
  const measured = Object.keys(task.forces_of).map((name) => rods.get(name));
  function state() {
    const all = bodies.flatMap(({ position: p, quaternion: q, velocity: v, angularVelocity: w }) => [
      p.x, p.y, p.z, q.w, q.x, q.y, q.z, v.x, v.y, v.z, w.x, w.y, w.z,
    ]);
    return all.concat(measured.map((row) => -row.multiplier));
  }

  const pushed = task.loads.length + task.fields.length > 0;
  function step() {
    if (pushed) push();
    world.step(task.time_step);
  }

  return { step, state };
});
