// Symmetric compositions of higher order; see rigid_composition.cpp.
#pragma once

#include <vector>

#include "rigid/block_rows.hpp"
#include "rigid/joint_tree.hpp"
#include "rigid/stage_hold.hpp"

namespace spook {

class RigidComposition {
public:
    RigidComposition(const RigidModel& model, RigidState& live, JointSet& joints, Forces& forces,
                     BlockRows& rows, const StageTimer& clock) noexcept
        : model_(model),
          live_(live),
          joints_(joints),
          forces_(forces),
          rows_(rows),
          clock_(clock),
          hold_(model, live, joints, rows) {}

    /// Null if joint coordinates will do, once the bodies are known.
    Refusal take();
    const JointTree& tree() const noexcept { return tree_; }

    void begin();
    void compose(std::int64_t steps);
    /// What is seen at the end of a step: momenta kicked and projected to the sample, forces from the accelerations there.
    void read();
    /// Momenta as joints allow them at the start, for a method that takes rates of joints from them.
    void project();
    /// What is set from outside acts from here on: up to here momenta are kicked as it was before.
    void catch_up();

private:
    static constexpr int MOST_HALVINGS = 12;

    double tension_rate(double allowed);
    void look_at_tension();
    void step(double h, int depth);
    bool stage(double tau, std::size_t stage);
    bool hold_stage(double tau, double span, std::size_t stage);
    void kick_all(double span);
    void turn_rotors() noexcept;
    void guess(std::size_t stage, double span);
    void remember(std::size_t stage, double span);
    void forget(std::size_t stage);
    void forget();

    const RigidModel& model_;
    RigidState& live_;
    JointSet& joints_;
    Forces& forces_;
    BlockRows& rows_;
    const StageTimer& clock_;
    StageHold hold_;
    JointTree tree_;
    bool in_tree_ = false;
    std::size_t unknowns_ = 0;  // of a stage: rows, or joint coordinates
    std::vector<double> multiplier_, pace_;
    std::vector<double> rates_;  // of tension, by body
    LargeArray<BodyState> step_start_[MOST_HALVINGS];
};

}  // namespace spook
