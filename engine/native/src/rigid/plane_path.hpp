// Plain and half-step steps by numbers of a plane (plane_step.hpp), where the scene and its state allow it; see rigid_plane.cpp.
#pragma once

#include "rigid/loop_watch.hpp"
#include "rigid/plane_step.hpp"

namespace spook {

class PlanePath {
public:
    PlanePath(const RigidModel& model, RigidState& live, JointSet& joints, const Forces& forces,
              LoopWatch& loops) noexcept
        : model_(model), live_(live), joints_(joints), forces_(forces), loops_(loops) {}

    /// Of a scene in which nothing but joints, steady forces and steps of the plain kind bears on the bodies. Null if they are in a plane.
    Refusal take();
    void begin();
    /// Whether this run may use it; whether the bodies are in it, those of the state behind.
    bool is_used() const noexcept { return used_; }
    bool at_hand() const noexcept { return at_hand_; }
    const PlaneStep& step() const noexcept { return plane_; }
    std::uint64_t solves() const noexcept { return solves_; }

    /// False if the step is one for the space.
    bool solve();
    /// Places of the step's end. A body that turns by a radian, −1 if there is none.
    int move() { return plane_.move(); }
    /// The bodies as others read them, and the joints if their rows are the plane's.
    void write();
    void deliver();
    /// Brings the bodies into the plane; out of it, as steps in space need them; no more.
    void enter();
    void leave();
    void give_up();
    void forget() noexcept { at_hand_ = false; }

private:
    const RigidModel& model_;
    RigidState& live_;
    JointSet& joints_;
    const Forces& forces_;
    LoopWatch& loops_;
    PlaneStep plane_;
    bool used_ = false, at_hand_ = false;
    std::uint64_t solves_ = 0;
};

}  // namespace spook
