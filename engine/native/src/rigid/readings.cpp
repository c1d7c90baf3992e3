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
    std::fill_n(out, 6, 0.0);
    const JointState& state = joints_.states[joint];
    if (scratch_.last_rows == LastRows::plane) {
        plane_.step().wrench(joint, state, out);
        for (int k = 0; k < 6; ++k) out[k] /= model_.h;
        return;
    }
    if (bilateral_.by_links() &&
        scratch_.last_rows != LastRows::mixed) {  // along the world's axes, at the joint
        for (int k = 0; k < 6; ++k) out[k] = state.multiplier[k] / model_.h;
        return;
    }
    const auto blocks = joints_.blocks();
    Vec3 force, torque;
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        if (blocks[k].joint != joint) continue;
        const double* rows = mixed_.jacobian(rows_, static_cast<int>(k), true);
        const double* multiplier = state.multipliers(blocks[k].axial);
        for (int i = 0; i < blocks[k].size; ++i) {
            const double f = multiplier[i] / model_.h;
            force += f * Vec3{rows[6 * i], rows[6 * i + 1], rows[6 * i + 2]};
            torque += f * Vec3{rows[6 * i + 3], rows[6 * i + 4], rows[6 * i + 5]};
        }
    }
    torque -= cross(state.second_reach, force);
    for (int k = 0; k < 3; ++k) out[k] = force[k], out[3 + k] = torque[k];
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
