#include "collision/segment.hpp"

#include <algorithm>
#include <utility>

namespace spook {

SegmentPair closest_parameters(const Segment& first, const Segment& second) noexcept {
    const Vec3 between = first.centre - second.centre;
    const double cosine = dot(first.direction, second.direction);
    const double along_first = dot(between, first.direction), along_second = dot(between, second.direction);
    const Vec3 sine = cross(first.direction, second.direction);
    const double sine_squared = dot(sine, sine);
    if (sine_squared < 1e-12) {
        // Middle of the shared stretch, so that two capsules side by side push at their common centre.
        const double reach = second.half, offset = -along_first;  // second's centre on the first's axis
        const double low = std::max(-first.half, offset - reach), high = std::min(first.half, offset + reach);
        const double t = low <= high ? 0.5 * (low + high) : clamped(offset, -first.half, first.half);
        return {t, closest_parameter(second, first.at(t)), true};
    }
    double t = clamped((cosine * along_second - along_first) / sine_squared, -first.half, first.half);
    const double unclamped = cosine * t + along_second;
    const double u = clamped(unclamped, -second.half, second.half);
    if (u != unclamped) t = clamped(cosine * u - along_first, -first.half, first.half);
    return {t, u, false};
}

SegmentBox closest_to_box(const Segment& segment, Vec3 half) noexcept {
    // The squared distance is convex and piecewise quadratic in t; its pieces meet where a coordinate crosses
    // a face. Its derivative grows from piece to piece: find where it first and last is zero.
    auto outside = [&](double t) noexcept {
        const Vec3 p = segment.at(t);
        return Vec3{p.x - clamped(p.x, -half.x, half.x), p.y - clamped(p.y, -half.y, half.y),
                    p.z - clamped(p.z, -half.z, half.z)};
    };
    double knots[8];
    int count = 0;
    knots[count++] = -segment.half;
    for (int i = 0; i < 3; ++i) {
        if (std::abs(segment.direction[i]) < 1e-14) continue;
        for (double face : {-half[i], half[i]}) {
            const double t = (face - segment.centre[i]) / segment.direction[i];
            if (t > -segment.half && t < segment.half) knots[count++] = t;
        }
    }
    knots[count++] = segment.half;
    for (int k = 1; k < count; ++k)  // at most eight: by insertion
        for (int j = k; j > 0 && knots[j] < knots[j - 1]; --j) std::swap(knots[j], knots[j - 1]);

    const double scale = std::max({half.x, half.y, half.z, segment.half});
    const double flat = 1e-12 * scale;  // slopes below are rounding: parallel to a face
    // half of d(distance²)/dt
    auto slope = [&](double t) noexcept { return dot(outside(t), segment.direction); };
    auto crossing = [&](double level) noexcept {  // the first t whose slope reaches `level`, or the far end
        double before = slope(knots[0]);
        if (before >= level) return knots[0];
        for (int k = 1; k < count; ++k) {
            const double after = slope(knots[k]);
            if (after >= level)
                return knots[k - 1] + (knots[k] - knots[k - 1]) * ((level - before) / (after - before));
            before = after;
        }
        return knots[count - 1];
    };
    double low = crossing(-flat), high = crossing(flat);
    if (high - low < 1e-6 * scale) low = high = clamped(crossing(0.0), low, high);
    const double middle = 0.5 * (low + high);
    const double distance = norm(outside(middle));
    return {low, high, distance};
}

}  // namespace spook
