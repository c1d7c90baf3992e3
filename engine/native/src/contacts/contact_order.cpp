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
    connected_.begin(model_->bodies.count());
    const auto root = [this](int b) { return connected_.root(b); };
    const auto join = [this](int a, int b) {
        if (model_->bodies.solver_index[a] >= 0 && model_->bodies.solver_index[b] >= 0) connected_.join(a, b);
    };
    for (const Point& point : points_.all) join(point.contact.first, point.contact.second);
    for (const auto& [a, b] : model_->bodies.joints)
        if (a >= 0 && b >= 0) join(a, b);

    auto& [members, impact_pair, plain, bouncy, when, speed, moving_along, may_move_along] = arrays_.events;
    members.assign(model_->bodies.count(), 0);
    impact_pair.assign(model_->bodies.count(), 0);
    plain.assign(model_->bodies.count(), 1), bouncy.assign(model_->bodies.count(), 0);
    moving_along.assign(model_->bodies.count(), 0), may_move_along.assign(model_->bodies.count(), 0);
    when.assign(model_->bodies.count(), -1.0);
    for (std::size_t b = 0; b < model_->bodies.count(); ++b)
        if (model_->bodies.solver_index[b] >= 0) {
            const int island = root(static_cast<int>(b));
            ++members[island];
            plain[island] = plain[island] && model_->bodies.ball[b];
            if (!motion_.is_free(b)) bouncy[island] |= held;
            moving_along[island] += motion_.moves_along_forces(static_cast<int>(b));
        }
    for (const Point& point : points_.all) {
        const Contact& contact = point.contact;
        const int island =
            root(model_->bodies.solver_index[contact.first] >= 0 ? contact.first : contact.second);
        if (motion_.drive.acts_at(contact, model_->surfaces)) may_move_along[island] = event_bodies;
        else if (pushes_against_forces(point, model_->bodies, motion_.dv_ext))
            may_move_along[island] = std::max<std::size_t>(may_move_along[island], 1);
        if (point.toi < 0.0) {
            const double approach = -relative_velocity(point, contact.point.normal, motion_.predicted);
            if (approach >
                1e-9 *
                    (search_.margins().reach()[contact.first] + search_.margins().reach()[contact.second]) /
                    model_->options.time_step)
                plain[island] = 0;
            continue;
        }
        const std::uint64_t pair = (contact.key >> feature_bits) + 1;
        if (impact_pair[island] != 0 && impact_pair[island] != pair) plain[island] = 0;
        impact_pair[island] = pair;
        when[island] = point.toi;
        if (model_->surfaces.pair(point.contact).restitution > 0.0) bouncy[island] |= rebounds;
    }
    // A plastic impact among bodies that may meet others after it acts at the start of the step, as the rows of those
    // others will: bodies moved to an event's time would not be where such rows expect them. Nor are impacts that come in order,
    // successive ones and those of free balls, moved here: another may come first.
    const bool successive = model_->options.impacts == ImpactOrder::successive;
    speed.assign(model_->bodies.count(), 0.0);
    for (std::size_t b = 0; b < model_->bodies.count(); ++b) {
        double& fastest =
            speed[model_->bodies.solver_index[b] >= 0 ? root(static_cast<int>(b)) : static_cast<int>(b)];
        fastest = std::max(fastest, norm(linear(motion_.predicted[b])));
    }
    const auto island = [&](int b) { return model_->bodies.solver_index[b] >= 0 ? root(b) : b; };
    for (const OpenPair& open : search_.open().pairs) {
        if (open.has_met()) continue;
        const int a = island(open.first), b = island(open.second);
        if (open.apart.gap > model_->options.time_step * (speed[a] + speed[b])) continue;
        plain[a] = plain[a] && bouncy[a] == (rebounds | held) && !successive;
        plain[b] = plain[b] && bouncy[b] == (rebounds | held) && !successive;
    }
    for (std::size_t b = 0; b < model_->bodies.count(); ++b) {
        if (model_->bodies.solver_index[b] < 0) continue;
        const int island = root(static_cast<int>(b));
        if (impact_pair[island] == 0 || !plain[island] || members[island] > event_bodies) continue;
        if (moving_along[island] > may_move_along[island]) continue;
        motion_.event_time[b] = when[island];
        if (motion_.is_free(b))
            motion_.apply_forces_until(
                b, part_of_forces(when[island] / model_->options.time_step, model_->surfaces.rebounds));
    }
    for (Point& point : points_.all) {
        if (point.toi < 0.0) continue;
        const int body = model_->bodies.solver_index[point.contact.first] >= 0 ? point.contact.first
                                                                               : point.contact.second;
        point.event = motion_.event_time[body] >= 0.0;
        if (point.event) point.contact.point.gap = std::max(0.0, point.meeting_gap);
    }
}

/// Approach, push and part in the impact of every point, from the current velocities.
void ContactStage::measure_points() {
    const double h = model_->options.time_step;
    impact_needed_ = false;
    for (Point& point : points_.all) {
        const Contact& contact = point.contact;
        const double gap = contact.point.gap;
        motion_.measure(point);
        const double psi = model_->surfaces.pair(contact).restitution, speed = -point.approach;
        point.bounce = -1.0;
        if (model_->bodies.is_closed(contact)) {
            point.bounce = speed > 0.0 ? psi : 0.0;
        } else if (plastic_first_ &&
                   point.impact > 0.0) {  // an impact of this step has brought them together
            point.bounce = 0.0;
        } else if (speed > 0.0 && gap + motion_.time_left(point) * (point.approach + point.dv_ext) < 0.0) {
            const double push = relative_velocity(point, contact.point.normal, motion_.whole_dv_ext);
            const double ahead = 2.0 * (-push / h) * gap / (speed * speed);
            const double left = psi > 0.0 ? psi * psi - (1.0 - psi * psi) * ahead : 0.0;
            if (left > 0.0) point.bounce = std::min(1.0, std::sqrt(left));
            else if (plastic_first_) point.bounce = 0.0;
        }
        const double kick =
            norm(linear(motion_.dv_ext[contact.first])) + norm(linear(motion_.dv_ext[contact.second]));
        point.rounding =
            1e-6 * kick +
            1e-12 * (search_.margins().reach()[contact.first] + search_.margins().reach()[contact.second]) /
                h;
        impact_needed_ = impact_needed_ || is_impact(point);
    }
}

}  // namespace spook
