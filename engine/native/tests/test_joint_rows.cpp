// The rows of every joint: Jacobians are the derivatives of violations, and reactions are equal and opposite.
#include "rigid/joint_rows.hpp"

#include <random>

#include "expect.hpp"

using namespace spook;

namespace {

std::mt19937 generator(3);
double random_number() { return std::uniform_real_distribution<double>(-1.0, 1.0)(generator); }
Vec3 random_vector() { return {random_number(), random_number(), random_number()}; }

const JointKind kKinds[] = {JointKind::distance,      JointKind::lock,        JointKind::ball,
                            JointKind::hinge,         JointKind::prismatic,   JointKind::universal,
                            JointKind::point_on_line, JointKind::cylindrical, JointKind::planar};

struct Pair {
    RigidBodySpec specs[2];
    BodyConstants bodies[2];
    BodyState states[2];
    JointConstants joint;
};

/// Two bodies somewhere, moved off their start by about `disturbance`.
Pair disturbed(JointKind kind, double disturbance) {
    Pair pair;
    for (int i = 0; i < 2; ++i) {
        RigidBodySpec& spec = pair.specs[i];
        spec.mass = 1.0;
        spec.inertia = {1.0, 1.3, 1.7};
        spec.position = random_vector();
        spec.orientation = unit(unit(unit(Quat{1.0, 0.3 * random_number(), 0.2, 0.1})));
        pair.bodies[i] = constants_of(spec);
        BodyState& state = pair.states[i] = start_of(spec, pair.bodies[i]);
        displace(pair.bodies[i], 1.0, disturbance * random_vector(), disturbance * random_vector(), state);
        state.velocity = random_vector();
        state.angular_velocity = random_vector();
    }
    JointSpec spec;
    spec.kind = kind;
    spec.first_point = spec.second_point = random_vector();
    if (kind == JointKind::distance) spec.second_point = random_vector();
    spec.rest_length = norm(spec.second_point - spec.first_point);
    const Vec3 a = (1.0 / std::sqrt(14.0)) * Vec3{1, 2, 3}, b = (1.0 / std::sqrt(5.0)) * Vec3{2, -1, 0};
    spec.axes = {a, b, cross(a, b)};
    pair.joint = constants_of(spec, &pair.specs[0].position, &pair.specs[1].position);
    return pair;
}

struct Rows {
    double first[36] = {}, second[36] = {};
    JointRows rows{first, second, {}, {}};
    Vec3 first_reach, second_reach;

    explicit Rows(const Pair& pair) {
        assemble_joint(pair.joint, pair.states[0], pair.states[1], rows, first_reach, second_reach);
    }
};

Pair moved(Pair pair, double h) {
    for (int i = 0; i < 2; ++i) {
        const Vec3 w = pair.states[i].angular_velocity;
        displace(pair.bodies[i], h, pair.states[i].velocity, w, pair.states[i]);
        pair.states[i].angular_velocity = w;
    }
    return pair;
}

double row_rate(const double* row, const BodyState& state) {
    return dot({row[0], row[1], row[2]}, state.velocity) +
           dot({row[3], row[4], row[5]}, state.angular_velocity);
}

void rates_are_derivatives_of_violations() {
    for (JointKind kind : kKinds)
        for (int round = 0; round < 20; ++round) {
            const Pair pair = disturbed(kind, 0.5);
            const Rows here(pair), before(moved(pair, -1e-5)), after(moved(pair, 1e-5));
            for (int k = 0; k < pair.joint.rows; ++k) {
                const double slope = (after.rows.violation[k] - before.rows.violation[k]) / 2e-5;
                EXPECT_NEAR(here.rows.rate[k], slope, 1e-8);
                const double product = row_rate(here.first + 6 * k, pair.states[0]) +
                                       row_rate(here.second + 6 * k, pair.states[1]);
                EXPECT_NEAR(product, here.rows.rate[k], 1e-13);
            }
        }
}

void reactions_leave_momentum_and_angular_momentum_alone() {
    for (JointKind kind : kKinds) {
        const Pair pair = disturbed(kind, 0.5);
        const Rows rows(pair);
        const Vec3 x[2] = {position(pair.bodies[0], pair.states[0]),
                           position(pair.bodies[1], pair.states[1])};
        for (int k = 0; k < pair.joint.rows; ++k) {
            const double *a = rows.first + 6 * k, *b = rows.second + 6 * k;
            const Vec3 f[2] = {{a[0], a[1], a[2]}, {b[0], b[1], b[2]}},
                       t[2] = {{a[3], a[4], a[5]}, {b[3], b[4], b[5]}};
            EXPECT_NEAR(norm(f[0] + f[1]), 0.0, 1e-15);
            EXPECT_NEAR(norm(cross(x[0], f[0]) + t[0] + cross(x[1], f[1]) + t[1]), 0.0, 1e-14);
        }
    }
}

void nothing_is_violated_at_the_start() {
    for (JointKind kind : kKinds) {
        const Pair pair = disturbed(kind, 0.0);
        const Rows rows(pair);
        for (int k = 0; k < pair.joint.rows; ++k) EXPECT(rows.rows.violation[k] == 0.0);
    }
}

void tiny_violations_keep_their_digits_far_from_the_origin() {
    Pair pair = disturbed(JointKind::lock, 0.0);
    pair.bodies[0].start += Vec3{1e6, 0, 0};
    pair.states[1].displacement = {1e-18, -2e-18, 3e-18};
    const Rows rows(pair);
    double squares = 0.0;
    for (int k = 0; k < 3; ++k) squares += rows.rows.violation[k] * rows.rows.violation[k];
    EXPECT_NEAR(squares / 14e-36, 1.0, 1e-14);
}

void free_motions_violate_nothing() {
    // Turn the second body about, or move it along, the joint's axis: only the free coordinate changes.
    for (JointKind kind : {JointKind::hinge, JointKind::prismatic}) {
        Pair pair = disturbed(kind, 0.0);
        const Vec3 axis = pair.joint.axes[0];
        if (kind == JointKind::hinge) {
            displace(pair.bodies[1], 1.0, {}, 2.0 * axis, pair.states[1]);
            const Vec3 arm = pair.joint.second_arm;
            pair.states[1].displacement = -1.0 * (pair.states[1].turn_less_one * arm);
        } else {
            pair.states[1].displacement = 2.0 * axis;
        }
        const Rows rows(pair);
        for (int k = 0; k < pair.joint.rows; ++k) EXPECT_NEAR(rows.rows.violation[k], 0.0, 1e-14);
        const AxialRow row = axial_row(pair.joint, pair.states[0], pair.states[1]);
        EXPECT_NEAR(row.coordinate, 2.0, 1e-14);
        EXPECT_NEAR(row.rate, row_rate(row.first, pair.states[0]) + row_rate(row.second, pair.states[1]),
                    1e-14);
    }
}

}  // namespace

int main() {
    rates_are_derivatives_of_violations();
    reactions_leave_momentum_and_angular_momentum_alone();
    nothing_is_violated_at_the_start();
    tiny_violations_keep_their_digits_far_from_the_origin();
    free_motions_violate_nothing();
    return report();
}
