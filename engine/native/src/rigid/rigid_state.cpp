#include "rigid/rigid_state.hpp"

#include "linear/elementary.hpp"

namespace spook {
namespace {

/// The turn of a constant angular velocity over h.
Quat turn_of(double h, Vec3 angular_velocity) noexcept {
    const double angle = 0.5 * h * norm(angular_velocity);
    const SineCosine half = sine_cosine(angle);
    const Vec3 e = (angle != 0.0 ? 0.5 * h * half.sine / angle : 0.0) * angular_velocity;
    return {half.cosine, e.x, e.y, e.z};
}

bool isotropic(Vec3 inertia) noexcept { return inertia.x == inertia.y && inertia.y == inertia.z; }

}  // namespace

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

bool advance_pose(const BodyConstants& body, double h, BodyState& state) noexcept {
    state.displacement += h * state.velocity;
    if (body.particle) return true;
    if (body.motion == Motion::kinematic) {
        state.turn = unit(turn_of(h, state.angular_velocity) * state.turn);
    } else {
        Vec3 w;
        if (isotropic(body.inertia)) {
            if (!rotation_rate(body.inertia, h, state.angular_momentum, w)) return false;
        } else {
            const Mat3 r = inertia_axes(body, state);
            if (!rotation_rate(body.inertia, h, transposed_times(r, state.angular_momentum), w)) return false;
            w = r * w;
        }
        const Vec3 e = 0.5 * h * w;
        state.turn = unit(Quat{std::sqrt(1.0 - dot(e, e)), e.x, e.y, e.z} * state.turn);
    }
    return true;
}

}  // namespace

bool move(const BodyConstants& body, double h, BodyState& state) noexcept {
    if (body.motion == Motion::fixed) return true;
    if (!advance_pose(body, h, state)) return false;
    if (!body.particle) state.turn_less_one = rotation_less_one(state.turn);
    return true;
}

bool lead(const BodyConstants& body, const Mat3& axes, double h, const BodyState& from, Vec3& rate,
          BodyState& to) noexcept {
    to.displacement = from.displacement + h * from.velocity;
    if (body.particle) return true;
    const Vec3 p = transposed_times(axes, from.angular_momentum);
    if (!rotation_rate(body.inertia, h, p, rate, !is_zero(rate))) return false;
    const Vec3 e = 0.5 * h * (axes * rate);
    to.turn = unit(Quat{std::sqrt(1.0 - dot(e, e)), e.x, e.y, e.z} * from.turn);
    to.turn_less_one = rotation_less_one(to.turn);
    return true;
}

bool integrate(const BodyConstants& body, double h, BodyState& state) noexcept {
    if (body.motion == Motion::fixed) return true;
    if (!advance_pose(body, h, state)) return false;
    if (!body.particle) refresh(body, state);
    return true;
}

void displace(const BodyConstants& body, double h, Vec3 velocity, Vec3 angular_velocity,
              BodyState& state) noexcept {
    state.displacement += h * velocity;
    if (body.particle) return;
    state.turn = unit(turn_of(h, angular_velocity) * state.turn);
    refresh(body, state);
}

Vec3 turned_by(const BodyConstants& body, const BodyState& state, Vec3 angular_momentum) noexcept {
    const Mat3 r = inertia_axes(body, state);
    const Vec3 p = transposed_times(r, angular_momentum);
    return r * Vec3{p.x / body.inertia.x, p.y / body.inertia.y, p.z / body.inertia.z};
}

}  // namespace spook
