// Factors of the masses of a system's bodies, kept while the masses stay.
#pragma once

#include <vector>

#include "contacts/pivot_system.hpp"

namespace spook {

/// Factor of a symmetric positive definite 6×6, L D Lᵀ with D in place of L's unit diagonal, and x ← M⁻¹ x with it.
/// No square roots: masses scaled by a power of two scale every result exactly.
Mat6 factor_six(const Mat6& m) noexcept;
void solve_six(const Mat6& factor, Vec6& x) noexcept;

/// G M⁻¹ Gᵀ of each of up to six rows of one body alone.
void own_inertias(const Mat6& factor, const Vec6* rows, int count, double* own) noexcept;

/// One island is solved several times a step, with the masses it had: those that are equal keep their
/// factors.
class MassFactors {
public:
    /// Tells `changed` which bodies have new ones.
    template <class Changed> void find(const std::vector<Mat6>& mass, const Changed& changed) {
        const std::size_t known = mass_.size();
        mass_.resize(mass.size());
        factors_.resize(mass.size());
        for (std::size_t b = 0; b < mass.size(); ++b) {
            if (b < known && mass_[b] == mass[b]) continue;
            mass_[b] = mass[b];
            factors_[b] = factor_six(mass[b]);
            changed(b);
        }
    }
    void find(const std::vector<Mat6>& mass) {
        find(mass, [](std::size_t) {});
    }
    const Mat6& operator[](std::size_t body) const noexcept { return factors_[body]; }

private:
    std::vector<Mat6> mass_, factors_;
};

}  // namespace spook
