// The distance rows of a scene: their constants, and what a step finds out about each.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "linear/regularisation.hpp"
#include "particles/particle_nodes.hpp"
#include "particles/particle_scene.hpp"

namespace spook {

/// |d + s| − |d| − u·s without cancellation: (s² − (u·s)²) / (|d + s| + |d| + u·s), never negative; u = d/|d|.
inline double curvature(Vec3 u, double length, Vec3 s) noexcept {
    const double along = dot(u, s), across = std::max(0.0, dot(s, s) - along * along), moved = length + along;
    return across == 0.0 ? 0.0 : across / (std::sqrt(moved * moved + across) + moved);
}

struct Row {                       // constants
    int a, b;                      // nodes
    double rest, stiff, diagonal;  // m; w_a + w_b; the same + softness, 1/kg
    double violation_gain, velocity_gain, relaxation, softness, rest_inverse, rest_inverse_square;
};

struct Link {                                                // of this step
    Vec3 u;                                                  // unit, from a to b
    double length, g, rhs, y, lambda, pivot_inverse, lower;  // y: the right side on the way down a path
};

/// In path order if the rows form open paths.
struct DistanceRows {
    std::vector<Row> row;
    std::vector<Link> link;
    std::vector<int> slot;  // where each row of the scene stands

    std::size_t size() const noexcept { return row.size(); }

    void add(const DistanceRow& spec, int a, int b, double time_step) {
        const Regularisation r = regularise(spec.compliance, spec.damping, time_step);
        const double rest = spec.rest_length;
        row.push_back({a, b, rest, 0.0, 0.0, r.violation_gain, r.velocity_gain, r.relaxation, r.softness,
                       1.0 / rest, 1.0 / (rest * rest)});
    }
    /// Once every node has its mass.
    void finish(const Nodes& nodes) {
        for (Row& r : row) {
            r.stiff = nodes.w[r.a] + nodes.w[r.b];
            r.diagonal = r.stiff + r.softness;
        }
        link.resize(row.size());
    }
    /// Directions, violations and right sides at the nodes' state.
    void assemble(const Nodes& nodes) noexcept;
    /// v += M⁻¹ Gᵀ λ
    void push(const Nodes& nodes, std::vector<Vec3>& v) const noexcept;
};

}  // namespace spook
