#include "contacts/step_motion.hpp"

#include <algorithm>
#include <cmath>

#include "contacts/contact_geometry.hpp"
#include "linear/elementary.hpp"

namespace spook {

using namespace tolerances::step_motion;

void StepMotion::begin(const std::vector<Pose>& at, const std::vector<Vec6>& v,
                       const std::vector<Vec6>& free_velocity) {
    const std::size_t bodies = model_->bodies.count();
    poses = at;
    velocity = v;
    dv_ext.resize(bodies);
    for (std::size_t b = 0; b < bodies; ++b) dv_ext[b] = sum(free_velocity[b], v[b], -1.0);
    whole_dv_ext = dv_ext;
    drive.begin(model_->bodies, model_->surfaces, v);
    toi_fraction.assign(bodies, 0.0);
    event_time.assign(bodies, -1.0);
    event_rotation.resize(bodies);
    correction.clear();
    supported.begin(bodies);
}

void StepMotion::predict(const std::vector<Vec6>& free_velocity) {
    supported.find(model_->bodies);
    predicted.resize(velocity.size());
    for (std::size_t b = 0; b < predicted.size(); ++b)
        predicted[b] = is_free(b) && model_->bodies.moves(b) ? free_velocity[b] : velocity[b];
}

bool StepMotion::moves_along_forces(int body) const {
    return !is_free(body) && is_along(linear(dv_ext[body]), linear(velocity[body]));
}

const std::vector<Vec6>& StepMotion::along(const std::vector<Vec6>& given) {
    const double h = model_->options.time_step;
    along_ = given;
    for (const Tumbler& body : model_->bodies.tumblers) {
        const Vec3 w = angular(given[body.body]);
        const double turn = h * norm(w);
        if (turn * turn < closed || turn > furthest_mean) continue;
        const Mat3 axes = poses[body.body].rotation * body.axes;
        const Vec3 p = transposed_times(axes, w);
        const Quat q = body.rotor.turn(h, {p.x * body.moments.x, p.y * body.moments.y, p.z * body.moments.z});
        const Vec3 e = axes * Vec3{q.x, q.y, q.z};
        const double sine = norm(e);
        const Vec3 mean = (2.0 * arc_tangent(sine, q.w) / (h * sine)) * e;
        along_[body.body][3] = mean.x, along_[body.body][4] = mean.y, along_[body.body][5] = mean.z;
    }
    return along_;
}

void StepMotion::apply_forces_until(std::size_t b, double part) {
    velocity[b] = sum(velocity[b], whole_dv_ext[b], part - toi_fraction[b]);
    dv_ext[b] = sum(Vec6{}, whole_dv_ext[b], 1.0 - part);
    toi_fraction[b] = part;
}

void StepMotion::apply_half_of_forces() {
    const bool rebounds = model_->surfaces.rebounds;
    for (std::size_t b = 0; rebounds && b < velocity.size(); ++b)
        if (model_->bodies.moves(b) && is_free(b) && event_time[b] < 0.0)
            apply_forces_until(b, part_of_forces(0.0, rebounds));
}

void StepMotion::release_support(int body, const Vec6& after) {
    if (event_time[body] < 0.0 || toi_fraction[body] > 0.0 || is_free(body)) return;
    const Vec3 kick = linear(dv_ext[body]), before = linear(velocity[body]);
    if (is_along(kick, before) || !is_along(kick, linear(after) - before)) return;
    toi_fraction[body] =
        part_of_forces(event_time[body] / model_->options.time_step, model_->surfaces.rebounds);
    supported.release(body, toi_fraction[body], dv_ext[body]);
    for (double& k : dv_ext[body]) k *= 1.0 - toi_fraction[body];
}

Vec3 StepMotion::free_fall_correction(int body, Vec3 after) const {
    const Vec3 k = linear(dv_ext[body]), change = after - linear(velocity[body]);
    if (!supported[body] || !(dot(k, k) > 0.0)) return {};
    const double passed = event_time[body] / model_->options.time_step,
                 won = passed * dot(k, after - linear(predicted[body])) - 0.5 * dot(change, change);
    return won > 0.0 ? (won / dot(k, k)) * k : Vec3{};
}

void StepMotion::correct_events(const MixedSystem& system, const std::vector<char>& has_rows) {
    for (std::size_t b = 0; b < model_->bodies.count(); ++b) {
        const int u = model_->bodies.solver_index[b];
        if (u < 0 || event_time[b] < 0.0 || !has_rows[u] || moved_until(static_cast<int>(b)) > 0.0) continue;
        if (correction.empty()) correction.assign(system.mass.size(), Vec6{});
        // What a joint holds turns as it goes, or the joint would answer the difference with a speed.
        for (int i = 0; i < (model_->bodies.jointed[b] ? 6 : 3); ++i)
            correction[u][i] +=
                event_time[b] / model_->options.time_step * (predicted[b][i] - system.velocity[u][i]);
        const Vec3 more = free_fall_correction(static_cast<int>(b), linear(system.velocity[u]));
        for (int i = 0; i < 3; ++i) correction[u][i] += more[i];
    }
}

Pose StepMotion::moved(int b, const std::vector<Vec6>& along) const {
    Pose pose = poses[b];
    if (event_time[b] >= 0.0) pose.position += event_time[b] * (linear(predicted[b]) - linear(along[b]));
    if (const double time = moved_until(b); time > 0.0) {
        const Vec3 w = angular(along[b]);
        const double rate = norm(w);
        const SineCosine half = sine_cosine(-0.5 * time * rate);
        const double s = rate > 0.0 ? half.sine / rate : 0.0;
        pose.rotation = rotation(Quat{half.cosine, s * w.x, s * w.y, s * w.z}) * event_rotation[b];
    }
    return pose;
}

double StepMotion::surface_speed(const StepContact& point, Vec3 direction) const noexcept {
    const ContactSurfaces& surfaces = model_->surfaces;
    if (!surfaces.conveys) return 0.0;
    const int a = point.contact.first, b = point.contact.second;
    return dot(direction, poses[a].rotation * surfaces[a].surface_velocity -
                              poses[b].rotation * surfaces[b].surface_velocity);
}

double StepMotion::given_back(const StepContact& point, double normal) const {
    const double fall = std::abs(relative_velocity(point, point.contact.point.normal, whole_dv_ext)),
                 speed = -point.approach - (point.rounding + fall);
    if (!(normal > 0.0 && speed > 0.0)) return 0.0;
    const double psi = model_->surfaces.pair(point.contact).restitution;
    return 0.5 * psi * psi * normal * speed;
}

}  // namespace spook
