// The rigid-body pipeline for Python: arrays in, a report out.
#include "bindings/common.hpp"

#include <stdexcept>

#include "rigid/rigid_program.hpp"

namespace spook {

namespace {

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
    }
    return collider;
}

RigidMethod to_method(const nb::dict& method) {
    RigidMethod out;
    out.time_step = nb::cast<double>(method["time_step"]);
    out.substeps = nb::cast<int>(method["substeps"]);
    out.refinements = nb::cast<int>(method["refinements"]);
    out.floor = nb::cast<double>(method["floor"]);
    out.solver = static_cast<SolverKind>(nb::cast<int>(method["solver"]));
    out.friction = static_cast<FrictionModel>(nb::cast<int>(method["friction"]));
    out.iterations = nb::cast<int>(method["iterations"]);
    out.residual_tolerance = nb::cast<double>(method["residual_tolerance"]);
    out.composition = nb::cast<int>(method["composition"]);
    out.half_step_velocities = nb::cast<bool>(method["half_step_velocities"]);
    out.corrections = nb::cast<int>(method["corrections"]);
    out.correction_cap = nb::cast<double>(method["correction_cap"]);
    out.string_stiffness = nb::cast<bool>(method["string_stiffness"]);
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
    expect_columns(joints.shape(1), 37, "joints");
    expect_columns(springs.shape(1), 9, "springs");
    expect_columns(fields.shape(1), 4, "fields");
    expect_columns(colliders.shape(1), 10, "colliders");
    RigidScene scene;
    scene.gravity = to_vec(gravity);
    scene.method = to_method(method);
    for (std::size_t i = 0; i < bodies.shape(0); ++i)
        scene.bodies.push_back(to_body(body_kinds.data() + 2 * i, bodies.data() + 28 * i));
    for (std::size_t i = 0; i < joints.shape(0); ++i)
        scene.joints.push_back(to_joint(joint_kinds.data() + 6 * i, joints.data() + 37 * i));
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
}

}  // namespace

void bind_rigid(nb::module_& m) {
    nb::class_<RigidProgram>(m, "RigidProgram", "A compiled scene with rigid bodies.")
        .def(
            "__init__", &make, nb::arg("body_kinds"), nb::arg("bodies"), nb::arg("joint_kinds"),
            nb::arg("joints"), nb::arg("spring_ends"), nb::arg("springs"), nb::arg("fields"),
            nb::arg("collider_kinds"), nb::arg("colliders"), nb::arg("no_contact"), nb::arg("gravity"),
            nb::arg("method"), nb::arg("quantities"), nb::arg("observations"),
            "body_kinds (n, 2): motion, particle. bodies (n, 28): mass, inertia, position, orientation, velocity,\n"
            "angular velocity, force, torque, friction, restitution, compliance, damping, slip compliance.\n"
            "joint_kinds (m, 6): kind, first, second, has motor, limit, spring. joints (m, 37): points of both\n"
            "ends, three axes, rest length, 6 compliances, 6 dampings, motor speed and force, limit lower, upper,\n"
            "compliance, damping, spring stiffness, rest, damping. springs and fields as for ParticleProgram.\n"
            "collider_kinds (c, 2): body, shape (sphere, capsule, box, plane). colliders (c, 10): position and\n"
            "orientation in the body, then radius, length or edges or normal. no_contact (p, 2): body indices.")
        .def(
            "run", &run, nb::arg("steps"), nb::arg("time_limit"), nb::arg("timed"),
            "Run from the start, the GIL released; a dict with status, recordings, counters, final_state, ...")
        .def_prop_ro("solver", &RigidProgram::solver, "none, block, pivot or iterative")
        .def_prop_ro("contacts_possible", &RigidProgram::contacts_possible);
}

}  // namespace spook
