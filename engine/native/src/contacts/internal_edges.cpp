// Bodies that are sunk into what holds them, and come to the side of its next part.
//
// A body that lies a micron deep in the first of two tiles would be stopped by the side of the second. Cast as it would stand if
// it were lifted out of the first, it goes over the second. What does not lie beneath the surface it is lifted to is no such
// part: it is met where it stands, or overlaps would breed others.
//
// What falls onto the first tile is cast through it, and would come to the side of the second from below: what is met first
// occludes what a body would meet behind it. Where edges lie on each other both faces are as near: the one a body moves past
// is no obstacle.
#include "contacts/internal_edges.hpp"

#include <algorithm>

#include "contacts/contact_geometry.hpp"
#include "contacts/tolerances.hpp"

namespace spook {

namespace {

using namespace tolerances::internal_edges;

/// How far the lowest point along n is above the origin, m; of a triangle infinite.
double height(const Mover& of, double time, Vec3 n) noexcept {
    return separation(of.shape, of.at(time), Primitive::plane(n), {}).gap;
}

/// The normal of two on their ways, onto the first.
Vec3 normal_at(const Mover& one, const Mover& other, double time) noexcept {
    return separation(one.shape, one.at(time), other.shape, other.at(time)).normal;
}

}  // namespace

Mover SearchedStep::mover(int collider, const Pose& pose, const std::vector<Vec6>& velocity) const {
    const Collider::View own = detection.collider(collider);
    return {own.shape, own.part, pose, linear(velocity[own.body]), angular(velocity[own.body])};
}

void InternalEdges::index(const SearchedStep& step) {
    points_of_.find(step.points.all, step.motion.bodies());
}

double InternalEdges::slop(const SearchedStep& step, const OpenPair& open) noexcept {
    return closed *
           std::max(step.motion.bodies().radius[open.first], step.motion.bodies().radius[open.second]);
}

/// Whether what is kept out of this face, and would come to another body at `toi` [s] or fall onto it in this step, goes over
/// it: the other lies beneath. `held` is what touches the face.
bool InternalEdges::Support::leads_over(const Mover& held, const Mover& moving, const Mover& other,
                                        double toi, double h, double slop) const {
    const double top = height(other, time, -normal);
    double falls = 0.0;
    for (const double then : {toi, h}) {  // against the face, and against the other
        const double rises =
            std::max((then - time) * dot(normal, velocity), top - height(other, then, -normal));
        falls = std::max(falls, depth + level + rises - height(held, then, normal));
    }
    const double lift = std::min(falls, most);
    // What holds a body may have sunk beside the other with it.
    if (!(falls > 0.0) || !(level + (pair != 0 ? lift : 0.0) + top > -flush * slop)) return false;
    Pose out = moving.body;
    out.position += (lift + slop) * normal;
    return time_of_impact({moving.shape, moving.part, out, moving.velocity, moving.spin}, other, h, slop) <
           0.0;
}

/// The face of the first of a body's points, which are left behind; what the body goes into it with these velocities is stopped.
InternalEdges::Support InternalEdges::next_support(const SearchedStep& step, const Mover& moving, int body,
                                                   std::span<const int>& points,
                                                   const std::vector<Vec6>& velocity) {
    const std::uint64_t pair = pair_of(step.points.all[points.front()].contact);
    Support found{.depth = -unbounded};
    double sinks = 0.0;
    for (; !points.empty() && pair_of(step.points.all[points.front()].contact) == pair;
         points = points.subspan(1)) {
        const StepContact& point = step.points.all[points.front()];
        if (point.toi >= 0.0) continue;
        const bool first = point.contact.first == body;
        const Vec3 n = point.contact.point.normal;
        const double gap = point.contact.point.gap, depth = std::max(0.0, -gap);
        const double closes = -step.motion.options().time_step * relative_velocity(point, n, velocity);
        sinks = std::max(sinks, closes - std::max(0.0, gap));
        if (!(depth > found.depth)) continue;
        const Vec6& holder = velocity[first ? point.contact.second : point.contact.first];
        found.pair = pair;
        found.depth = depth;
        found.normal = (first ? 1.0 : -1.0) * n;
        found.velocity = linear(holder) + cross(angular(holder), first ? point.second_arm : point.first_arm);
    }
    found.most = found.depth + sinks;
    found.level = height(moving, 0.0, found.normal);
    return found;
}

bool InternalEdges::is_internal_edge(const SearchedStep& step, const Mover& moving, int body,
                                     const Mover& other, const OpenPair& open, const Cast& cast, double time,
                                     Vec3 facing) const {
    if (!have_sides(moving.shape, other.shape) || !step.motion.bodies().moves(body)) return false;
    const ContactOptions& options = step.motion.options();
    const double h = options.time_step, slop = this->slop(step, open);
    for (std::span<const int> own = points_of_[body]; !own.empty();) {
        Support support = next_support(step, moving, body, own, cast.velocity);
        if (support.pair == 0 || support.pair == pair_of(open.pair) ||
            std::abs(dot(support.normal, facing)) > same_face_cosine)
            continue;
        support.most += flush * slop;
        if (cast.when == Cast::When::iterating) support.most = unbounded;
        else if (options.solver == SolverKind::iterative &&
                 std::abs(dot(support.normal, normal_at(moving, other, time))) < side_cosine)
            support.most += h * options.unsettled_residual;
        if (support.leads_over(moving, moving, other, time, h, slop)) return true;
    }
    return false;
}

/// Whether `body`, that meets one after the other in this step, would not meet the later one if the earlier one stopped it:
/// it falls onto a tile, and would be past its edge, below its top, when it came to the next one's side.
bool InternalEdges::occludes(const SearchedStep& step, const OpenPair& before, double earlier,
                             const OpenPair& after, double later, int body,
                             const std::vector<Vec6>& velocity) {
    const OpenWays one(step, before, velocity), two(step, after, velocity);
    const Mover &held = before.first == body ? one.first : one.second,
                &holder = before.first == body ? one.second : one.first,
                &moving = after.first == body ? two.first : two.second,
                &other = after.first == body ? two.second : two.first;
    for (const Mover* each : {&holder, &other})
        if (each->shape.kind == ShapeKind::triangle) return false;  // its neighbours are known
    if (!have_sides(moving.shape, other.shape)) return false;
    const Vec3 n = normal_at(held, holder, earlier);
    if (dot(n, normal_at(moving, other, later)) > same_direction_cosine) return false;
    const Support support{.normal = n,
                          .velocity = std::min(0.0, dot(n, holder.velocity)) * n,
                          .level = height(held, earlier, n),
                          .time = earlier};
    return support.leads_over(held, moving, other, later, step.motion.options().time_step,
                              InternalEdges::slop(step, after));
}

void InternalEdges::remove_occluded(const SearchedStep& step, const LargeArray<OpenPair>& pairs,
                                    const std::vector<Vec6>& velocity, std::vector<Meeting>& meetings) {
    if (!step.motion.bodies().swings || meetings.size() < 2) return;
    meetings_of_.clear();
    for (std::size_t at = 0; at < meetings.size(); ++at)
        for (const int b : {pairs[meetings[at].open].first, pairs[meetings[at].open].second})
            if (step.motion.bodies().moves(b)) meetings_of_.push_back({b, meetings[at].time, at});
    std::sort(meetings_of_.begin(), meetings_of_.end(), [](const MeetingOf& a, const MeetingOf& b) {
        return a.body != b.body ? a.body < b.body : a.time != b.time ? a.time < b.time : a.at < b.at;
    });
    for (std::size_t from = 0; from < meetings_of_.size();) {
        std::size_t end = from + 1;
        for (; end < meetings_of_.size() && meetings_of_[end].body == meetings_of_[from].body; ++end) {
            Meeting& later = meetings[meetings_of_[end].at];
            for (std::size_t k = from; k < std::min(end, from + max_earlier) && !(later.time < 0.0); ++k) {
                Meeting& earlier = meetings[meetings_of_[k].at];
                if (earlier.time < 0.0) continue;
                const int body = meetings_of_[from].body;
                const OpenPair &one = pairs[earlier.open], &other = pairs[later.open];
                if (occludes(step, one, earlier.time, other, later.time, body, velocity)) later.time = -1.0;
                else if (later.time - earlier.time < simultaneous * step.motion.options().time_step &&
                         occludes(step, other, later.time, one, earlier.time, body, velocity))
                    earlier.time = -1.0;
            }
        }
        from = end;
    }
    std::erase_if(meetings, [](const Meeting& meeting) { return meeting.time < 0.0; });
}

bool InternalEdges::is_grazing(const SearchedStep& step, const StepContact& point, const OpenPair& open,
                               double overlap) const {
    const Contact& contact = point.contact;
    if (!have_sides(step.detection.collider(open.pair.first).shape,
                    step.detection.collider(open.pair.second).shape))
        return false;
    if (!(overlap > slop(step, open))) return false;
    const int a = contact.first, b = contact.second;
    const Mover first = step.mover(open.pair.first, step.motion.poses[a], step.motion.velocity),
                second = step.mover(open.pair.second, step.motion.poses[b], step.motion.velocity);
    return time_of_impact(first, second, step.motion.options().time_step, slop(step, open)) < 0.0 ||
           is_internal_edge(step, first, a, second, open, {step.motion.velocity, Cast::When::solved}, 0.0,
                            contact.point.normal) ||
           is_internal_edge(step, second, b, first, open, {step.motion.velocity, Cast::When::solved}, 0.0,
                            contact.point.normal);
}

}  // namespace spook
