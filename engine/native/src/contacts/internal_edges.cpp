// The contact stage's part for bodies that are sunk into what holds them, and come to the side of its next part.
//
// A body that lies a micron deep in the first of two tiles, as compliance and overlaps make it, would be stopped by the side
// of the second. Cast as it would stand if it were lifted out of the first, it goes over the second. What does not lie
// beneath the surface it is lifted to is no such part: it is met where it stands, however deep the body is sunk elsewhere,
// or overlaps would breed others.
//
// What falls onto the first tile is cast through it as well, and would come to the side of the second from below: what is met
// first occludes what a body would meet only behind it. And where edges lie on each other, as a body's and a tile's do when
// a step begins there, both faces are as near: the one it moves past is no obstacle.
#include <algorithm>
#include <span>

#include "collision/shape_cast.hpp"
#include "contacts/contact_geometry.hpp"
#include "contacts/contact_stage.hpp"
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

}  // namespace

/// How deep a closed point is at the start of the step, and what the velocity then adds to it before that is answered, m.
/// When a solve has answered it, as much as iterations that count as settled may have left, or as the depth.
double ContactStage::depth_at_toi(const Point& point, bool late) const {
    const double h = model_->options.time_step, depth = std::max(0.0, -point.contact.point.gap);
    const double sinking =
        std::max(0.0, -h * relative_velocity(point, point.contact.point.normal, motion_.velocity));
    const double left =
        model_->options.solver == SolverKind::iterative ? h * model_->options.unsettled_residual : 0.0;
    return depth + (late ? std::min(sinking, std::max(depth, left)) : sinking);
}

/// Whether `body`, that would meet another at `time` [s], does not once it is lifted out of what holds it. `facing` is
/// the normal they touch with already, if they do. Between iterations a body may also sink on the way, and to the side of another
/// as far as settled iterations may have left it falling.
bool ContactStage::is_internal_edge(const Mover& moving, int body, const Mover& other, const OpenPair& open,
                                    const std::vector<Vec6>& velocity, double time, bool late,
                                    Vec3 facing) const {
    if (!have_sides(moving.shape, other.shape)) return false;
    const double h = model_->options.time_step, slop = this->slop(open), least = share * slop;
    const bool by_pgs = model_->options.solver == SolverKind::iterative;
    if (model_->bodies.solver_index[body] < 0 || !(iterating_ || by_pgs || depth_[body] > least))
        return false;
    const std::span<const int> own = points_of_[body];
    for (std::size_t at = 0; at < own.size();) {
        const std::uint64_t pair = points_.all[own[at]].contact.key >> feature_bits;
        Vec3 n, support_velocity;  // what holds it goes itself, m/s
        double depth = -unbounded, begun = 0.0, sinking = 0.0;
        for (; at < own.size() && points_.all[own[at]].contact.key >> feature_bits == pair; ++at) {
            const Point& point = points_.all[own[at]];
            if (point.toi >= 0.0) continue;
            const double gap = point.contact.point.gap, side = point.contact.first == body ? 1.0 : -1.0;
            const double deep = depth_at_toi(point, late);
            if (deep > depth) {
                const int holder = point.contact.first == body ? point.contact.second : point.contact.first;
                const Vec3 arm = point.contact.first == body ? point.second_arm : point.first_arm;
                depth = deep, n = side * point.contact.point.normal;
                support_velocity = linear(velocity[holder]) + cross(angular(velocity[holder]), arm);
            }
            begun = std::max(begun, -gap);
            sinking = std::max(sinking, depth_at_toi(point, false));
        }
        if (depth == -unbounded || pair == pair_of(open.pair) || std::abs(dot(n, facing)) > same_face_cosine)
            continue;
        if (iterating_ || by_pgs) {
            const double now = height(moving, 0.0, n), top = height(other, 0.0, -n);
            double falls = 0.0;
            for (const double part : {time, h}) {  // against what holds it, and against the other
                const double rises = std::max(part * dot(n, support_velocity), top - height(other, part, -n));
                falls = std::max(falls, now + rises - height(moving, part, n));
            }
            const double left = h * model_->options.unsettled_residual;
            double most = residual_motion * slop;
            if (iterating_)
                most = std::max(
                    begun, left + h * free_fall_allowance * norm(linear(motion_.dv_ext[body])) + sinking);
            else if (falls > most && meets_side_face(moving, other, time, n)) most = left;
            falls = std::min(falls, most);
            depth = std::max(depth, begun + falls);
            if (iterating_) depth += slop;  // it met the other with as much
        }
        if (!(depth > least)) continue;
        Pose out = moving.body;
        out.position += depth * n;
        const Mover lifted{moving.shape, moving.part, out, moving.velocity, moving.spin};
        const double above = height(lifted, 0.0, n) + height(other, 0.0, -n);
        if (above > -least && time_of_impact(lifted, other, h, slop) < 0.0) return true;
    }
    return false;
}

/// Whether `body`, that meets one after the other in this step, would not meet the later one if the earlier one stopped it:
/// it falls onto a tile, and would be past its edge, below its top, when it came to the next one's side.
bool ContactStage::occludes(const Meeting& earlier, const Meeting& later, int body,
                            const std::vector<Vec6>& velocity) const {
    const OpenPair &before = open_.pairs[earlier.open], &after = open_.pairs[later.open];
    const Pose before_first = motion_.moved(before.first, velocity),
               before_second = motion_.moved(before.second, velocity),
               after_first = motion_.moved(after.first, velocity),
               after_second = motion_.moved(after.second, velocity);
    const Mover one = mover(before.pair.first, before_first, velocity),
                two = mover(before.pair.second, before_second, velocity),
                three = mover(after.pair.first, after_first, velocity),
                four = mover(after.pair.second, after_second, velocity);
    const Mover &held = before.first == body ? one : two, &moving = after.first == body ? three : four,
                &other = after.first == body ? four : three;
    for (const Mover* each : {&one, &two, &three, &four})
        if (each->shape.kind == ShapeKind::triangle) return false;  // its neighbours are known
    if (!have_sides(moving.shape, other.shape)) return false;
    const auto normal = [](const Mover& a, const Mover& b, double time) {
        return separation(a.shape, a.at(time), b.shape, b.at(time)).normal;
    };
    const Vec3 n = (before.first == body ? 1.0 : -1.0) * normal(one, two, earlier.time);
    const Vec3 side = (after.first == body ? 1.0 : -1.0) * normal(three, four, later.time);
    if (dot(n, side) > same_direction_cosine) return false;
    const double h = model_->options.time_step, slop = this->slop(after),
                 level = height(held, earlier.time, n);
    if (!(level + height(other, earlier.time, -n) > -2.0 * (slop + this->slop(before)))) return false;
    const Mover& holder = before.first == body ? two : one;
    const double support_path = std::min(0.0, dot(n, holder.velocity)) * (h - earlier.time);
    const double falls = level + support_path - std::min(height(held, later.time, n), height(held, h, n));
    if (!(falls > 0.0)) return false;
    Pose out = moving.body;
    out.position += (falls + slop) * n;
    return time_of_impact({moving.shape, moving.part, out, moving.velocity, moving.spin}, other, h, slop) <
           0.0;
}

/// Of what one body meets in a step, leaves out what it would not meet if that which comes before stopped it. What it meets
/// all the same is found again with the velocities of the solve.
void ContactStage::remove_occluded(std::vector<Meeting>& meetings, const std::vector<Vec6>& velocity) {
    if (!model_->bodies.swings || meetings.size() < 2) return;
    meetings_of_.clear();
    for (std::size_t at = 0; at < meetings.size(); ++at)
        for (const int b : {open_.pairs[meetings[at].open].first, open_.pairs[meetings[at].open].second})
            if (model_->bodies.solver_index[b] >= 0) meetings_of_.push_back({b, meetings[at].time, at});
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
                if (occludes(earlier, later, body, velocity)) later.time = -1.0;
                else if (later.time - earlier.time < simultaneous * model_->options.time_step &&
                         occludes(later, earlier, body, velocity))
                    earlier.time = -1.0;
            }
        }
        from = end;
    }
    std::erase_if(meetings, [](const Meeting& meeting) { return meeting.time < 0.0; });
}

/// Takes out the points from `from` on of pairs that only graze: they touch with a side or an edge, and as they move no
/// overlap comes of it. Two bodies whose edges lie on each other touch with either face, and the one they move past is no
/// obstacle. Whether there are such pairs: they are open then.
bool ContactStage::skip_grazing(std::size_t from) {
    if (!model_->bodies.swings || from == points_.all.size()) return false;
    const double h = model_->options.time_step;
    std::vector<IndexPair>& gone = arrays_.grazing;
    gone.clear();
    points_of_.find(points_.all, model_->bodies);
    for (std::size_t k = from, end = from; k < points_.all.size(); k = end) {
        const std::uint64_t key = points_.all[k].contact.key >> feature_bits;
        std::size_t deepest = k;
        double most = 0.0;
        for (; end < points_.all.size() && points_.all[end].contact.key >> feature_bits == key; ++end) {
            const Contact& contact = points_.all[end].contact;
            const double closing =
                -relative_velocity(points_.all[end], contact.point.normal, motion_.velocity);
            const double overlap = h * closing - std::max(0.0, contact.point.gap);
            if (overlap > most) most = overlap, deepest = end;
        }
        if (most > 0.0 && is_grazing(points_.all[deepest], most))
            gone.push_back({static_cast<int>(key >> 24), static_cast<int>(key & 0xffffff)});
    }
    for (const IndexPair& pair : gone) {
        const Collider::View one = detection_.collider(pair.first), two = detection_.collider(pair.second);
        open_.pairs.push_back(opened(pair, separation(one.shape, detection_.pose(pair.first), two.shape,
                                                      detection_.pose(pair.second))));
        std::erase_if(points_.all,
                      [&](const Point& point) { return point.contact.key >> feature_bits == pair_of(pair); });
    }
    return !gone.empty();
}

/// Whether bodies that touch, and would overlap by `overlap` [m] along that normal, do not as they move.
bool ContactStage::is_grazing(const Point& point, double overlap) const {
    const Contact& contact = point.contact;
    const IndexPair pair{static_cast<int>(contact.key >> (feature_bits + 24)),
                         static_cast<int>(contact.key >> feature_bits & 0xffffff)};
    if (!have_sides(detection_.collider(pair.first).shape, detection_.collider(pair.second).shape))
        return false;
    const OpenPair open = opened(pair, {contact.point.gap, contact.point.normal});
    if (!(overlap > slop(open))) return false;
    const int a = contact.first, b = contact.second;
    const Mover first = mover(pair.first, motion_.poses[a], motion_.velocity),
                second = mover(pair.second, motion_.poses[b], motion_.velocity);
    return time_of_impact(first, second, model_->options.time_step, slop(open)) < 0.0 ||
           is_internal_edge(first, a, second, open, motion_.velocity, 0.0, true, contact.point.normal) ||
           is_internal_edge(second, b, first, open, motion_.velocity, 0.0, true, contact.point.normal);
}

}  // namespace spook
