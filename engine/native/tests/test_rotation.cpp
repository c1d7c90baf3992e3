// The turn of a free body: Euler's equations by small steps of Runge and Kutta, what is kept, and steady spins of any rate.
#include "collision/rotation.hpp"

#include <limits>

#include "expect.hpp"
#include "rigid/rigid_state.hpp"

using namespace spook;

namespace {

constexpr Vec3 kInertia{0.9144, 1.098, 1.66};

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
    for (int n = static_cast<int>(std::round(seconds / h)); n > 0; --n) integrate(body, h, state);
    return state;
}

Quat plus(Quat a, double s, Quat b) { return {a.w + s * b.w, a.x + s * b.x, a.y + s * b.y, a.z + s * b.z}; }

double apart(Quat a, Quat b) {
    const Quat d = plus(a, -1.0, b);
    return std::sqrt(d.w * d.w + d.x * d.x + d.y * d.y + d.z * d.z);
}

/// q' = ½ q (I⁻¹ Rᵀ p) by the classical Runge-Kutta method.
Quat integrated(Vec3 moments, double h, Vec3 p, int steps) {
    const auto slope = [&](Quat q) {
        const Vec3 l = transposed_times(rotation(q), p);
        return q * Quat{0.0, 0.5 * l.x / moments.x, 0.5 * l.y / moments.y, 0.5 * l.z / moments.z};
    };
    Quat q;
    const double t = h / steps;
    for (int n = 0; n < steps; ++n) {
        const Quat a = slope(q), b = slope(plus(q, 0.5 * t, a)), c = slope(plus(q, 0.5 * t, b)),
                   d = slope(plus(q, t, c));
        q = plus(plus(plus(plus(q, t / 6, a), t / 3, b), t / 3, c), t / 6, d);
    }
    return q;
}

constexpr Vec3 kBodies[] = {kInertia,
                            {1.66, 0.9144, 1.098},
                            {1.098, 1.66, 0.9144},
                            {1.66, 1.098, 0.9144},
                            {2, 2, 3},
                            {3, 2, 2},
                            {2, 3, 2},
                            {1, 1, 1},
                            {1, 1.01, 0.02},
                            {1, 1 + 1e-9, 1.5},
                            {1, 2, 3}};

void the_turn_solves_eulers_equations() {
    for (const Vec3 moments : kBodies)
        for (const Vec3 p :
             {Vec3{1, 0.2, -0.3}, Vec3{0.1, 2, 0.1}, Vec3{0.4, -0.1, 1.5}, Vec3{1e-9, 1, 1e-8}})
            for (const double h : {1e-6, 1e-3, 0.05, -0.05, 0.4, 2.0}) {
                const double rate = norm({p.x / moments.x, p.y / moments.y, p.z / moments.z});
                const int steps = 20 + static_cast<int>(2000 * std::fabs(h) * rate);
                EXPECT_NEAR(apart(FreeRotor(moments).turn(h, p), integrated(moments, h, p, steps)), 0.0,
                            2e-12);
            }
}

void momentum_and_energy_are_kept() {
    for (const Vec3 moments : kBodies)
        for (const double h : {1e-3, 0.1, 1.0, 30.0, 900.0}) {
            const Vec3 p{0.3, -0.2, 0.9}, end = transposed_times(rotation(FreeRotor(moments).turn(h, p)), p);
            const auto energy = [&](Vec3 l) {
                return l.x * l.x / moments.x + l.y * l.y / moments.y + l.z * l.z / moments.z;
            };
            EXPECT_NEAR(norm(end) / norm(p), 1.0, 1e-15 * (10.0 + h));
            EXPECT_NEAR(energy(end) / energy(p), 1.0, 4e-15 * (1.0 + h / std::fmin(moments.y, moments.z)));
        }
}

/// About each axis, to the digits that the angle itself has.
void a_steady_spin_turns_by_its_rate_however_fast() {
    for (const Vec3 moments : kBodies)
        for (int axis = 0; axis < 3; ++axis)
            for (const double angle : {1e-9, 0.01, 0.99, 1.01, 3.2, 100.0, 999.0, 1001.0, 1e6}) {
                Vec3 p;
                p[axis] = moments[axis] * angle / 0.25;
                const Quat q = FreeRotor(moments).turn(0.25, p);
                const Vec3 e{q.x, q.y, q.z};
                EXPECT_NEAR(q.w, std::cos(0.5 * angle), 1e-14 * (1.0 + angle));
                EXPECT_NEAR(e[axis], std::sin(0.5 * angle), 1e-14 * (1.0 + angle));
                EXPECT(e[(axis + 1) % 3] == 0.0 && e[(axis + 2) % 3] == 0.0);
            }
}

void two_turns_make_one() {
    for (const Vec3 moments : kBodies) {
        const FreeRotor rotor(moments);
        const Vec3 p{0.4, -0.1, 1.5};
        const Quat first = rotor.turn(0.3, p);
        const Quat second = rotor.turn(0.5, transposed_times(rotation(first), p));
        EXPECT_NEAR(apart(rotor.turn(0.8, p), first * second), 0.0, 2e-14);
        const Quat back = rotor.turn(-0.3, transposed_times(rotation(first), p));
        EXPECT_NEAR(apart(first * back, {}), 0.0, 4e-15);
    }
}

void the_turn_does_not_depend_on_the_unit_of_mass() {
    for (const Vec3 moments : kBodies)
        for (const double h : {1e-3, 0.4})
            for (const int exponent : {-1000, -700, -400, -260, 260, 400, 700, 1000}) {
                const double s = std::ldexp(1.0, exponent);
                const Quat one = FreeRotor(moments).turn(h, {1, 0.2, -0.3});
                const Quat other = FreeRotor(s * moments).turn(h, s * Vec3{1, 0.2, -0.3});
                EXPECT(one.w == other.w && one.x == other.x && one.y == other.y && one.z == other.z);
            }
}

void rest_and_no_number_stay_what_they_are() {
    for (const Vec3 moments : kBodies) {
        const Quat rest = FreeRotor(moments).turn(0.1, {});
        EXPECT(rest.w == 1.0 && rest.x == 0.0 && rest.y == 0.0 && rest.z == 0.0);
        const double none = std::nan(""), all = std::numeric_limits<double>::infinity();
        for (const double p : {none, all, 1e300}) {
            const Quat q = FreeRotor(moments).turn(1.0, {0.0, p, p});
            EXPECT(std::isnan(q.w) || std::fabs(q.w) <= 1.0);
        }
    }
}

/// About its middle axis, over and over, as by Dzhanibekov's wing nut.
void energy_of_a_tumbling_body_is_kept() {
    const RigidBodySpec spec = spinning({0.01, 1.0, 0.01});
    const BodyConstants body = constants_of(spec);
    BodyState state = start_of(spec, body);
    const Vec3 momentum = state.angular_momentum;
    const double energy = dot(state.angular_velocity, momentum);
    for (int n = 0; n < 100000; ++n) {
        integrate(body, 0.1, state);
        EXPECT_NEAR(dot(state.angular_velocity, state.angular_momentum) / energy, 1.0, 1e-12);
    }
    EXPECT(state.angular_momentum.x == momentum.x && state.angular_momentum.y == momentum.y);
    const Quat q = state.turn;
    EXPECT_NEAR(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z, 1.0, 1e-15);
}

void the_step_does_not_matter() {
    const RigidBodySpec spec = spinning({0.3, 1.0, -0.2});
    const Vec3 truth = spun(spec, 4.0, 0.01).angular_velocity;
    EXPECT_NEAR(norm(spun(spec, 4.0, 0.5).angular_velocity - truth), 0.0, 1e-13);
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
    the_turn_solves_eulers_equations();
    momentum_and_energy_are_kept();
    a_steady_spin_turns_by_its_rate_however_fast();
    two_turns_make_one();
    the_turn_does_not_depend_on_the_unit_of_mass();
    rest_and_no_number_stay_what_they_are();
    energy_of_a_tumbling_body_is_kept();
    the_step_does_not_matter();
    a_small_turn_keeps_its_digits();
    a_kinematic_body_turns_at_its_rate();
    return report();
}
