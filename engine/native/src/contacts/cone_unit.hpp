// One law of Newton's method on the cone: a point of Coulomb friction, or one row of anything else.
#pragma once

#include <array>

#include "contacts/pivot_system.hpp"

namespace spook {

/// The multipliers z that are eliminated together, and their law u = G v + Sig z − r. Inside, both are scaled to
/// √J so that a light and a heavy contact weigh alike: y = E⁻¹ z/√rho and w = √rho E (u + De Saxcé's term), with
/// E = (1, mu, mu) and rho the inverse of the rows' own G M⁻¹ Gᵀ.
struct ConeUnit {
    using Vec = std::array<double, 3>;

    int block = 0, row = 0, size = 1;  // its rows in the system: three of a point with friction, or one
    int first = -1, second = -1;       // bodies
    int edge = -1;                     // of the matrix; −1 if one body does not move
    bool turned = false;               // its first body is the edge's second
    double friction = -1.0;            // mu
    double root = 1.0;                 // √rho
    double over = 1.0, along = 0.0;    // 1/root, and over mu
    double lower = 0.0, upper = 0.0;   // of a single row, scaled
    Vec6 first_row[3], second_row[3];  // G
    Vec softness{}, right{};           // Sig, r
    bool soft = false;                 // some Sig is not zero
    Vec z{}, u{};                      // where it stands
    Vec met{};                         // z, where the path was met last
    Vec held{};                        // y, what the proximal term holds on to
    double load = 0.0;                 // of the normal, scaled: the kink of |u_t| is rounded by b²/(b + load)
    Vec dz{}, du{};                    // Newton's direction
    Vec tz{}, tu{};                    // along the path, for the whole blur
    Vec map{}, bend{};  // of linearise(): the smoothed natural map, its derivative by the blur,
    double slope[3] = {}, rest[3] = {};  //   D's eigenvalues and those of 1 − D + hold D,
    double over_rest[3] = {};            //   the latter inverted,
    double t1 = 1.0, t2 = 0.0;           //   the direction of their frame,
    double s1 = 0.0, s2 = 0.0;           //   that of the slip,
    double k[9] = {}, g[9] = {};         //   K = −dz/d(G v), and (1 + K₀ Sig)⁻¹
    Vec lack{}, c{}, turn{};             // what is to be answered, respond()'s answer, and the u of that

    /// How the map is changed on the way to its root.
    struct Aid {
        double blur = 0.0;  // b
        double hold = 0.0;  // on to y
    };

    /// The natural map y − P_b(y − w − hold (y − held)) at (z, u); returns its square.
    double natural(const Vec& at_z, const Vec& at_u, const Aid& aid, double* out) const;

    /// What the law says to first order: (1 − D + hold D) dy + D dw = −map.
    void linearise(const Aid& aid);

    /// c: the dz that answers what is missing in the first-order law, G dv held.
    void respond(const Vec& missing);

    /// y: z as the map takes it.
    Vec scaled() const noexcept { return {z[0] * over, z[1] * along, z[2] * along}; }

    /// What changes of z and u change in the law: (1 − D) dy + D dw.
    Vec law(const Vec& change_z, const Vec& change_u) const;

    static double square(const Vec& v) noexcept { return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]; }

    /// Impulses within their bounds to the last bit, and none where a row is open.
    void finish();

private:
    void spectral(const double* f, const double* x, double* y) const;
    void linearise_row(const Aid& aid);
    double kink(double blur) const noexcept { return blur > 0.0 ? blur * blur / (blur + load) : 0.0; }
    void soften();
};

inline double dot(const ConeUnit::Vec& a, const ConeUnit::Vec& b) noexcept {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

}  // namespace spook
