#include "collision/polytope.hpp"

#include <algorithm>
#include <map>
#include <stdexcept>
#include <utility>

#include "collision/segment.hpp"

namespace spook {

Polytope::Polytope(std::vector<Vec3> given, std::vector<int> rounds, const std::vector<int>& counts)
    : corners(std::move(given)), loops(std::move(rounds)) {
    if (corners.size() > most_corners) throw std::invalid_argument("a polytope has too many corners");
    if (counts.size() > most_faces) throw std::invalid_argument("a polytope has too many faces");
    int begin = 0;
    std::map<std::pair<int, int>, int> sides;  // from, to: the face on its left
    for (const int count : counts) {
        if (count < 3 || count > most_round_a_face)
            throw std::invalid_argument("a face of a polytope has too few or too many corners");
        Face face{begin, count, {}, 0.0, 0.0};
        Vec3 twice;
        for (int k = 1; k + 1 < count; ++k)
            twice +=
                cross(corner_of(face, k) - corner_of(face, 0), corner_of(face, k + 1) - corner_of(face, 0));
        face.area = 0.5 * norm(twice);
        face.normal = (1.0 / norm(twice)) * twice;
        for (int k = 0; k < count; ++k) face.offset += dot(face.normal, corner_of(face, k)) / count;
        for (int k = 0; k < count; ++k) {
            const int from = begin + k, to = begin + (k + 1) % count;
            sides[{loops[static_cast<std::size_t>(from)], loops[static_cast<std::size_t>(to)]}] =
                static_cast<int>(faces.size());
        }
        volume += face.offset * face.area / 3.0;
        faces.push_back(face);
        begin += count;
    }
    for (const auto& [side, left] : sides) {
        const auto other = sides.find({side.second, side.first});
        if (other == sides.end()) throw std::invalid_argument("an edge of a polytope parts no two faces");
        if (side.first < side.second) edges.push_back({side.first, side.second, left, other->second});
    }
    for (const Vec3 corner : corners) reach = std::max(reach, norm(corner));
    thickness = 2.0 * reach;
    for (const Face& face : faces)
        thickness = std::min(thickness, face.offset + farthest(*this, -face.normal));
}

const Polytope& cube() {
    static const Polytope unit(
        {{-1, -1, -1}, {1, -1, -1}, {-1, 1, -1}, {1, 1, -1}, {-1, -1, 1}, {1, -1, 1}, {-1, 1, 1}, {1, 1, 1}},
        {0, 4, 6, 2, 1, 3, 7, 5, 0, 1, 5, 4, 2, 6, 7, 3, 0, 2, 3, 1, 4, 5, 7, 6}, {4, 4, 4, 4, 4, 4});
    return unit;
}

double farthest(const Polytope& polytope, Vec3 n) noexcept {
    double most = -1e300;
    for (const Vec3 corner : polytope.corners) most = std::max(most, dot(n, corner));
    return most;
}

Nearest nearest(const Polytope& polytope, Vec3 p) noexcept {
    const Polytope::Face* highest = polytope.faces.data();  // also of what is no number
    double top = -1e300;
    for (const Polytope::Face& face : polytope.faces) {
        const double height = dot(face.normal, p) - face.offset;
        if (height > top) top = height, highest = &face;
    }
    Nearest found{p - top * highest->normal, highest->normal, top};
    if (top <= 0.0) return found;
    // Outside, the nearest point lies on a face that p looks at: within it, or on its rim.
    double least = 1e300;
    for (const Polytope::Face& face : polytope.faces) {
        const double height = dot(face.normal, p) - face.offset;
        if (height <= 0.0) continue;
        bool within = true;
        for (int k = 0; k < face.count; ++k) {
            const Vec3 from = polytope.corner_of(face, k), along = polytope.corner_of(face, k + 1) - from;
            if (dot(cross(along, face.normal), p - from) <= 0.0) continue;
            within = false;
            const Vec3 on = from + clamped(dot(p - from, along) / dot(along, along), 0.0, 1.0) * along;
            if (dot(p - on, p - on) < least) least = dot(p - on, p - on), found.on = on;
        }
        if (within) return {p - height * face.normal, face.normal, height};
    }
    const double distance = std::sqrt(least);
    if (distance > 1e-14 * polytope.reach) found.normal = (1.0 / distance) * (p - found.on);
    found.height = distance;
    return found;
}

}  // namespace spook
