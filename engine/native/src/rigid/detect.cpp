// Stage: contact points. Pairs that are closed where the step begins, and pairs that will touch within it along v (supported
// bodies) or v + dv_ext (free ones): where, when and in which order, see contacts/contact_stage.hpp.
//
// reads: places and velocities of bodies, dv_ext. writes: the contact stage's points, scratch_.poses, scratch_.velocities, scratch_.free_velocities,
// touching_, scratch_.start_of_contacts; sleepers that were met.
#include "rigid/rigid_system.hpp"

namespace spook {

void RigidSystem::detect() {
    if (!contacts_) return;
    const std::size_t count = constants_.size();
    scratch_.poses.resize(count);
    scratch_.velocities.resize(count);
    scratch_.free_velocities.resize(count);
    for (int i = 0; i < bodies(); ++i) {
        const BodyState& s = live_.bodies[i];
        scratch_.poses[i] = {position_of(i), axes(constants_[i], s)};
        const Vec3 v = s.velocity, w = s.angular_velocity;
        scratch_.velocities[i] = scratch_.free_velocities[i] = {v.x, v.y, v.z, w.x, w.y, w.z};
        if (!constants_[i].moves()) continue;
        const Vec3 dv = kick(i);
        for (int k = 0; k < 3; ++k) scratch_.free_velocities[i][k] += dv[k];
        if (dot(constants_[i].torque, constants_[i].torque) > 0.0) {
            const Vec3 dw = turned_by(constants_[i], s, twist(i));
            for (int k = 0; k < 3; ++k) scratch_.free_velocities[i][3 + k] += dw[k];
        }
    }
    touching_ = contacts_->detect(scratch_.poses, scratch_.velocities, scratch_.free_velocities);
    if (touching_) note_start_of_contacts();
    if (clock_) clock_->mark(Stage::collision);
}

/// In a step that began without contacts, whether bodies meet because of what joints make of their velocities, scratch_.next:
/// cast along their own they do not. Then the step is to be solved with contacts.
bool RigidSystem::meet_late() {
    const auto any = [this](auto is) {
        return mixed_values_ && std::any_of(mixed_.rows.begin(), mixed_.rows.end(), is);
    };
    const bool stop_hit = any([](const RowBlock& block) { return block.stop.hit; }),
               rebounds = any([](const RowBlock& block) { return block.stop.rebound != 0.0; });
    const bool meets = contacts_->meets(scratch_.next, stop_hit, rebounds);
    if (clock_) clock_->mark(Stage::collision);
    if (!meets) return false;
    touching_ = true;
    note_start_of_contacts();
    return true;
}

/// What the step is to be compared with.
void RigidSystem::note_start_of_contacts() {
    scratch_.start_of_contacts.resize(constants_.size());
    for (int i : constrained_) {
        const BodyState& s = live_.bodies[i];
        scratch_.start_of_contacts[i] = {s.displacement, s.turn, twice_energy(constants_[i], s)};
    }
}

}  // namespace spook
