// What acts along the free coordinates of joints: motors, limits, springs, armatures and friction, as the scene has them and
// as they are set while it runs.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "linear/regularisation.hpp"
#include "rigid/joint_blocks.hpp"
#include "rigid/rigid_scene.hpp"

namespace spook {

/// What acts along the free coordinate of a joint.
struct Axial {
    bool has_motor = false, has_limit = false, has_spring = false, pushes = false;
    std::array<bool, 2> rubs{};
    std::array<double, 2> friction{};  // N s, N m s
    double speed = 0.0, impulse = 0.0;
    double lower = 0.0, upper = 0.0, restitution = 0.0, spring_impulse = 0.0;
    int spring_at = -1;         // in springs_
    bool spring_pulls = false;  // as a force, without a row
    bool rest_moves = false;    // then, over the step before and this one, m/s or rad/s:
    double rest_before = 0.0, rest_ahead = 0.0;
    Regularisation limit, spring;
};

class JointDrives {
public:
    explicit JointDrives(double time_step) noexcept : time_step_(time_step) {}

    /// Takes the next joint, whose own rows are the block `own`; the rows of what acts along its free coordinate are put into
    /// `block`, which will have this number. `springs_pull`: as forces, without a row.
    void add(const JointSpec& spec, int own, int number, bool springs_pull, JointBlock& block);
    /// Of a joint; null: nothing acts along its free coordinate.
    const Axial* of(int joint) const noexcept {
        return of_joint_[joint] < 0 ? nullptr : &axials_[of_joint_[joint]];
    }
    /// Those of all free coordinates.
    std::span<const JointSpring> springs() const noexcept { return springs_; }
    /// Rows whose bounds grow with what other rows carry.
    std::span<const BearingRow> bearings() const noexcept { return bearings_; }
    /// Whether some motor or spring gives energy that no book has: it has a speed or a force of its own, or a rest that moves, or
    /// gives way where ½ k d² goes on.
    bool give_energy() const noexcept;

    void set_speed(int joint, double speed) noexcept { at(joint).speed = speed; }
    /// A new target of a motor whose force stays bounded or unbounded, as it was. Whether it is another.
    bool set_motor(int joint, double speed, double max_force);
    /// What a motor pushes with, or the most it may [N or N m].
    void set_push(int joint, double force) noexcept {
        at(joint).impulse = time_step_ * (at(joint).pushes ? force : std::max(0.0, force));
    }
    /// A new rest of a spring of a free coordinate; the second: one that moves with the time, with its speeds over
    /// the step before and the coming one. Whether it is another.
    bool set_rest(int joint, double rest);
    void let_rest_move(int joint) noexcept { at(joint).rest_moves = true; }
    void set_moving_rest(int joint, double rest, double before, double ahead);

private:
    Axial& at(int joint) noexcept { return axials_[of_joint_[joint]]; }

    double time_step_;
    std::vector<int> of_joint_;  // index into axials_
    std::vector<Axial> axials_;
    std::vector<JointSpring> springs_;
    std::vector<BearingRow> bearings_;
};

}  // namespace spook
