// Bodies that are sunk into what holds them, and come to the side of its next part.
//
// A body that lies a micron deep in the first of two tiles, as compliance and overlaps make it, would be stopped by the side
// of the second. Cast as it would stand if it were lifted out of the first, it goes over the second. What does not lie
// beneath the surface it is lifted to is no such part: it is met where it stands, however deep the body is sunk elsewhere,
// or overlaps would breed others.
//
// What falls onto the first tile is cast through it as well, and would come to the side of the second from below: what is met
// first occludes what a body would meet only behind it. And where edges lie on each other, as a body's and a tile's do when
// a step begins there, both faces are as near: the one it moves past is no obstacle.
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

/// Whether two meet with a side, seen from a face whose normal is n: what lands on another one falls as far, and meets it.
bool meets_side_face(const Mover& one, const Mover& other, double time, Vec3 n) noexcept {
    return std::abs(dot(n, separation(one.shape, one.at(time), other.shape, other.at(time)).normal)) <
           side_cosine;
}

/// How deep a closed point is at the start of the step, and what the velocity then adds to it before that is answered, m.
/// When a solve has answered it, as much as iterations that count as settled may have left, or as the depth.
double depth_at_toi(const SearchedStep& step, const StepContact& point, bool late) {
    const ContactOptions& options = step.motion.options();
    const double h = options.time_step, depth = std::max(0.0, -point.contact.point.gap);
    const double sinking =
        std::max(0.0, -h * relative_velocity(point, point.contact.point.normal, step.motion.velocity));
    const double left = options.solver == SolverKind::iterative ? h * options.unsettled_residual : 0.0;
    return depth + (late ? std::min(sinking, std::max(depth, left)) : sinking);
}

}  // namespace

Mover SearchedStep::mover(int collider, const Pose& pose, const std::vector<Vec6>& velocity) const {
    const Collider::View own = detection.collider(collider);
    return {own.shape, own.part, pose, linear(velocity[own.body]), angular(velocity[own.body])};
}

void InternalEdges::begin(std::size_t bodies) {
    depth_.assign(bodies, 0.0);
    predicted_sinking_.assign(bodies, 0.0);
}

void InternalEdges::forget_sinking() noexcept {
    std::fill(predicted_sinking_.begin(), predicted_sinking_.end(), 0.0);
}

void InternalEdges::note_depths(const SearchedStep& step, std::size_t from) {
    for (std::size_t k = from; k < step.points.all.size(); ++k) {
        // As deep as a body will be when it meets the next part of what holds it.
        const double depth = depth_at_toi(step, step.points.all[k], false);
        for (const int b : {step.points.all[k].contact.first, step.points.all[k].contact.second})
            depth_[b] = std::max(depth_[b], depth);
    }
}

void InternalEdges::predict_sinking(const SearchedStep& step, const std::vector<Vec6>& velocity) {
    forget_sinking();
    for (const StepContact& point : step.points.all) {
        if (point.toi >= 0.0) continue;
        const Contact& contact = point.contact;
        const double closing = -relative_velocity(point, contact.point.normal, velocity);
        const double sinking = step.motion.options().time_step * closing - std::max(0.0, contact.point.gap);
        for (const int b : {contact.first, contact.second})
            predicted_sinking_[b] = std::max(predicted_sinking_[b], sinking);
    }
}

void InternalEdges::index(const SearchedStep& step) {
    points_of_.find(step.points.all, step.motion.bodies());
}

double InternalEdges::slop(const SearchedStep& step, const OpenPair& open) const noexcept {
    const int a = open.first, b = open.second;
    const bool sides = have_sides(step.detection.collider(open.pair.first).shape,
                                  step.detection.collider(open.pair.second).shape);
    return closed * std::max(step.motion.bodies().radius[a], step.motion.bodies().radius[b]) +
           (sides ? 2.0 * std::max(predicted_sinking_[a], predicted_sinking_[b]) : 0.0);
}

InternalEdges::Support InternalEdges::next_support(const SearchedStep& step, int body,
                                                   std::span<const int>& points, const Cast& cast) {
    Support found{.pair = pair_of(step.points.all[points.front()].contact)};
    for (; !points.empty() && pair_of(step.points.all[points.front()].contact) == found.pair;
         points = points.subspan(1)) {
        const StepContact& point = step.points.all[points.front()];
        if (point.toi >= 0.0) continue;
        const bool first = point.contact.first == body;
        const double depth = depth_at_toi(step, point, cast.when != Cast::When::ahead);
        if (depth > found.depth) {
            const Vec6& holder = cast.velocity[first ? point.contact.second : point.contact.first];
            found.depth = depth;
            found.normal = (first ? 1.0 : -1.0) * point.contact.point.normal;
            found.velocity =
                linear(holder) + cross(angular(holder), first ? point.second_arm : point.first_arm);
        }
        found.begun = std::max(found.begun, -point.contact.point.gap);
        found.sinking = std::max(found.sinking, depth_at_toi(step, point, false));
    }
    return found;
}

/// How deep a body will be in what holds it when it meets the other, m: iterations leave it falling on the way there.
double InternalEdges::fallen_depth(const SearchedStep& step, const Support& support, const Mover& moving,
                                   int body, const Mover& other, Cast::When when, double time,
                                   double slop) const {
    const ContactOptions& options = step.motion.options();
    const double h = options.time_step, left = h * options.unsettled_residual;
    const bool iterating = when == Cast::When::iterating;
    if (!iterating && options.solver != SolverKind::iterative) return support.depth;
    const Vec3 n = support.normal;
    const double now = height(moving, 0.0, n), top = height(other, 0.0, -n);
    double falls = 0.0;
    for (const double part : {time, h}) {  // against what holds it, and against the other
        const double rises = std::max(part * dot(n, support.velocity), top - height(other, part, -n));
        falls = std::max(falls, now + rises - height(moving, part, n));
    }
    double most = residual_motion * slop;
    if (iterating)
        most =
            std::max(support.begun, left + h * free_fall_allowance * norm(linear(step.motion.dv_ext[body])) +
                                        support.sinking);
    else if (falls > most && meets_side_face(moving, other, time, n)) most = left;
    const double depth = std::max(support.depth, support.begun + std::min(falls, most));
    return iterating ? depth + slop : depth;  // it met the other with as much
}

bool InternalEdges::is_internal_edge(const SearchedStep& step, const Mover& moving, int body,
                                     const Mover& other, const OpenPair& open, const Cast& cast, double time,
                                     Vec3 facing) const {
    const ContactOptions& options = step.motion.options();
    if (!have_sides(moving.shape, other.shape) || !step.motion.bodies().moves(body)) return false;
    const double slop = this->slop(step, open), least = share * slop;
    if (cast.when != Cast::When::iterating && options.solver != SolverKind::iterative &&
        !(depth_[body] > least))
        return false;
    for (std::span<const int> own = points_of_[body]; !own.empty();) {
        const Support support = next_support(step, body, own, cast);
        const Vec3 n = support.normal;
        if (support.depth == -unbounded || support.pair == pair_of(open.pair) ||
            std::abs(dot(n, facing)) > same_face_cosine)
            continue;
        const double depth = fallen_depth(step, support, moving, body, other, cast.when, time, slop);
        if (!(depth > least)) continue;
        Pose out = moving.body;
        out.position += depth * n;
        const Mover lifted{moving.shape, moving.part, out, moving.velocity, moving.spin};
        const double above = height(lifted, 0.0, n) + height(other, 0.0, -n);
        if (above > -least && time_of_impact(lifted, other, options.time_step, slop) < 0.0) return true;
    }
    return false;
}

/// Whether `body`, that meets one after the other in this step, would not meet the later one if the earlier one stopped it:
/// it falls onto a tile, and would be past its edge, below its top, when it came to the next one's side.
bool InternalEdges::occludes(const SearchedStep& step, const OpenPair& before, double earlier,
                             const OpenPair& after, double later, int body,
                             const std::vector<Vec6>& velocity) const {
    const Pose before_first = step.motion.moved(before.first, velocity),
               before_second = step.motion.moved(before.second, velocity),
               after_first = step.motion.moved(after.first, velocity),
               after_second = step.motion.moved(after.second, velocity);
    const Mover one = step.mover(before.pair.first, before_first, velocity),
                two = step.mover(before.pair.second, before_second, velocity),
                three = step.mover(after.pair.first, after_first, velocity),
                four = step.mover(after.pair.second, after_second, velocity);
    const Mover &held = before.first == body ? one : two, &moving = after.first == body ? three : four,
                &other = after.first == body ? four : three;
    for (const Mover* each : {&one, &two, &three, &four})
        if (each->shape.kind == ShapeKind::triangle) return false;  // its neighbours are known
    if (!have_sides(moving.shape, other.shape)) return false;
    const auto normal = [](const Mover& a, const Mover& b, double time) {
        return separation(a.shape, a.at(time), b.shape, b.at(time)).normal;
    };
    const Vec3 n = (before.first == body ? 1.0 : -1.0) * normal(one, two, earlier);
    const Vec3 side = (after.first == body ? 1.0 : -1.0) * normal(three, four, later);
    if (dot(n, side) > same_direction_cosine) return false;
    const double h = step.motion.options().time_step, slop = this->slop(step, after),
                 level = height(held, earlier, n);
    if (!(level + height(other, earlier, -n) > -2.0 * (slop + this->slop(step, before)))) return false;
    const Mover& holder = before.first == body ? two : one;
    const double support_path = std::min(0.0, dot(n, holder.velocity)) * (h - earlier);
    const double falls = level + support_path - std::min(height(held, later, n), height(held, h, n));
    if (!(falls > 0.0)) return false;
    Pose out = moving.body;
    out.position += (falls + slop) * n;
    return time_of_impact({moving.shape, moving.part, out, moving.velocity, moving.spin}, other, h, slop) <
           0.0;
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
                               double overlap, Cast::When when) const {
    const Contact& contact = point.contact;
    if (!have_sides(step.detection.collider(open.pair.first).shape,
                    step.detection.collider(open.pair.second).shape))
        return false;
    if (!(overlap > slop(step, open))) return false;
    const Cast cast{step.motion.velocity, when == Cast::When::ahead ? Cast::When::solved : when};
    const int a = contact.first, b = contact.second;
    const Mover first = step.mover(open.pair.first, step.motion.poses[a], step.motion.velocity),
                second = step.mover(open.pair.second, step.motion.poses[b], step.motion.velocity);
    return time_of_impact(first, second, step.motion.options().time_step, slop(step, open)) < 0.0 ||
           is_internal_edge(step, first, a, second, open, cast, 0.0, contact.point.normal) ||
           is_internal_edge(step, second, b, first, open, cast, 0.0, contact.point.normal);
}

}  // namespace spook
