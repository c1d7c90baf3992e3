// The variational rotation step: its equation, conservation, order, and the refusal of a body that is too fast.
#include "rigid/rotation.hpp"

#include "expect.hpp"
#include "rigid/rigid_state.hpp"

using namespace spook;

namespace {

constexpr Vec3 kInertia{0.9144, 1.098, 1.66};

Vec3 times(Vec3 a, Vec3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }

RigidBodySpec spinning(Vec3 angular_velocity, Vec3 inertia = kInertia) {
    RigidBodySpec spec;
    spec.mass = 1.0;
    spec.inertia = inertia;
    spec.orientation = {0.5, 0.5, -0.5, 0.5};
    spec.angular_velocity = angular_velocity;
    return spec;
}

/// The state after `seconds` with steps of h.
BodyState spun(const RigidBodySpec& spec, double seconds, double h) {
    const BodyConstants body = constants_of(spec);
    BodyState state = start_of(spec, body);
    for (int n = static_cast<int>(std::round(seconds / h)); n > 0; --n) EXPECT(integrate(body, h, state));
    return state;
}

void the_rate_solves_its_equation() {
    for (double h : {1e-6, 1e-3, 0.1, 0.4}) {
        for (const Vec3 p : {Vec3{1, 0.2, -0.3}, Vec3{1e-12, 0, 1e-13}, Vec3{0, 2, 0}, Vec3{0, 0, 0}}) {
            Vec3 w;
            EXPECT(rotation_rate(kInertia, h, p, w));
            const double c = std::sqrt(1.0 - 0.25 * h * h * dot(w, w));
            const Vec3 rest = c * times(kInertia, w) + 0.5 * h * cross(w, times(kInertia, w)) - p;
            EXPECT(norm(rest) <= 1e-15 * norm(p));
        }
    }
}

void the_rate_does_not_depend_on_the_unit_of_mass() {
    for (const Vec3 inertia : {kInertia, Vec3{2, 2, 2}})
        for (double h : {1e-6, 1e-3, 0.1, 0.4})
            for (const int exponent : {-1000, -700, -400, -260, 260, 400, 700, 1000}) {
                const double s = std::ldexp(1.0, exponent);
                Vec3 one, other;
                EXPECT(rotation_rate(inertia, h, {1, 0.2, -0.3}, one));
                EXPECT(rotation_rate(s * inertia, h, s * Vec3{1, 0.2, -0.3}, other));
                EXPECT(one.x == other.x && one.y == other.y && one.z == other.z);
                EXPECT(!rotation_rate(s * kInertia, 1.0, s * Vec3{0, 3, 0}, other));
            }
}

void equal_moments_have_a_closed_form() {
    Vec3 w;
    EXPECT(rotation_rate({2, 2, 2}, 0.3, {1, 2, 3}, w));
    const double c = std::sqrt(1.0 - 0.25 * 0.09 * dot(w, w));
    EXPECT_NEAR(norm(c * 2.0 * w - Vec3{1, 2, 3}), 0.0, 1e-15);
}

void a_body_too_fast_for_the_step_is_refused() {
    Vec3 w;
    EXPECT(!rotation_rate(kInertia, 1.0, {0, 3, 0}, w));
    EXPECT(!rotation_rate({1, 1, 1}, 1.0, {0, 1.01, 0}, w));
    EXPECT(rotation_rate({1, 1, 1}, 1.0, {0, 0.99, 0}, w));
    EXPECT(!rotation_rate(kInertia, 1.0, {0, std::nan(""), 0}, w));
}

void energy_of_a_tumbling_body_is_bounded() {
    const RigidBodySpec spec = spinning({0.01, 1.0, 0.01});
    const BodyConstants body = constants_of(spec);
    BodyState state = start_of(spec, body);
    const Vec3 momentum = state.angular_momentum;
    const double energy = dot(state.angular_velocity, momentum);
    for (int n = 0; n < 100000; ++n) {
        EXPECT(integrate(body, 0.1, state));
        EXPECT_NEAR(dot(state.angular_velocity, state.angular_momentum) / energy, 1.0, 1e-11);
    }
    EXPECT(state.angular_momentum.x == momentum.x && state.angular_momentum.y == momentum.y);
    const Quat q = state.turn;
    EXPECT_NEAR(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z, 1.0, 1e-15);
}

void the_step_is_of_second_order() {
    const RigidBodySpec spec = spinning({0.3, 1.0, -0.2});
    const Vec3 truth = spun(spec, 4.0, 1e-4).angular_velocity;
    const double coarse = norm(spun(spec, 4.0, 0.1).angular_velocity - truth);
    const double fine = norm(spun(spec, 4.0, 0.05).angular_velocity - truth);
    EXPECT_NEAR(coarse / fine, 4.0, 0.1);
}

void a_small_turn_keeps_its_digits() {
    const Quat q{1.0, 1e-20, 2e-20, -3e-20};
    const Mat3 r = rotation_less_one(q);
    EXPECT_NEAR(r(2, 1), 2e-20, 1e-35);
    EXPECT_NEAR(r(0, 2), 4e-20, 1e-35);
}

void a_kinematic_body_turns_at_its_rate() {
    RigidBodySpec spec = spinning({0, 0, 3});
    spec.motion = Motion::kinematic;
    spec.velocity = {1, 0, 0};
    const BodyState state = spun(spec, 2.0, 0.5);
    EXPECT_NEAR(2.0 * std::atan2(state.turn.z, state.turn.w) + 4.0 * std::acos(-1.0),
                6.0 + 4.0 * std::acos(-1.0), 1e-14);
    EXPECT_NEAR(state.displacement.x, 2.0, 1e-15);
}

}  // namespace

int main() {
    the_rate_solves_its_equation();
    the_rate_does_not_depend_on_the_unit_of_mass();
    equal_moments_have_a_closed_form();
    a_body_too_fast_for_the_step_is_refused();
    energy_of_a_tumbling_body_is_bounded();
    the_step_is_of_second_order();
    a_small_turn_keeps_its_digits();
    a_kinematic_body_turns_at_its_rate();
    return report();
}
