// Bounded rows and Coulomb's cone, all at once, by a smoothing Newton method.
//
// A contact's law is a complementarity on a self-dual cone L = {y₀ >= |y_t|}: with nu, beta its impulses and u its
// relative velocity,
//     y = (nu, beta/mu),  w = (u_n + mu |u_t|, mu u_t),   L ∋ y ⟂ w ∈ L,
// the term mu |u_t| being De Saxcé's. It holds where y = P(y − rho w), P the projection onto L. Rows with bounds obey
// the same with P the clamp between them, bilateral ones with P the identity.
//
// P is smoothed: each eigenvalue's max(0, λ) becomes (λ + √(λ² + 4 b²))/2. The points of y = P_b(y − rho w) form the
// central path of the problem, b = 0 its solution. It is followed as interior methods do: one factor gives the way back
// to the path and the way along it, and b falls as far as the next point still is near the path. In a step all
// multipliers are eliminated, contact by contact; what is left is a system in the velocities with one 6×6 block per
// body and one pair per pair of bodies that touch, however many points they touch at. It is not symmetric, since
// friction is not. Rolling and torsional friction, whose bound is a part of nu, follow after it (contacts/turning_friction.hpp).
//
// Where a point sticks, dz/dv is infinite, and where points are redundant z is not one. So y is held, lightly, where
// it was: w + hold (y − y before) in place of w, anew in every iteration (a proximal method). At rest nothing is held,
// so no equation is changed, and loads spread evenly where points are redundant.
//
// Coulomb's law has systems with several answers, and the path may end where two of them part: a box that slides on
// four corners that are not quite in a plane rests on either three. Then the path is left: Newton's steps at b = 0,
// taken whole, jump from one set of rows that push to another, as pivoting does, and the best point met is the answer.
//
// Sources: De Saxcé and Feng 1998 (the cone's law); Fukushima, Luo, Tseng 2002 (smoothing on second-order cones);
// Burke, Xu 2000 (following such paths); Acary, Brémond, Huber 2018 (a comparison of solvers for this law).
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "contacts/bilateral_rows.hpp"
#include "contacts/cone_unit.hpp"
#include "contacts/friction_point.hpp"
#include "contacts/mass_factors.hpp"
#include "contacts/turning_friction.hpp"
#include "linear/block_lu.hpp"

namespace spook {

struct ConeReport {
    int iterations = 0;      // systems factored
    double residual = 0.0;   // of the worst row, relative to the speeds in the system
    bool converged = false;  // the residual is that of rounding, or as good as it gets
};

class ConeNewton {
public:
    int max_iterations = 100;
    int max_losses = 3;  // of the path, sought again
    int max_frozen = 0;  // paths with De Saxcé's term frozen, where that has no answer
    double near_enough =
        1e-6;  // a residual, relative to the speeds, that is not worth jumps, nor beginning anew

    /// Starts from the multipliers in `system` and fills velocities and multipliers with the best it met. Points obey the
    /// cone; rows that are no point's obey their bounds.
    ConeReport solve(MixedSystem& system, const std::vector<FrictionPoint>& points);

    std::uint64_t factorisations() const noexcept { return factorisations_; }
    std::uint64_t block_operations() const noexcept { return block_operations_; }

private:
    using Left = ConeLaws::Left;
    struct Search {
        double blur, length,
            along;  // the next blur, parts of Newton's direction and of the path's; 0: none is better
    };
    void prepare(MixedSystem& system, const std::vector<FrictionPoint>& points);
    void read(const RowBlock& given, const FrictionPoint* friction, ConeUnit& unit, ConeFour& four,
              int at) const;
    void connect();
    void measure(const MixedSystem& system);
    double merit(double blur, double length, double along, double enough) const;
    Left worst() const;
    Left follow_frozen(MixedSystem& system, ConeReport& report, Left best);
    double rounding() const;
    Search search(double blur) const;
    void hold();
    void move(const MixedSystem& system, const Search& found);
    bool find_directions(double blur);
    bool answer(ConeFour::Each (ConeFour::*dz)[3], ConeFour::Each (ConeFour::*du)[3], bool newton,
                double enough);
    static void scale(double share, const ConeFour::Each* from, ConeFour::Each* to) noexcept;
    double speed_of(const MixedSystem& system) const;
    void keep();
    void keep_met();
    void back_to_best(const MixedSystem& system);
    double relative(double speed) const noexcept;
    double goal_from(const Left& start) const noexcept;
    int patience(const Left& best) const noexcept;
    static double asked_after(int stalled) noexcept;
    void let_go_behind(const Left& left, const Left& before, double blur) noexcept;
    void take_best(MixedSystem& system);
    double back_from(double met, double blur, const MixedSystem& system);
    bool step(const MixedSystem& system, double blur);

    BlockLu matrix_;
    std::vector<std::pair<int, int>> pairs_, needed_;  // analysed, and those of this system
    std::vector<BlockEdge> edges_;                     // those needed
    int bodies_ = -1;
    std::vector<const FrictionPoint*> friction_;  // of each block, while units are read
    std::vector<int> sizes_;                      // of the blocks of matrix_, and which are joints
    std::vector<std::uint8_t> is_constraint_;
    BilateralRows joints_;
    TurningFriction turning_;
    std::vector<ConeUnit> units_;
    std::vector<ConeFour> fours_;  // their laws
    const ConeLaws* laws_ = nullptr;
    MassFactors mass_;
    std::vector<Mat6> mass_inverse_;
    std::vector<Vec6> velocity_, change_, image_;
    struct Best {
        ConeFour::Each z[3], u[3];
    };
    std::vector<Best> best_;  // of every four
    bool frozen_ = false;
    double speed_ = 0.0, hold_ = 0.0, near_ = 1.0;
    std::uint64_t factorisations_ = 0, block_operations_ = 0;
};

}  // namespace spook
