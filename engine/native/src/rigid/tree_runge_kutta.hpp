// Steps of smooth trees of joints by an explicit Runge–Kutta method in joint coordinates; see tree_runge_kutta.cpp.
#pragma once

#include <vector>

#include "rigid/articulated_tree.hpp"
#include "rigid/forces.hpp"
#include "rigid/rigid_model.hpp"
#include "rigid/run_state.hpp"
#include "run/stage_clock.hpp"

namespace spook {

class TreeRungeKutta {
public:
    TreeRungeKutta(const RigidModel& model, RigidState& live, JointSet& joints, Forces& forces,
                   const StageTimer& clock) noexcept
        : model_(model), live_(live), joints_(joints), forces_(forces), clock_(clock) {}

    /// Once the bodies are known. False if their joints make no trees, or close loops.
    bool take();
    void advance(std::int64_t steps);
    std::size_t coordinates() const noexcept { return tree_.coordinates(); }

private:
    void step(double time);
    void go_on(double time, double left);
    void load() noexcept;
    double first_guess() noexcept;
    void find_stage(int stage, double time);
    void stages(double time, double h);
    double fastest() const noexcept;
    double error(double h) noexcept;
    void lose() noexcept;

    const RigidModel& model_;
    RigidState& live_;
    JointSet& joints_;
    Forces& forces_;
    const StageTimer& clock_;
    ArticulatedTree tree_;
    // Coordinates, then their rates; per stage, how both change:
    std::vector<double> start_, there_, changes_;
    std::size_t worst_ = 0;  // the coordinate with the largest error
};

}  // namespace spook
