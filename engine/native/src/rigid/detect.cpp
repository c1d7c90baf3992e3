// Stage: contact points. Pairs that are closed where the step begins, and pairs that will touch within it along v (supported
// bodies) or v + dv_ext (free ones): where, when and in which order, see contacts/contact_stage.hpp.
//
// reads: places and velocities of bodies, dv_ext. writes: the contact stage's points; poses, velocities, free_velocities and
// start_of_contacts of scratch_; touching_; sleepers that were met.
#include "rigid/mixed_rows.hpp"

namespace spook {

void MixedRows::detect() {
    if (!contacts_) return;
    const std::size_t count = model_.constants.size();
    scratch_.poses.resize(count);
    scratch_.velocities.resize(count);
    scratch_.free_velocities.resize(count);
    for (int i = 0; i < model_.bodies(); ++i) {
        const BodyState& s = live_.bodies[i];
        scratch_.poses[i] = {model_.position(i, live_.bodies), axes(model_.constants[i], s)};
        const Vec3 v = s.velocity, w = s.angular_velocity;
        scratch_.velocities[i] = scratch_.free_velocities[i] = {v.x, v.y, v.z, w.x, w.y, w.z};
        if (!model_.constants[i].moves()) continue;
        const Vec3 dv = forces_.kick(i);
        for (int k = 0; k < 3; ++k) scratch_.free_velocities[i][k] += dv[k];
        if (dot(model_.constants[i].torque, model_.constants[i].torque) > 0.0) {
            const Vec3 dw = turned_by(model_.constants[i], s, forces_.angular_impulse(i));
            for (int k = 0; k < 3; ++k) scratch_.free_velocities[i][3 + k] += dw[k];
        }
    }
    touching_ = contacts_->detect(scratch_.poses, scratch_.velocities, scratch_.free_velocities);
    if (touching_) note_start_of_contacts();
    clock_.mark(Stage::collision);
}

/// In a step that began without contacts, whether bodies meet because of what joints make of their velocities, scratch_.next:
/// cast along their own they do not. Then the step is to be solved with contacts.
bool MixedRows::find_late_contacts() {
    const bool meets = contacts_->meets(scratch_.next);
    clock_.mark(Stage::collision);
    if (!meets) return false;
    touching_ = true;
    note_start_of_contacts();
    return true;
}

/// What the step is to be compared with.
void MixedRows::note_start_of_contacts() {
    scratch_.start_of_contacts.resize(model_.constants.size());
    for (int i : model_.constrained) {
        const BodyState& s = live_.bodies[i];
        scratch_.start_of_contacts[i] = {s.displacement, s.turn, twice_energy(model_.constants[i], s)};
    }
}

void find_what_touches(const ContactStage* contacts, std::span<const BodyConstants> bodies,
                       const JointSet& joints, std::vector<char>& touched) {
    if (joints.turning.empty()) return;
    touched.assign(bodies.size(), 0);
    if (contacts == nullptr) return;
    for (const StepContact& point : contacts->judged().points.all)
        for (const int body : {point.contact.first, point.contact.second})
            if (bodies[body].moves()) touched[joints.trees[body]] = 1;
}

bool follows_turns(const JointSet& joints, const JointBlock& block,
                   const std::vector<char>& touched) noexcept {
    const auto free = [&](int body) { return body < 0 || touched[joints.trees[body]] == 0; };
    return !joints.turning.empty() && free(block.first) && free(block.second);
}

}  // namespace spook
