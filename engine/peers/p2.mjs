// p2-es in its own loop: the scene as engine/peers/p2.py describes it, in the coordinates of its plane.
import { serve } from "./loop.mjs";

serve(async (task) => {
  // Which precision it keeps is read once, when the module is: each is a module of its own.
  globalThis.P2_ARRAY_TYPE = task.options.double ? Float64Array : Float32Array;
  const P = await import(`${task.module}?${globalThis.P2_ARRAY_TYPE.name}`);

  const { across, up, normal } = task.plane; // unit vectors, across × up = normal
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const flat = (v) => [dot(v, across), dot(v, up)];
  const raised = (x, y, z) => [0, 1, 2].map((k) => x * across[k] + y * up[k] + z * normal[k]);

  const world = new P.World({ gravity: flat(task.gravity) });
  world.applyDamping = false;
  world.solver.iterations = task.options.sweeps;
  world.solver.tolerance = 0;

  function bodyOf(one) {
    const body = new P.Body({
      mass: one.mass, position: flat(one.position), velocity: flat(one.velocity), damping: 0, angularDamping: 0,
      angularVelocity: dot(one.spin, normal), fixedRotation: one.motion === "particle",
    });
    if (one.mass > 0 && one.motion !== "particle") {
      body.inertia = one.turning; // p2 takes it from the shapes, and there are none
      body.invInertia = 1 / one.turning;
    }
    world.addBody(body);
    return body;
  }

  const bodies = task.bodies.map(bodyOf);
  const heights = task.bodies.map((one) => dot(one.position, normal));
  const rods = new Map();
  for (const one of task.constraints) {
    const [a, b] = one.ends.map((end, k) => {
      if (typeof end === "number") return bodies[end];
      const fixed = new P.Body({ mass: 0, position: flat(one.points[k]) });
      world.addBody(fixed);
      return fixed;
    });
    let made;
    if (one.kind === "distance") {
      const anchors = one.anchors.map(flat);
      made = new P.DistanceConstraint(a, b, { distance: one.length, localAnchorA: anchors[0], localAnchorB: anchors[1] });
      rods.set(one.name, made.equations[0]);
    } else if (one.kind === "hinge") made = new P.RevoluteConstraint(a, b, { worldPivot: flat(one.points[0]) });
    else made = new P.LockConstraint(a, b);
    made.setStiffness(task.options.stiffness);
    made.setRelaxation(task.options.relaxation);
    for (const row of made.equations) [row.maxForce, row.minForce] = [task.force, -task.force];
    world.addConstraint(made);
  }

  function push() {
    for (const load of task.loads) {
      const [x, y] = flat(load.force);
      bodies[load.body].force[0] += x;
      bodies[load.body].force[1] += y;
      bodies[load.body].angularForce += dot(load.torque, normal);
    }
    for (const field of task.fields) {
      const [cx, cy] = flat(field.centre);
      for (const body of bodies) {
        const [x, y] = [body.position[0] - cx, body.position[1] - cy];
        const size = (-body.mass * field.strength) / (x * x + y * y) ** 1.5;
        body.force[0] += size * x;
        body.force[1] += size * y;
      }
    }
  }

  /// The turn `angle` about the normal after the turn at the start; (w, x, y, z).
  function turned([w, x, y, z], angle) {
    const [c, s] = [Math.cos(angle / 2), Math.sin(angle / 2)];
    const [p, q, r] = normal.map((part) => s * part);
    return [c * w - p * x - q * y - r * z, c * x + p * w + q * z - r * y,
      c * y - p * z + q * w + r * x, c * z + p * y - q * x + r * w];
  }

  // A rod's row pushes its ends apart where it is positive; the force of a row is its multiplier. None before a step.
  const measured = Object.keys(task.forces_of).map((name) => rods.get(name));
  function state() {
    const all = bodies.flatMap((body, k) => [
      ...raised(body.position[0], body.position[1], heights[k]),
      ...turned(task.bodies[k].orientation, body.angle),
      ...raised(body.velocity[0], body.velocity[1], 0),
      ...normal.map((part) => part * body.angularVelocity),
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
