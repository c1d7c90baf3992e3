// Two shapes anywhere, from bytes: what touches, when they would meet, how much is under water.
#include <algorithm>
#include <cstdint>

#include "../tests/support_distance.hpp"
#include "bytes.hpp"
#include "collision/narrow_phase.hpp"
#include "collision/shape_cast.hpp"
#include "collision/submerged.hpp"

namespace {

using namespace fuzz;

/// Whether a point of the world is inside a solid, by more than `by` [m] along each of its own measures.
bool holds(const Primitive& shape, const Pose& at, Vec3 point, double by) {
    const Vec3 p = local(at.rotation, point - at.position);
    const double aside = std::sqrt(p.x * p.x + p.y * p.y);
    switch (shape.kind) {
        case ShapeKind::sphere: return norm(p) < shape.radius - by;
        case ShapeKind::capsule: {
            const double along = std::max(0.0, std::abs(p.z) - shape.half_length);
            return std::sqrt(aside * aside + along * along) < shape.radius - by;
        }
        case ShapeKind::box:
            return std::abs(p.x) < shape.half.x - by && std::abs(p.y) < shape.half.y - by &&
                   std::abs(p.z) < shape.half.z - by;
        case ShapeKind::cylinder: return aside < shape.radius - by && std::abs(p.z) < shape.half_length - by;
        case ShapeKind::cone: {
            const double height = 2.0 * shape.half_length, up = p.z + 0.25 * height;
            const double slant = std::sqrt(height * height + shape.radius * shape.radius);
            return up > by && (shape.radius * (height - up) - height * aside) / slant > by;
        }
        case ShapeKind::hull:
            return std::all_of(shape.hull->faces.begin(), shape.hull->faces.end(),
                               [&](const auto& face) { return dot(face.normal, p) - face.offset < -by; });
        case ShapeKind::plane: return dot(shape.normal, p) < -by;
        case ShapeKind::triangle: return false;
    }
    return false;
}

double reach(const Primitive& shape) {
    switch (shape.kind) {
        case ShapeKind::sphere: return shape.radius;
        case ShapeKind::capsule: return shape.radius + shape.half_length;
        case ShapeKind::box: return norm(shape.half);
        case ShapeKind::cylinder:
        case ShapeKind::cone: return shape.radius + 2.0 * shape.half_length;
        case ShapeKind::hull: return shape.hull->reach;
        case ShapeKind::plane: return 0.0;
        case ShapeKind::triangle: return 12.0;
    }
    return 0.0;
}

/// What is said of two shapes against bounds of their distance that the engine has no part in.
void as_far_as_supports_say(const Primitive& first, const Pose& at_first, const Primitive& second,
                            const Pose& at_second, double margin, double rounding, const Manifold& found) {
    if (second.kind == ShapeKind::plane || first.kind == ShapeKind::plane) {
        const bool swapped = first.kind == ShapeKind::plane;
        const Primitive &solid = swapped ? second : first, &plane = swapped ? first : second;
        const Pose &at = swapped ? at_second : at_first, &at_plane = swapped ? at_first : at_second;
        if (solid.kind == ShapeKind::plane) return;
        const Vec3 up = at_plane.rotation * plane.normal;
        const double lowest = dot(up, support::farthest_point(solid, at, -up) - at_plane.position);
        if (lowest > margin + rounding) PROMISE(found.count == 0);
        if (lowest < margin - rounding) PROMISE(found.count > 0);
        double deepest = margin;
        for (int k = 0; k < found.count; ++k) deepest = std::min(deepest, found.points[k].gap);
        if (found.count > 0) PROMISE(std::abs(deepest - lowest) <= rounding);
        return;
    }
    const Vec3 between = at_first.position - at_second.position;
    const support::Distance apart =
        support::distance(first, at_first, second, at_second, norm(between) > 0.0 ? between : Vec3{0, 0, 1});
    if (!(apart.least > rounding)) return;
    if (apart.least > margin + rounding) PROMISE(found.count == 0);
    // Flat sides that face each other at corners alone have no point, and a lower bound for a distance.
    const bool flat = (first.faceted() || first.kind == ShapeKind::triangle) &&
                      (second.faceted() || second.kind == ShapeKind::triangle);
    // A face is preferred to an edge within this of the thickness: see collision/overlay.hpp.
    const double tie = 2e-5 * std::min(reach(first), reach(second)) + rounding;
    double deepest = HUGE_VAL;
    for (int k = 0; k < found.count; ++k) deepest = std::min(deepest, found.points[k].gap);
    if (!flat) PROMISE(deepest >= apart.least - tie);
    PROMISE(deepest > -rounding);
    if (first.kind == ShapeKind::triangle || second.kind == ShapeKind::triangle) return;
    if (!flat && found.count > 0) PROMISE(deepest <= apart.most + tie);
    if (!flat && apart.most < margin - rounding) PROMISE(found.count > 0);
    const Separation told = separation(first, at_first, second, at_second);
    PROMISE(told.gap > 0.0 && told.gap <= apart.most + rounding);
    if (!flat) PROMISE(told.gap >= apart.least - rounding);
}

void touch(const Primitive& first, const Pose& at_first, const Primitive& second, const Pose& at_second,
           double margin, double scale) {
    const Manifold found = collide(first, at_first, second, at_second, margin);
    const double rounding = 1e-9 * scale;
    PROMISE(found.count >= 0 && found.count <= Manifold::capacity);
    double deepest = 1e300;
    for (int k = 0; k < found.count; ++k) {
        const ContactPoint& point = found.points[k];
        PROMISE(fuzz::finite(point.position) && std::isfinite(point.gap));
        PROMISE(std::abs(norm(point.normal) - 1.0) < 1e-9);
        PROMISE(point.gap <= margin + rounding);
        for (int other = 0; other < k; ++other) PROMISE(found.points[other].feature != point.feature);
        deepest = std::min(deepest, point.gap);
    }
    const Manifold again = collide(first, at_first, second, at_second, margin);
    PROMISE(again.count == found.count);
    for (int k = 0; k < found.count; ++k) PROMISE(again.points[k].gap == found.points[k].gap);

    as_far_as_supports_say(first, at_first, second, at_second, margin, rounding, found);
    if (first.kind == ShapeKind::triangle || second.kind == ShapeKind::triangle) return;
    // Two solids with a point in common push each other apart; the point is found without the engine.
    const double inside = 1e-6 * scale;
    if (holds(first, at_first, at_second.position, inside) &&
        holds(second, at_second, at_second.position, inside))
        PROMISE(deepest < 0.0);
    if (second.kind != ShapeKind::plane && holds(second, at_second, at_first.position, inside) &&
        holds(first, at_first, at_first.position, inside))
        PROMISE(deepest < 0.0);
    if (first.kind == ShapeKind::plane || second.kind == ShapeKind::plane) return;
    const Separation apart = separation(first, at_first, second, at_second);
    PROMISE(std::isfinite(apart.gap) && std::abs(norm(apart.normal) - 1.0) < 1e-9);
    if (apart.gap > margin + rounding) PROMISE(found.count == 0);
    if (apart.gap < -inside) PROMISE(found.count > 0);
    // What is farther than both reach does not touch.
    if (norm(at_first.position - at_second.position) > reach(first) + reach(second) + margin + rounding)
        PROMISE(found.count == 0);
}

void dip(const Primitive& shape, const Pose& at, Vec3 up, double level) {
    const double whole = volume(shape), side = reach(shape);
    const Submerged below = submerged(shape, at, up, level), above = submerged(shape, at, -up, -level);
    const double rounding = 1e-6 * (side * side * side);
    PROMISE(whole > 0.0 && std::isfinite(whole) && whole < 8.4 * side * side * side);
    PROMISE(below.volume >= 0.0 && below.volume <= whole + rounding);
    PROMISE(std::abs(below.volume + above.volume - whole) <= rounding);
    if (below.volume > rounding) {
        PROMISE(fuzz::finite(below.centre));
        PROMISE(dot(up, below.centre) <= level + 1e-3 * side);
        PROMISE(norm(below.centre - at.position) <= 1.001 * side);
    }
    const double dark = shadow(shape, at, up);
    PROMISE(dark > 0.0 && dark <= 3.2 * side * side);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace fuzz;
    Bytes bytes(data, size);
    const int what = bytes.below(8);
    const double margin = bytes.share();
    const Primitive first = solid(bytes);
    const Pose at_first = pose(bytes);
    Primitive second = Primitive::plane({0, 0, 1});
    if (what == 0) second = Primitive::plane(bytes.direction());
    if (what == 1)
        if (auto made = sheet(bytes)) second = Primitive::sheet(std::move(made), bytes.below(2));
    if (what > 1) second = solid(bytes);
    const Pose at_second = pose(bytes);
    const double scale =
        1.0 + reach(first) + reach(second) + norm(at_first.position) + norm(at_second.position);
    touch(first, at_first, second, at_second, margin, scale);
    touch(second, at_second, first, at_first, margin, scale);

    const Vec3 up = bytes.direction();
    dip(first, at_first, up, bytes.number());
    if (second.kind == ShapeKind::triangle) return 0;
    const Pose placed{};
    const Vec3 speed = bytes.place(), spin = bytes.place();
    const Mover one{first, placed, at_first, speed, spin};
    const Mover two{second, placed, at_second, bytes.place(), {}};
    const double duration = 0.02, time = time_of_impact(one, two, duration, 1e-6);
    PROMISE(time < 0.0 || time <= duration);
    return 0;
}
