// Distance rows in open paths: G M⁻¹ Gᵀ + Sig is tridiagonal, because only neighbours share a body.
//
//     S_kk = w_a + w_b + Sig,   S_k−1,k = −w u_k−1·u_k  (w of the shared body),   S = L D Lᵀ,
// one pass down and one up, O(n) in time and memory.
#pragma once

#include <vector>

#include "particles/distance_rows.hpp"

namespace spook {

class OpenPaths {
public:
    /// Begins a path with the row that is added next; end() after the last.
    void begin(const DistanceRows& rows) { first_.push_back(static_cast<int>(rows.size())); }
    void end(const DistanceRows& rows) { begin(rows); }
    /// Path p has rows first()[p] … first()[p + 1] − 1.
    const std::vector<int>& first() const noexcept { return first_; }

    /// At the directions of the links; `rigid` leaves the softness out.
    void factor(const Nodes& nodes, DistanceRows& rows, bool rigid = false) const noexcept;
    /// λ of every row from its right side.
    void substitute(DistanceRows& rows) const noexcept;
    /// v += kick + M⁻¹ Gᵀ λ
    void kick(const Nodes& nodes, const DistanceRows& rows, std::vector<Vec3>& v) const noexcept;

private:
    std::vector<int> first_;
};

}  // namespace spook
