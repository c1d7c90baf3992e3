// The first hour in the core, as CONTRIBUTING tells it: a joint, a solver and a shape of one's own, a few lines each, and the
// number each is held to.
#include <algorithm>
#include <cmath>
#include <vector>

#include "collision/narrow_phase.hpp"
#include "contacts/contact_islands.hpp"
#include "contacts/mass_factors.hpp"
#include "expect.hpp"
#include "linear/regularisation.hpp"

using namespace spook;

namespace {

constexpr double h = 1.0 / 60.0, gravity = 10.0;

Mat6 ball(double mass) {
    Mat6 m{};
    for (int i = 0; i < 6; ++i) m[7 * i] = i < 3 ? mass : 0.4 * mass;
    return m;
}

// A joint: a violation g, its Jacobian G, and the coefficients of a SPOOK row. This one, a rope over a pulley, keeps the sum of
// the heights of two bodies: g = z₁ + z₂ − s, G = (0 0 1 0 0 0 | 0 0 1 0 0 0).
RowBlock pulley(double violation, double rate, double compliance, double damping) {
    const Regularisation row = regularise(compliance, damping, h);
    RowBlock block;
    block.first = 0, block.second = 1;
    block.first_jacobian[0] = block.second_jacobian[0] = {0.0, 0.0, 1.0, 0.0, 0.0, 0.0};
    block.softness[0] = row.softness;
    block.right[0] = -row.violation_gain * violation + row.velocity_gain * rate;
    return block;
}

/// Rows for the next step of two bodies that hang on it.
MixedSystem hanging(const double* mass, const double* z, const double* v) {
    MixedSystem system;
    for (int i = 0; i < 2; ++i) {
        system.mass.push_back(ball(mass[i]));
        system.momentum.push_back({0.0, 0.0, mass[i] * (v[i] - h * gravity), 0.0, 0.0, 0.0});
    }
    system.velocity.resize(2);
    system.rows.push_back(pulley(z[0] + z[1], v[0] + v[1], 0.0, 2.0 * h));
    return system;
}

// A solver: velocities and multipliers of one island. This one is projected Gauss-Seidel without anything: row by row, each
// multiplier to where its own row holds, between its bounds.
FrictionReport row_by_row(MixedSystem& system, std::vector<FrictionPoint>&, DirectSolver&) {
    MassFactors mass;
    mass.find(system.mass);
    system.velocity = system.momentum;
    for (std::size_t b = 0; b < system.mass.size(); ++b) solve_six(mass[b], system.velocity[b]);
    const auto push = [&](int body, Vec6 row, double impulse) {
        if (body < 0) return;
        solve_six(mass[body], row);
        for (int i = 0; i < 6; ++i) system.velocity[body][i] += impulse * row[i];
    };
    FrictionReport report;
    for (; report.pgs_iterations < 2000; ++report.pgs_iterations)
        for (RowBlock& block : system.rows)
            for (int i = 0; i < block.size; ++i) {
                const double before = block.multiplier[i], own = own_inertia(system, block, i);
                const double wanted = before - row_residual(block, i, system.velocity) / own;
                block.multiplier[i] = std::clamp(wanted, block.lower[i], block.upper[i]);
                push(block.first, block.first_jacobian[i], block.multiplier[i] - before);
                push(block.second, block.second_jacobian[i], block.multiplier[i] - before);
            }
    return report;
}

// A shape: where it reaches, and where it touches. This one is an ellipsoid with these half axes, m, in its own axes.
Vec3 scaled(Vec3 by, Vec3 v) { return {by.x * v.x, by.y * v.y, by.z * v.z}; }

Vec3 reach(Vec3 half, const Pose& at, Vec3 way) {
    const Vec3 across = scaled(half, local(at.rotation, way));
    return apply(at, (1.0 / norm(across)) * scaled(half, across));
}

Manifold ellipsoid_plane(Vec3 half, const Pose& at, const Primitive& plane, const Pose& at_plane,
                         double margin) {
    Manifold manifold;
    const Vec3 normal = at_plane.rotation * plane.normal, lowest = reach(half, at, -1.0 * normal);
    const double gap = dot(normal, lowest - at_plane.position);
    if (gap <= margin) manifold.add(lowest - 0.5 * gap * normal, normal, gap, 0);
    return manifold;
}

FrictionReport directly(MixedSystem& system, std::vector<FrictionPoint>& points, DirectSolver& solver) {
    return solve_friction_direct(system, points, FrictionModel::cone, solver);
}

/// Atwood's machine: the heavier body falls with g (m₁ − m₂)/(m₁ + m₂), and the rope keeps its length.
void the_pulley_is_atwoods_machine() {
    const double mass[] = {3.0, 2.0};
    for (const IslandSolver::Solve& solve :
         {IslandSolver::Solve(row_by_row), IslandSolver::Solve(directly)}) {
        double z[] = {0.0, 0.0}, v[] = {0.0, 0.0};
        IslandSolver islands;
        std::vector<FrictionPoint> none;
        for (int step = 0; step < 60; ++step) {
            MixedSystem system = hanging(mass, z, v);
            islands.run(system, none, solve);
            for (int i = 0; i < 2; ++i) v[i] = system.velocity[i][2], z[i] += h * v[i];
        }
        EXPECT_NEAR(v[0], -gravity * (mass[0] - mass[1]) / (mass[0] + mass[1]), 1e-12);
        EXPECT_NEAR(z[0] + z[1], 0.0, 1e-14);
    }
}

/// Three bodies on top of each other, which push and never pull: the lowest rests, the second is hit and rises off it.
void the_solver_agrees_with_the_direct_one() {
    MixedSystem system;
    for (int i = 0; i < 3; ++i) {
        system.mass.push_back(ball(1.0 + i));
        system.momentum.push_back({0.0, 0.0, (1.0 + i) * (i == 1 ? 2.0 : -1.0), 0.0, 0.0, 0.0});
    }
    system.velocity.resize(3);
    for (int i = 0; i < 3; ++i) {  // each against the next, the last against the ground
        RowBlock block;
        block.first = i, block.second = i < 2 ? i + 1 : -1;
        block.first_jacobian[0] = {0.0, 0.0, 1.0, 0.0, 0.0, 0.0};
        if (i < 2) block.second_jacobian[0] = {0.0, 0.0, -1.0, 0.0, 0.0, 0.0};
        block.lower[0] = 0.0;  // it pushes
        system.rows.push_back(block);
    }
    MixedSystem other = system;
    std::vector<FrictionPoint> none;
    IslandSolver().run(system, none, row_by_row);
    IslandSolver().run(other, none, directly);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(system.velocity[i][2], other.velocity[i][2], 1e-12);
    EXPECT_NEAR(system.velocity[2][2], 0.0, 1e-12);
    EXPECT_NEAR(system.velocity[1][2], (1.0 * -1.0 + 2.0 * 2.0) / 3.0, 1e-12);
    EXPECT(system.rows[1].multiplier[0] == 0.0);
}

/// A rate that the row is not to have goes by 4θ/(1 + 4θ) a step, θ = τ/h = 2.
void its_damping_is_that_of_the_row() {
    const double mass[] = {3.0, 2.0}, z[] = {0.0, 0.0}, v[] = {0.5, 0.0};
    MixedSystem system = hanging(mass, z, v);
    std::vector<FrictionPoint> none;
    IslandSolver().run(system, none, directly);
    EXPECT_NEAR(system.velocity[0][2] + system.velocity[1][2], 0.5 * 8.0 / 9.0, 1e-14);
}

/// A ball where its half axes are equal. Else its lowest point is on the surface, Σ (xᵢ/aᵢ)² = 1, whose gradient there is along the
/// plane's normal, and what is further than the margin does not touch.
void the_ellipsoid_touches_where_its_surface_is_level() {
    const Primitive plane = Primitive::plane({0.36, -0.48, 0.8});
    const Pose still, at{{0.3, 0.2, 0.6}, rotation(Quat{0.7, 0.5, -0.5, 0.1})};
    const Manifold round = ellipsoid_plane({0.5, 0.5, 0.5}, at, plane, still, 0.1),
                   ball = collide(Primitive::sphere(0.5), at, plane, still, 0.1);
    EXPECT(round.count == 1 && ball.count == 1);
    EXPECT_NEAR(round.points[0].gap, ball.points[0].gap, 1e-15);
    EXPECT_NEAR(norm(round.points[0].position - ball.points[0].position), 0.0, 1e-15);

    const Vec3 half{0.4, 0.7, 0.2};
    const Manifold touch = ellipsoid_plane(half, at, plane, still, 1.0);
    EXPECT(touch.count == 1);
    const ContactPoint& point = touch.points[0];
    const Vec3 x = local(at.rotation, point.position + 0.5 * point.gap * point.normal - at.position),
               over = {x.x / half.x, x.y / half.y, x.z / half.z},
               gradient = at.rotation * Vec3{over.x / half.x, over.y / half.y, over.z / half.z};
    EXPECT_NEAR(dot(over, over), 1.0, 1e-14);
    EXPECT_NEAR(norm(cross(gradient, point.normal)), 0.0, 1e-14);
    EXPECT(dot(gradient, point.normal) < 0.0);
    EXPECT(ellipsoid_plane(half, at, plane, still, point.gap - 1e-9).count == 0);
}

}  // namespace

int main() {
    the_ellipsoid_touches_where_its_surface_is_level();
    its_damping_is_that_of_the_row();
    the_pulley_is_atwoods_machine();
    the_solver_agrees_with_the_direct_one();
    return report();
}
