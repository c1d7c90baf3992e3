// The rigid-body pipeline for Python: tables in, a report out.
#include "bindings/forces.hpp"
#include "rigid/rigid_program.hpp"
#include "run/composition.hpp"

namespace spook {

namespace {

void read_bodies(Entries& in, RigidScene& scene) {
    Columns table(in, "bodies");
    const std::vector<Motion> motion = table.kinds<Motion>("motion", "motion");
    const Numbers particle = table.numbers("particle"), mass = table.numbers("mass"),
                  inertia = table.numbers("inertia", 3), inertia_axes = table.numbers("inertia_axes", 4),
                  position = table.numbers("position", 3), orientation = table.numbers("orientation", 4),
                  velocity = table.numbers("velocity", 3),
                  angular_velocity = table.numbers("angular_velocity", 3), force = table.numbers("force", 3),
                  torque = table.numbers("torque", 3), friction = table.numbers("friction"),
                  restitution = table.numbers("restitution"), compliance = table.numbers("compliance"),
                  damping = table.numbers("damping"), slip_compliance = table.numbers("slip_compliance"),
                  rolling = table.numbers("rolling_friction"),
                  torsional = table.numbers("torsional_friction"),
                  surface_velocity = table.numbers("surface_velocity", 3),
                  friction_across = table.numbers("friction_across"),
                  friction_direction = table.numbers("friction_direction", 3),
                  tangential_restitution = table.numbers("tangential_restitution");
    for (std::size_t i = 0; i < table.rows(); ++i) {
        RigidBodySpec& body = scene.bodies.emplace_back();
        body.motion = motion[i];
        body.particle = particle.flag(i);
        body.mass = mass[i];
        body.inertia = inertia.vec(i);
        body.inertia_axes = inertia_axes.quat(i);
        body.position = position.vec(i);
        body.orientation = orientation.quat(i);
        body.velocity = velocity.vec(i);
        body.angular_velocity = angular_velocity.vec(i);
        body.force = force.vec(i);
        body.torque = torque.vec(i);
        body.material = {friction[i],
                         restitution[i],
                         compliance[i],
                         damping[i],
                         slip_compliance[i],
                         rolling[i],
                         torsional[i],
                         surface_velocity.vec(i),
                         friction_across[i],
                         friction_direction.vec(i),
                         tangential_restitution[i]};
    }
    table.expect_all_read();
}

void read_joints(Entries& in, RigidScene& scene) {
    Columns table(in, "joints");
    const std::vector<JointKind> kind = table.kinds<JointKind>("kind", "joint");
    const Numbers first = table.numbers("first"), second = table.numbers("second"),
                  first_point = table.numbers("first_point", 3),
                  second_point = table.numbers("second_point", 3), axes = table.numbers("axes", 9),
                  length = table.numbers("rest_length"), compliance = table.numbers("compliance", 6),
                  damping = table.numbers("damping", 6), one_sided = table.numbers("one_sided"),
                  restitution = table.numbers("restitution"), strength = table.numbers("strength"),
                  torque_strength = table.numbers("torque_strength");
    const Range bodies{scene.bodies.size(), "bodies", true};
    for (std::size_t i = 0; i < table.rows(); ++i) {
        JointSpec& joint = scene.joints.emplace_back();
        joint.kind = kind[i];
        joint.first = first.index(i, bodies);
        joint.second = second.index(i, bodies);
        joint.first_point = first_point.vec(i);
        joint.second_point = second_point.vec(i);
        for (std::size_t k = 0; k < 3; ++k) joint.axes[k] = axes.vec(i, k);
        joint.rest_length = length[i];
        joint.one_sided = one_sided.flag(i);
        joint.restitution = restitution[i];
        joint.strength = strength[i];
        joint.torque_strength = torque_strength[i];
        std::copy_n(compliance.at(i), 6, joint.compliance.begin());
        std::copy_n(damping.at(i), 6, joint.damping.begin());
    }
    table.expect_all_read();
}

Range all_joints(const RigidScene& scene) { return {scene.joints.size(), "joints"}; }

void read_motors(Entries& in, RigidScene& scene) {
    Columns table(in, "motors");
    const Numbers joint = table.numbers("joint"), speed = table.numbers("speed"),
                  force = table.numbers("max_force"), pushes = table.numbers("pushes");
    for (std::size_t i = 0; i < table.rows(); ++i) {
        JointSpec& spec = scene.joints[joint.index(i, all_joints(scene))];
        spec.motor.emplace();
        spec.motor->speed = speed[i];
        spec.motor->force = force[i];
        spec.motor->pushes = pushes.flag(i);
    }
    table.expect_all_read();
}

void read_frictions(Entries& in, RigidScene& scene) {
    Columns table(in, "joint_frictions");
    const Numbers joint = table.numbers("joint"), constant = table.numbers("constant", 2),
                  load = table.numbers("load", 2);
    for (std::size_t i = 0; i < table.rows(); ++i) {
        JointSpec& spec = scene.joints[joint.index(i, all_joints(scene))];
        std::copy_n(constant.at(i), 2, spec.dry_friction.begin());
        std::copy_n(load.at(i), 2, spec.load_friction.begin());
    }
    table.expect_all_read();
}

void read_armatures(Entries& in, RigidScene& scene) {
    Columns table(in, "armatures");
    const Numbers joint = table.numbers("joint"), inertia = table.numbers("inertia");
    for (std::size_t i = 0; i < table.rows(); ++i)
        scene.joints[joint.index(i, all_joints(scene))].armature = inertia[i];
    table.expect_all_read();
}

void read_limits(Entries& in, RigidScene& scene) {
    Columns table(in, "limits");
    const Numbers joint = table.numbers("joint"), lower = table.numbers("lower"),
                  upper = table.numbers("upper"), compliance = table.numbers("compliance"),
                  damping = table.numbers("damping"), restitution = table.numbers("restitution");
    for (std::size_t i = 0; i < table.rows(); ++i) {
        JointSpec& spec = scene.joints[joint.index(i, all_joints(scene))];
        spec.limit.emplace();
        spec.limit->lower = lower[i];
        spec.limit->upper = upper[i];
        spec.limit->compliance = compliance[i];
        spec.limit->damping = damping[i];
        spec.limit->restitution = restitution[i];
    }
    table.expect_all_read();
}

void read_joint_springs(Entries& in, RigidScene& scene) {
    Columns table(in, "joint_springs");
    const Numbers joint = table.numbers("joint"), stiffness = table.numbers("stiffness"),
                  rest = table.numbers("rest"), damping = table.numbers("damping"),
                  force = table.numbers("max_force");
    for (std::size_t i = 0; i < table.rows(); ++i) {
        JointSpec& spec = scene.joints[joint.index(i, all_joints(scene))];
        spec.spring.emplace();
        spec.spring->force = force[i];
        spec.spring->stiffness = stiffness[i];
        spec.spring->rest = rest[i];
        spec.spring->damping = damping[i];
    }
    table.expect_all_read();
}

/// Corners and faces of a hull or a mesh, made once, when it is first named.
struct Outline {
    std::vector<Vec3> places;
    std::vector<int> indices, counts;
    std::shared_ptr<const Polytope> hull{};
    std::shared_ptr<const Mesh> mesh{};

    const std::shared_ptr<const Polytope>& as_hull() {
        if (!hull) hull = std::make_shared<const Polytope>(places, indices, counts);
        return hull;
    }
    const std::shared_ptr<const Mesh>& as_mesh() {
        if (mesh) return mesh;
        std::vector<std::array<int, 3>> triangles;
        for (std::size_t k = 0; k + 2 < indices.size(); k += 3)
            triangles.push_back({indices[k], indices[k + 1], indices[k + 2]});
        mesh = std::make_shared<const Mesh>(places, std::move(triangles));
        return mesh;
    }
};
using Outlines = std::vector<Outline>;

/// Corners of hulls and meshes, and the loops round their faces; both in ascending order of outline and face.
Outlines read_outlines(Entries& in) {
    Columns points(in, "outline_corners"), rounds(in, "outline_faces");
    const Numbers outline_of = points.numbers("outline"), place = points.numbers("position", 3),
                  loop_of = rounds.numbers("outline"), face = rounds.numbers("face"),
                  corner = rounds.numbers("corner");
    Outlines outlines;
    std::size_t point = 0, row = 0;
    while (point < points.rows()) {
        const int outline = outline_of.index(point);
        std::vector<Vec3> places;
        std::vector<int> indices, counts;
        for (; point < points.rows() && outline_of.index(point) == outline; ++point)
            places.push_back(place.vec(point));
        for (int last = -1; row < rounds.rows() && loop_of.index(row) == outline; ++row) {
            if (face.index(row) != last) counts.push_back(0);
            last = face.index(row);
            ++counts.back();
            indices.push_back(corner.index(row, {places.size(), "corners"}));
        }
        outlines.push_back({std::move(places), std::move(indices), std::move(counts)});
    }
    points.expect_all_read();
    rounds.expect_all_read();
    return outlines;
}

std::vector<Collider> read_colliders(Entries& in, Outlines& outlines, std::size_t bodies, const char* name) {
    std::vector<Collider> read;
    Columns table(in, name);
    const std::vector<ShapeKind> kind = table.kinds<ShapeKind>("kind", "shape");
    const Numbers body = table.numbers("body"), position = table.numbers("position", 3),
                  orientation = table.numbers("orientation", 4), radius = table.numbers("radius"),
                  length = table.numbers("length"), size = table.numbers("size", 3),
                  normal = table.numbers("normal", 3), outline = table.numbers("outline");
    for (std::size_t i = 0; i < table.rows(); ++i) {
        Collider& collider = read.emplace_back();
        collider.body = body.index(i, {bodies, "bodies"});
        collider.part = {position.vec(i), rotation(orientation.quat(i))};
        switch (kind[i]) {
            case ShapeKind::sphere: collider.shape = Primitive::sphere(radius[i]); break;
            case ShapeKind::capsule: collider.shape = Primitive::capsule(radius[i], length[i]); break;
            case ShapeKind::box: collider.shape = Primitive::box(size.vec(i)); break;
            case ShapeKind::cylinder: collider.shape = Primitive::cylinder(radius[i], length[i]); break;
            case ShapeKind::cone: collider.shape = Primitive::cone(radius[i], length[i]); break;
            case ShapeKind::hull:
                collider.shape =
                    Primitive::convex(outlines[outline.index(i, {outlines.size(), "outlines"})].as_hull());
                break;
            case ShapeKind::plane: collider.shape = Primitive::plane(normal.vec(i)); break;
            case ShapeKind::triangle: {  // a row for a mesh, a collider for each of its triangles
                const auto& mesh = outlines[outline.index(i, {outlines.size(), "outlines"})].as_mesh();
                const Collider whole = collider;
                read.pop_back();
                for (int k = 0; k < static_cast<int>(mesh->triangles.size()); ++k)
                    read.push_back({whole.body, Primitive::sheet(mesh, k), whole.part});
                break;
            }
        }
    }
    table.expect_all_read();
    return read;
}

void read_terms(Entries& in, RigidScene& scene) {
    Columns table(in, "terms");
    const Numbers row = table.numbers("row"), joint = table.numbers("joint"),
                  coefficient = table.numbers("coefficient");
    for (std::size_t i = 0; i < table.rows(); ++i)
        scene.joints[row.index(i, all_joints(scene))].terms.push_back(
            {joint.index(i, all_joints(scene)), coefficient[i]});
    table.expect_all_read();
}

void read_wire_points(Entries& in, RigidScene& scene) {
    Columns table(in, "wire_points");
    const Numbers wire = table.numbers("wire"), body = table.numbers("body"),
                  point = table.numbers("point", 3);
    for (std::size_t i = 0; i < table.rows(); ++i)
        scene.joints[wire.index(i, all_joints(scene))].points.push_back(
            {body.index(i, {scene.bodies.size(), "bodies", true}), point.vec(i)});
    table.expect_all_read();
}

void read_eyes(Entries& in, RigidScene& scene) {
    Columns table(in, "eyes");
    const Numbers wire = table.numbers("wire"), point = table.numbers("point"),
                  friction = table.numbers("friction"), turns = table.numbers("turns");
    for (std::size_t i = 0; i < table.rows(); ++i) {
        const JointSpec& over = scene.joints[wire.index(i, all_joints(scene))];
        JointSpec eye;
        eye.kind = JointKind::eye;
        eye.wire = wire.index(i);
        eye.eye = point.index(i, {over.points.size(), "points of this wire"});
        eye.points.assign(over.points.begin() + eye.eye, over.points.end());
        eye.terms = over.terms;
        eye.friction[0] = friction[i];
        eye.turns = turns[i];
        scene.joints.push_back(std::move(eye));
    }
    table.expect_all_read();
}

void read_tyres(Entries& in, RigidScene& scene) {
    Columns table(in, "tyres");
    const Numbers joint = table.numbers("joint"), radius = table.numbers("radius"),
                  stiffness = table.numbers("slip_stiffness", 2), friction = table.numbers("friction", 2);
    for (std::size_t i = 0; i < table.rows(); ++i) {
        JointSpec& tyre = scene.joints[joint.index(i, all_joints(scene))];
        tyre.radius = radius[i];
        std::copy_n(stiffness.at(i), 2, tyre.slip_stiffness.begin());
        std::copy_n(friction.at(i), 2, tyre.friction.begin());
    }
    table.expect_all_read();
}

void read_fluids(Entries& in, RigidScene& scene) {
    Columns table(in, "fluids");
    const Numbers density = table.numbers("density"), level = table.numbers("level"),
                  up = table.numbers("up", 3), velocity = table.numbers("velocity", 3),
                  drag = table.numbers("drag");
    for (std::size_t i = 0; i < table.rows(); ++i)
        scene.fluids.push_back({density[i], level[i], up.vec(i), velocity.vec(i), drag[i]});
    table.expect_all_read();
}

/// Functions of time, and the knots of those that are tables.
void read_drives(Entries& in, RigidScene& scene) {
    Columns table(in, "drives");
    const std::vector<DriveKind> kind = table.kinds<DriveKind>("kind", "drive");
    const std::vector<TimeKind> function = table.kinds<TimeKind>("function", "function of time");
    const Numbers index = table.numbers("index"), linear = table.numbers("linear", 3),
                  angular = table.numbers("angular", 3), offset = table.numbers("offset"),
                  amplitude = table.numbers("amplitude"), rate = table.numbers("rate"),
                  phase = table.numbers("phase");
    for (std::size_t i = 0; i < table.rows(); ++i)
        scene.drives.push_back({kind[i],
                                index.index(i),
                                linear.vec(i),
                                angular.vec(i),
                                {function[i], offset[i], amplitude[i], rate[i], phase[i], {}, {}}});
    table.expect_all_read();
    Columns rows(in, "knots");
    const Numbers drive = rows.numbers("drive"), time = rows.numbers("time"), value = rows.numbers("value");
    for (std::size_t i = 0; i < rows.rows(); ++i) {
        TimeFunction& of = scene.drives[drive.index(i, {scene.drives.size(), "drives"})].function;
        of.times.push_back(time[i]);
        of.values.push_back(value[i]);
    }
    rows.expect_all_read();
}

void read_no_contact(Entries& in, RigidScene& scene) {
    Columns table(in, "no_contact");
    const Numbers first = table.numbers("first"), second = table.numbers("second");
    const Range bodies{scene.bodies.size(), "bodies"};
    for (std::size_t i = 0; i < table.rows(); ++i)
        scene.no_contact.push_back({first.index(i, bodies), second.index(i, bodies)});
    table.expect_all_read();
}

void read_pair_frictions(Entries& in, RigidScene& scene) {
    Columns table(in, "pair_frictions");
    const Numbers first = table.numbers("first"), second = table.numbers("second");
    const Numbers friction = table.numbers("friction"), rolling = table.numbers("rolling_friction"),
                  torsional = table.numbers("torsional_friction");
    const Range bodies{scene.bodies.size(), "bodies"};
    for (std::size_t i = 0; i < table.rows(); ++i)
        scene.pair_frictions.push_back(
            {first.index(i, bodies), second.index(i, bodies), friction[i], rolling[i], torsional[i]});
    table.expect_all_read();
}

RigidMethod to_method(Entries& in) {
    RigidMethod out;
    Entries options(in.dict("method"), "method: the option");
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
    options.read("sleep_speed", out.sleep_speed);
    options.read("sleep_after", out.sleep_after);
    Composition composition{};
    options.read_kind("composition", composition);
    out.composition = order_of(composition);
    options.read("runge_kutta", out.runge_kutta);
    options.read("tolerance", out.tolerance);
    if (out.runge_kutta) out.composition = 8;  // what holds beside a composition's stages holds here
    options.read("string_stiffness", out.string_stiffness);
    options.read("half_step_velocities", out.half_step_velocities);
    options.read("linear_turns", out.linear_turns);
    options.read("corrections", out.corrections);
    options.read("correction_cap", out.correction_cap);
    options.read("force_collision", out.force_collision);
    options.read("force_rotation", out.force_rotation);
    options.read("force_block", out.force_block);
    options.expect_all_read();
    return out;
}

void make(RigidProgram* self, const nb::dict& tables, const std::vector<QuantityRequest>& quantities,
          const std::vector<Observation>& observations, double time_left) {
    RigidScene scene;
    Entries in(tables, "scene: the table");
    read_settings(in, scene);
    in.read("contacts", scene.contacts);
    scene.method = to_method(in);
    read_bodies(in, scene);
    read_joints(in, scene);
    read_motors(in, scene);
    read_limits(in, scene);
    read_joint_springs(in, scene);
    read_frictions(in, scene);
    read_armatures(in, scene);
    scene.springs = read_springs(in, scene.bodies.size());
    scene.fields = read_fields(in);
    read_terms(in, scene);
    read_wire_points(in, scene);
    read_eyes(in, scene);
    read_tyres(in, scene);
    read_fluids(in, scene);
    read_drives(in, scene);
    Outlines outlines = read_outlines(in);
    scene.floaters = read_colliders(in, outlines, scene.bodies.size(), "floaters");
    scene.colliders = read_colliders(in, outlines, scene.bodies.size(), "colliders");
    read_no_contact(in, scene);
    read_pair_frictions(in, scene);
    in.expect_all_read();
    make_in_time(self, scene, quantities, observations, time_left);
}

}  // namespace

void bind_rigid(nb::module_& m) {
    bind_program<RigidSystem>(
        m, "RigidProgram", "RigidSnapshot", "A compiled scene with rigid bodies.", &make, nb::arg("scene"),
        nb::arg("quantities"), nb::arg("observations"), nb::arg("time_left") = 0.0,
        "`scene` has the tables that engine/rigid_program.py packs, each a dict of columns with a row for each\n"
        "body, joint, … in the names of RigidBodySpec, JointSpec and Primitive, and beside them method, gravity,\n"
        "contacts and loads_change; a table or column that is missing or unknown is a ValueError that names it.\n"
        "Outlines of hulls and meshes are numbered in the order they come; springs and fields as for\n"
        "ParticleProgram. A body is an index, -1 the world; motors, limits, joint_springs, joint_frictions and\n"
        "armatures name the joint they drive. Raises TimeoutError where making it takes longer than\n"
        "`time_left` [s, 0 for no limit].");
}

}  // namespace spook
