// Factors are kept for masses that stay, and no longer; rows side by side round as they would alone.
#include <random>
#include <vector>

#include "contacts/mass_factors.hpp"
#include "expect.hpp"

using namespace spook;

namespace {

Mat6 random_mass(std::mt19937& random) {
    std::uniform_real_distribution<double> number(-1.0, 1.0);
    Mat6 part{}, mass{};
    for (double& x : part) x = number(random);
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) {
            mass[6 * i + j] = i == j ? 1.0 : 0.0;
            for (int k = 0; k < 6; ++k) mass[6 * i + j] += part[6 * i + k] * part[6 * j + k];
        }
    return mass;
}

/// As many bodies as come, some with the mass they had, some with another.
void factors_are_those_of_the_masses(std::mt19937& random) {
    MassFactors factors;
    std::vector<Mat6> mass;
    for (int round = 0; round < 200; ++round) {
        const std::vector<Mat6> before = mass;
        mass.resize(random() % 12);
        for (std::size_t b = 0; b < mass.size(); ++b)
            if (b >= before.size() || random() % 3 == 0) mass[b] = random_mass(random);
        std::size_t told = 0, differ = 0;
        factors.find(mass, [&](std::size_t) { ++told; });
        for (std::size_t b = 0; b < mass.size(); ++b) {
            EXPECT(factors[b] == factor_six(mass[b]));
            differ += b >= before.size() || mass[b] != before[b];
        }
        EXPECT(told == differ);
    }
}

void rows_side_by_side_round_alike(std::mt19937& random) {
    std::uniform_real_distribution<double> number(-1.0, 1.0);
    for (int round = 0; round < 200; ++round) {
        const Mat6 factor = factor_six(random_mass(random));
        const int count = 1 + round % 6;
        Vec6 rows[6];
        double own[6];
        for (int i = 0; i < count; ++i)
            for (double& x : rows[i]) x = number(random);
        own_inertias(factor, rows, count, own);
        for (int i = 0; i < count; ++i) {
            Vec6 x = rows[i];
            solve_six(factor, x);
            EXPECT(own[i] == dot(rows[i], x));
        }
    }
}

}  // namespace

int main() {
    std::mt19937 random(4);
    factors_are_those_of_the_masses(random);
    rows_side_by_side_round_alike(random);
    return report();
}
