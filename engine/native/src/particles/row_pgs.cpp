#include "particles/row_pgs.hpp"

#include <algorithm>
#include <cmath>

namespace spook {

void RowPgs::solve(const Nodes& nodes, DistanceRows& rows) noexcept {
    std::fill(pushed_.begin(), pushed_.end(), Vec3{});  // M⁻¹ Gᵀ λ
    for (std::size_t k = 0; k < rows.row.size(); ++k) {
        const Vec3 impulse = rows.link[k].lambda * rows.link[k].u;
        pushed_[rows.row[k].a] -= nodes.w[rows.row[k].a] * impulse;
        pushed_[rows.row[k].b] += nodes.w[rows.row[k].b] * impulse;
    }
    for (int iteration = 0; iteration < iterations; ++iteration) {
        double worst = 0.0;
        ++work.pgs_iterations;
        for (std::size_t k = 0; k < rows.row.size(); ++k) {
            const Row& row = rows.row[k];
            Link& link = rows.link[k];
            const double residual =
                link.rhs - dot(link.u, pushed_[row.b] - pushed_[row.a]) - row.softness * link.lambda;
            worst = std::max(worst, std::fabs(residual));
            const double change = residual / row.diagonal;
            link.lambda += change;
            pushed_[row.a] -= (nodes.w[row.a] * change) * link.u;
            pushed_[row.b] += (nodes.w[row.b] * change) * link.u;
        }
        work.residual = worst;
        if (worst <= tolerance) break;
    }
}

}  // namespace spook
