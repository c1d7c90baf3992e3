// The laws of Newton's method on the cone, four at a time: each a point of Coulomb friction, or one row of anything else.
#pragma once

#include <vector>

#include "contacts/pivot_system.hpp"

namespace spook {

/// The multipliers z that are eliminated together, and where their rows G are.
struct ConeUnit {
    int block = 0, row = 0, size = 1;  // its rows in the system: three of a point with friction, or one
    int first = -1, second = -1;       // bodies
    Vec6 first_row[3], second_row[3];  // G
    double* matrix[2][2] = {};         // blocks of its bodies: whether of the first one's rows, and columns
};

/// The laws of up to four units of one size that follow each other, u = G v + Sig z − r, side by side: whatever is done
/// to one is done to all. Inside, both z and u are scaled to √J so that a light and a heavy contact weigh alike:
/// y = E⁻¹ z/√rho and w = √rho E (u + De Saxcé's term), with E = (1, mu, mu) and rho the inverse of the rows' own
/// G M⁻¹ Gᵀ.
struct alignas(32) ConeFour {
    static constexpr int most = 4;
    using Each = double[most];

    Each friction;                // mu
    Each root;                    // √rho
    Each over, along;             // 1/root, and over mu
    Each lower, upper;            // of a single row, scaled
    Each softness[3], right[3];   // Sig, r
    Each z[3], u[3];              // where it stands
    Each held[3];                 // y, what the proximal term holds on to
    Each slide;                   // mu |u_t|, scaled, where it is frozen
    Each load;                    // of the normal, scaled: the kink of |u_t| is rounded by b²/(b + load)
    Each dz[3], du[3];            // Newton's direction
    Each tz[3], tu[3];            // along the path, for the whole blur
    Each map[3], bend[3];         // of linearise(): the smoothed natural map, its derivative by the blur,
    Each slope[3], rest[3];       //   D's eigenvalues and those of 1 − D + hold D,
    Each over_rest[3];            //   the latter inverted,
    Each t1, t2;                  //   the direction of their frame,
    Each s1, s2;                  //   that of the slip,
    Each k[9], g[9];              //   K = −dz/d(G v), and (1 + K₀ Sig)⁻¹
    Each lack[3], c[3], turn[3];  // what is to be answered, respond()'s answer, and the u of that
    Each met[3];                  // z, where the path was met last
    int begin = 0, count = 0, size = 1;  // units
    bool soft = false;                   // some Sig is not zero
    bool pushing = false;                // single rows that are bounded from below, and only so

    /// Makes all laws those of one unit that does nothing.
    void clear(int of_size);

    bool is_soft(int i) const noexcept { return softness[0][i] > 0.0 || softness[1][i] > 0.0; }

    /// g = (1 + K Sig)⁻¹, K ← g K of one unit: what is left when the rows give way themselves.
    void soften(int i) noexcept;

    /// Impulses of one unit within their bounds to the last bit, and none where a row is open.
    void finish(int i) noexcept;
};

/// How the map is changed on the way to its root.
struct ConeAid {
    double blur = 0.0;    // b
    double hold = 0.0;    // on to y
    bool frozen = false;  // De Saxcé's term is what ConeFour::slide says: the rest is convex, with one path
};

/// What is done to all laws of a system, for one instruction set: the bits are the same.
struct ConeLaws {
    struct Left {
        double map = 0.0, speed = 0.0;  // √J, m/s
    };
    using Fours = std::vector<ConeFour>;
    using Units = std::vector<ConeUnit>;

    /// The square of the natural map y − P_b(y − w − hold (y − held)) parts of the way along Newton's direction and
    /// the path; past `enough` a part of it.
    double (*merit)(const Fours& fours, ConeAid aid, double length, double along, double enough);
    /// The largest natural map, and as a velocity.
    Left (*worst)(const Fours& fours, bool frozen);
    /// What the laws say to first order: (1 − D + hold D) dy + D dw = −map.
    void (*linearise)(Fours& fours, ConeAid aid);
    /// What they add to the matrix: Gᵀ K G.
    void (*add)(const Fours& fours, const Units& units);
    /// c: the dz that answers what is missing in the first-order law, G dv held; image += Gᵀ c.
    void (*respond)(Fours& fours, const Units& units, Vec6* image);
    /// c −= K G image; change += Gᵀ c.
    void (*turn)(Fours& fours, const Units& units, const Vec6* image, Vec6* change);
    /// Each body's six numbers by its matrix.
    void (*map_bodies)(const std::vector<Mat6>& by, Vec6* x);
    /// turn = G change + Sig c; what c and it change in the law is taken from what is missing: the square of the rest.
    double (*remain)(Fours& fours, const Units& units, const Vec6* change);
    /// v += Gᵀ z.
    void (*push)(const Fours& fours, const Units& units, Vec6* v);
    /// u = G v + Sig z − r.
    void (*measure)(Fours& fours, const Units& units, const Vec6* v);
};

const ConeLaws& portable_cone_laws() noexcept;
const ConeLaws& avx2_cone_laws() noexcept;  // the portable ones where the compiler cannot build them

/// The fastest ones this machine runs.
const ConeLaws& cone_laws() noexcept;
/// For tests: from now on the portable ones, or the fastest again. Not for use between threads.
void use_portable_cone_laws(bool portable) noexcept;

}  // namespace spook
