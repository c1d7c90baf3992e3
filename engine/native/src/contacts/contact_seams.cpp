// The contact stage's part for bodies that are sunk into what holds them, and come to the side of its next part.
//
// A body that lies a micron deep in the first of two tiles, as compliance and overlaps make it, would be stopped by the side
// of the second. Swept as it would stand if it were lifted out of the first, it goes over the second. What does not lie
// beneath the surface it is lifted to is no such part: it is met where it stands, however deep the body is sunk elsewhere,
// or overlaps would breed others.
#include <algorithm>

#include "collision/sweep.hpp"
#include "contacts/contact_geometry.hpp"
#include "contacts/contact_stage.hpp"

namespace spook {

namespace {

constexpr double share = 0.25;     // of the overlap at which pairs count as met: less is none
constexpr double same_face = 0.9;  // cosine of normals: what both lie on

}  // namespace

/// How deep a closed point is at the start of the step, and what the velocity then adds to it before that is answered, m: as
/// much as sweeps that count as settled may have left, or as the depth.
double ContactStage::sunk_by(const Point& point) const {
    const double h = options_.time_step, depth = std::max(0.0, -point.contact.point.gap);
    const double sinking = -h * relative(point, point.contact.point.normal, velocity_, false);
    const double left = options_.solver == SolverKind::iterative ? h * options_.unsettled_residual : 0.0;
    return depth + std::clamp(sinking, 0.0, std::max(depth, left));
}

/// Puts the points of each body together: what holds it is asked of each that it would meet.
void ContactStage::index_points() {
    std::vector<int>& begin = points_begin_;
    begin.assign(unknown_.size() + 2, 0);
    const auto both = [this](auto&& each) {
        for (std::size_t k = 0; k < points_.size(); ++k)
            for (const int b : {points_[k].contact.first, points_[k].contact.second})
                if (unknown_[b] >= 0) each(static_cast<std::size_t>(b), static_cast<int>(k));
    };
    both([&](std::size_t b, int) { ++begin[b + 2]; });
    for (std::size_t b = 2; b < begin.size(); ++b) begin[b] += begin[b - 1];
    points_of_.resize(static_cast<std::size_t>(begin.back()));
    both([&](std::size_t b, int k) { points_of_[static_cast<std::size_t>(begin[b + 1]++)] = k; });
}

/// Whether `body`, that would meet another as they move, does not once it is lifted out of what holds it. `facing` is
/// the normal they touch with already, if they do. Between sweeps a body may also sink on the way.
bool ContactStage::is_seam(const Mover& moving, int body, const Mover& other, const OpenPair& open,
                           Vec3 facing) const {
    const ShapeKind kind = moving.shape.kind, next = other.shape.kind;
    if (kind == ShapeKind::plane || next == ShapeKind::plane) return false;  // they have no sides
    if (kind == ShapeKind::sphere && next == ShapeKind::sphere) return false;
    const bool sinks = options_.solver == SolverKind::iterative;
    const double h = options_.time_step, slop = this->slop(open), least = share * slop;
    if (unknown_[body] < 0 || !(sinks || depth_[body] > least)) return false;
    const auto height = [&](const Primitive& shape, const Pose& at, Vec3 n) {
        return separation(shape, at, Primitive::plane(n), {}).gap;  // of a triangle: infinite
    };
    const int end = points_begin_[static_cast<std::size_t>(body) + 1];
    for (int at = points_begin_[static_cast<std::size_t>(body)]; at < end;) {
        const std::uint64_t pair = points_[points_of_[at]].contact.key >> feature_bits;
        Vec3 n;
        double depth = -unbounded, begun = 0.0;
        for (; at < end && points_[points_of_[at]].contact.key >> feature_bits == pair; ++at) {
            const Point& point = points_[points_of_[at]];
            if (point.strike >= 0.0) continue;
            const double deep = sunk_by(point), side = point.contact.first == body ? 1.0 : -1.0;
            if (deep > depth) depth = deep, n = side * point.contact.point.normal;
            begun = std::max(begun, -point.contact.point.gap);
        }
        if (depth < 0.0 || pair == pair_of(open.pair) || std::abs(dot(n, facing)) > same_face) continue;
        if (sinks) {
            const double falls =
                height(moving.shape, moving.at(0.0), n) - height(moving.shape, moving.at(h), n);
            depth = std::max(
                depth, begun + std::clamp(falls, 0.0, std::max(begun, h * options_.unsettled_residual)));
        }
        if (!(depth > least)) continue;
        Pose out = moving.body;
        out.position += depth * n;
        const Mover lifted{moving.shape, moving.part, out, moving.velocity, moving.spin};
        const double above = height(moving.shape, lifted.at(0.0), n) + height(other.shape, other.at(0.0), -n);
        if (above > -least && first_touch(lifted, other, h, slop) < 0.0) return true;
    }
    return false;
}

/// Takes out the points from `from` on of pairs that only graze: they touch with a side or an edge, and as they move no
/// overlap comes of it. Two bodies whose edges lie on each other touch with either face, and the one they move past is no
/// obstacle. Whether there are such pairs: they are open then.
bool ContactStage::let_pass(std::size_t from) {
    if (!swings_ || from == points_.size()) return false;
    const double h = options_.time_step;
    std::vector<IndexPair>& gone = arrays_.grazing;
    gone.clear();
    index_points();
    for (std::size_t k = from, end = from; k < points_.size(); k = end) {
        const std::uint64_t key = points_[k].contact.key >> feature_bits;
        std::size_t deepest = k;
        double most = 0.0;
        for (; end < points_.size() && points_[end].contact.key >> feature_bits == key; ++end) {
            const Contact& contact = points_[end].contact;
            const double closing = -relative(points_[end], contact.point.normal, velocity_, false);
            const double overlap = h * closing - std::max(0.0, contact.point.gap);
            if (overlap > most) most = overlap, deepest = end;
        }
        if (most > 0.0 && passes_by(points_[deepest], most))
            gone.push_back({static_cast<int>(key >> 24), static_cast<int>(key & 0xffffff)});
    }
    for (const IndexPair& pair : gone) {
        const Collider &one = detection_.collider(pair.first), &two = detection_.collider(pair.second);
        open_.push_back(opened(pair, separation(one.shape, detection_.pose(pair.first), two.shape,
                                                detection_.pose(pair.second))));
        std::erase_if(points_,
                      [&](const Point& point) { return point.contact.key >> feature_bits == pair_of(pair); });
    }
    return !gone.empty();
}

/// Whether bodies that touch, and would overlap by `overlap` [m] along that normal, do not as they move.
bool ContactStage::passes_by(const Point& point, double overlap) const {
    const Contact& contact = point.contact;
    const IndexPair pair{static_cast<int>(contact.key >> (feature_bits + 24)),
                         static_cast<int>(contact.key >> feature_bits & 0xffffff)};
    const ShapeKind one = detection_.collider(pair.first).shape.kind,
                    two = detection_.collider(pair.second).shape.kind;
    if (one == ShapeKind::plane || two == ShapeKind::plane) return false;
    if (one == ShapeKind::sphere && two == ShapeKind::sphere) return false;
    const OpenPair open = opened(pair, {contact.point.gap, contact.point.normal});
    if (!(overlap > slop(open))) return false;
    const int a = contact.first, b = contact.second;
    const Mover first = mover(pair.first, poses_[a], velocity_),
                second = mover(pair.second, poses_[b], velocity_);
    return first_touch(first, second, options_.time_step, slop(open)) < 0.0 ||
           is_seam(first, a, second, open, contact.point.normal) ||
           is_seam(second, b, first, open, contact.point.normal);
}

}  // namespace spook
