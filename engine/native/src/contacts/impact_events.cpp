#include "contacts/impact_events.hpp"

#include <algorithm>

#include "contacts/contact_geometry.hpp"
#include "contacts/tolerances.hpp"

namespace spook {

using namespace tolerances::impact_events;

void ImpactEvents::find(const CandidateSearch& search, StepMotion& motion, ContactPoints& points) {
    const ContactBodies& bodies = motion.bodies();
    connect(bodies, points);
    look_at_bodies(motion);
    for (const StepContact& point : points.all) look_at(point, search.margins().reach(), motion);
    look_at(search.open(), motion);
    for (std::size_t b = 0; b < bodies.count(); ++b) {
        if (!bodies.moves(b)) continue;
        const Island& island = of(bodies, static_cast<int>(b));
        if (!is_event(island)) continue;
        motion.event_time[b] = island.time;
        if (motion.is_free(b))
            motion.apply_forces_until(
                b, part_of_forces(island.time / motion.options().time_step, motion.surfaces().rebounds));
    }
    for (StepContact& point : points.all) {
        if (point.toi < 0.0) continue;
        const int body = bodies.moves(point.contact.first) ? point.contact.first : point.contact.second;
        point.event = motion.event_time[body] >= 0.0;
        if (point.event) point.contact.point.gap = std::max(0.0, point.meeting_gap);
    }
}

void ImpactEvents::connect(const ContactBodies& bodies, const ContactPoints& points) {
    connected_.begin(bodies.count());
    const auto join = [&](int a, int b) {
        if (bodies.moves(a) && bodies.moves(b)) connected_.join(a, b);
    };
    for (const StepContact& point : points.all) join(point.contact.first, point.contact.second);
    for (const auto& [a, b] : bodies.joints)
        if (a >= 0 && b >= 0) join(a, b);
    islands_.assign(bodies.count(), {});
}

void ImpactEvents::look_at_bodies(const StepMotion& motion) {
    const ContactBodies& bodies = motion.bodies();
    for (std::size_t b = 0; b < bodies.count(); ++b) {
        Island& island = of(bodies, static_cast<int>(b));
        island.fastest = std::max(island.fastest, norm(linear(motion.predicted[b])));
        if (!bodies.moves(b)) continue;
        ++island.members;
        island.plain = island.plain && bodies.ball[b];
        island.held = island.held || !motion.is_free(b);
        island.moving_along += motion.moves_along_forces(static_cast<int>(b));
    }
}

/// Another impact, or another point that is approached, and its island's is not the only one.
void ImpactEvents::look_at(const StepContact& point, const std::vector<double>& reach,
                           const StepMotion& motion) {
    const ContactBodies& bodies = motion.bodies();
    const Contact& contact = point.contact;
    Island& island = of(bodies, bodies.moves(contact.first) ? contact.first : contact.second);
    if (motion.drive.acts_at(contact, motion.surfaces())) island.may_move_along = event_bodies;
    else if (pushes_against_forces(point, bodies, motion.dv_ext))
        island.may_move_along = std::max<std::size_t>(island.may_move_along, 1);
    if (point.toi < 0.0) {
        const double approach = -relative_velocity(point, contact.point.normal, motion.predicted);
        const double rounding =
            1e-9 * (reach[contact.first] + reach[contact.second]) / motion.options().time_step;
        if (approach > rounding) island.plain = false;
        return;
    }
    const std::uint64_t pair = pair_of(contact) + 1;
    if (island.impact_pair != 0 && island.impact_pair != pair) island.plain = false;
    island.impact_pair = pair;
    island.time = point.toi;
    island.rebounds = island.rebounds || motion.surfaces().pair(contact).restitution > 0.0;
}

/// A plastic impact among bodies that may meet others after it acts at the start of the step, as the rows of those
/// others will: bodies moved to an event's time would not be where such rows expect them. Nor are impacts that come in order,
/// successive ones and those of free balls, moved here: another may come first.
void ImpactEvents::look_at(const OpenPairs& open_pairs, const StepMotion& motion) {
    const ContactOptions& options = motion.options();
    const bool successive = options.impacts == ImpactOrder::successive;
    for (const OpenPair& open : open_pairs.pairs) {
        if (open.has_met()) continue;
        Island &first = of(motion.bodies(), open.first), &second = of(motion.bodies(), open.second);
        if (open.apart.gap > options.time_step * (first.fastest + second.fastest)) continue;
        for (Island* const island : {&first, &second})
            island->plain = island->plain && island->rebounds && island->held && !successive;
    }
}

bool ImpactEvents::is_event(const Island& island) const noexcept {
    return island.impact_pair != 0 && island.plain && island.members <= event_bodies &&
           island.moving_along <= island.may_move_along;
}

}  // namespace spook
