// Newton's method on the cone against closed forms, enumeration and projected iterations; wedges, ties and NaN.
#include <limits>
#include <random>

#include "collision/shape.hpp"
#include "contacts/cone_newton.hpp"
#include "dense_problem.hpp"
#include "expect.hpp"
#include "linear/vec.hpp"

using namespace spook;

namespace {

struct Problem {
    MixedSystem system;
    std::vector<FrictionPoint> points;
};

/// A point of contact on `first` (and `second`, if it moves) with normal n, its arms, and friction mu.
void add_point(Problem& problem, int first, int second, Vec3 n, Vec3 first_arm, Vec3 second_arm, double mu,
               double softness = 0.0, double slip_softness = 0.0) {
    const Vec3 t = any_normal_to(n), axes[3] = {n, t, cross(n, t)};
    RowBlock block;
    block.size = 3;
    block.first = first;
    block.second = second;
    for (int i = 0; i < 3; ++i) {
        const Vec3 a = axes[i], one = cross(first_arm, a), two = cross(second_arm, a);
        block.first_jacobian[i] = {a.x, a.y, a.z, one.x, one.y, one.z};
        if (second >= 0) block.second_jacobian[i] = {-a.x, -a.y, -a.z, -two.x, -two.y, -two.z};
    }
    block.lower[0] = 0.0;
    block.is_contact = true;
    block.softness[0] = softness;
    block.softness[1] = block.softness[2] = slip_softness;
    problem.points.push_back({static_cast<int>(problem.system.rows.size()), mu, slip_softness, -1.0});
    problem.system.rows.push_back(block);
}

/// Rolling and torsional friction of the last point, and its own turning r.
void add_turning(Problem& problem, double rolling, double torsional, double right = 0.0) {
    RowBlock& block = problem.system.rows.back();
    const int at = static_cast<int>(problem.system.rows.size()) - 1, axes[3] = {1, 2, 0};
    for (int i = 0; i < 3; ++i)
        for (int a = 0; a < 3; ++a) {
            const double part = block.first_jacobian[axes[i]][a];
            block.first_jacobian[3 + i][3 + a] = part;
            if (block.second >= 0) block.second_jacobian[3 + i][3 + a] = -part;
        }
    block.right[3] = block.right[5] = right;
    block.size = 6;
    problem.points.push_back({at, rolling, 0.0, -1.0, 3, 2});
    problem.points.push_back({at, torsional, 0.0, -1.0, 5, 1});
}

/// How far the answer is from Coulomb's law and from Newton's, in units of the largest speed and impulse.
double broken_law(const Problem& problem) {
    const MixedSystem& s = problem.system;
    double worst = 0.0;
    std::vector<Vec6> missing = s.momentum;
    for (std::size_t b = 0; b < missing.size(); ++b)
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < 6; ++j) missing[b][i] -= s.mass[b][6 * i + j] * s.velocity[b][j];
    for (const RowBlock& block : s.rows)
        for (int i = 0; i < block.size; ++i)
            for (int a = 0; a < 6; ++a) {
                if (block.first >= 0)
                    missing[block.first][a] += block.first_jacobian[i][a] * block.multiplier[i];
                if (block.second >= 0)
                    missing[block.second][a] += block.second_jacobian[i][a] * block.multiplier[i];
            }
    for (const Vec6& part : missing)
        for (const double impulse : part) worst = std::max(worst, std::abs(impulse));
    for (const FrictionPoint& point : problem.points) {
        const RowBlock& block = s.rows[point.block];
        const double nu = block.multiplier[0], u = row_residual(block, 0, s.velocity);
        const int one = point.row, two = point.row + point.size - 1;
        const double b1 = block.multiplier[one], b2 = one == two ? 0.0 : block.multiplier[two];
        const double s1 = slip(block, point, one, s.velocity),
                     s2 = one == two ? 0.0 : slip(block, point, two, s.velocity);
        const double force = std::hypot(b1, b2), slide = std::hypot(s1, s2), bound = point.coefficient * nu;
        worst = std::max({worst, -nu, -u, nu > 0.0 ? std::min(nu, u) : 0.0, force - bound});
        if (bound > 0.0)
            worst = std::max(worst, std::min(slide, std::abs(b1 * s1 + b2 * s2 + bound * slide)));
        if (std::isnan(nu + u + force + slide)) return unbounded;
    }
    return worst;
}

void one_point_matches_its_closed_form() {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    int open = 0, stuck = 0, sliding = 0;
    for (int trial = 0; trial < 600; ++trial) {
        const double mass = std::exp(5.0 * unit(random)), mu = std::exp(2.0 * unit(random) - 1.0);
        const double soft = trial % 3 ? 0.0 : std::exp(3.0 * unit(random)) / mass;
        const double slip_soft = trial % 2 ? 0.0 : std::exp(3.0 * unit(random)) / mass;
        Problem problem;
        problem.system.mass.push_back(diagonal(mass, mass));
        const double v[3] = {unit(random), unit(random), unit(random)};
        problem.system.momentum.push_back({mass * v[0], mass * v[1], mass * v[2], 0.0, 0.0, 0.0});
        add_point(problem, 0, -1, {0, 0, 1}, {}, {}, mu, soft, slip_soft);
        ConeNewton newton;
        EXPECT(newton.solve(problem.system, problem.points).converged);

        const double nu = std::max(0.0, -v[2] / (1.0 / mass + soft)), speed = std::hypot(v[0], v[1]);
        const double grip = speed / (1.0 / mass + slip_soft), drag = std::min(mu * nu, grip) / mass;
        const Vec6& after = problem.system.velocity[0];
        EXPECT_NEAR(problem.system.rows[0].multiplier[0], nu, 1e-8 * mass);
        EXPECT_NEAR(after[0], v[0] - drag * v[0] / speed, 1e-8);
        EXPECT_NEAR(after[1], v[1] - drag * v[1] / speed, 1e-8);
        EXPECT_NEAR(after[2], v[2] + nu / mass, 1e-8);
        (nu == 0.0 ? open : grip < mu * nu ? stuck : sliding) += 1;
    }
    EXPECT(open > 100 && stuck > 50 && sliding > 50);
}

/// Rows with none, one or two bounds, and no friction: convex, so there is one answer.
void rows_with_bounds_match_enumeration() {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    int at_bounds = 0;
    for (int trial = 0; trial < 300; ++trial) {
        MixedSystem system;
        for (int b = 0; b < 3; ++b) {
            system.mass.push_back(diagonal(std::exp(2 * unit(random)), std::exp(2 * unit(random))));
            Vec6 p;
            for (double& x : p) x = unit(random);
            system.momentum.push_back(p);
        }
        for (int k = 0; k < 5; ++k) {
            RowBlock block;
            block.size = 1 + k % 2;
            block.first = k % 3;
            block.second = k == 3 ? -1 : (k + 1) % 3;
            for (int i = 0; i < block.size; ++i) {
                for (int a = 0; a < 6; ++a)
                    block.first_jacobian[i][a] = unit(random), block.second_jacobian[i][a] = unit(random);
                block.softness[i] = 1e-3;
                block.right[i] = unit(random);
                if (k > 0) block.lower[i] = k == 3 ? -0.1 : 0.0;
                if (k == 3) block.upper[i] = 0.1;
                if (k == 4) block.lower[i] = -unbounded, block.upper[i] = 0.0;
                block.multiplier[i] = trial % 2 ? unit(random) : 0.0;
            }
            system.rows.push_back(block);
        }
        ConeNewton newton;
        EXPECT(newton.solve(system, {}).converged);
        const std::vector<double> reference = enumerate(flatten(system));
        std::size_t r = 0;
        for (const RowBlock& block : system.rows)
            for (int i = 0; i < block.size; ++i, ++r) {
                if (r >= reference.size()) continue;
                EXPECT_NEAR(block.multiplier[i], reference[r], 1e-8);
                at_bounds += reference[r] == block.lower[i] || reference[r] == block.upper[i];
            }
        EXPECT(r == reference.size());
    }
    EXPECT(at_bounds > 100);
}

/// `layers` of bodies, each on three points of the one below, pushed about.
Problem tower(int layers, std::mt19937_64& random, double push, double ratio = 1.0, double softness = 0.0,
              bool turning = false) {
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    Problem problem;
    double mass = 1.0;
    for (int b = 0; b < layers; ++b, mass *= ratio) {
        problem.system.mass.push_back(diagonal(mass, 0.1 * mass));
        Vec6 p{};
        for (double& x : p) x = mass * push * unit(random);
        p[2] -= mass;
        problem.system.momentum.push_back(p);
        for (int k = 0; k < 3; ++k) {
            const Vec3 arm{0.5 * std::cos(2.1 * k), 0.5 * std::sin(2.1 * k), -0.5};
            const Vec3 tilt{0.2 * push * unit(random), 0.2 * push * unit(random), 1.0};
            add_point(problem, b, b - 1, (1.0 / norm(tilt)) * tilt, arm, arm + Vec3{0, 0, 1},
                      0.3 + 0.2 * unit(random), softness, softness);
            if (turning) add_turning(problem, 0.05 + 0.04 * unit(random), 0.02, 0.1 * push * unit(random));
        }
    }
    return problem;
}

void coulombs_law_holds_in_towers(bool turning) {
    std::mt19937_64 random(29);
    int found = 0, iterations = 0;
    double worst = 0.0;
    for (int trial = 0; trial < 120; ++trial) {
        Problem problem = tower(1 + trial % 12, random, trial % 3 ? 0.5 : 0.05, 1.0, 0.0, turning);
        ConeNewton newton;
        const ConeReport report = newton.solve(problem.system, problem.points);
        iterations += report.iterations;
        if (!report.converged) continue;
        ++found;
        worst = std::max(worst, broken_law(problem));
    }
    std::printf("towers: %d of 120 found, law broken by %.2g at most, %.1f systems factored each\n", found,
                worst, iterations / 120.0);
    EXPECT(found >= (turning ? 98 : 108));  // the rest is left to pivoting
    EXPECT(worst <= 1e-7);
}

/// The same answer by projected Gauss–Seidel over dense rows, where rows give way and friction is small: one answer.
void soft_towers_match_projected_gauss_seidel() {
    std::mt19937_64 random(31);
    for (int trial = 0; trial < 10; ++trial) {
        Problem problem = tower(3, random, 0.5, 1.0, 0.05);
        for (FrictionPoint& point : problem.points) point.coefficient *= 0.3;
        const Flat flat = flatten(problem.system);
        const std::size_t n = flat.q.size();
        std::vector<double> z(n, 0.0);
        auto w = [&](std::size_t r) {
            double sum = flat.q[r];
            for (std::size_t c = 0; c < n; ++c) sum += flat.s[r][c] * z[c];
            return sum;
        };
        for (int iteration = 0; iteration < 20'000; ++iteration)
            for (std::size_t r = 0; r < n; r += 3) {
                z[r] = std::max(0.0, z[r] - w(r) / flat.s[r][r]);
                const double scale = flat.s[r + 1][r + 1] + flat.s[r + 2][r + 2];
                const double w1 = w(r + 1), w2 = w(r + 2);
                const double t1 = z[r + 1] - w1 / scale, t2 = z[r + 2] - w2 / scale;
                const double bound = problem.points[r / 3].coefficient * z[r], reach = std::hypot(t1, t2);
                const double shrink = reach > bound ? bound / reach : 1.0;
                z[r + 1] = shrink * t1, z[r + 2] = shrink * t2;
            }
        ConeNewton newton;
        EXPECT(newton.solve(problem.system, problem.points).converged);
        for (std::size_t r = 0; r < n; ++r)
            EXPECT_NEAR(problem.system.rows[r / 3].multiplier[r % 3], z[r], 1e-8);
    }
}

/// However tall, and whatever stands on what: loads are sums of weights.
void a_tower_carries_what_stands_on_it() {
    std::mt19937_64 random(1);
    for (const double ratio : {1.0, 10.0, 0.1}) {
        const int layers = ratio == 1.0 ? 500 : 7;
        Problem problem = tower(layers, random, 0.0, ratio);
        ConeNewton newton;
        EXPECT(newton.solve(problem.system, problem.points).converged);
        double above = 0.0, worst = 0.0;
        for (int b = layers; b-- > 0;) {
            above += problem.system.mass[b][0];
            double load = 0.0;
            for (int k = 0; k < 3; ++k) load += problem.system.rows[3 * b + k].multiplier[0];
            worst = std::max(worst, std::abs(load - above) / above);
        }
        EXPECT(worst <= 1e-8);
    }
}

/// Four rigid corners on a floor: one load too many. Equal corners carry equal parts.
void redundant_loads_are_shared() {
    Problem problem;
    problem.system.mass.push_back(diagonal(2.0, 0.3));
    problem.system.momentum.push_back({0, 0, -1.0, 0, 0, 0});
    for (int corner = 0; corner < 4; ++corner)
        add_point(problem, 0, -1, {0, 0, 1}, {corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5, -0.5}, {},
                  0.5);
    ConeNewton newton;
    EXPECT(newton.solve(problem.system, problem.points).converged);
    for (const RowBlock& block : problem.system.rows) EXPECT_NEAR(block.multiplier[0], 0.25, 1e-9);
}

/// Once found, an answer is its own start: a second search ends at once, where it began.
void an_answer_is_its_own_start() {
    std::mt19937_64 random(2);
    Problem problem = tower(6, random, 0.0);
    ConeNewton newton;
    EXPECT(newton.solve(problem.system, problem.points).iterations > 2);
    const MixedSystem found = problem.system;
    EXPECT(newton.solve(problem.system, problem.points).iterations <= 1);
    for (std::size_t b = 0; b < found.velocity.size(); ++b)
        for (int a = 0; a < 6; ++a) EXPECT_NEAR(problem.system.velocity[b][a], found.velocity[b][a], 1e-11);
}

/// Nor does it matter where the search begins, or what the solver did before.
void a_wrong_start_leads_to_the_same_velocities() {
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    Problem problem = tower(5, random, 0.5, 1.0, 0.05);
    const Problem cold = problem;
    ConeNewton newton, fresh;
    EXPECT(fresh.solve(problem.system, problem.points).converged);
    for (int trial = 0; trial < 20; ++trial) {
        Problem warm = cold;
        for (RowBlock& block : warm.system.rows)
            for (int i = 0; i < 3; ++i) block.multiplier[i] = 10.0 * unit(random);
        EXPECT(newton.solve(warm.system, warm.points).converged);
        for (std::size_t b = 0; b < warm.system.velocity.size(); ++b)
            for (int a = 0; a < 6; ++a)
                EXPECT_NEAR(warm.system.velocity[b][a], problem.system.velocity[b][a], 1e-7);
    }
    Problem again = cold;
    newton.solve(again.system, again.points);
    EXPECT(again.system.velocity == problem.system.velocity);
}

/// Units of mass and speed that are powers of four change no mantissa.
void it_knows_no_units() {
    std::mt19937_64 random(13);
    Problem here = tower(8, random, 0.5), there = here;
    const double mass = 0x1p20, speed = 0x1p-10;
    for (Mat6& m : there.system.mass)
        for (double& x : m) x *= mass;
    for (Vec6& p : there.system.momentum)
        for (double& x : p) x *= mass * speed;
    ConeNewton one, two;
    one.solve(here.system, here.points);
    two.solve(there.system, there.points);
    for (std::size_t b = 0; b < here.system.velocity.size(); ++b)
        for (int a = 0; a < 6; ++a) EXPECT(there.system.velocity[b][a] == speed * here.system.velocity[b][a]);
}

void without_friction_tangents_carry_nothing() {
    std::mt19937_64 random(17);
    Problem problem = tower(3, random, 0.3, 1.0, 1e-3);
    for (FrictionPoint& point : problem.points) point.coefficient = 0.0;
    for (RowBlock& block : problem.system.rows) block.multiplier[1] = 1.0;
    ConeNewton newton;
    EXPECT(newton.solve(problem.system, problem.points).converged);
    EXPECT(broken_law(problem) <= 1e-8);
    for (const RowBlock& block : problem.system.rows)
        EXPECT(block.multiplier[1] == 0.0 && block.multiplier[2] == 0.0);
}

/// What has no answer is said to have none, within a bounded number of systems, and nothing becomes infinite.
void the_impossible_is_said() {
    Problem squeezed;  // two walls that close in on a body from both sides
    squeezed.system.mass.push_back(diagonal(1.0, 1.0));
    squeezed.system.momentum.push_back({});
    for (const double side : {1.0, -1.0}) {
        add_point(squeezed, 0, -1, {side, 0, 0}, {}, {}, 0.5);
        squeezed.system.rows.back().right[0] = 1.0;
    }
    ConeNewton newton;
    const ConeReport report = newton.solve(squeezed.system, squeezed.points);
    EXPECT(!report.converged && report.iterations <= newton.max_iterations);
    EXPECT(report.residual > 0.1);
    for (const double v : squeezed.system.velocity[0]) EXPECT(std::isfinite(v));

    std::mt19937_64 random(5);
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), unbounded}) {
        Problem broken = tower(3, random, 0.1);
        broken.system.momentum[1][2] = bad;
        EXPECT(!newton.solve(broken.system, broken.points).converged);
        broken = tower(3, random, 0.1);
        broken.system.rows[4].first_jacobian[0][1] = bad;
        EXPECT(!newton.solve(broken.system, broken.points).converged);
    }
    Problem after = tower(3, random, 0.1);  // and it is none the worse for it
    EXPECT(newton.solve(after.system, after.points).converged);
}

}  // namespace

int main() {
    one_point_matches_its_closed_form();
    rows_with_bounds_match_enumeration();
    for (const bool turning : {false, true}) coulombs_law_holds_in_towers(turning);
    soft_towers_match_projected_gauss_seidel();
    a_tower_carries_what_stands_on_it();
    redundant_loads_are_shared();
    an_answer_is_its_own_start();
    a_wrong_start_leads_to_the_same_velocities();
    it_knows_no_units();
    without_friction_tangents_carry_nothing();
    the_impossible_is_said();
    return report();
}
