// The friction of one contact by itself, where a step of projection would be slow.
#pragma once

#include "linear/elementary.hpp"

namespace spook {

/// The impulses z1, z2 with |z| <= bound that do the least of ½ zᵀ S z + zᵀ (s − S b): friction of one contact whose slip
/// is s at the impulses b, and s + S (z − b) at others. S = schur: (1, 1), (1, 2), (2, 2), positive definite. Either
/// nothing slips, or the slip is opposite to z: (S + λ) z = S b − s with the λ > 0 for which |z| = bound. Newton's
/// method on 1/|z| finds it, from one side (Moré, Sorensen 1983). Where S is far from a multiple of one, a step of
/// projection creeps: it takes the square of the ratio of both scales.
inline void least_on_disc(const double schur[3], double b1, double b2, double s1, double s2, double bound,
                          double& z1, double& z2) noexcept {
    const double q1 = schur[0] * b1 + schur[1] * b2 - s1, q2 = schur[1] * b1 + schur[2] * b2 - s2;
    z1 = z2 = 0.0;
    if (!(bound > 0.0)) return;
    double lambda = 0.0;
    for (int round = 0; round < 60; ++round) {
        const double a = schur[0] + lambda, c = schur[2] + lambda, det = a * c - schur[1] * schur[1];
        if (!(det > 0.0)) return;
        z1 = (c * q1 - schur[1] * q2) / det;
        z2 = (a * q2 - schur[1] * q1) / det;
        const double reach = length(z1, z2);
        if (reach <= bound * (1.0 + 4e-16)) break;
        const double y1 = (c * z1 - schur[1] * z2) / det, y2 = (a * z2 - schur[1] * z1) / det;
        const double next = lambda + reach * reach / (z1 * y1 + z2 * y2) * (reach / bound - 1.0);
        if (!(next > lambda)) break;
        lambda = next;
    }
    const double reach = length(z1, z2);
    if (reach > bound) z1 *= bound / reach, z2 *= bound / reach;
}

}  // namespace spook
