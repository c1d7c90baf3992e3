#include "rigid/readings.hpp"

#include <algorithm>
#include <limits>

#include "rigid/rotors.hpp"
#include "run/quantities.hpp"

namespace spook {

namespace {
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
}

double kinetic_energy(const RigidModel& model, const RigidState& live, const JointSet& joints) noexcept {
    double sum = 0.0;
    for (int i = 0; i < model.bodies(); ++i) {
        if (!model.constants[i].moves()) continue;
        const BodyState& s = live.bodies[i];
        sum += 0.5 * model.constants[i].mass * dot(s.velocity, s.velocity);
        if (!model.constants[i].particle) sum += 0.5 * dot(s.angular_velocity, s.angular_momentum);
    }
    return sum + rotor_energy(joints, live.bodies);
}

std::vector<double> RigidReadings::states(bool velocities) const {
    std::vector<double> out;
    out.reserve(13 * model_.constants.size());
    for (int i = 0; i < bodies(); ++i) {
        const BodyState& s = state(i);
        const Vec3 x = position_of(i), none{nan, nan, nan};
        const Vec3 v = velocities ? s.velocity : none, w = velocities ? s.angular_velocity : none;
        const Quat q = orientation_of(i);
        out.insert(out.end(), {x.x, x.y, x.z, q.w, q.x, q.y, q.z, v.x, v.y, v.z, w.x, w.y, w.z});
    }
    return out;
}

void RigidReadings::wrench(int joint, double* out) const noexcept {
    if (!kept_wrenches_.empty()) return static_cast<void>(std::copy_n(kept_wrenches_[joint].data(), 6, out));
    if (!by_rows()) return find_wrench(joint, out);
    Vec3 force, torque;
    for (std::size_t k = 0; k < joints_.blocks().size(); ++k)
        if (joints_.blocks()[k].joint == joint) add_rows(k, force, torque);
    torque -= cross(joints_.states[joint].second_reach, force);
    for (int k = 0; k < 3; ++k) out[k] = force[k], out[3 + k] = torque[k];
}

std::vector<Vec6> RigidReadings::wrenches() const {
    if (!kept_wrenches_.empty()) return kept_wrenches_;
    std::vector<Vec6> all(joints_.states.size(), Vec6{});
    if (!by_rows()) {
        for (std::size_t joint = 0; joint < all.size(); ++joint)
            find_wrench(static_cast<int>(joint), all[joint].data());
        return all;
    }
    std::vector<Vec3> force(all.size()), torque(all.size());
    for (std::size_t k = 0; k < joints_.blocks().size(); ++k)
        add_rows(k, force[joints_.blocks()[k].joint], torque[joints_.blocks()[k].joint]);
    for (std::size_t joint = 0; joint < all.size(); ++joint) {
        const Vec3 at = torque[joint] - cross(joints_.states[joint].second_reach, force[joint]);
        for (int k = 0; k < 3; ++k) all[joint][k] = force[joint][k], all[joint][3 + k] = at[k];
    }
    return all;
}

/// Steps in a plane, and links that are solved along their tree, have no rows but the wrenches themselves.
bool RigidReadings::by_rows() const noexcept {
    return live_.last_rows == LastRows::mixed ||
           (live_.last_rows == LastRows::block && !bilateral_.by_links());
}

void RigidReadings::find_wrench(int joint, double* out) const noexcept {
    const JointState& state = joints_.states[joint];
    std::fill_n(out, 6, 0.0);
    if (live_.last_rows == LastRows::plane) plane_.step().wrench(joint, state, out);
    else std::copy_n(state.multiplier.data(), 6, out);  // along the world's axes, at the joint
    for (int k = 0; k < 6; ++k) out[k] /= model_.h;
}

void RigidReadings::add_rows(std::size_t block, Vec3& force, Vec3& torque) const noexcept {
    const JointBlock& of = joints_.blocks()[block];
    const double* rows = mixed_.jacobian(rows_, static_cast<int>(block), true);
    const double* multiplier = joints_.states[of.joint].multipliers(of.axial);
    for (int i = 0; i < of.size; ++i) {
        const double f = multiplier[i] / model_.h;
        force += f * Vec3{rows[6 * i], rows[6 * i + 1], rows[6 * i + 2]};
        torque += f * Vec3{rows[6 * i + 3], rows[6 * i + 4], rows[6 * i + 5]};
    }
}

Vec3 RigidReadings::contact_force(int body, int other) const noexcept {
    const ContactStage* contacts = mixed_.contacts();
    return contacts ? contacts->cache().force(body, other, model_.h) : Vec3{};
}

int RigidReadings::contact_count() const noexcept {
    const ContactStage* contacts = mixed_.contacts();
    return contacts ? contacts->cache().count() : 0;
}

void RigidReadings::contact_points(int most, double* out) const noexcept {
    if (const ContactStage* contacts = mixed_.contacts()) contacts->cache().tell(most, model_.h, out);
    else std::fill_n(out, CONTACT_NUMBERS * most, nan);
}

double RigidReadings::penetration() const noexcept {
    const ContactStage* contacts = mixed_.contacts();
    return contacts ? contacts->cache().penetration() : 0.0;
}

}  // namespace spook
