#include "contacts/contact_rows.hpp"

#include <algorithm>
#include <tuple>

#include "contacts/contact_geometry.hpp"
#include "contacts/solve_quality.hpp"

namespace spook {

namespace {

/// How far a compliant contact is pressed in at the end of the step: where it was, and the way its bodies go.
double compression(const ContactRows& rows, const MixedSystem& system, const StepContact& point) {
    const ContactModel& model = rows.motion.model();
    if (!(model.surfaces.pair(point.contact).compliance > 0.0)) return 0.0;
    const Contact& contact = point.contact;
    double speed = 0.0;
    for (const int b : {contact.first, contact.second}) {
        const Vec6& v = model.bodies.solver_index[b] < 0 ? rows.motion.velocity[b]
                                                         : system.velocity[model.bodies.solver_index[b]];
        const bool first = b == contact.first;
        speed += dot(contact_row(first ? contact.point.normal : -contact.point.normal,
                                 first ? point.first_arm : point.second_arm),
                     v);
    }
    const double before = std::min(point.compression_before, -contact.point.gap);  // an open gap comes first
    return std::max(0.0, before - rows.motion.time_left(point) * speed);
}

}  // namespace

PgsContact ContactRows::packed(const StepContact& point) const {
    const ContactExtras& extras = points.extras(point);
    PgsContact packed;
    std::tie(packed.first, packed.second) = motion.bodies().solver_pair(point.contact);
    packed.normal = point.contact.point.normal;
    packed.tangent = extras.axis_scale[0] * point.tangent;
    packed.across = extras.axis_scale[1] * cross(packed.normal, point.tangent);
    packed.anisotropic = extras.is_anisotropic();
    packed.first_arm = point.first_arm;
    packed.second_arm = point.second_arm;
    packed.friction = point.friction;
    packed.normal_before = point.before;
    const Vec3 directions[3] = {packed.normal, packed.tangent, packed.across};
    for (int i = 0; i < 3; ++i) {
        packed.right[i] =
            motion.drive.any() ? -relative_velocity(point, directions[i], motion.drive.prescribed()) : -0.0;
        if (i > 0) packed.right[i] -= motion.surface_speed(point, directions[i]);
    }
    return packed;
}

RowBlock ContactRows::row_block(const StepContact& point, const PgsContact& packed, int rows) const {
    RowBlock block;
    block.is_contact = true;
    block.first = packed.first;
    block.second = packed.second;
    block.size = std::min(rows, 3);
    const Vec3 directions[3] = {packed.normal, packed.tangent, packed.across};
    for (int i = 0; i < block.size; ++i) {
        if (block.first >= 0) block.first_jacobian[i] = contact_row(directions[i], packed.first_arm);
        if (block.second >= 0) block.second_jacobian[i] = contact_row(-directions[i], packed.second_arm);
        block.right[i] = packed.right[i];
    }
    block.lower[0] = 0.0;
    if (rows == 6) add_turning(point, block);
    return block;
}

/// Rolling about both tangents and turning about the normal, as speeds at the larger body's radius: what is left of
/// them then compares with that of other rows.
void ContactRows::add_turning(const StepContact& point, RowBlock& block) const {
    const double scale = motion.bodies().size(point.contact);
    const Vec3 n = point.contact.point.normal;
    const Vec3 axes[3] = {point.tangent, cross(n, point.tangent), n};
    for (int i = 0; i < 3; ++i) {
        const Vec3 axis = scale * axes[i];
        const Vec6 row{0.0, 0.0, 0.0, axis.x, axis.y, axis.z};
        if (block.first >= 0) block.first_jacobian[3 + i] = row;
        if (block.second >= 0) block.second_jacobian[3 + i] = {0.0, 0.0, 0.0, -axis.x, -axis.y, -axis.z};
        block.right[3 + i] = -dot(axis, angular(motion.drive.prescribed()[point.contact.first]) -
                                            angular(motion.drive.prescribed()[point.contact.second]));
        block.lower[3 + i] = block.upper[3 + i] = 0.0;  // until its friction bounds it
    }
    block.size = 6;
}

void ContactRows::add_friction(const StepContact& point, int block,
                               std::vector<FrictionPoint>& friction) const {
    const PairMaterial material = motion.surfaces().pair(point.contact);
    const double soft = material.slip_compliance / motion.options().time_step,
                 scale = motion.bodies().size(point.contact);
    double normal = point.before;
    if (motion.options().friction == FrictionModel::box)
        normal = normal < 0.0 ? points.extras(point).guessed : normal;
    else if (point.solved) normal = point.normal;
    if (point.friction > 0.0) {
        friction.push_back({block, point.friction, soft, normal});
        friction.back().anisotropic = points.extras(point).is_anisotropic();
    }
    if (material.rolling > 0.0) friction.push_back({block, material.rolling / scale, 0.0, normal, 3, 2});
    if (material.torsional > 0.0) friction.push_back({block, material.torsional / scale, 0.0, normal, 5, 1});
}

/// What the normal's row at rest asks for, m/s.
double ContactRows::resting_right(StepContact& point, const Regularisation& row) const {
    const ContactBodies& bodies = motion.bodies();
    const double h = motion.options().time_step, gap = bodies.gap(point.contact);
    motion.measure(point);
    const bool touching = bodies.is_closed(point.contact);
    if (point.event)  // another point of a pair that meets may still be open
        return -(touching ? 0.0 : gap / motion.time_left(point));
    if (!touching) return -gap / h;
    const double depth = -row.violation_gain * std::max(gap, -elastic_depth(bodies, point));
    // A rigid contact that opens is not pushed after its own speed.
    return motion.surfaces().pair(point.contact).compliance > 0.0
               ? depth + row.upsilon * point.resting_approach()
               : depth;
}

/// Whether a point is likely to push: what a solver starts from.
bool ContactRows::is_pressed(const StepContact& point) const noexcept {
    const double h = motion.options().time_step, gap = point.contact.point.gap;
    if (point.solved) return point.normal > 0.0;
    return point.before > 0.0 || point.toi >= 0.0 ||
           (point.before < 0.0 && (motion.bodies().is_closed(point.contact) ||
                                   gap + h * (point.resting_approach() + point.dv_ext) < 0.0));
}

PgsContact ContactRows::resting(StepContact& point) const {
    const double h = motion.options().time_step;
    const PairMaterial material = motion.surfaces().pair(point.contact);
    const Regularisation row = regularise(material.compliance, material.damping, h);
    const double* const axis_scale = points.extras(point).axis_scale;
    PgsContact packed = this->packed(point);
    packed.right[0] += resting_right(point, row);
    packed.softness = row.softness;
    packed.slip_softness = material.slip_compliance / h;
    packed.impulse[0] = point.solved ? point.normal : std::max(0.0, point.before);
    for (int i = 0; i < 2; ++i) packed.impulse[i + 1] = point.tangents[i] / axis_scale[i];
    return packed;
}

RowBlock ContactRows::resting_block(StepContact& point) const {
    const PgsContact packed = resting(point);
    const bool turning = motion.surfaces().pair(point.contact).resists_turning(), rubs = point.friction > 0.0;
    RowBlock block = row_block(point, packed, turning ? 6 : rubs ? 3 : 1);
    block.softness[0] = packed.softness;
    block.state[0] = is_pressed(point) ? RowState::free : RowState::at_lower;
    block.multiplier[0] = packed.impulse[0];
    for (int i = 1; i <= 2 && rubs; ++i) {
        block.softness[i] = packed.slip_softness;
        block.multiplier[i] = packed.impulse[i];
    }
    for (int i = 1; i <= 2 && turning && !rubs; ++i) block.lower[i] = block.upper[i] = 0.0;
    for (int i = 3; i < block.size; ++i) block.multiplier[i] = points.extras(point).turning[i - 3];
    return block;
}

Vec3 store_solution(const ContactBodies& bodies, const RowBlock& block, ContactPoints& points,
                    StepContact& point) {
    Vec3 along, turning;
    for (int i = 1; i < block.size; ++i) {
        const Vec6& row = block.first >= 0 ? block.first_jacobian[i] : block.second_jacobian[i];
        const double sign = block.first >= 0 ? block.multiplier[i] : -block.multiplier[i];
        if (i < 3) along += sign * linear(row);
        else turning += sign * angular(row);
    }
    const Vec3 n = point.contact.point.normal, t = point.tangent;
    const double scale = 1.0 / bodies.size(point.contact);
    point.solved = point.answered = true;
    point.normal = block.multiplier[0];
    point.tangents[0] = dot(along, t);
    point.tangents[1] = dot(along, cross(n, t));
    if (block.size > 3) {
        double* const own = points.own_extras(point).turning;
        own[0] = scale * dot(turning, t);
        own[1] = scale * dot(turning, cross(n, t));
        own[2] = scale * dot(turning, n);
    }
    return along;
}

CachedContact& cache_contact(const ContactRows& rows, const MixedSystem& system, const StepContact& point,
                             double normal, Vec3 along, std::vector<CachedContact>& cache) {
    CachedContact& cached = cache.emplace_back();
    const Vec3 n = point.contact.point.normal;
    cached.contact = point.contact;
    cached.normal = normal;
    cached.compression = compression(rows, system, point);
    cached.impact = point.impact;
    cached.impulse = normal * n + along + rows.points.extras(point).impact_impulse;
    cached.tangent[0] = dot(along, point.tangent);
    cached.tangent[1] = dot(along, cross(n, point.tangent));
    cached.friction = rows.points.extras(point).axis_scale[0] * point.friction;
    cached.active =
        cached.normal > 0.0 || cached.impact > 0.0 || rows.motion.bodies().is_closed(point.contact);
    return cached;
}

}  // namespace spook
