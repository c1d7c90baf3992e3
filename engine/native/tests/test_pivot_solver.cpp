// The pivoting solver against enumeration of every set of bound rows, and on problems with known answers.
#include <algorithm>
#include <random>

#include "contacts/pivot_solver.hpp"
#include "dense_problem.hpp"
#include "expect.hpp"

using namespace spook;

namespace {

void random_systems_match_enumeration() {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (int trial = 0; trial < 400; ++trial) {
        MixedSystem system;
        for (int b = 0; b < 3; ++b) {
            system.mass.push_back(diagonal(std::exp(2 * unit(random)), std::exp(2 * unit(random))));
            Vec6 p;
            for (double& x : p) x = unit(random);
            system.momentum.push_back(p);
        }
        for (int k = 0; k < 4; ++k) {
            RowBlock block;
            block.size = 1 + k % 2;
            block.first = k % 3;
            block.second = k == 3 ? -1 : (k + 1) % 3;
            for (int i = 0; i < block.size; ++i) {
                for (int a = 0; a < 6; ++a) {
                    block.first_jacobian[i][a] = unit(random);
                    block.second_jacobian[i][a] = unit(random);
                }
                block.softness[i] = 1e-3;
                block.right[i] = unit(random);
                if (k > 0) block.lower[i] = k == 3 ? -0.1 : 0.0;
                if (k == 3) block.upper[i] = 0.1;
                block.state[i] = trial % 2 ? RowState::free : RowState::at_lower;
            }
            system.rows.push_back(block);
        }
        PivotSolver solver;
        const PivotReport report = solver.solve(system);
        EXPECT(report.converged && report.finite);
        const std::vector<double> reference = enumerate(flatten(system));
        EXPECT(reference.size() == 6);
        std::size_t r = 0;
        for (const RowBlock& block : system.rows)
            for (int i = 0; i < block.size; ++i, ++r)
                if (r < reference.size()) EXPECT_NEAR(block.multiplier[i], reference[r], 1e-10);
    }
}

/// A box on four rigid corners: singular, and the least norm is wanted.
MixedSystem four_corners(double load_offset) {
    MixedSystem system;
    system.mass.push_back(diagonal(2.0, 0.3));
    system.momentum.push_back({0, 0, -1.0, 0, load_offset, 0});  // the weight of one step, off centre along x
    for (int corner = 0; corner < 4; ++corner) {
        const double x = corner & 1 ? 0.5 : -0.5, y = corner & 2 ? 0.5 : -0.5;
        RowBlock block;
        block.first = 0;
        block.first_jacobian[0] = {0, 0, 1, y, -x, 0};
        block.lower[0] = 0.0;
        system.rows.push_back(block);
    }
    return system;
}

void four_rigid_corners_share_the_load() {
    MixedSystem system = four_corners(0.0);
    PivotSolver solver;
    EXPECT(solver.solve(system).converged);
    for (const RowBlock& block : system.rows) EXPECT_NEAR(block.multiplier[0], 0.25, 1e-10);
    for (double v : system.velocity[0]) EXPECT_NEAR(v, 0.0, 1e-16);

    system = four_corners(0.1);  // moment balance: the right pair carries .6, the left pair .4
    EXPECT(solver.solve(system).converged);
    for (int k = 0; k < 4; ++k) EXPECT_NEAR(system.rows[k].multiplier[0], k & 1 ? 0.3 : 0.2, 1e-9);

    system = four_corners(0.7);  // tips: the left corners let go, the velocity is no longer zero
    EXPECT(solver.solve(system).converged);
    EXPECT(system.rows[0].multiplier[0] == 0.0 && system.rows[2].multiplier[0] == 0.0);
    EXPECT(system.velocity[0][4] > 0.1);
    EXPECT_NEAR(row_velocity(system.rows[1], 0, system.velocity), 0.0, 1e-16);
}

void a_kept_factor_gives_the_same_answer() {
    MixedSystem system = four_corners(0.1);
    PivotSolver solver;
    solver.solve(system);
    const std::uint64_t before = solver.counters().factorisations;
    system.momentum[0][2] = -2.0;
    solver.solve(system, true);
    EXPECT(solver.counters().factorisations == before);
    EXPECT_NEAR(system.rows[1].multiplier[0] + system.rows[0].multiplier[0], 1.0, 1e-9);
}

/// Three corners can hold what four share: whatever rows the search starts from, it ends at the least norm.
void the_share_does_not_depend_on_where_the_search_begins() {
    for (const double offset : {0.0, 0.1, -0.15}) {
        MixedSystem shared = four_corners(offset);
        for (RowBlock& block : shared.rows) block.state[0] = RowState::free;
        PivotSolver().solve(shared);
        for (int start = 0; start < 16; ++start) {
            MixedSystem system = four_corners(offset);
            for (int corner = 0; corner < 4; ++corner)
                system.rows[corner].state[0] = start >> corner & 1 ? RowState::free : RowState::at_lower;
            EXPECT(PivotSolver().solve(system).converged);
            for (int corner = 0; corner < 4; ++corner)
                EXPECT_NEAR(system.rows[corner].multiplier[0], shared.rows[corner].multiplier[0], 1e-12);
        }
    }
}

/// A body on four rigid corners, free or locked against rising and tilting. The gaps are known to rounding only, so
/// the corners contradict each other by that much and no answer is exact. Each stall loosens the tolerance tenfold
/// from 1e-11, so the search ends with the stall that reaches the contradiction, and not by flipping one row a round.
void a_contradiction_of_rounding_ends_the_search() {
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (int digits = -11; digits <= -8; ++digits)
        for (unsigned seed = 0; seed < 40; ++seed)
            for (const bool locked : {false, true}) {
                std::mt19937_64 random(seed);
                const double rounding = std::pow(10.0, digits);
                MixedSystem system;
                system.mass.push_back(diagonal(2.0, 0.3));
                system.momentum.push_back({0, 0, -1.0, 0, 0, 0});
                if (locked) {
                    RowBlock lock;
                    lock.first = 0;
                    lock.size = 2;
                    lock.first_jacobian[0] = {0, 0, 1, 0, 0, 0};
                    lock.first_jacobian[1] = {0, 0, 0, 1, 0, 0};
                    lock.right[0] = rounding * unit(random);
                    system.rows.push_back(lock);
                }
                for (int corner = 0; corner < 4; ++corner) {
                    const double x = unit(random), y = unit(random);
                    RowBlock block;
                    block.first = 0;
                    block.first_jacobian[0] = {0, 0, 1, y, -x, 0};
                    block.lower[0] = 0.0;
                    block.right[0] = rounding * unit(random);
                    system.rows.push_back(block);
                }
                PivotSolver solver;
                const PivotReport report = solver.solve(system);
                EXPECT(report.converged && report.finite);
                EXPECT(report.restarts <= digits + 12);
            }
}

void nothing_silent_about_nan() {
    MixedSystem system = four_corners(0.0);
    system.rows[1].first_jacobian[0][2] = NAN;
    PivotSolver solver;
    const PivotReport report = solver.solve(system);
    EXPECT(!report.finite || !report.converged || std::isnan(system.velocity[0][2]));
}

/// Systems that a step solves in turn are analysed once each, with the bits that each has alone.
void graphs_of_the_last_solves_are_kept() {
    const auto corners = [](std::size_t count) {
        MixedSystem system = four_corners(0.1);
        system.rows.resize(count);
        return system;
    };
    PivotSolver solver;
    for (int turn = 0; turn < 5; ++turn)
        for (std::size_t count = 1; count <= 4; ++count) {
            MixedSystem system = corners(count), alone = corners(count);
            EXPECT(solver.solve(system).converged);
            PivotSolver().solve(alone);
            EXPECT(system.velocity == alone.velocity);
            for (std::size_t k = 0; k < count; ++k)
                EXPECT(system.rows[k].multiplier == alone.rows[k].multiplier);
        }
    EXPECT(solver.analyses() == 4);
}

}  // namespace

int main() {
    random_systems_match_enumeration();
    four_rigid_corners_share_the_load();
    the_share_does_not_depend_on_where_the_search_begins();
    a_kept_factor_gives_the_same_answer();
    graphs_of_the_last_solves_are_kept();
    a_contradiction_of_rounding_ends_the_search();
    nothing_silent_about_nan();
    return report();
}
