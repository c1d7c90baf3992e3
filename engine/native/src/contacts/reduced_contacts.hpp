// Joints out first, cones on the rest: contacts and bounded rows of an island whose joints are eliminated exactly.
//
// Bodies and bilateral rows are factored once. What is left is a dense problem in the bounded rows alone,
//
//     u = W z + q,    W = G A⁻¹ Gᵀ + Sig,    q = G v₀ − r,
//
// with A⁻¹ the velocities that impulses give to bodies held by their joints, and v₀ those without any. Projected
// Gauss–Seidel crawls along chains of joints; on W it settles within tens of iterations which contacts push and which slide,
// and Newton's method on the exact laws finishes. Every iteration keeps the bounds, so that wherever the limit stops it
// there is an answer, whose residual is told.
//
// Beyond `most_rows` W is too large to be dense, and Newton's method on the whole is asked (contacts/cone_newton.hpp).
// Few points with rolling and torsional friction are found here without joints, too.
//
// Sources: Featherstone 2008, ch. 11 (contacts by the inverse of the operational-space inertia); Alart, Curnier 1991 (the
// laws as a root); Horak, Trinkle 2019 (how solvers of robots' contacts compare).
#pragma once

#include <vector>

#include "contacts/bilateral_rows.hpp"
#include "contacts/friction_point.hpp"
#include "contacts/mass_factors.hpp"
#include "contacts/reduced_newton.hpp"
#include "linear/block_ldlt.hpp"

namespace spook {

class ReducedContacts : private ReducedNewton {
public:
    static constexpr int most_rows = 120;          // of contacts: three of one with friction
    static constexpr int most_turning_rows = 48;   // the same without joints, where points resist turning
    static constexpr int most_bounded_rows = 400;  // with stops and drives, few of which are at their bounds

    struct Report {
        int iterations = 0, newton_steps = 0;
        double residual = unbounded;  // of the worst row, relative to the speeds in the system
    };

    /// Whether the system has joints to eliminate, or points that resist turning, and few enough rows between bounds.
    static bool takes(const MixedSystem& system, const std::vector<FrictionPoint>& points);

    /// Joints that are led back stay as far open as they are; impulses met so far, which a jam multiplies, are forgotten.
    static void leave_open(MixedSystem& system) noexcept;

    /// Starts from the multipliers of bounded rows in `system`; fills velocities and all multipliers. Points obey the cone.
    /// `iterations`: between tries of Newton's method.
    Report solve(MixedSystem& system, const std::vector<FrictionPoint>& points, int iterations);

    BlockLdlt::Counters counters() const noexcept { return matrix_.counters(); }

private:
    struct Pattern {
        int first = -1, second = -1, size = 0;
        bool operator==(const Pattern&) const = default;
    };
    bool factor(const MixedSystem& system);
    void analyse(const MixedSystem& system);
    void list_units(const MixedSystem& system, const std::vector<FrictionPoint>& points);
    void fill_right(const MixedSystem& system);
    void reduce(const MixedSystem& system);
    void couple();
    void couple_refined(const MixedSystem& system);
    void change(int at, double by);
    struct NewPair {
        std::vector<int> normals, slips;  // rows of its points' normals, and units of their friction
    };
    void share_new_loads(const MixedSystem& system);
    void share(const NewPair& pair);
    void iterate();
    void find_row(const Unit& unit);
    void find_disc(const Unit& unit);
    void settle(Report& report, double goal, int iterations);
    void deliver(MixedSystem& system);

    BlockLdlt matrix_;
    std::vector<Pattern> pattern_;
    std::vector<std::pair<int, int>> further_;  // of joints over more bodies: node and body
    int bodies_ = -1;
    struct Joint {
        int block = 0, count = 0;
        int row[6] = {};
        int first_edge = -1, second_edge = -1, further_edge = -1;
    };
    std::vector<Joint> joints_;
    std::vector<NewPair> new_pairs_;
    std::vector<double> slip_;
    MassFactors mass_;
    bool floored_ = false;                // pivots, by the last factorisation
    std::vector<double> response_;        // columns U⁻ᵀ Gᵀ; A⁻¹ Gᵀ where pivots are floored; of all unknowns
    std::vector<double> line_;            // of the first, what one unknown adds to a row of W
    std::vector<int> touched_, reached_;  // bodies of a row, and columns it reaches
    std::vector<double> right_, free_, whole_;
};

}  // namespace spook
