// Everything that has a place: the bodies, and the world points that rows and springs hang from.
#pragma once

#include <vector>

#include "linear/vec.hpp"

namespace spook {

inline Vec3 vec_at(const double* p) noexcept { return {p[0], p[1], p[2]}; }

/// One entry per node. World points have inverse mass 0, so nothing moves them. If the rows form open paths, the
/// nodes stand in path order.
struct Nodes {
    std::vector<Vec3> x, v;         // m, m/s
    std::vector<Vec3> kick;         // change of v by the forces of this step
    std::vector<Vec3> steady_kick;  // that of the forces that are the same in every step
    std::vector<double> w;          // inverse mass, 1/kg
    std::vector<int> body;          // of the scene, −1: a world point
    std::vector<int> of_body;       // the node of each body of the scene

    std::size_t size() const noexcept { return x.size(); }
    /// A node at that place; returns its index.
    int add(Vec3 place) {
        x.push_back(place);
        w.push_back(0.0);
        steady_kick.push_back({});
        return static_cast<int>(x.size()) - 1;
    }
};

}  // namespace spook
