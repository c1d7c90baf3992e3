// The points of a step, once they are found: which of them act at the time of their impact, in which order they are
// solved, and how fast they close.
#include <algorithm>
#include <cmath>

#include "contacts/contact_geometry.hpp"
#include "contacts/contact_stage.hpp"
#include "contacts/tolerances.hpp"

namespace spook {

namespace {

constexpr char rebounds = 1,
               held = 2;  // of an island: some impact in it has a restitution; not all in it is free

using namespace tolerances::contact_order;

}  // namespace

/// Islands of balls whose only impact is one pair, and in which nothing else is approached, are moved to the impact's
/// time. Balls, since other shapes would have to be turned to that time as well, and a turn without the momentum
/// that goes with it changes the energy. A supported body that moves along the forces would gain energy by it, unless what
/// is moved supports it, or the impact is with something that stands still and pushes against the forces.
void ContactStage::find_events() {
    connected_.begin(bodies_->solver_index.size());
    const auto root = [this](int b) { return connected_.root(b); };
    const auto join = [this](int a, int b) {
        if (bodies_->solver_index[a] >= 0 && bodies_->solver_index[b] >= 0) connected_.join(a, b);
    };
    for (const Point& point : points_) join(point.contact.first, point.contact.second);
    for (const auto& [a, b] : bodies_->joints)
        if (a >= 0 && b >= 0) join(a, b);

    auto& [members, impact_pair, plain, bouncy, when, speed, moving_along, may_move_along] = arrays_.events;
    members.assign(bodies_->solver_index.size(), 0);
    impact_pair.assign(bodies_->solver_index.size(), 0);
    plain.assign(bodies_->solver_index.size(), 1), bouncy.assign(bodies_->solver_index.size(), 0);
    moving_along.assign(bodies_->solver_index.size(), 0),
        may_move_along.assign(bodies_->solver_index.size(), 0);
    when.assign(bodies_->solver_index.size(), -1.0);
    for (std::size_t b = 0; b < bodies_->solver_index.size(); ++b)
        if (bodies_->solver_index[b] >= 0) {
            const int island = root(static_cast<int>(b));
            ++members[island];
            plain[island] = plain[island] && bodies_->ball[b];
            if (!is_free(b)) bouncy[island] |= held;
            moving_along[island] += moves_along_forces(static_cast<int>(b));
        }
    for (const Point& point : points_) {
        const Contact& contact = point.contact;
        const int island = root(bodies_->solver_index[contact.first] >= 0 ? contact.first : contact.second);
        if (drive_.acts_at(contact, *surfaces_)) may_move_along[island] = event_bodies;
        else if (pushes_against_forces(point, *bodies_, dv_ext_))
            may_move_along[island] = std::max<std::size_t>(may_move_along[island], 1);
        if (point.toi < 0.0) {
            const double approach = -relative_velocity(point, contact.point.normal, predicted_);
            if (approach > 1e-9 * (margins_.reach()[contact.first] + margins_.reach()[contact.second]) /
                               options_.time_step)
                plain[island] = 0;
            continue;
        }
        const std::uint64_t pair = (contact.key >> feature_bits) + 1;
        if (impact_pair[island] != 0 && impact_pair[island] != pair) plain[island] = 0;
        impact_pair[island] = pair;
        when[island] = point.toi;
        if (surfaces_->pair(point.contact).restitution > 0.0) bouncy[island] |= rebounds;
    }
    // A plastic impact among bodies that may meet others after it acts at the start of the step, as the rows of those
    // others will: bodies moved to an event's time would not be where such rows expect them. Nor are impacts that come in order,
    // successive ones and those of free balls, moved here: another may come first.
    const bool successive = options_.impacts == ImpactOrder::successive;
    speed.assign(bodies_->solver_index.size(), 0.0);
    for (std::size_t b = 0; b < bodies_->solver_index.size(); ++b) {
        double& fastest =
            speed[bodies_->solver_index[b] >= 0 ? root(static_cast<int>(b)) : static_cast<int>(b)];
        fastest = std::max(fastest, norm(linear(predicted_[b])));
    }
    const auto island = [&](int b) { return bodies_->solver_index[b] >= 0 ? root(b) : b; };
    for (const OpenPair& open : open_.pairs) {
        if (open.has_met()) continue;
        const int a = island(open.first), b = island(open.second);
        if (open.apart.gap > options_.time_step * (speed[a] + speed[b])) continue;
        plain[a] = plain[a] && bouncy[a] == (rebounds | held) && !successive;
        plain[b] = plain[b] && bouncy[b] == (rebounds | held) && !successive;
    }
    for (std::size_t b = 0; b < bodies_->solver_index.size(); ++b) {
        if (bodies_->solver_index[b] < 0) continue;
        const int island = root(static_cast<int>(b));
        if (impact_pair[island] == 0 || !plain[island] || members[island] > event_bodies) continue;
        if (moving_along[island] > may_move_along[island]) continue;
        event_time_[b] = when[island];
        if (is_free(b))
            apply_forces_until(b, part_of_forces(when[island] / options_.time_step, surfaces_->rebounds));
    }
    for (Point& point : points_) {
        if (point.toi < 0.0) continue;
        const int body =
            bodies_->solver_index[point.contact.first] >= 0 ? point.contact.first : point.contact.second;
        point.event = event_time_[body] >= 0.0;
        if (point.event) point.contact.point.gap = std::max(0.0, point.meeting_gap);
    }
}

/// Whether a body that is supported, or jointed, moves along the forces.
bool ContactStage::moves_along_forces(int body) const {
    return (supported_[body] || bodies_->jointed[body]) &&
           is_along(linear(dv_ext_[body]), linear(velocity_[body]));
}

/// A supported body that an impact sends along the forces, or against them: until then its support took its kick.
void ContactStage::release_support(int body, const Vec6& velocity) {
    if (event_time_[body] < 0.0 || toi_fraction_[body] > 0.0 || !(supported_[body] || bodies_->jointed[body]))
        return;
    const Vec3 kick = linear(dv_ext_[body]), before = linear(velocity_[body]);
    if (is_along(kick, before) || !is_along(kick, linear(velocity) - before)) return;
    toi_fraction_[body] = part_of_forces(event_time_[body] / options_.time_step, surfaces_->rebounds);
    supported_.release(body, toi_fraction_[body], dv_ext_[body]);
    for (double& k : dv_ext_[body]) k *= 1.0 - toi_fraction_[body];
}

/// What a supported body of an event that falls in the rest of the step is to go besides, m/s: it falls for all of it, or it
/// would have the speed of a fall and not have lost the height.
Vec3 ContactStage::free_fall_correction(int body, Vec3 after) const {
    const Vec3 k = linear(dv_ext_[body]), change = after - linear(velocity_[body]);
    if (!supported_[body] || !(dot(k, k) > 0.0)) return {};
    const double won = event_time_[body] / options_.time_step * dot(k, after - linear(predicted_[body])) -
                       0.5 * dot(change, change);
    return won > 0.0 ? (won / dot(k, k)) * k : Vec3{};
}

/// Forces act on a free body up to this part of the step; the rest of them comes with the solve.
void ContactStage::apply_forces_until(std::size_t b, double part) {
    velocity_[b] = sum(velocity_[b], whole_dv_ext_[b], part - toi_fraction_[b]);
    dv_ext_[b] = sum(Vec6{}, whole_dv_ext_[b], 1.0 - part);
    toi_fraction_[b] = part;
}

/// Where bodies may rebound, free ones that are not moved to the time of an impact have half of the forces before any.
void ContactStage::apply_half_of_forces() {
    for (std::size_t b = 0; surfaces_->rebounds && b < bodies_->solver_index.size(); ++b)
        if (bodies_->solver_index[b] >= 0 && is_free(b) && event_time_[b] < 0.0)
            apply_forces_until(b, part_of_forces(0.0, surfaces_->rebounds));
}

/// Bodies that forces would bring together again in the rest of the step, so soon after their impact, lie on each other: what is
/// left of their forces, which would lift them off where more than the half of the step has passed, is taken by the contact.
void ContactStage::lay_down() {
    for (const Point& point : points_) {
        if (!point.event) continue;
        const double apart = relative_velocity(point, point.contact.point.normal, velocity_),
                     push = relative_velocity(point, point.contact.point.normal, whole_dv_ext_);
        const double left = 1.0 - point.toi / options_.time_step;
        if (!(std::abs(apart) < 0.5 * left * -push)) continue;
        for (const int b : {point.contact.first, point.contact.second})
            if (bodies_->solver_index[b] >= 0 && toi_fraction_[b] > 1.0)
                dv_ext_[b] = Vec6{}, toi_fraction_[b] = 1.0;
    }
}

/// Sorts the points by key and finds each one's predecessor in the step before.
void ContactStage::order_points() {
    order_by_key(points_, toi_points_, places_);
    const std::vector<CachedContact>& cached = state_.cache.points;
    std::size_t old = 0;
    for (Point& point : points_) {
        while (old < cached.size() && cached[old].contact.key < point.contact.key) ++old;
        if (old == cached.size() || cached[old].contact.key != point.contact.key) continue;
        // What carries nothing may be rounded below it.
        point.before = std::max(0.0, cached[old].normal);
        point.compression_before = cached[old].compression;
        if (point.solved) continue;
        std::copy_n(cached[old].tangent, 2, point.tangents);
        if (surfaces_->resists_turning) std::copy_n(cached[old].turning, 3, extras_.own(point).turning);
    }
    ordered_ = points_.size();
}

/// Approach and push, from the current velocities.
void ContactStage::measure(Point& point) const {
    point.approach = relative_velocity(point, point.contact.point.normal, velocity_);
    point.dv_ext = relative_velocity(point, point.contact.point.normal, dv_ext_);
}

/// Approach, push and part in the impact of every point, from the current velocities.
void ContactStage::measure_points() {
    const double h = options_.time_step;
    impact_needed_ = false;
    for (Point& point : points_) {
        const Contact& contact = point.contact;
        const double gap = contact.point.gap;
        measure(point);
        const double psi = surfaces_->pair(contact).restitution, speed = -point.approach;
        point.bounce = -1.0;
        if (bodies_->is_closed(contact)) {
            point.bounce = speed > 0.0 ? psi : 0.0;
        } else if (plastic_first_ &&
                   point.impact > 0.0) {  // an impact of this step has brought them together
            point.bounce = 0.0;
        } else if (speed > 0.0 && gap + time_left(point) * (point.approach + point.dv_ext) < 0.0) {
            const double push = relative_velocity(point, contact.point.normal, whole_dv_ext_);
            const double ahead = 2.0 * (-push / h) * gap / (speed * speed);
            const double left = psi > 0.0 ? psi * psi - (1.0 - psi * psi) * ahead : 0.0;
            if (left > 0.0) point.bounce = std::min(1.0, std::sqrt(left));
            else if (plastic_first_) point.bounce = 0.0;
        }
        const double kick = norm(linear(dv_ext_[contact.first])) + norm(linear(dv_ext_[contact.second]));
        point.rounding =
            1e-6 * kick + 1e-12 * (margins_.reach()[contact.first] + margins_.reach()[contact.second]) / h;
        impact_needed_ = impact_needed_ || is_impact(point);
    }
}

}  // namespace spook
