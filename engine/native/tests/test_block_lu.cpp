// Block LU against dense Gauss elimination, on random patterns whose values are not symmetric.
#include <algorithm>
#include <limits>
#include <random>

#include "dense_problem.hpp"
#include "expect.hpp"
#include "linear/block_lu.hpp"

using namespace spook;

namespace {

struct Problem {
    int blocks;
    std::vector<BlockEdge> edges;
    std::vector<std::vector<double>> a;
};

/// Diagonally heavy, as M + Σ Gᵀ K G is, but not symmetric; `density` is the share of pairs that are coupled.
Problem random_problem(int blocks, double density, std::mt19937_64& random) {
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const std::size_t n = 6 * static_cast<std::size_t>(blocks);
    Problem problem{blocks, {}, std::vector<std::vector<double>>(n, std::vector<double>(n, 0.0))};
    auto fill = [&](int r, int c, double weight) {
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < 6; ++j) problem.a[6 * r + i][6 * c + j] = weight * unit(random);
    };
    for (int r = 0; r < blocks; ++r) {
        fill(r, r, 1.0);
        for (int i = 0; i < 6; ++i) problem.a[6 * r + i][6 * r + i] += 8.0;
        for (int c = r + 1; c < blocks; ++c)
            if (unit(random) < 2.0 * density - 1.0)
                fill(r, c, 1.0), fill(c, r, 1.0), problem.edges.push_back({r, c});
    }
    return problem;
}

void fill(BlockLu& matrix, const Problem& problem) {
    matrix.clear();
    auto copy = [&](double* to, int r, int c) {
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < 6; ++j) to[6 * i + j] = problem.a[6 * r + i][6 * c + j];
    };
    for (int b = 0; b < problem.blocks; ++b) copy(matrix.diagonal(b), b, b);
    for (std::size_t e = 0; e < problem.edges.size(); ++e) {
        const auto [first, second] = problem.edges[e];
        copy(matrix.forth(static_cast<int>(e)), first, second);
        copy(matrix.back(static_cast<int>(e)), second, first);
    }
}

void analyse(BlockLu& matrix, int blocks, const std::vector<BlockEdge>& edges) {
    const std::vector<int> sizes(blocks, 6);
    const std::vector<std::uint8_t> bodies(blocks, 0);
    matrix.analyse(sizes, edges, bodies);
}

void random_matrices_match_dense_elimination() {
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    double worst = 0.0;
    for (const double density : {0.0, 0.1, 0.4, 1.0})
        for (const int blocks : {1, 2, 5, 12}) {
            const Problem problem = random_problem(blocks, density, random);
            std::vector<double> right(6 * static_cast<std::size_t>(blocks));
            for (double& x : right) x = unit(random);
            BlockLu matrix;
            analyse(matrix, blocks, problem.edges);
            std::vector<double> first;
            for (int round = 0; round < 2; ++round) {  // refilled, it gives the same bits
                fill(matrix, problem);
                EXPECT(matrix.factor());
                std::vector<double> x = right;
                matrix.solve(x.data());
                if (round == 0) first = x;
                EXPECT(x == first);
            }
            const std::vector<double> reference = dense_solve(problem.a, right);
            for (std::size_t i = 0; i < reference.size(); ++i)
                worst = std::max(worst, std::abs(first[i] - reference[i]));
        }
    std::printf("block LU: largest difference to dense elimination %.2g\n", worst);
    EXPECT(worst <= 1e-14);
}

/// Bodies in trees and loops of rigid joints, some on the ground, with contacts stiff and not symmetric between others: no
/// joint may be eliminated while nothing holds it, or its pivot is its relief.
void rigid_joints_keep_their_digits() {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const auto pick = [&](int count) {
        return static_cast<int>(random() % static_cast<std::uint64_t>(count));
    };
    double worst = 0.0;
    for (int trial = 0; trial < 200; ++trial) {
        const int bodies = 2 + pick(10);
        struct Joint {
            int first, second, rows;  // second: −1 the ground
        };
        std::vector<Joint> joints;
        for (int b = 1; b < bodies; ++b) joints.push_back({pick(b), b, 1 + pick(5)});
        if (pick(2)) joints.push_back({pick(bodies), -1, 1 + pick(5)});
        if (bodies > 3 && pick(2)) joints.push_back({0, bodies - 1, 1});
        const int blocks = bodies + static_cast<int>(joints.size());
        Problem problem{blocks, {}, {}};
        const std::size_t n = 6 * static_cast<std::size_t>(blocks);
        problem.a.assign(n, std::vector<double>(n, 0.0));
        std::vector<int> sizes(bodies, 6);
        std::vector<std::uint8_t> is_constraint(bodies, 0);
        for (std::size_t i = 0; i < 6 * static_cast<std::size_t>(bodies); ++i) problem.a[i][i] = 1.0;
        for (int k = 0; k < bodies / 2; ++k) {  // contacts that stick
            const int one = pick(bodies), two = pick(bodies);
            if (one == two) continue;
            double row[2][6];
            for (auto& part : row)
                for (double& x : part) x = unit(random);
            const int at[2] = {one, two};
            for (int p = 0; p < 2; ++p)
                for (int q = 0; q < 2; ++q)
                    for (int i = 0; i < 6; ++i)
                        for (int j = 0; j < 6; ++j)
                            problem.a[6 * at[p] + i][6 * at[q] + j] += 1e3 * row[p][i] * row[q][j];
            problem.edges.push_back({std::min(one, two), std::max(one, two)});
        }
        for (std::size_t k = 0; k < joints.size(); ++k) {
            const int node = bodies + static_cast<int>(k);
            sizes.push_back(joints[k].rows), is_constraint.push_back(1);
            for (int i = 0; i < 6; ++i)
                problem.a[6 * node + i][6 * node + i] = i < joints[k].rows ? 1e-10 : 1.0;
            for (const int body : {joints[k].first, joints[k].second}) {
                if (body < 0) continue;
                for (int i = 0; i < joints[k].rows; ++i)
                    for (int a = 0; a < 6; ++a) {
                        const double g = unit(random);
                        problem.a[6 * body + a][6 * node + i] = -g;
                        problem.a[6 * node + i][6 * body + a] = g;
                    }
                problem.edges.push_back({body, node});
            }
        }
        std::sort(problem.edges.begin(), problem.edges.end(), [](const BlockEdge& a, const BlockEdge& b) {
            return std::pair{a.first, a.second} < std::pair{b.first, b.second};
        });
        problem.edges.erase(std::unique(problem.edges.begin(), problem.edges.end(),
                                        [](const BlockEdge& a, const BlockEdge& b) {
                                            return a.first == b.first && a.second == b.second;
                                        }),
                            problem.edges.end());
        BlockLu matrix;
        matrix.analyse(sizes, problem.edges, is_constraint);
        fill(matrix, problem);
        EXPECT(matrix.factor());
        std::vector<double> right(n, 0.0);
        for (int b = 0; b < bodies; ++b)
            for (int i = 0; i < 6; ++i) right[6 * b + i] = unit(random);
        std::vector<double> x = right;
        matrix.solve(x.data());
        const std::vector<double> reference = dense_solve(problem.a, right);
        double size = 0.0, off = 0.0;
        for (std::size_t i = 0; i < n; ++i)
            size = std::max(size, std::abs(reference[i])), off = std::max(off, std::abs(x[i] - reference[i]));
        worst = std::max(worst, off / size);
    }
    std::printf("block LU: largest difference beside rigid joints %.2g\n", worst);
    EXPECT(worst <= 1e-7);
}

/// A chain fills nothing in: its products grow with its length, not with its square.
void a_chain_costs_in_proportion() {
    auto operations = [](int blocks) {
        std::vector<BlockEdge> edges;
        for (int b = 0; b + 1 < blocks; ++b) edges.push_back({b, b + 1});
        BlockLu matrix;
        analyse(matrix, blocks, edges);
        return matrix.operations();
    };
    EXPECT(operations(1000) <= 10 * operations(100) + 20);
}

void a_matrix_without_inverse_is_refused() {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const double bad : {0.0, nan}) {
        BlockLu matrix;
        const std::vector<BlockEdge> edges{{0, 1}};
        analyse(matrix, 2, edges);
        matrix.clear();
        for (int i = 0; i < 6; ++i)
            matrix.diagonal(0)[7 * i] = 1.0, matrix.diagonal(1)[7 * i] = i ? 1.0 : bad;
        EXPECT(!matrix.factor());
    }
}

}  // namespace

int main() {
    random_matrices_match_dense_elimination();
    rigid_joints_keep_their_digits();
    a_chain_costs_in_proportion();
    a_matrix_without_inverse_is_refused();
    return report();
}
