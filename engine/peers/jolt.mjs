// Jolt (WebAssembly, single precision) in its own loop: the scene as engine/peers/jolt.py describes it.
import { serve } from "./loop.mjs";

serve(async (task) => {
  const J = await (await import(task.module)).default();

  const vec = (v) => new J.Vec3(...v);
  const place = (v) => new J.RVec3(...v);
  const quat = ([w, x, y, z]) => new J.Quat(x, y, z, w);
  const WITHOUT_BOUND = 1e9; // m/s, rad/s: Jolt bounds all speeds
  const CONTACTS = 10240; // pairs that touch, at most: more do not fit into the memory Jolt keeps for a step
  const PLANE = 1e5; // m, half the edge of what stands for a plane without end
  const ROUNDED = task.options.rounded ?? 0.05; // m, of edges, at most

  const given = new J.JoltSettings();
  const layers = new J.ObjectLayerPairFilterTable(1);
  if (task.contacts) layers.EnableCollision(0, 0);
  const broad = new J.BroadPhaseLayerInterfaceTable(1, 1);
  broad.MapObjectToBroadPhaseLayer(0, new J.BroadPhaseLayer(0));
  given.mObjectLayerPairFilter = layers;
  given.mBroadPhaseLayerInterface = broad;
  given.mObjectVsBroadPhaseLayerFilter = new J.ObjectVsBroadPhaseLayerFilterTable(broad, 1, layers, 1);
  given.mMaxBodies = task.bodies.length + 1;
  given.mMaxBodyPairs = 1024 + 16 * task.bodies.length;
  given.mMaxContactConstraints = Math.min(1024 + 8 * task.bodies.length, CONTACTS);
  const jolt = new J.JoltInterface(given);
  const system = jolt.GetPhysicsSystem();
  const rules = system.GetPhysicsSettings();
  for (const [name, value] of Object.entries(task.options.settings)) rules[name] = value;
  rules.mAllowSleeping = false;
  system.SetPhysicsSettings(rules);
  system.SetGravity(vec(task.gravity));

  function shapeOf(shape) {
    if (!shape) return new J.EmptyShape();
    if (shape.kind === "sphere") return new J.SphereShape(shape.radius);
    if (shape.kind === "box") return new J.BoxShape(vec(shape.half), Math.min(ROUNDED, 0.2 * Math.min(...shape.half)));
    if (shape.kind === "plane") return new J.PlaneShape(new J.Plane(vec(shape.normal), 0), null, PLANE);
    if (shape.kind === "compound") return compoundOf(shape.parts);
    if (shape.kind === "hull") return hullOf(shape.corners);
    if (shape.kind === "mesh") return meshOf(shape);
    const rounded = Math.min(ROUNDED, 0.2 * Math.min(shape.half, shape.radius)); // of a cylinder's edges
    const upright = // along y; ours lies along z
      shape.kind === "cylinder"
        ? new J.CylinderShapeSettings(shape.half, shape.radius, rounded)
        : new J.CapsuleShapeSettings(shape.half, shape.radius);
    const turn = J.Quat.prototype.sRotation(vec([1, 0, 0]), Math.PI / 2);
    return new J.RotatedTranslatedShapeSettings(vec([0, 0, 0]), turn, upright).Create().Get();
  }

  function meshOf({ corners, faces }) {
    const triangles = new J.TriangleList();
    for (const face of faces) triangles.push_back(new J.Triangle(...face.map((k) => vec(corners[k]))));
    return new J.MeshShapeSettings(triangles, new J.PhysicsMaterialList()).Create().Get();
  }

  function hullOf(corners) {
    const settings = new J.ConvexHullShapeSettings();
    for (const corner of corners) settings.mPoints.push_back(vec(corner));
    return centred(settings.Create().Get());
  }

  function compoundOf(parts) {
    const settings = new J.StaticCompoundShapeSettings();
    for (const part of parts) settings.AddShapeShape(vec(part.at), quat(part.turn), shapeOf(part.shape), 0);
    return centred(settings.Create().Get());
  }

  // The centre of mass, which Jolt puts where the shape has it, put back to where the body's is.
  function centred(shape) {
    return new J.OffsetCenterOfMassShape(shape, vec(three(shape.GetCenterOfMass()).map((x) => -x)));
  }

  const three = (v) => [v.GetX(), v.GetY(), v.GetZ()];
  const filter = new J.GroupFilterTable(task.bodies.length);
  task.apart.forEach(([a, b]) => filter.DisableCollision(a, b));
  const interface_ = system.GetBodyInterface();
  const motions = { static: J.EMotionType_Static, kinematic: J.EMotionType_Kinematic };

  function bodyOf(one, index) {
    const kind = motions[one.motion] ?? J.EMotionType_Dynamic;
    const made = new J.BodyCreationSettings(shapeOf(one.shape), place(one.position), quat(one.orientation), kind, 0);
    made.mLinearVelocity = vec(one.velocity);
    made.mAngularVelocity = vec(one.spin);
    made.mLinearDamping = made.mAngularDamping = 0;
    made.mMaxLinearVelocity = made.mMaxAngularVelocity = WITHOUT_BOUND;
    made.mAllowSleeping = false;
    made.mApplyGyroscopicForce = task.options.gyroscopic;
    made.mFriction = one.friction; // two surfaces: the geometric mean, and the larger restitution, as the scene wants
    made.mRestitution = one.restitution;
    if (task.options.edges && one.mass > 0) made.mEnhancedInternalEdgeRemoval = true;
    made.mCollisionGroup = new J.CollisionGroup(filter, 0, index);
    if (one.mass > 0) {
      made.mOverrideMassProperties = J.EOverrideMassProperties_MassAndInertiaProvided;
      const properties = new J.MassProperties();
      properties.mMass = one.mass;
      properties.mInertia = J.Mat44.prototype.sScaleVec3(vec(one.motion === "particle" ? [1, 1, 1] : one.inertia));
      made.mMassPropertiesOverride = properties;
    }
    if (one.motion === "particle")
      made.mAllowedDOFs = J.EAllowedDOFs_TranslationX | J.EAllowedDOFs_TranslationY | J.EAllowedDOFs_TranslationZ;
    const body = interface_.CreateBody(made);
    interface_.AddBody(body.GetID(), J.EActivation_Activate);
    return body;
  }

  const bodies = task.bodies.map(bodyOf);
  system.OptimizeBroadPhase();
  // What constraints to the world hold on to; packages before 1.1.0 have none, so a body without a shape stands for it.
  const world =
    J.Body.prototype.sFixedToWorld ??
    J.JoltInterface.prototype.sGetFixedToWorldBody?.() ??
    interface_.CreateBody(
      new J.BodyCreationSettings(new J.EmptyShape(), place([0, 0, 0]), quat([1, 0, 0, 0]), J.EMotionType_Static, 0),
    );

  function spring(settings, stiffness, viscosity) {
    settings.mMode = J.ESpringMode_StiffnessAndDamping;
    settings.mStiffness = stiffness;
    settings.mDamping = viscosity;
  }

  // A drive of hinge or slide: Jolt's velocity motor, which a row of its own holds.
  function drive(constraint, { speed, most }, kind) {
    const motor = constraint.GetMotorSettings();
    if (kind === "hinge") {
      [motor.mMinTorqueLimit, motor.mMaxTorqueLimit] = [-most, most];
      constraint.SetTargetAngularVelocity(speed);
    } else {
      [motor.mMinForceLimit, motor.mMaxForceLimit] = [-most, most];
      constraint.SetTargetVelocity(speed);
    }
    constraint.SetMotorState(J.EMotorState_Velocity);
  }

  // Two joints of bodies that turn or slide against what stands: `a` x + `b` y = 0 of their coordinates.
  function relate({ kind, names, axes, factors }) {
    const [one, two] = names.map((name) => made.get(name));
    const ratio = factors[1] / factors[0];
    const gear = kind === "gear";
    const settings = gear ? new J.GearConstraintSettings() : new J.RackAndPinionConstraintSettings();
    settings.mSpace = J.EConstraintSpace_LocalToBodyCOM;
    if (gear) {
      // Its impulse on the second leaves out the ratio (GearConstraintPart), so the second axis, which keeps its length in the
      // axes of its body, has it. Angles are not mended then: they would be by a ratio of 1.
      settings.mRatio = 1;
      settings.mHingeAxis1 = vec(axes[0]);
      settings.mHingeAxis2 = vec(axes[1].map((x) => ratio * x));
    } else {
      [settings.mHingeAxis, settings.mSliderAxis] = axes.map(vec);
      settings.mRatio = -ratio; // x of the pinion: x = ratio y
    }
    const held = settings.Create(one.moving, two.moving);
    const type = gear ? J.GearConstraint : J.RackAndPinionConstraint;
    // Drift is mended by the joints' own coordinates, which count the other way where what stands is their second end.
    if (one.moving === one.second && two.moving === two.second && (ratio === 1 || !gear))
      J.castObject(held, type).SetConstraints(one.constraint, two.constraint);
    system.AddConstraint(held);
  }

  function settingsOf(one) {
    if (one.kind === "distance") {
      const rod = new J.DistanceConstraintSettings();
      [rod.mPoint1, rod.mPoint2] = one.points.map(place);
      rod.mMinDistance = rod.mMaxDistance = one.length;
      if (one.stiffness > 0) spring(rod.mLimitsSpringSettings, one.stiffness, one.viscosity);
      return [rod, J.DistanceConstraint];
    }
    const [kind, type] = {
      ball: [J.PointConstraintSettings, J.PointConstraint], hinge: [J.HingeConstraintSettings, J.HingeConstraint],
      lock: [J.FixedConstraintSettings, J.TwoBodyConstraint], prismatic: [J.SliderConstraintSettings, J.SliderConstraint],
    }[one.kind];
    const joint = new kind();
    joint.mPoint1 = joint.mPoint2 = place(one.at);
    const normal = vec(one.axis).GetNormalizedPerpendicular();
    const across = [normal.GetX(), normal.GetY(), normal.GetZ()];
    if (one.kind === "hinge") {
      joint.mHingeAxis1 = joint.mHingeAxis2 = vec(one.axis);
      joint.mNormalAxis1 = joint.mNormalAxis2 = vec(across);
      joint.mMaxFrictionTorque = one.friction;
    }
    if (one.kind === "prismatic") {
      joint.mSliderAxis1 = joint.mSliderAxis2 = vec(one.axis);
      joint.mNormalAxis1 = joint.mNormalAxis2 = vec(across);
      joint.mMaxFrictionForce = one.friction;
    }
    return [joint, type];
  }

  const made = new Map();
  for (const one of task.constraints) {
    const [settings, type] = settingsOf(one);
    const [a, b] = one.ends.map((end) => (end === null ? world : bodies[end]));
    const constraint = settings.Create(a, b);
    system.AddConstraint(constraint);
    const cast = J.castObject(constraint, type);
    if (one.motor) drive(cast, one.motor, one.kind);
    const moving = one.ends[1] === null ? a : b;
    made.set(one.name, { kind: one.kind, second: b, first: a, moving, constraint: cast });
  }
  task.relations.forEach(relate);

  // What Jolt shows of a constraint are the impulses of the last step, on its second body; of a lock this package does not.
  const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
  function turned(body, local) {
    return three(body.GetRotation().MulVec3(local));
  }
  function impulse({ kind, first, second, constraint }) {
    if (kind === "distance") return [-constraint.GetTotalLambdaPosition()];
    const push = three(constraint.GetTotalLambdaPosition());
    if (kind === "ball") return [...push, 0, 0, 0];
    const rows = constraint.GetTotalLambdaRotation();
    const driven = constraint.GetTotalLambdaMotor();
    const lambdas = [rows.GetComponent(0), rows.GetComponent(1)];
    const axis = turned(first, constraint.GetLocalSpaceHingeAxis1());
    const b = three(vec(turned(second, constraint.GetLocalSpaceHingeAxis2())).GetNormalizedPerpendicular());
    const c = cross(turned(second, constraint.GetLocalSpaceHingeAxis2()), b);
    const [one, two] = [cross(b, axis), cross(c, axis)];
    return [...push, ...one.map((_, i) => one[i] * lambdas[0] + two[i] * lambdas[1] + axis[i] * driven)];
  }

  let deepest = 0;
  const belts = new Map(); // body → velocity of what moves along itself, in its axes
  task.bodies.forEach((one, index) => {
    if (one.belt) belts.set(bodies[index].GetID().GetIndex(), vec(one.belt));
  });
  const flow = vec([0, 0, 0]);
  function belt(body, settings, sign) {
    const along = belts.get(body.GetID().GetIndex());
    if (!along) return;
    const before = three(settings.mRelativeLinearSurfaceVelocity);
    flow.Set(...turned(body, along).map((x, i) => before[i] + sign * x));
    settings.mRelativeLinearSurfaceVelocity = flow;
  }
  if (task.depth || belts.size > 0) {
    const listener = new J.ContactListenerJS();
    const look = (a, b, manifold, settings) => {
      deepest = Math.max(deepest, J.wrapPointer(manifold, J.ContactManifold).mPenetrationDepth);
      if (belts.size === 0) return;
      const asked = J.wrapPointer(settings, J.ContactSettings); // of the second against the first
      belt(J.wrapPointer(a, J.Body), asked, -1);
      belt(J.wrapPointer(b, J.Body), asked, 1);
    };
    listener.OnContactValidate = () => J.ValidateResult_AcceptAllContactsForThisBodyPair;
    listener.OnContactAdded = listener.OnContactPersisted = look;
    listener.OnContactRemoved = () => {};
    system.SetContactListener(listener);
  }

  const force = vec([0, 0, 0]);
  function act(body, x, y, z) {
    force.Set(x, y, z);
    body.AddForce(force);
  }

  // A point of a body, given in its axes: where it is, and how fast.
  const anchored = (anchor) => (anchor.some((x) => x !== 0) ? vec(anchor) : null);
  const springs = task.springs.map((spring) => ({ ...spring, anchors: spring.anchors.map(anchored) }));
  function reached(end, anchor) {
    const at = three(bodies[end].GetPosition());
    return anchor ? turned(bodies[end], anchor).map((x, i) => x + at[i]) : at;
  }
  function speedOf(end, anchor) {
    const speed = three(bodies[end].GetLinearVelocity());
    if (!anchor) return speed;
    const round = cross(three(bodies[end].GetAngularVelocity()), turned(bodies[end], anchor));
    return speed.map((x, i) => x + round[i]);
  }
  function twist(end, anchor, pull) {
    force.Set(...cross(turned(bodies[end], anchor), pull));
    bodies[end].AddTorque(force);
  }

  const loads = task.loads.map((load) => [bodies[load.body], vec(load.force), vec(load.torque)]);
  const moving = task.bodies.flatMap((one, index) => (one.mass > 0 ? [[bodies[index], one.mass]] : []));
  function push() {
    for (const [body, pull, torque] of loads) {
      body.AddForce(pull);
      body.AddTorque(torque);
    }
    for (const { centre, strength } of task.fields)
      for (const [body, mass] of moving) {
        const p = body.GetPosition();
        const [x, y, z] = [p.GetX() - centre[0], p.GetY() - centre[1], p.GetZ() - centre[2]];
        const size = (-mass * strength) / (x * x + y * y + z * z) ** 1.5;
        act(body, size * x, size * y, size * z);
      }
    for (const spring of springs) {
      const [one, two] = spring.ends.map((end, k) => (Array.isArray(end) ? end : reached(end, spring.anchors[k])));
      const away = two.map((x, i) => x - one[i]);
      const length = Math.hypot(...away);
      const speeds = spring.ends.map((end, k) => (Array.isArray(end) ? [0, 0, 0] : speedOf(end, spring.anchors[k])));
      const opening = away.reduce((sum, x, i) => sum + x * (speeds[1][i] - speeds[0][i]), 0) / length;
      const size = length > 0 ? (spring.stiffness * (length - spring.rest) + spring.viscosity * opening) / length : 0;
      spring.ends.forEach((end, k) => {
        if (Array.isArray(end)) return;
        const pull = away.map((x) => (k === 0 ? size : -size) * x);
        act(bodies[end], ...pull);
        if (spring.anchors[k]) twist(end, spring.anchors[k], pull);
      });
    }
  }

  const shown = Object.keys(task.forces_of).map((name) => made.get(name));
  function state() {
    const all = bodies.flatMap((body) => {
      const p = three(body.GetPosition());
      const q = body.GetRotation();
      const turn = [q.GetW(), q.GetX(), q.GetY(), q.GetZ()];
      return [...p, ...turn, ...three(body.GetLinearVelocity()), ...three(body.GetAngularVelocity())];
    });
    const forces = shown.flatMap((one) => impulse(one).map((value) => value / task.time_step));
    return all.concat(forces, task.depth ? [deepest] : []);
  }

  const pushed = task.loads.length + task.fields.length + task.springs.length > 0;
  function step() {
    if (pushed) push();
    deepest = 0;
    jolt.Step(task.time_step, 1);
  }

  return { step, state };
});
