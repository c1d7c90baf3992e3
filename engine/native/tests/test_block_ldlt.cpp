// The block factor against a dense elimination with pivoting in long double, and the promises of its ordering.
#include "linear/block_ldlt.hpp"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <random>
#include <stdexcept>

#include "expect.hpp"

using spook::BlockEdge;
using spook::BlockLdlt;

namespace {

struct System {
    std::vector<int> sizes;
    std::vector<BlockEdge> edges;
    std::vector<std::uint8_t> is_constraint;
};

std::mt19937 generator(7);
double random_number() { return std::uniform_real_distribution<double>(-1.0, 1.0)(generator); }

/// Bodies first, then joints: positive definite masses, random Jacobians, −sig on the constraints.
void fill_values(BlockLdlt& a, const System& system, double sig) {
    for (int i = 0; i < a.block_count(); ++i) {
        const int n = a.size(i);
        double* d = a.diagonal(i);
        for (int j = 0; j < n * n; ++j) d[j] = 0.0;
        if (system.is_constraint[i]) {
            for (int j = 0; j < n; ++j) d[j * n + j] = -sig;
            continue;
        }
        double b[36];
        for (int j = 0; j < n * n; ++j) b[j] = random_number();
        for (int j = 0; j < n; ++j)
            for (int k = 0; k < n; ++k) {
                d[j * n + k] = j == k ? 1.0 : 0.0;
                for (int l = 0; l < n; ++l) d[j * n + k] += b[j * n + l] * b[k * n + l];
            }
    }
    for (std::size_t e = 0; e < system.edges.size(); ++e) {
        const int entries = a.size(system.edges[e].first) * a.size(system.edges[e].second);
        for (int j = 0; j < entries; ++j) a.coupling(static_cast<int>(e))[j] = random_number();
    }
}

std::vector<long double> dense(const BlockLdlt& a) {
    const int n = a.unknowns();
    std::vector<long double> m(static_cast<std::size_t>(n) * n, 0.0L);
    for (int i = 0; i < a.block_count(); ++i)
        for (int r = 0; r < a.size(i); ++r)
            for (int c = 0; c < a.size(i); ++c)
                m[(a.offset(i) + r) * n + a.offset(i) + c] = a.diagonal(i)[r * a.size(i) + c];
    for (std::size_t e = 0; e < a.edges().size(); ++e) {
        const auto [i, j] = a.edges()[e];
        for (int r = 0; r < a.size(i); ++r)
            for (int c = 0; c < a.size(j); ++c) {
                const double value = a.coupling(static_cast<int>(e))[r * a.size(j) + c];
                m[(a.offset(i) + r) * n + a.offset(j) + c] = value;
                m[(a.offset(j) + c) * n + a.offset(i) + r] = value;
            }
    }
    return m;
}

std::vector<double> dense_solve(std::vector<long double> m, const std::vector<double>& rhs) {
    const int n = static_cast<int>(rhs.size());
    std::vector<long double> x(rhs.begin(), rhs.end());
    for (int k = 0; k < n; ++k) {
        int best = k;
        for (int i = k + 1; i < n; ++i)
            if (std::abs(m[i * n + k]) > std::abs(m[best * n + k])) best = i;
        for (int j = 0; j < n; ++j) std::swap(m[k * n + j], m[best * n + j]);
        std::swap(x[k], x[best]);
        for (int i = k + 1; i < n; ++i) {
            const long double f = m[i * n + k] / m[k * n + k];
            for (int j = k; j < n; ++j) m[i * n + j] -= f * m[k * n + j];
            x[i] -= f * x[k];
        }
    }
    for (int k = n - 1; k >= 0; --k) {
        for (int j = k + 1; j < n; ++j) x[k] -= m[k * n + j] * x[j];
        x[k] /= m[k * n + k];
    }
    return {x.begin(), x.end()};
}

double relative_error(const std::vector<double>& x, const std::vector<double>& truth) {
    double error = 0.0, size = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        error = std::max(error, std::abs(x[i] - truth[i]));
        size = std::max(size, std::abs(truth[i]));
    }
    return error / size;
}

/// World – lock – body – lock – body …: n bodies of `body` unknowns, n joints of `rows`.
System chain(int n, int body = 6, int rows = 6) {
    System s;
    s.sizes.assign(n, body);
    s.sizes.insert(s.sizes.end(), n, rows);
    s.is_constraint.assign(n, 0);
    s.is_constraint.insert(s.is_constraint.end(), n, 1);
    for (int i = 0; i < n; ++i) {
        s.edges.push_back({i, n + i});
        if (i > 0) s.edges.push_back({i - 1, n + i});
    }
    return s;
}

/// One body, n constraints to the world.
System door(int n, int rows) {
    System s;
    s.sizes.assign(1, 6);
    s.sizes.insert(s.sizes.end(), n, rows);
    s.is_constraint.assign(n + 1, 1);
    s.is_constraint[0] = 0;
    for (int i = 0; i < n; ++i) s.edges.push_back({0, i + 1});
    return s;
}

System ring(int n, int rows) {
    System s = chain(n, 6, rows);
    s.edges.push_back({n - 1, n});  // the first joint ties the last body too
    return s;
}

/// Random sizes on a random graph: every constraint joins two bodies.
System tangle(int bodies, int constraints) {
    System s;
    for (int i = 0; i < bodies; ++i) s.sizes.push_back(generator() % 2 ? 6 : 3);
    s.is_constraint.assign(bodies, 0);
    for (int i = 0; i < constraints; ++i) {
        s.sizes.push_back(1 + static_cast<int>(generator() % 6));
        s.is_constraint.push_back(1);
        const int a = static_cast<int>(generator() % bodies), b = static_cast<int>(generator() % bodies);
        s.edges.push_back({a, bodies + i});
        if (a != b) s.edges.push_back({b, bodies + i});
    }
    return s;
}

double solved_error(const System& s, double sig, int refinements = 1) {
    BlockLdlt a;
    a.analyse(s.sizes, s.edges, s.is_constraint);
    fill_values(a, s, sig);
    EXPECT(a.factor(1e-12));
    std::vector<double> rhs(a.unknowns()), x(a.unknowns());
    for (double& value : rhs) value = random_number();
    a.solve_refined(rhs.data(), x.data(), refinements);
    return relative_error(x, dense_solve(dense(a), rhs));
}

void solves_what_a_dense_elimination_solves() {
    EXPECT(solved_error(chain(8), 1e-6) < 1e-11);
    EXPECT(solved_error(chain(30), 1e-3) < 1e-12);
    EXPECT(solved_error(chain(30, 6, 5), 1e-3) < 1e-12);
    EXPECT(solved_error(chain(40, 3, 1), 0.0) < 1e-12);
    EXPECT(solved_error(door(20, 5), 0.1) < 1e-12);
    EXPECT(solved_error(ring(20, 5), 1e-3) < 1e-12);
    for (int round = 0; round < 20; ++round) EXPECT(solved_error(tangle(15, 18), 0.01) < 1e-12);
}

/// x₁ᵀ A⁻¹ x₂ of vectors in two blocks: half a solve each, along their ways to the root.
void the_inverse_between_two_blocks_needs_their_ways_to_the_root_only() {
    for (const System& s : {chain(12, 6, 5), door(9, 4), ring(9, 5), tangle(12, 10)}) {
        BlockLdlt a;
        a.analyse(s.sizes, s.edges, s.is_constraint);
        fill_values(a, s, 0.01);
        EXPECT(a.factor(1e-12));
        std::vector<int> columns;
        std::vector<std::vector<double>> given, half;
        for (const int block : {0, a.block_count() / 2, a.block_count() - 1}) {
            given.emplace_back(a.unknowns(), 0.0);
            for (int i = 0; i < a.size(block); ++i) given.back()[a.offset(block) + i] = random_number();
            half.push_back(given.back());
            a.reach(std::vector<int>{block}, columns);
            a.forward(columns, half.back().data());
        }
        for (std::size_t i = 0; i < given.size(); ++i) {
            const std::vector<double> whole = dense_solve(dense(a), given[i]);
            for (std::size_t j = 0; j < given.size(); ++j) {
                double sum = 0.0, truth = 0.0, scale = 0.0;
                for (int k = 0; k < a.block_count(); ++k) {
                    const auto [offset, inverse] = a.pivots(k);
                    for (std::size_t c = 0; c < inverse.size(); ++c)
                        sum += half[i][offset + c] * inverse[c] * half[j][offset + c];
                }
                for (int k = 0; k < a.unknowns(); ++k)
                    truth += given[j][k] * whole[k], scale += std::abs(given[j][k] * whole[k]);
                EXPECT(std::abs(sum - truth) < 1e-10 * (scale + 1.0));
            }
        }
    }
}

void chains_and_trees_have_no_fill() {
    BlockLdlt a;
    System s = chain(200);
    a.analyse(s.sizes, s.edges, s.is_constraint);
    EXPECT(a.fill() == 0);
    // A tree of joints, each body hanging from body (i − 1) / 3.
    s = {};
    const int n = 300;
    s.sizes.assign(2 * n, 6);
    s.is_constraint.assign(n, 0);
    s.is_constraint.insert(s.is_constraint.end(), n, 1);
    for (int i = 0; i < n; ++i) {
        s.edges.push_back({i, n + i});
        if (i > 0) s.edges.push_back({(i - 1) / 3, n + i});
    }
    a.analyse(s.sizes, s.edges, s.is_constraint);
    EXPECT(a.fill() == 0);
}

void no_constraint_of_a_chain_is_eliminated_before_its_child() {
    BlockLdlt a;
    const System s = chain(50);
    a.analyse(s.sizes, s.edges, s.is_constraint);
    std::vector<int> position(100);
    for (int k = 0; k < 100; ++k) position[a.order()[k]] = k;
    for (int i = 0; i < 50; ++i) EXPECT(position[i] < position[50 + i]);
}

void many_hinges_on_one_body_do_not_couple() {
    BlockLdlt a;
    const System s = door(200, 5);
    a.analyse(s.sizes, s.edges, s.is_constraint);
    EXPECT(a.fill() < 50);
}

void redundant_rows_are_solved_consistently() {
    // Twenty hinges on one body without compliance: the multipliers are not unique, the motion is.
    const System s = door(20, 5);
    BlockLdlt a;
    a.analyse(s.sizes, s.edges, s.is_constraint);
    fill_values(a, s, 0.0);
    std::vector<double> rhs(a.unknowns(), 0.0), x(a.unknowns()), r(a.unknowns());
    for (int i = 0; i < 6; ++i) rhs[i] = random_number();  // a force: compatible with standing still
    EXPECT(a.factor(1e-12));
    a.solve_refined(rhs.data(), x.data(), 2);
    a.residual(rhs.data(), x.data(), r.data());
    for (double value : r) EXPECT_NEAR(value, 0.0, 1e-13);
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(x[i], 0.0, 1e-13);
    EXPECT(a.counters().floored_pivots > 0);
}

void a_closed_ring_of_locks_is_solved() {
    // Rigid motion of the ring keeps every lock: G = [−1, 1] is redundant by six rows.
    const int n = 12;
    const System s = ring(n, 6);
    BlockLdlt a;
    a.analyse(s.sizes, s.edges, s.is_constraint);
    fill_values(a, s, 0.0);
    for (std::size_t e = 0; e < s.edges.size(); ++e) {
        const bool own = s.edges[e].second - n == s.edges[e].first;
        for (int j = 0; j < 36; ++j) a.coupling(static_cast<int>(e))[j] = j % 7 ? 0.0 : own ? 1.0 : -1.0;
    }
    std::vector<double> rhs(a.unknowns(), 0.0), x(a.unknowns()), r(a.unknowns());
    for (int i = 0; i < 6 * n; ++i) rhs[i] = random_number();
    EXPECT(a.factor(1e-12));
    a.solve_refined(rhs.data(), x.data(), 2);
    a.residual(rhs.data(), x.data(), r.data());
    for (double value : r) EXPECT_NEAR(value, 0.0, 1e-12);
    for (int i = 6; i < 6 * n; ++i) EXPECT_NEAR(x[i], x[i % 6], 1e-12);  // all bodies move alike
}

void a_zero_floor_reports_a_singular_system() {
    const System s = door(2, 6);
    BlockLdlt a;
    a.analyse(s.sizes, s.edges, s.is_constraint);
    EXPECT(!a.factor(0.0));  // every entry is zero
    fill_values(a, s, 0.0);
    a.diagonal(0)[0] = std::nan("");
    EXPECT(!a.factor(1e-12));
}

void equal_input_gives_equal_bits_on_every_instruction_set() {
    const System s = tangle(30, 35);
    BlockLdlt a;
    a.analyse(s.sizes, s.edges, s.is_constraint);
    fill_values(a, s, 0.01);
    std::vector<double> rhs(a.unknowns()), x(a.unknowns()), y(a.unknowns());
    for (double& value : rhs) value = random_number();
    EXPECT(a.factor(1e-12));
    a.solve_refined(rhs.data(), x.data(), 1);
    spook::kernel::use_portable_kernels(true);
    EXPECT(a.factor(1e-12));
    a.solve_refined(rhs.data(), y.data(), 1);
    spook::kernel::use_portable_kernels(false);
    EXPECT(std::memcmp(x.data(), y.data(), x.size() * sizeof(double)) == 0);
}

void counts_are_exact() {
    const System s = chain(10);
    BlockLdlt a;
    a.analyse(s.sizes, s.edges, s.is_constraint);
    fill_values(a, s, 0.1);
    EXPECT(a.factor(1e-12));
    // 20 pivots, 19 couplings, 19 updates.
    EXPECT(a.counters().block_operations == 58);
}

void a_malformed_graph_is_refused() {
    BlockLdlt a;
    const auto refused = [&](const System& s) {
        try {
            a.analyse(s.sizes, s.edges, s.is_constraint);
        } catch (const std::invalid_argument&) {
            return true;
        }
        return false;
    };
    EXPECT(refused({{6, 7}, {}, {0, 1}}));
    EXPECT(refused({{6, 6}, {{1, 0}}, {0, 1}}));
    EXPECT(refused({{6, 6}, {{0, 1}, {0, 1}}, {0, 1}}));
    EXPECT(refused({{6, 6}, {{0, 2}}, {0, 1}}));
}

/// Work and memory grow with the chain. Quadratic time would take minutes here and meet the time limit of the test.
void a_large_chain_costs_no_more_per_body_than_a_small_one() {
    double work[2];
    for (const int n : {1000, 100000}) {
        const System s = chain(n);
        BlockLdlt a;
        a.analyse(s.sizes, s.edges, s.is_constraint);
        fill_values(a, s, 1e-6);
        EXPECT(a.factor(1e-12));
        EXPECT(a.fill() == 0);
        work[n > 1000] = static_cast<double>(a.counters().block_operations) / n;
    }
    EXPECT_NEAR(work[1] / work[0], 1.0, 0.01);
}

}  // namespace

int main() {
    solves_what_a_dense_elimination_solves();
    the_inverse_between_two_blocks_needs_their_ways_to_the_root_only();
    chains_and_trees_have_no_fill();
    no_constraint_of_a_chain_is_eliminated_before_its_child();
    many_hinges_on_one_body_do_not_couple();
    redundant_rows_are_solved_consistently();
    a_closed_ring_of_locks_is_solved();
    a_zero_floor_reports_a_singular_system();
    equal_input_gives_equal_bits_on_every_instruction_set();
    counts_are_exact();
    a_malformed_graph_is_refused();
    a_large_chain_costs_no_more_per_body_than_a_small_one();
    return report();
}
