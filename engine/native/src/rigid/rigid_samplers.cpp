#include "rigid/rigid_program.hpp"

namespace spook {
namespace {

std::vector<int> distances(const RigidReadings& system) {
    std::vector<int> found;
    for (int joint = 0; joint < system.joints().count(); ++joint)
        if (system.joints().constants(joint).kind == JointKind::distance) found.push_back(joint);
    return found;
}

Sampler joint_sampler(const RigidReadings* s, int joint, bool force) {
    const auto read_distance = [s, force](int distance, double* out) {
        if (force) *out = s->tension(distance);
        else s->violation(distance, out);
    };
    if (joint < 0) {
        const std::vector<int> all = distances(*s);
        return {static_cast<int>(all.size()), [=](double* out) {
                    for (int distance : all) read_distance(distance, out++);
                }};
    }
    const JointKind kind = s->joints().constants(joint).kind;
    if (kind == JointKind::relation && force)  // what a coordinate of coefficient 1 feels
        return {1, [=](double* out) { *out = -s->tension(joint); }};
    if (kind == JointKind::distance || kind == JointKind::relation || kind == JointKind::wire)
        return {1, [=](double* out) { read_distance(joint, out); }};
    if (force) return {6, [=](double* out) { s->wrench(joint, out); }};
    return {s->joints().rows(joint), [=](double* out) { s->violation(joint, out); }};
}

/// From the centre of mass to a point given in body axes, world axes.
Vec3 arm(const RigidReadings& system, int body, Vec3 point) {
    if (point.x == 0.0 && point.y == 0.0 && point.z == 0.0) return {};
    return axes(system.constants(body), system.state(body)) * point;
}

Sampler momentum_sampler(const RigidReadings* s, bool angular, Vec3 about) {
    return {3, [=](double* out) {
                Vec3 sum;
                for (int i = 0; i < s->bodies(); ++i) {
                    if (!s->constants(i).moves()) continue;
                    const Vec3 p = s->constants(i).mass * s->state(i).velocity;
                    sum += angular ? cross(s->position_of(i) - about, p) + s->state(i).angular_momentum : p;
                }
                put(out, sum);
            }};
}

/// Whether positions and orientations alone give it.
bool of_places(Quantity quantity) {
    switch (quantity) {
        case Quantity::position:
        case Quantity::orientation:
        case Quantity::violation:
        case Quantity::joint_coordinate:
        case Quantity::potential_energy: return true;
        case Quantity::velocity:
        case Quantity::angular_velocity:
        case Quantity::kinetic_energy:
        case Quantity::energy:
        case Quantity::momentum:
        case Quantity::angular_momentum:
        case Quantity::constraint_force:
        case Quantity::contact_force:
        case Quantity::contact_count:
        case Quantity::penetration:
        case Quantity::contact_points: break;
    }
    return false;
}

}  // namespace

Sampler sampler_of(RigidSystem& system, const QuantityRequest& request) {
    const RigidReadings* s = &system.read();
    const Quantity quantity = from_text<Quantity>(request.kind, "quantity");
    if (quantity == Quantity::constraint_force) system.see_forces();
    if (!of_places(quantity)) system.see_velocities();
    const int index = request.index, other = request.other, count = s->bodies();
    switch (quantity) {
        case Quantity::position:
            return one_or_all(index, count, 3, [s, point = request.point](int i, double* out) {
                put(out, s->position_of(i) + arm(*s, i, point));
            });
        case Quantity::velocity:
            return one_or_all(index, count, 3, [s, point = request.point](int i, double* out) {
                put(out, s->state(i).velocity + cross(s->state(i).angular_velocity, arm(*s, i, point)));
            });
        case Quantity::angular_velocity:
            return one_or_all(index, count, 3,
                              [s](int i, double* out) { put(out, s->state(i).angular_velocity); });
        case Quantity::orientation:
            return one_or_all(index, count, 4, [s](int i, double* out) {
                const Quat q = s->orientation_of(i);
                out[0] = q.w, out[1] = q.x, out[2] = q.y, out[3] = q.z;
            });
        case Quantity::kinetic_energy: return {1, [s](double* out) { *out = s->kinetic_energy(); }};
        case Quantity::potential_energy: return {1, [s](double* out) { *out = s->potential_energy(); }};
        case Quantity::energy:
            return {1, [s](double* out) { *out = s->kinetic_energy() + s->potential_energy(); }};
        case Quantity::momentum: return momentum_sampler(s, false, request.point);
        case Quantity::angular_momentum: return momentum_sampler(s, true, request.point);
        case Quantity::violation: return joint_sampler(s, index, false);
        case Quantity::constraint_force: return joint_sampler(s, index, true);
        case Quantity::joint_coordinate:
            system.track(index);
            return {1, [s, index](double* out) { *out = s->coordinate(index); }};
        case Quantity::contact_force:
            return {3, [s, index, other](double* out) { put(out, s->contact_force(index, other)); }};
        case Quantity::contact_count: return {1, [s](double* out) { *out = s->contact_count(); }};
        case Quantity::contact_points:
            return {CONTACT_NUMBERS * index, [s, index](double* out) { s->contact_points(index, out); }};
        case Quantity::penetration: return {1, [s](double* out) { *out = s->penetration(); }};
    }
    throw std::invalid_argument("rigid bodies have no quantity " + request.kind);
}

}  // namespace spook
