#include "contacts/impact_events.hpp"

#include <algorithm>

#include "contacts/contact_geometry.hpp"
#include "contacts/tolerances.hpp"

namespace spook {

namespace {

constexpr char rebounds = 1,
               held = 2;  // of an island: some impact in it has a restitution; not all in it is free

using namespace tolerances::impact_events;

}  // namespace

void ImpactEvents::find(const CandidateSearch& search, StepMotion& motion, ContactPoints& points) {
    const ContactBodies& bodies = motion.bodies();
    const ContactOptions& options = motion.options();
    const ContactSurfaces& surfaces = motion.surfaces();
    connected_.begin(bodies.count());
    const auto root = [this](int b) { return connected_.root(b); };
    const auto join = [&](int a, int b) {
        if (bodies.moves(a) && bodies.moves(b)) connected_.join(a, b);
    };
    for (const StepContact& point : points.all) join(point.contact.first, point.contact.second);
    for (const auto& [a, b] : bodies.joints)
        if (a >= 0 && b >= 0) join(a, b);

    auto& [members, impact_pair, plain, bouncy, when, speed, moving_along, may_move_along] = arrays_;
    members.assign(bodies.count(), 0);
    impact_pair.assign(bodies.count(), 0);
    plain.assign(bodies.count(), 1), bouncy.assign(bodies.count(), 0);
    moving_along.assign(bodies.count(), 0), may_move_along.assign(bodies.count(), 0);
    when.assign(bodies.count(), -1.0);
    for (std::size_t b = 0; b < bodies.count(); ++b)
        if (bodies.moves(b)) {
            const int island = root(static_cast<int>(b));
            ++members[island];
            plain[island] = plain[island] && bodies.ball[b];
            if (!motion.is_free(b)) bouncy[island] |= held;
            moving_along[island] += motion.moves_along_forces(static_cast<int>(b));
        }
    for (const StepContact& point : points.all) {
        const Contact& contact = point.contact;
        const int island = root(bodies.moves(contact.first) ? contact.first : contact.second);
        if (motion.drive.acts_at(contact, surfaces)) may_move_along[island] = event_bodies;
        else if (pushes_against_forces(point, bodies, motion.dv_ext))
            may_move_along[island] = std::max<std::size_t>(may_move_along[island], 1);
        if (point.toi < 0.0) {
            const double approach = -relative_velocity(point, contact.point.normal, motion.predicted);
            if (approach >
                1e-9 * (search.margins().reach()[contact.first] + search.margins().reach()[contact.second]) /
                    options.time_step)
                plain[island] = 0;
            continue;
        }
        const std::uint64_t pair = pair_of(contact) + 1;
        if (impact_pair[island] != 0 && impact_pair[island] != pair) plain[island] = 0;
        impact_pair[island] = pair;
        when[island] = point.toi;
        if (surfaces.pair(point.contact).restitution > 0.0) bouncy[island] |= rebounds;
    }
    // A plastic impact among bodies that may meet others after it acts at the start of the step, as the rows of those
    // others will: bodies moved to an event's time would not be where such rows expect them. Nor are impacts that come in order,
    // successive ones and those of free balls, moved here: another may come first.
    const bool successive = options.impacts == ImpactOrder::successive;
    speed.assign(bodies.count(), 0.0);
    for (std::size_t b = 0; b < bodies.count(); ++b) {
        double& fastest = speed[bodies.moves(b) ? root(static_cast<int>(b)) : static_cast<int>(b)];
        fastest = std::max(fastest, norm(linear(motion.predicted[b])));
    }
    const auto island = [&](int b) { return bodies.moves(b) ? root(b) : b; };
    for (const OpenPair& open : search.open().pairs) {
        if (open.has_met()) continue;
        const int a = island(open.first), b = island(open.second);
        if (open.apart.gap > options.time_step * (speed[a] + speed[b])) continue;
        plain[a] = plain[a] && bouncy[a] == (rebounds | held) && !successive;
        plain[b] = plain[b] && bouncy[b] == (rebounds | held) && !successive;
    }
    for (std::size_t b = 0; b < bodies.count(); ++b) {
        if (!bodies.moves(b)) continue;
        const int island = root(static_cast<int>(b));
        if (impact_pair[island] == 0 || !plain[island] || members[island] > event_bodies) continue;
        if (moving_along[island] > may_move_along[island]) continue;
        motion.event_time[b] = when[island];
        if (motion.is_free(b))
            motion.apply_forces_until(b, part_of_forces(when[island] / options.time_step, surfaces.rebounds));
    }
    for (StepContact& point : points.all) {
        if (point.toi < 0.0) continue;
        const int body = bodies.moves(point.contact.first) ? point.contact.first : point.contact.second;
        point.event = motion.event_time[body] >= 0.0;
        if (point.event) point.contact.point.gap = std::max(0.0, point.meeting_gap);
    }
}

}  // namespace spook
