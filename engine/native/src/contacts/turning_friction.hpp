// Rolling and torsional friction beside the laws of the cone's Newton method: |t| <= c nu, against the turning.
//
// With t the impulse, u_t the turning and nu the normal impulse of its point, y = (c nu, t), w = (|u_t|, u_t) obey the cone's
// law L ∋ y ⟂ w ∈ L as friction does, but that c nu is the point's own: its rows are those of y_t = P(y − rho w)_t alone,
// smoothed as the others' are. So t is eliminated after nu,
//
//     dt = (what is missing) − K G_t dv + N dnu,    dnu = (what is missing) − K_nu G dv,
//
// and adds Gᵀ_t K G_t and Gᵀ_t N K_nu G to the bodies' matrix, which pair its point's own rows have coupled already.
#pragma once

#include <vector>

#include "contacts/cone_unit.hpp"
#include "contacts/friction_point.hpp"
#include "contacts/mass_factors.hpp"
#include "contacts/pivot_system.hpp"

namespace spook {

class TurningFriction {
public:
    using Fours = ConeLaws::Fours;
    using Units = ConeLaws::Units;

    void clear() noexcept { discs_.clear(); }
    int rows() const noexcept;
    /// Takes a point whose normal is the law `lane` of `four`, and unit `unit`.
    void read(const RowBlock& block, const FrictionPoint& point, const MassFactors& mass, int four, int lane,
              int unit);

    /// v += Gᵀ z, for impulses; and u = G v + Sig z − r.
    void push(Vec6* momentum) const;
    void measure(const Vec6* velocity);
    double largest_right() const;
    /// The largest natural map, √J, and as a velocity.
    ConeLaws::Left worst(const Fours& fours, bool frozen) const;
    /// The square of the smoothed map parts of the way along both directions, J.
    double merit(const Fours& fours, ConeAid aid, double length, double along) const;
    /// Where it stands is held; and De Saxcé's term is frozen as it is.
    void hold(const Fours& fours);
    void freeze();
    void move(double length, double along);

    /// The laws to first order; then what they add to the bodies' matrix.
    void linearise(const Fours& fours, ConeAid aid);
    void add(const Fours& fours, const Units& units) const;
    /// What is to be answered: the map, or what the path asks for the whole blur.
    void ask(bool newton, double blur);
    double asked() const;
    /// As ConeLaws do it, each after them: their c is dnu by then.
    void respond(const Fours& fours, Vec6* image);
    void turn(const Fours& fours, const Vec6* image, Vec6* change);
    double remain(const Fours& fours, const Vec6* change);
    void take(bool newton, bool first);
    void forget_path();

    void keep_best();
    void keep_met();
    void back_to_met();
    void back_to_best();
    /// Best impulses into the system, once those of the normals are there.
    void deliver(MixedSystem& system);

private:
    using Pair = std::array<double, 2>;
    using Two = std::array<double, 4>;   // row-major
    struct Law {                         // to first order: stays dy + slips dw = −map + by_bound d(c nu)
        Pair map{}, bend{}, by_bound{};  // the smoothed natural map, its derivative by the blur, and by c nu
        Two stays{}, slips{};
        Two inverse{}, k{};  // (stays/root + root Sig slips)⁻¹, K
        Pair n{};            // N
    };
    struct Way {
        Pair z{}, u{};
    };
    struct Disc {
        int block = 0, row = 0, size = 2;
        int four = 0, lane = 0, unit = 0;
        int first = -1, second = -1;
        std::array<Vec6, 2> first_row{}, second_row{};  // G
        double coefficient = 0.0, root = 1.0;           // c, √rho
        Pair right{};
        double softness = 0.0;
        Pair z{}, u{}, held{}, lack{}, c{}, image{}, best{}, met{};
        Way newton, path;                // Newton's direction, and the path's for the whole blur
        double load = 0.0, slide = 0.0;  // c nu where it is held, scaled; De Saxcé's term where it is frozen
        Law law;
    };
    static Pair along(const Disc& disc, const Vec6* v) noexcept;
    static void put(const Disc& disc, const Pair& z, Vec6* x) noexcept;
    static Pair natural(const Disc& disc, double normal, const Pair& z, const Pair& u, ConeAid aid) noexcept;
    static void linearise(Disc& disc, double normal, ConeAid aid) noexcept;
    std::vector<Disc> discs_;
};

}  // namespace spook
