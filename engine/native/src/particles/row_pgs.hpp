// Projected Gauss–Seidel on the Schur form, warm started with the last step's impulses.
#pragma once

#include <cstdint>
#include <vector>

#include "particles/distance_rows.hpp"

namespace spook {

class RowPgs {
public:
    int iterations = 50;
    double tolerance = 0.0;  // m/s: the largest row residual at which a solve stops

    void prepare(const Nodes& nodes) { pushed_.resize(nodes.size()); }
    /// λ of every row from its right side.
    void solve(const Nodes& nodes, DistanceRows& rows) noexcept;

    struct Work {
        std::int64_t pgs_iterations = 0;
        double residual = 0.0;  // of the last solve, m/s
    };
    Work work;

private:
    std::vector<Vec3> pushed_;  // M⁻¹ Gᵀ λ
};

}  // namespace spook
