#include "rigid/joint_drives.hpp"

#include <cmath>
#include <stdexcept>

namespace spook {

void JointDrives::add(const JointSpec& spec, int own, int number, bool springs_pull, JointBlock& block) {
    if (!(spec.motor || spec.limit || spec.spring || spec.armature > 0.0 || rubs(spec)))
        return of_joint_.push_back(-1);
    Axial axial;
    const auto add_row = [&](double softness) { block.softness[block.size++] = softness; };
    if (spec.motor) {
        axial.has_motor = true;
        axial.speed = spec.motor->speed;
        axial.pushes = spec.motor->pushes;
        axial.impulse = time_step_ * spec.motor->force;
        add_row(0.0);
    }
    if (spec.limit) {
        axial.has_limit = true;
        axial.lower = spec.limit->lower;
        axial.upper = spec.limit->upper;
        axial.restitution = spec.limit->restitution;
        axial.limit = regularise(spec.limit->compliance, spec.limit->damping, time_step_);
        add_row(axial.limit.softness);
    }
    if (spec.spring) {
        axial.has_spring = true;
        axial.spring_at = static_cast<int>(springs_.size());
        axial.spring_pulls = springs_pull;
        springs_.push_back({own, spec.spring->stiffness, spec.spring->rest, spec.spring->damping});
        axial.spring_impulse = time_step_ * spec.spring->force;
        axial.spring = regularise(1.0 / spec.spring->stiffness, spec.spring->damping, time_step_);
        if (!springs_pull) add_row(axial.spring.softness);
    }
    if (spec.armature > 0.0) {  // G v₊ + λ/I = w, the rotor's speed before
        block.rotor = block.size;
        add_row(1.0 / spec.armature);
    }
    for (int way = 0; way < 2; ++way) {
        if (!rubs(spec, way)) continue;
        axial.rubs[way] = true;
        axial.friction[way] = time_step_ * spec.dry_friction[way];
        if (spec.load_friction[way] > 0.0)
            bearings_.push_back({number, block.size, way, own, axial.friction[way], spec.load_friction[way]});
        add_row(0.0);
    }
    of_joint_.push_back(static_cast<int>(axials_.size()));
    axials_.push_back(axial);
}

bool JointDrives::give_energy() const noexcept {
    for (const Axial& axial : axials_)
        if (axial.pushes || (axial.has_motor && axial.speed != 0.0) || axial.rest_moves ||
            (axial.has_spring && std::isfinite(axial.spring_impulse)))
            return true;
    return false;
}

bool JointDrives::set_motor(int joint, double speed, double max_force) {
    Axial& axial = axials_.at(of_joint_.at(joint));
    if (!axial.has_motor || std::isfinite(axial.impulse) != std::isfinite(max_force))
        throw std::invalid_argument("a motor keeps its kind: with a bound or without");
    const double impulse = time_step_ * max_force;
    const bool other = axial.speed != speed || axial.impulse != impulse;
    axial.speed = speed;
    axial.impulse = impulse;
    return other;
}

bool JointDrives::set_rest(int joint, double rest) {
    Axial& axial = axials_.at(of_joint_.at(joint));
    if (!axial.has_spring) throw std::invalid_argument("the joint has no spring");
    double& rests = springs_[axial.spring_at].rest;
    const bool other = rests != rest;
    rests = rest;
    axial.rest_moves = false;
    return other;
}

void JointDrives::set_moving_rest(int joint, double rest, double before, double ahead) {
    set_rest(joint, rest);
    Axial& axial = at(joint);
    axial.rest_moves = true;
    axial.rest_before = before;
    axial.rest_ahead = ahead;
}

}  // namespace spook
