// Pairs that touch and turn: features that swing in within the step.
//
// While two bodies turn on a manifold, an edge or a corner may come down that no row of it knows of. So both are moved to the
// end of the step with the velocities a solve found, and what lies deep there gets a row for the step itself, with the gap
// that to first order closes to the depth found.
#include <algorithm>

#include "collision/shape_cast.hpp"
#include "contacts/candidate_search.hpp"
#include "contacts/contact_geometry.hpp"
#include "contacts/tolerances.hpp"

namespace spook {

namespace {

constexpr std::uint64_t swung_in = 1u << 15;  // marks a point whose feature has one in the manifold already

using namespace tolerances::contact_turning;

/// Two of these touch at one point, wherever they turn.
bool is_single(const Primitive& shape) noexcept {
    return shape.kind == ShapeKind::sphere || shape.kind == ShapeKind::plane;
}

}  // namespace

/// Whether the point is one of the pair's: of those in order in [from, end), or of those found since.
bool CandidateSearch::is_known(const ContactPoints& points, const Contact& contact, std::size_t from,
                               std::size_t end, double size, bool& named) const {
    const auto same = [&](const StepContact& point) {
        const Contact& old = point.contact;
        named = named || old.key == contact.key;
        return pair_of(old) == pair_of(contact) &&
               dot(old.point.normal, contact.point.normal) > same_direction_cosine &&
               norm(old.point.position - contact.point.position) < same_place * size;
    };
    const auto at = [&points](std::size_t k) { return points.all.begin() + static_cast<std::ptrdiff_t>(k); };
    return std::any_of(at(from), at(end), same) || std::any_of(at(points.ordered), points.all.end(), same);
}

/// Looks where `velocity` leads the pairs that have points; true if some feature swings in and got a row.
bool CandidateSearch::find_turned(const std::vector<Vec6>& velocity, const StepMotion& motion,
                                  ContactPoints& points) {
    const ContactBodies& bodies = motion.bodies();
    if (!bodies.swings) return false;
    const double h = motion.options().time_step;
    const std::size_t known = points.all.size();
    for (std::size_t from = 0, end = 0; from < points.ordered; from = end) {
        const std::uint64_t key = pair_of(points.all[from].contact);
        double depth = 0.0;
        for (; end < points.ordered && pair_of(points.all[end].contact) == key; ++end)
            depth = std::max(depth, -points.all[end].contact.point.gap);
        const IndexPair pair{static_cast<int>(key >> 24), static_cast<int>(key & 0xffffff)};
        const Collider::View one = detection.collider(pair.first), two = detection.collider(pair.second);
        if (points.all[from].event || (is_single(one.shape) && is_single(two.shape))) continue;
        const int a = one.body, b = two.body;
        const double size = std::max(bodies.radius[a], bodies.radius[b]);
        const double turning =
            norm(angular(velocity[a])) * bodies.radius[a] + norm(angular(velocity[b])) * bodies.radius[b];
        const double sliding = norm(linear(velocity[a]) - linear(velocity[b]));
        if (h * (sliding + turning) < deep * size) continue;
        const Mover first = step(motion, points).mover(pair.first, motion.poses[a], velocity),
                    second = step(motion, points).mover(pair.second, motion.poses[b], velocity);
        const Pose first_end = first.body_at(h), second_end = second.body_at(h);
        scratch_.clear();
        detection.collide_pair(pair, first_end, second_end, 0.0, scratch_);
        for (Contact& contact : scratch_) {
            if (contact.point.gap >= -(depth + deep * size)) continue;
            // Back to where both surfaces were at the start, half-way between them.
            const Vec3 q = contact.point.position;
            const Vec3 on_first = apply(motion.poses[a], local(first_end.rotation, q - first_end.position));
            const Vec3 on_second =
                apply(motion.poses[b], local(second_end.rotation, q - second_end.position));
            contact.point.position = 0.5 * (on_first + on_second);
            bool named = false;
            if (is_known(points, contact, from, end, size, named)) continue;
            if (named) contact.key |= swung_in;
            StepContact& point =
                add_point(motion.model(), points, contact, motion.poses[a], motion.poses[b], h);
            const double closing = -relative_velocity(point, contact.point.normal, velocity);
            point.contact.point.gap = std::max(0.0, contact.point.gap + h * closing);
        }
    }
    return points.all.size() > known;
}

}  // namespace spook
