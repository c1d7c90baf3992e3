// The rigid-body pipeline for Python: tables in, a report out.
#include "bindings/columns.hpp"
#include "rigid/rigid_program.hpp"

namespace spook {

namespace {

<<<<<<< HEAD
/// (kind, index or −1, point)
using QuantityTuple = std::tuple<std::string, int, std::tuple<double, double, double>>;
using Point = std::tuple<double, double, double>;

Vec3 to_vec(const Point& t) { return {std::get<0>(t), std::get<1>(t), std::get<2>(t)}; }
Quat quat(const double* p) noexcept { return {p[0], p[1], p[2], p[3]}; }

void expect_columns(std::size_t found, std::size_t columns, const char* name) {
    if (found != columns)
        throw std::invalid_argument(std::string(name) + " needs " + std::to_string(columns) + " columns");
}

RigidBodySpec to_body(const std::int64_t* kind, const double* b) {
    RigidBodySpec spec;
    spec.motion = static_cast<Motion>(kind[0]);
    spec.particle = kind[1] != 0;
    spec.mass = b[0];
    spec.inertia = vec3(b + 1);
    spec.position = vec3(b + 4);
    spec.orientation = quat(b + 7);
    spec.velocity = vec3(b + 11);
    spec.angular_velocity = vec3(b + 14);
    spec.force = vec3(b + 17);
    spec.torque = vec3(b + 20);
    spec.material = {b[23], b[24], b[25], b[26], b[27]};
    return spec;
}

JointSpec to_joint(const std::int64_t* kind, const double* j) {
    JointSpec spec;
    spec.kind = static_cast<JointKind>(kind[0]);
    spec.first = static_cast<int>(kind[1]);
    spec.second = static_cast<int>(kind[2]);
    spec.has_motor = kind[3] != 0;
    spec.has_limit = kind[4] != 0;
    spec.has_spring = kind[5] != 0;
    spec.first_point = vec3(j);
    spec.second_point = vec3(j + 3);
    for (int k = 0; k < 3; ++k) spec.axes[k] = vec3(j + 6 + 3 * k);
    spec.rest_length = j[15];
    std::copy_n(j + 16, 6, spec.compliance.begin());
    std::copy_n(j + 22, 6, spec.damping.begin());
    spec.motor_speed = j[28];
    spec.motor_force = j[29];
    spec.limit_lower = j[30];
    spec.limit_upper = j[31];
    spec.limit_compliance = j[32];
    spec.limit_damping = j[33];
    spec.spring_stiffness = j[34];
    spec.spring_rest = j[35];
    spec.spring_damping = j[36];
    spec.limit_restitution = j[37];
    return spec;
}

Collider to_collider(const std::int64_t* kind, const double* c) {
    Collider collider;
    collider.body = static_cast<int>(kind[0]);
    collider.part = {vec3(c), rotation(quat(c + 3))};
    switch (kind[1]) {
        case 0: collider.shape = Primitive::sphere(c[7]); break;
        case 1: collider.shape = Primitive::capsule(c[7], c[8]); break;
        case 2: collider.shape = Primitive::box(vec3(c + 7)); break;
        default: collider.shape = Primitive::plane(vec3(c + 7)); break;
=======
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
>>>>>>> main
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
                  damping = table.numbers("damping");
    for (std::size_t i = 0; i < table.rows(); ++i) {
        JointSpec& spec = scene.joints.at(joint.index(i));
        spec.has_limit = true;
        spec.limit_lower = lower[i];
        spec.limit_upper = upper[i];
        spec.limit_compliance = compliance[i];
        spec.limit_damping = damping[i];
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

void read_forces(const nb::dict& springs, const nb::dict& fields, RigidScene& scene) {
    Columns spring(springs, "springs");
    const Numbers first = spring.numbers("first"), second = spring.numbers("second"),
                  first_point = spring.numbers("first_point", 3),
                  second_point = spring.numbers("second_point", 3), stiffness = spring.numbers("stiffness"),
                  length = spring.numbers("rest_length"), viscosity = spring.numbers("viscosity");
    for (std::size_t i = 0; i < spring.rows(); ++i)
        scene.springs.push_back({first.index(i), second.index(i), first_point.vec(i), second_point.vec(i),
                                 stiffness[i], length[i], viscosity[i]});
    spring.expect_all_read();
    Columns field(fields, "fields");
    const Numbers strength = field.numbers("strength"), centre = field.numbers("centre", 3);
    for (std::size_t i = 0; i < field.rows(); ++i) scene.fields.push_back({strength[i], centre.vec(i)});
    field.expect_all_read();
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
<<<<<<< HEAD
    out.time_step = nb::cast<double>(method["time_step"]);
    out.substeps = nb::cast<int>(method["substeps"]);
    out.refinements = nb::cast<int>(method["refinements"]);
    out.floor = nb::cast<double>(method["floor"]);
    out.solver = static_cast<SolverKind>(nb::cast<int>(method["solver"]));
    out.friction = static_cast<FrictionModel>(nb::cast<int>(method["friction"]));
    out.iterations = nb::cast<int>(method["iterations"]);
    out.residual_tolerance = nb::cast<double>(method["residual_tolerance"]);
    out.impacts = static_cast<ImpactOrder>(nb::cast<int>(method["impacts"]));
    out.unsettled_residual = nb::cast<double>(method["unsettled_residual"]);
    out.force_collision = nb::cast<bool>(method["force_collision"]);
    return out;
}

void make(RigidProgram* self, IndexTable body_kinds, Table bodies, IndexTable joint_kinds, Table joints,
          IndexTable spring_ends, Table springs, Table fields, IndexTable collider_kinds, Table colliders,
          IndexTable no_contact, Point gravity, const nb::dict& method,
          const std::vector<QuantityTuple>& quantities, const std::vector<ObservationTuple>& observations) {
    expect_columns(body_kinds.shape(1), 2, "body_kinds");
    expect_columns(bodies.shape(1), 28, "bodies");
    expect_columns(joint_kinds.shape(1), 6, "joint_kinds");
    expect_columns(joints.shape(1), 38, "joints");
    expect_columns(springs.shape(1), 9, "springs");
    expect_columns(fields.shape(1), 4, "fields");
    expect_columns(colliders.shape(1), 10, "colliders");
=======
    Options options(method);
    options.read("time_step", out.time_step);
    options.read("substeps", out.substeps);
    options.read("refinements", out.refinements);
    options.read("floor", out.floor);
    options.read_kind("solver", out.solver);
    options.read_kind("friction", out.friction);
    options.read("iterations", out.iterations);
    options.read("residual_tolerance", out.residual_tolerance);
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
>>>>>>> main
    RigidScene scene;
    scene.gravity = to_vec(gravity);
    scene.contacts = contacts;
    scene.method = to_method(method);
<<<<<<< HEAD
    for (std::size_t i = 0; i < bodies.shape(0); ++i)
        scene.bodies.push_back(to_body(body_kinds.data() + 2 * i, bodies.data() + 28 * i));
    for (std::size_t i = 0; i < joints.shape(0); ++i)
        scene.joints.push_back(to_joint(joint_kinds.data() + 6 * i, joints.data() + 38 * i));
    for (std::size_t i = 0; i < springs.shape(0); ++i) {
        const double* s = springs.data() + 9 * i;
        const std::int64_t* ends = spring_ends.data() + 2 * i;
        scene.springs.push_back(
            {static_cast<int>(ends[0]), static_cast<int>(ends[1]), vec3(s), vec3(s + 3), s[6], s[7], s[8]});
    }
    for (std::size_t i = 0; i < fields.shape(0); ++i)
        scene.fields.push_back({fields.data()[4 * i], vec3(fields.data() + 4 * i + 1)});
    for (std::size_t i = 0; i < colliders.shape(0); ++i)
        scene.colliders.push_back(to_collider(collider_kinds.data() + 2 * i, colliders.data() + 10 * i));
    for (std::size_t i = 0; i < no_contact.shape(0); ++i)
        scene.no_contact.push_back(
            {static_cast<int>(no_contact.data()[2 * i]), static_cast<int>(no_contact.data()[2 * i + 1])});
    std::vector<QuantityRequest> requests;
    for (const auto& [kind, index, point] : quantities) requests.push_back({kind, index, to_vec(point)});
    new (self) RigidProgram(scene, requests, to_observations(observations));
}

nb::dict run(RigidProgram& program, std::int64_t steps, double time_limit, bool timed) {
    RunReport report;
    {
        nb::gil_scoped_release release;
        report = program.run(steps, time_limit, timed);
    }
    return to_dict(report);
=======
    read_bodies(bodies, scene);
    read_joints(joints, scene);
    read_motors(motors, scene);
    read_limits(limits, scene);
    read_joint_springs(joint_springs, scene);
    read_forces(springs, fields, scene);
    read_colliders(colliders, scene);
    read_no_contact(no_contact, scene);
    new (self) RigidProgram(scene, quantities, observations);
>>>>>>> main
}

}  // namespace

void bind_rigid(nb::module_& m) {
<<<<<<< HEAD
    nb::class_<RigidProgram>(m, "RigidProgram", "A compiled scene with rigid bodies.")
        .def(
            "__init__", &make, nb::arg("body_kinds"), nb::arg("bodies"), nb::arg("joint_kinds"),
            nb::arg("joints"), nb::arg("spring_ends"), nb::arg("springs"), nb::arg("fields"),
            nb::arg("collider_kinds"), nb::arg("colliders"), nb::arg("no_contact"), nb::arg("gravity"),
            nb::arg("method"), nb::arg("quantities"), nb::arg("observations"),
            "body_kinds (n, 2): motion, particle. bodies (n, 28): mass, inertia, position, orientation, velocity,\n"
            "angular velocity, force, torque, friction, restitution, compliance, damping, slip compliance.\n"
            "joint_kinds (m, 6): kind, first, second, has motor, limit, spring. joints (m, 38): points of both\n"
            "ends, three axes, rest length, 6 compliances, 6 dampings, motor speed and force, limit lower, upper,\n"
            "compliance, damping, spring stiffness, rest, damping, limit restitution. springs and fields as for ParticleProgram.\n"
            "collider_kinds (c, 2): body, shape (sphere, capsule, box, plane). colliders (c, 10): position and\n"
            "orientation in the body, then radius, length or edges or normal. no_contact (p, 2): body indices.")
        .def(
            "run", &run, nb::arg("steps"), nb::arg("time_limit"), nb::arg("timed"),
            "Run from the start, the GIL released; a dict with status, recordings, counters, final_state, ...")
        .def_prop_ro("solver", &RigidProgram::solver, "none, block, pivot or iterative")
        .def_prop_ro("contacts_possible", &RigidProgram::contacts_possible);
=======
    bind_program<RigidSystem>(
        m, "RigidProgram", "A compiled scene with rigid bodies.", &make, nb::arg("bodies"), nb::arg("joints"),
        nb::arg("motors"), nb::arg("limits"), nb::arg("joint_springs"), nb::arg("springs"), nb::arg("fields"),
        nb::arg("colliders"), nb::arg("no_contact"), nb::arg("contacts"), nb::arg("gravity"),
        nb::arg("method"), nb::arg("quantities"), nb::arg("observations"),
        "Tables are dicts of columns, a row each, in the names of RigidBodySpec, JointSpec and Primitive;\n"
        "springs and fields as for ParticleProgram. A body is an index, -1 the world; motors, limits and\n"
        "joint_springs name the joint they drive.");
>>>>>>> main
}

}  // namespace spook
