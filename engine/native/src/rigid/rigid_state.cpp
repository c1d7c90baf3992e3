#include "rigid/rigid_state.hpp"

#include "rigid/tolerances.hpp"

namespace spook {
namespace {

Mat3 turned(const Mat3& start, const BodyState& state) noexcept {
    Mat3 r = state.turn_less_one * start;
    for (int i = 0; i < 9; ++i) r.m[i] += start.m[i];
    return r;
}

}  // namespace

Mat3 axes(const BodyConstants& body, const BodyState& state) noexcept {
    return turned(body.start_rotation, state);
}

Mat3 inertia_axes(const BodyConstants& body, const BodyState& state) noexcept {
    return turned(body.start_principal, state);
}

BodyConstants constants_of(const RigidBodySpec& spec) noexcept {
    const Mat3 start = rotation(spec.orientation);
    const bool tilted = !is_zero(Vec3{spec.inertia_axes.x, spec.inertia_axes.y, spec.inertia_axes.z});
    return {spec.motion,
            spec.particle,
            spec.mass,
            spec.inertia,
            spec.particle ? FreeRotor{} : FreeRotor(spec.inertia),
            start,
            spec.position,
            spec.orientation,
            spec.force,
            spec.torque,
            tilted ? start * rotation(spec.inertia_axes) : start,
            tilted};
}

BodyState start_of(const RigidBodySpec& spec, const BodyConstants& body) noexcept {
    BodyState state;
    state.velocity = spec.velocity;
    state.angular_velocity = spec.angular_velocity;
    if (!body.particle && body.moves()) {
        refresh(body, state);  // for the inertia
        state.angular_momentum = state.inertia * spec.angular_velocity;
        state.angular_velocity = spec.angular_velocity;
    }
    return state;
}

void refresh(const BodyConstants& body, BodyState& state) noexcept {
    state.turn_less_one = rotation_less_one(state.turn);
    if (!body.moves()) return;
    if (isotropic(body.inertia)) {
        state.inertia = Mat3::diagonal(body.inertia);
        state.angular_velocity = (1.0 / body.inertia.x) * state.angular_momentum;
        return;
    }
    const Mat3 r = inertia_axes(body, state);
    const Vec3 p = transposed_times(r, state.angular_momentum);
    state.angular_velocity = r * Vec3{p.x / body.inertia.x, p.y / body.inertia.y, p.z / body.inertia.z};
    for (int i = 0; i < 3; ++i)
        for (int j = i; j < 3; ++j)
            state.inertia.m[3 * i + j] = state.inertia.m[3 * j + i] =
                r.m[3 * i] * body.inertia.x * r.m[3 * j] + r.m[3 * i + 1] * body.inertia.y * r.m[3 * j + 1] +
                r.m[3 * i + 2] * body.inertia.z * r.m[3 * j + 2];
}

namespace {

/// A turn in principal axes, which `axes` carries to the world, after `from`.
Quat turned_on(const Mat3& axes, Quat turn, Quat from) noexcept {
    const Vec3 e = axes * Vec3{turn.x, turn.y, turn.z};
    return unit(Quat{turn.w, e.x, e.y, e.z} * from);
}

void advance_pose(const BodyConstants& body, double h, BodyState& state) noexcept {
    state.displacement += h * state.velocity;
    if (body.particle) return;
    if (body.motion == Motion::kinematic) {
        state.turn = unit(turn_of(h, state.angular_velocity) * state.turn);
    } else if (isotropic(body.inertia)) {
        state.turn = unit(body.rotor.turn(h, state.angular_momentum) * state.turn);
    } else {
        const Mat3 r = inertia_axes(body, state);
        state.turn =
            turned_on(r, body.rotor.turn(h, transposed_times(r, state.angular_momentum)), state.turn);
    }
}

}  // namespace

void move(const BodyConstants& body, double h, BodyState& state) noexcept {
    if (body.motion == Motion::fixed) return;
    advance_pose(body, h, state);
    if (!body.particle) state.turn_less_one = rotation_less_one(state.turn);
}

double share_of_bend(double turn) noexcept { return std::clamp(turn / fast_turn - 1.0, 0.0, 1.0); }
double share_of_angles(double turn) noexcept { return std::clamp(2.0 - turn / far_turn, 0.0, 1.0); }

void look_around(const BodyConstants& body, double h, BodyState& behind, BodyState& next,
                 BodyState& ahead) noexcept {
    const bool steady = body.motion != Motion::kinematic &&
                        h * h * dot(next.angular_velocity, next.angular_velocity) > 4.0 * far_turn * far_turn;
    const auto moved = [&](double time, BodyState& state) {
        if (!steady) return move(body, time, state);
        state.displacement += time * state.velocity;
        state.turn = unit(turn_of(time, state.angular_velocity) * state.turn);
        state.turn_less_one = rotation_less_one(state.turn);
    };
    moved(-h, behind);
    if (!steady && !body.particle && body.moves() && !isotropic(body.inertia)) {
        next.angular_momentum =
            carried(rotation_less_one(next.turn * conjugate(behind.turn)), next.angular_momentum);
        next.angular_velocity = turned_by(body, next, next.angular_momentum);
    }
    moved(h, ahead = next);
}

void lead(const BodyConstants& body, const Mat3& axes, double h, const BodyState& from,
          BodyState& to) noexcept {
    to.displacement = from.displacement + h * from.velocity;
    if (body.particle) return;
    to.turn = turned_on(axes, body.rotor.turn(h, transposed_times(axes, from.angular_momentum)), from.turn);
    to.turn_less_one = rotation_less_one(to.turn);
}

void integrate(const BodyConstants& body, double h, BodyState& state) noexcept {
    if (body.motion == Motion::fixed) return;
    advance_pose(body, h, state);
    if (!body.particle) refresh(body, state);
}

void displace(const BodyConstants& body, double h, Vec3 velocity, Vec3 angular_velocity,
              BodyState& state) noexcept {
    state.displacement += h * velocity;
    if (body.particle) return;
    state.turn = unit(turn_of(h, angular_velocity) * state.turn);
    refresh(body, state);
}

Vec3 turned_by(const BodyConstants& body, const BodyState& state, Vec3 angular_momentum) noexcept {
    if (body.particle) return {};
    const Mat3 r = inertia_axes(body, state);
    const Vec3 p = transposed_times(r, angular_momentum);
    return r * Vec3{p.x / body.inertia.x, p.y / body.inertia.y, p.z / body.inertia.z};
}

}  // namespace spook
