// The rigid-body pipeline for Python: tables in, a report out.
#include "bindings/forces.hpp"
#include "rigid/rigid_program.hpp"

namespace spook {

namespace {

void read_bodies(const nb::dict& bodies, RigidScene& scene) {
    Columns table(bodies, "bodies");
    const std::vector<Motion> motion = table.kinds<Motion>("motion", "motion");
    const Numbers particle = table.numbers("particle"), mass = table.numbers("mass"),
                  inertia = table.numbers("inertia", 3), position = table.numbers("position", 3),
                  orientation = table.numbers("orientation", 4), velocity = table.numbers("velocity", 3),
                  angular_velocity = table.numbers("angular_velocity", 3), force = table.numbers("force", 3),
                  torque = table.numbers("torque", 3), friction = table.numbers("friction"),
                  restitution = table.numbers("restitution"), compliance = table.numbers("compliance"),
                  damping = table.numbers("damping"), slip_compliance = table.numbers("slip_compliance");
    for (std::size_t i = 0; i < table.rows(); ++i) {
        RigidBodySpec& body = scene.bodies.emplace_back();
        body.motion = motion[i];
        body.particle = particle.flag(i);
        body.mass = mass[i];
        body.inertia = inertia.vec(i);
        body.position = position.vec(i);
        body.orientation = orientation.quat(i);
        body.velocity = velocity.vec(i);
        body.angular_velocity = angular_velocity.vec(i);
        body.force = force.vec(i);
        body.torque = torque.vec(i);
        body.material = {friction[i], restitution[i], compliance[i], damping[i], slip_compliance[i]};
    }
    table.expect_all_read();
}

void read_joints(const nb::dict& joints, RigidScene& scene) {
    Columns table(joints, "joints");
    const std::vector<JointKind> kind = table.kinds<JointKind>("kind", "joint");
    const Numbers first = table.numbers("first"), second = table.numbers("second"),
                  first_point = table.numbers("first_point", 3),
                  second_point = table.numbers("second_point", 3), axes = table.numbers("axes", 9),
                  length = table.numbers("rest_length"), compliance = table.numbers("compliance", 6),
                  damping = table.numbers("damping", 6);
    for (std::size_t i = 0; i < table.rows(); ++i) {
        JointSpec& joint = scene.joints.emplace_back();
        joint.kind = kind[i];
        joint.first = first.index(i);
        joint.second = second.index(i);
        joint.first_point = first_point.vec(i);
        joint.second_point = second_point.vec(i);
        for (std::size_t k = 0; k < 3; ++k) joint.axes[k] = axes.vec(i, k);
        joint.rest_length = length[i];
        std::copy_n(compliance.at(i), 6, joint.compliance.begin());
        std::copy_n(damping.at(i), 6, joint.damping.begin());
    }
    table.expect_all_read();
}

void read_motors(const nb::dict& motors, RigidScene& scene) {
    Columns table(motors, "motors");
    const Numbers joint = table.numbers("joint"), speed = table.numbers("speed"),
                  force = table.numbers("max_force");
    for (std::size_t i = 0; i < table.rows(); ++i) {
        JointSpec& spec = scene.joints.at(joint.index(i));
        spec.has_motor = true;
        spec.motor_speed = speed[i];
        spec.motor_force = force[i];
    }
    table.expect_all_read();
}

void read_limits(const nb::dict& limits, RigidScene& scene) {
    Columns table(limits, "limits");
    const Numbers joint = table.numbers("joint"), lower = table.numbers("lower"),
                  upper = table.numbers("upper"), compliance = table.numbers("compliance"),
                  damping = table.numbers("damping"), restitution = table.numbers("restitution");
    for (std::size_t i = 0; i < table.rows(); ++i) {
        JointSpec& spec = scene.joints.at(joint.index(i));
        spec.has_limit = true;
        spec.limit_lower = lower[i];
        spec.limit_upper = upper[i];
        spec.limit_compliance = compliance[i];
        spec.limit_damping = damping[i];
        spec.limit_restitution = restitution[i];
    }
    table.expect_all_read();
}

void read_joint_springs(const nb::dict& springs, RigidScene& scene) {
    Columns table(springs, "joint_springs");
    const Numbers joint = table.numbers("joint"), stiffness = table.numbers("stiffness"),
                  rest = table.numbers("rest"), damping = table.numbers("damping");
    for (std::size_t i = 0; i < table.rows(); ++i) {
        JointSpec& spec = scene.joints.at(joint.index(i));
        spec.has_spring = true;
        spec.spring_stiffness = stiffness[i];
        spec.spring_rest = rest[i];
        spec.spring_damping = damping[i];
    }
    table.expect_all_read();
}

void read_colliders(const nb::dict& colliders, RigidScene& scene) {
    Columns table(colliders, "colliders");
    const std::vector<ShapeKind> kind = table.kinds<ShapeKind>("kind", "shape");
    const Numbers body = table.numbers("body"), position = table.numbers("position", 3),
                  orientation = table.numbers("orientation", 4), radius = table.numbers("radius"),
                  length = table.numbers("length"), size = table.numbers("size", 3),
                  normal = table.numbers("normal", 3);
    for (std::size_t i = 0; i < table.rows(); ++i) {
        Collider& collider = scene.colliders.emplace_back();
        collider.body = body.index(i);
        collider.part = {position.vec(i), rotation(orientation.quat(i))};
        switch (kind[i]) {
            case ShapeKind::sphere: collider.shape = Primitive::sphere(radius[i]); break;
            case ShapeKind::capsule: collider.shape = Primitive::capsule(radius[i], length[i]); break;
            case ShapeKind::box: collider.shape = Primitive::box(size.vec(i)); break;
            case ShapeKind::plane: collider.shape = Primitive::plane(normal.vec(i)); break;
        }
    }
    table.expect_all_read();
}

void read_no_contact(const nb::dict& no_contact, RigidScene& scene) {
    Columns table(no_contact, "no_contact");
    const Numbers first = table.numbers("first"), second = table.numbers("second");
    for (std::size_t i = 0; i < table.rows(); ++i)
        scene.no_contact.push_back({first.index(i), second.index(i)});
    table.expect_all_read();
}

RigidMethod to_method(const nb::dict& method) {
    RigidMethod out;
    Options options(method);
    options.read("time_step", out.time_step);
    options.read("substeps", out.substeps);
    options.read("refinements", out.refinements);
    options.read("floor", out.floor);
    options.read_kind("solver", out.solver);
    options.read_kind("friction", out.friction);
    options.read("iterations", out.iterations);
    options.read("residual_tolerance", out.residual_tolerance);
    options.read_kind("impacts", out.impacts);
    options.read("unsettled_residual", out.unsettled_residual);
    options.read("composition", out.composition);
    options.read("string_stiffness", out.string_stiffness);
    options.read("half_step_velocities", out.half_step_velocities);
    options.read("corrections", out.corrections);
    options.read("correction_cap", out.correction_cap);
    options.read("force_collision", out.force_collision);
    options.read("force_rotation", out.force_rotation);
    options.expect_all_read();
    return out;
}

void make(RigidProgram* self, const nb::dict& bodies, const nb::dict& joints, const nb::dict& motors,
          const nb::dict& limits, const nb::dict& joint_springs, const nb::dict& springs,
          const nb::dict& fields, const nb::dict& colliders, const nb::dict& no_contact, bool contacts,
          const Point& gravity, const nb::dict& method, const std::vector<QuantityRequest>& quantities,
          const std::vector<Observation>& observations) {
    RigidScene scene;
    scene.gravity = to_vec(gravity);
    scene.contacts = contacts;
    scene.method = to_method(method);
    read_bodies(bodies, scene);
    read_joints(joints, scene);
    read_motors(motors, scene);
    read_limits(limits, scene);
    read_joint_springs(joint_springs, scene);
    scene.springs = read_springs(springs);
    scene.fields = read_fields(fields);
    read_colliders(colliders, scene);
    read_no_contact(no_contact, scene);
    new (self) RigidProgram(scene, quantities, observations);
}

}  // namespace

void bind_rigid(nb::module_& m) {
    bind_program<RigidSystem>(
        m, "RigidProgram", "A compiled scene with rigid bodies.", &make, nb::arg("bodies"), nb::arg("joints"),
        nb::arg("motors"), nb::arg("limits"), nb::arg("joint_springs"), nb::arg("springs"), nb::arg("fields"),
        nb::arg("colliders"), nb::arg("no_contact"), nb::arg("contacts"), nb::arg("gravity"),
        nb::arg("method"), nb::arg("quantities"), nb::arg("observations"),
        "Tables are dicts of columns, a row each, in the names of RigidBodySpec, JointSpec and Primitive;\n"
        "springs and fields as for ParticleProgram. A body is an index, -1 the world; motors, limits and\n"
        "joint_springs name the joint they drive.");
}

}  // namespace spook
