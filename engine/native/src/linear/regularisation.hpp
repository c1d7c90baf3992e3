// The coefficients of one SPOOK row, from compliance and damping in SI units and the time step.
#pragma once

namespace spook {

/// Row: (G M⁻¹ Gᵀ + softness) λ = −violation_gain g − velocity_gain G v − h G M⁻¹ f, λ an impulse [N s].
struct Regularisation {
    double violation_gain = 0.0;  // a = 4/(h(1+4θ)), 1/s
    double velocity_gain = 0.0;   // b = 4θ/(1+4θ), 1
    double softness = 0.0;        // Sig = 4 eps/(h²(1+4θ)), 1/kg
    double upsilon = 1.0;         // Ups = 1/(1+4θ) = 1 − b, 1
    double relaxation = 0.0;      // θ = τ/h, 1
};

/// Compliance eps [m/N], damping τ [s], time step h [s] (Lacoursière 2007, eqs 4.27 to 4.35, linearised).
constexpr Regularisation regularise(double compliance, double damping, double time_step) noexcept {
    const double theta = damping / time_step, spread = 1.0 + 4.0 * theta;
    return {4.0 / (time_step * spread), 4.0 * theta / spread,
            4.0 * compliance / (time_step * time_step * spread), 1.0 / spread, theta};
}
static_assert(regularise(0.0, 0.0, 0.5).violation_gain == 8.0);
static_assert(regularise(0.0, 0.25, 0.25).velocity_gain == 0.8);

}  // namespace spook
