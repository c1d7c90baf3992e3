#include "collision/mesh.hpp"

#include <algorithm>
#include <map>
#include <stdexcept>
#include <utility>

namespace spook {

Mesh::Mesh(std::vector<Vec3> places, std::vector<std::array<int, 3>> given)
    : corners(std::move(places)),
      triangles(std::move(given)),
      round(corners.size()),
      on_rim(corners.size(), 0) {
    std::map<std::pair<int, int>, int> far;  // of a side, from and to: the third corner of its triangle
    for (int t = 0; t < static_cast<int>(triangles.size()); ++t) {
        const Vec3 twice = cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0));
        if (!(norm(twice) > 0.0)) throw std::invalid_argument("a triangle of a mesh has no area");
        normals.push_back((1.0 / norm(twice)) * twice);
        for (int k = 0; k < 3; ++k)
            if (!far.emplace(std::pair{index(t, k), index(t, k + 1)}, index(t, k + 2)).second)
                throw std::invalid_argument("a side of a mesh is used twice in the same direction");
    }
    for (int t = 0; t < static_cast<int>(triangles.size()); ++t) {
        std::array<int, 3>& over = across.emplace_back();
        for (int k = 0; k < 3; ++k) {
            const int from = index(t, k), to = index(t, k + 1);
            const auto other = far.find({to, from});
            over[static_cast<std::size_t>(k)] = other == far.end() ? -1 : other->second;
            round[static_cast<std::size_t>(from)].push_back(to);
            if (other != far.end()) continue;
            round[static_cast<std::size_t>(to)].push_back(from);
            on_rim[static_cast<std::size_t>(from)] = on_rim[static_cast<std::size_t>(to)] = 1;
        }
    }
}

}  // namespace spook
