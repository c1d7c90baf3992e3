// What iterations store of a contact depends on what others have; what they do to it does not, nor on where it lies.
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "contacts/pgs_solver.hpp"
#include "expect.hpp"

using namespace spook;

namespace {

constexpr int bodies = 40;
enum class Given { one_by_one, announced, in_two_lots };

Vec3 any_vec(std::mt19937& random) {
    std::uniform_real_distribution<double> number(-1.0, 1.0);
    return {number(random), number(random), number(random)};
}

PgsContact between(int first, int second, std::mt19937& random) {
    PgsContact c;
    c.first = first, c.second = second;
    const Vec3 n = any_vec(random);
    c.normal = (1.0 / norm(n)) * n;
    const Vec3 t = cross(c.normal, any_vec(random));
    c.tangent = (1.0 / norm(t)) * t;
    c.across = cross(c.normal, c.tangent);
    c.first_arm = any_vec(random), c.second_arm = any_vec(random);
    return c;
}

/// Contacts of which `kinds` says what some have: friction (1), give (2), a surface that moves (4), an ellipse (8).
std::vector<PgsContact> contacts(unsigned kinds, std::mt19937& random) {
    std::vector<PgsContact> all;
    for (int k = 0; k < 120; ++k) {
        const int first = static_cast<int>(random() % bodies);
        PgsContact c = between(
            first, random() % 6 == 0 ? -1 : (first + 1 + static_cast<int>(random() % 5)) % bodies, random);
        const unsigned own = kinds & random();
        if (own & 1) c.friction = 0.5, c.impulse[1] = 0.01;
        if (own & 2) c.softness = 0.1;
        if (own & 4) c.right[1] = 0.2, c.right[2] = -0.1;
        if ((own & 8) && (own & 1)) c.anisotropic = true, c.tangent = 3.0 * c.tangent;
        c.impulse[0] = random() % 2 ? 0.05 : 0.0;
        all.push_back(c);
    }
    return all;
}

/// Velocities and impulses. `with_all`: another contact, far from these, has everything a contact can have, and a body that turns less about one axis.
std::vector<double> solved(const std::vector<PgsContact>& all, Given given, bool with_all,
                           FrictionModel model) {
    std::mt19937 random(9);
    MixedSystem system;
    Mat6 mass{};
    for (int b = 0; b < bodies + 2; ++b) {
        for (int i = 0; i < 6; ++i) mass[7 * i] = 1.0 + 0.2 * (i / 3) + 0.1 * (b % 3);
        if (with_all && b == bodies) mass[28] = 1.7;  // alike about every axis no longer
        system.mass.push_back(mass);
        mass = {};
        const Vec3 p = any_vec(random), l = any_vec(random);
        system.momentum.push_back({p.x, p.y, p.z, l.x, l.y, l.z});
    }
    std::vector<PgsContact> list = all;
    if (with_all) {
        PgsContact c = between(bodies, bodies + 1, random);
        c.friction = 0.5, c.softness = 0.1, c.right[1] = 0.3, c.anisotropic = true,
        c.tangent = 2.0 * c.tangent;
        list.insert(list.begin(), c);
    }
    PgsSolver solver;
    solver.start(system, model);
    for (const int b : {0, bodies})
        EXPECT(std::abs(system.mass[b][28] * solver.velocity(b)[4] - system.momentum[b][4]) < 1e-14);
    const std::size_t half = given == Given::in_two_lots ? list.size() / 2 : list.size();
    for (std::size_t from = 0; from < list.size(); from += half) {
        const std::size_t end = std::min(list.size(), from + half);
        if (given != Given::one_by_one) {
            for (std::size_t k = from; k < end; ++k) solver.announce(list[k].first, list[k].second);
            solver.arrange();
        }
        for (std::size_t k = from; k < end; ++k) EXPECT(solver.add(list[k]) == static_cast<int>(k));
    }
    solver.run(12, 0.0, 0.0, nullptr);
    const RowsResidual worst = solver.worst(1e9, 1e9);
    std::vector<double> out;
    for (int b = 0; b < bodies; ++b)
        for (const double v : solver.velocity(b)) out.push_back(v + 0.0);
    const int others = with_all ? 1 : 0;
    for (int k = others; k < static_cast<int>(list.size()); ++k)
        out.insert(out.end(), solver.impulse(k), solver.impulse(k) + 3);
    if (!with_all) out.push_back(worst.row), out.push_back(worst.residual);
    return out;
}

}  // namespace

int main() {
    std::mt19937 random(2);
    for (const FrictionModel model : {FrictionModel::cone, FrictionModel::box, FrictionModel::scaled_box})
        for (unsigned kinds = 0; kinds < 16; ++kinds)
            for (int round = 0; round < 4; ++round) {
                const std::vector<PgsContact> all = contacts(kinds, random);
                const std::vector<double> alone = solved(all, Given::one_by_one, false, model);
                EXPECT(solved(all, Given::announced, false, model) == alone);
                std::vector<double> beside = solved(all, Given::announced, true, model);
                EXPECT(std::equal(beside.begin(), beside.end(), alone.begin()));
                const std::vector<double> lots = solved(all, Given::in_two_lots, false, model),
                                          whole = solved(all, Given::in_two_lots, true, model);
                EXPECT(std::equal(whole.begin(), whole.end(), lots.begin()));
            }
    return report();
}
