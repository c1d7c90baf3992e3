// Block LU against dense Gauss elimination, on random patterns whose values are not symmetric.
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
            matrix.analyse(blocks, problem.edges);
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

/// A chain fills nothing in: its products grow with its length, not with its square.
void a_chain_costs_in_proportion() {
    auto operations = [](int blocks) {
        std::vector<BlockEdge> edges;
        for (int b = 0; b + 1 < blocks; ++b) edges.push_back({b, b + 1});
        BlockLu matrix;
        matrix.analyse(blocks, edges);
        return matrix.operations();
    };
    EXPECT(operations(1000) <= 10 * operations(100) + 20);
}

void a_matrix_without_inverse_is_refused() {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const double bad : {0.0, nan}) {
        BlockLu matrix;
        const std::vector<BlockEdge> edges{{0, 1}};
        matrix.analyse(2, edges);
        matrix.clear();
        for (int i = 0; i < 6; ++i)
            matrix.diagonal(0)[7 * i] = 1.0, matrix.diagonal(1)[7 * i] = i ? 1.0 : bad;
        EXPECT(!matrix.factor());
    }
}

}  // namespace

int main() {
    random_matrices_match_dense_elimination();
    a_chain_costs_in_proportion();
    a_matrix_without_inverse_is_refused();
    return report();
}
