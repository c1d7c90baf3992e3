// A rigid-body scene as the native side gets it: indices instead of names, every default resolved.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "collision/detection.hpp"
#include "contacts/contact_stage.hpp"
#include "linear/vec.hpp"
#include "run/forces.hpp"
#include "run/named_enum.hpp"
#include "run/time_function.hpp"

namespace spook {

SPOOK_NAMED_ENUM(Motion, dynamic, fixed, kinematic)
SPOOK_NAMED_ENUM(JointKind, distance, lock, ball, hinge, prismatic, universal, point_on_line, cylindrical,
                 planar, relation, wire, eye, tyre)

/// How a joint holds rotations: not; all three; the axis only; one axis normal to another.
enum class Turning : unsigned char { free, held, swing, cross };

/// What a joint between two frames holds: translations along its axes linear_first … linear_end − 1, then rotations.
struct JointHolds {
    int linear_first, linear_end;
    Turning turning;
    constexpr int linear() const noexcept { return linear_end - linear_first; }
    constexpr int rows() const noexcept {
        return linear() + (turning == Turning::held    ? 3
                           : turning == Turning::swing ? 2
                           : turning == Turning::cross ? 1
                                                       : 0);
    }
};

constexpr JointHolds holds_of(JointKind kind) noexcept {
    switch (kind) {
        case JointKind::lock: return {0, 3, Turning::held};
        case JointKind::ball: return {0, 3, Turning::free};
        case JointKind::hinge: return {0, 3, Turning::swing};
        case JointKind::prismatic: return {1, 3, Turning::held};
        case JointKind::universal: return {0, 3, Turning::cross};
        case JointKind::point_on_line: return {1, 3, Turning::free};
        case JointKind::cylindrical: return {1, 3, Turning::swing};
        case JointKind::planar: return {0, 1, Turning::swing};
        case JointKind::distance:
        case JointKind::relation:
        case JointKind::wire:
        case JointKind::eye:
        case JointKind::tyre: return {0, 0, Turning::free};
    }
    return {0, 0, Turning::free};
}

struct RigidBodySpec {
    Motion motion = Motion::dynamic;
    bool particle = false;  // three unknowns, no rotation
    double mass = 0.0;
    Vec3 inertia;       // principal moments
    Quat inertia_axes;  // principal axes in those of the body
    Vec3 position;
    Quat orientation;
    Vec3 velocity, angular_velocity;  // world axes
    Vec3 force, torque;               // constant loads, world axes
    SurfaceMaterial material;
};

/// One joint's free coordinate in a relation.
struct RelationTerm {
    int joint = 0;
    double coefficient = 0.0;
};

struct MotorSpec {
    double speed = 0.0, force = 0.0;  // force may be infinite
    bool pushes = false;              // with `force` whatever the speed
};
struct LimitSpec {
    double lower = 0.0, upper = 0.0, compliance = 0.0, damping = 0.0, restitution = 0.0;
};
struct JointSpringSpec {
    double stiffness = 0.0, rest = 0.0, damping = 0.0;
    double force = std::numeric_limits<double>::infinity();  // N, N m: the most it pulls
};

/// Rows of a joint in the order of engine/joints.py, then those of its free coordinate: motor, limit, spring, armature,
/// friction.
struct JointSpec {
    JointKind kind = JointKind::lock;
    int first = -1, second = -1;     // body, −1 the world
    Vec3 first_point, second_point;  // where the joint holds each end at the start, world
    std::array<Vec3, 3> axes;        // unit, right-handed, at the start; the first is the joint's axis.
                                     // universal: axis, cross axis, their product
    double rest_length = 0.0;        // distance, wire
    std::array<double, 6> compliance{}, damping{};

    std::vector<RelationTerm> terms;  // relation: Σ coefficient × coordinate is kept at zero
    std::vector<End> points;          // wire: where it runs through, world places at the start
    bool one_sided = false;           // wire: it may go slack
    double restitution = 0.0;         // wire: of the speed at which it snaps taut

    int wire = -1, eye = 0;                  // eye: of which wire, and which of its points
    double turns = 0.0;                      // eye: of the wire round it, beyond its bend there
    std::array<double, 2> friction{};        // eye: µ; tyre: µ along and across
    std::array<double, 2> slip_stiffness{};  // tyre: N per unit of slip along, N/rad of slip angle
    double radius = 0.0;                     // tyre; its axes: spin axis, normal of the road

    double strength = std::numeric_limits<double>::infinity();  // N: it breaks under more; of a relation,
    double torque_strength =
        std::numeric_limits<double>::infinity();  // N m    what one of coefficient 1 feels

    std::optional<MotorSpec> motor;
    std::optional<LimitSpec> limit;
    std::optional<JointSpringSpec> spring;
    double armature = 0.0;                  // kg, kg m²: inertia that goes as the free coordinate does
    std::array<double, 2> dry_friction{};   // of the slide along the axis, N, and of the turn about it, N m
    std::array<double, 2> load_friction{};  // the same per N the joint holds: 1, m
};

/// Distances, relations, wires and their eyes have one row; a tyre's are its load, and the forces along and across.
constexpr int row_count(JointKind kind) noexcept {
    const int rows = kind == JointKind::tyre ? 3 : holds_of(kind).rows();
    return rows > 0 ? rows : 1;
}

/// Friction and springs: rows that hold no place.
constexpr bool gives_way(JointKind kind) noexcept {
    return kind == JointKind::eye || kind == JointKind::tyre;
}

inline bool can_break(const JointSpec& joint) noexcept {
    return std::isfinite(joint.strength) || std::isfinite(joint.torque_strength);
}

/// Whether the slide along the joint's axis (0) or the turn about it (1) meets friction.
inline bool rubs(const JointSpec& joint, int way) noexcept {
    return joint.dry_friction[way] > 0.0 || joint.load_friction[way] > 0.0;
}
inline bool rubs(const JointSpec& joint) noexcept { return rubs(joint, 0) || rubs(joint, 1); }

/// Whether some row of the joint has a finite bound.
inline bool can_let_go(const JointSpec& joint) noexcept {
    return joint.one_sided || gives_way(joint.kind) || can_break(joint) || rubs(joint) ||
           (joint.motor && (joint.motor->pushes || std::isfinite(joint.motor->force))) ||
           (joint.spring && std::isfinite(joint.spring->force)) ||
           (joint.limit && joint.limit->lower < joint.limit->upper);
}

struct RigidMethod {
    double time_step = 0.0;  // of a reported step
    int substeps = 1;
    int refinements = 1;
    double floor = 1e-12;
    SolverKind solver = SolverKind::direct;
    FrictionModel friction = FrictionModel::cone;
    int iterations = 50;
    double residual_tolerance = 1e-10;  // m/s
    ImpactOrder impacts = ImpactOrder::simultaneous;
    double unsettled_residual = 0.1;              // m/s
    double sleep_speed = 0.0, sleep_after = 0.5;  // m/s, s: what is slower for so long sleeps; 0: none
    int composition = 2;            // order; above 2 a symmetric composition of constrained steps
    bool runge_kutta = false;       // an explicit method of order 8 in joint coordinates in its place
    double tolerance = 0.0;         // of its parts of a step, rad or sizes of joints; 0: none, a step is one
    bool string_stiffness = false;  // the geometric stiffness of loaded joints, implicitly
    bool half_step_velocities = false;  // velocities live at mid-step
    bool linear_turns = false;          // rows as they are, however far bodies turn
    int corrections = 0;                // extra solves per step for the curvature of the rows
    double correction_cap = 0.3;        // of the joint's arms, or rad
    bool force_collision = false;  // look for contacts even where none are possible, to measure what it costs
    bool force_rotation = false;   // give particles a rotation that is not seen, to measure what it costs
    bool force_block = false;      // factor blocks also where numbers of a plane would do
};

/// A fluid at rest or in steady motion below the plane up · x = level.
struct Fluid {
    double density = 0.0, level = 0.0;  // kg/m³, m
    Vec3 up, velocity;                  // unit; m/s
    double drag = 0.0;                  // quadratic drag coefficient
};

struct RigidScene {
    std::vector<RigidBodySpec> bodies;
    std::vector<JointSpec> joints;
    std::vector<SpringForce> springs;
    std::vector<CentralField> fields;
    std::vector<Fluid> fluids;
    std::vector<Collider> floaters;            // surfaces that displace fluid
    std::vector<TimeDrive> drives;             // what follows the time
    std::vector<Collider> colliders;           // of all bodies that can touch
    std::vector<IndexPair> no_contact;         // pairs of bodies that never touch
    std::vector<PairFriction> pair_frictions;  // of two bodies, in place of what their surfaces make of it
    bool contacts = true;                      // false: the scene switches them off
    bool loads_change = false;                 // loads are set while it runs, whatever they are at the start
    Vec3 gravity;
    RigidMethod method;
};

/// Whether the stop of some joint does.
inline bool stops_rebound(const RigidScene& scene) {
    return std::ranges::any_of(scene.joints, [](const JointSpec& joint) {
        return joint.restitution > 0.0 || (joint.limit && joint.limit->restitution > 0.0);
    });
}

}  // namespace spook
