// Newton's method on joint coordinates, round by round: when it goes on, and when it gives up. The same in space
// (joint_tree_stage.cpp) and in a plane (plane_tree.cpp).
#pragma once

namespace spook {

class JointRounds {
public:
    static constexpr int max_rounds = 20;

    /// Whether the next round takes the derivative where the joints are; else it keeps the last one.
    bool fresh() const noexcept { return fresh_; }

    /// Whether a step of this size leads astray: to other solutions, or on and on.
    bool lost(double size) const noexcept { return !(size < max_step) || round_ == max_rounds; }

    /// Whether after a step of this size nothing is left but rounding; `moved`: the largest square of a half turn's sine.
    bool settled(double size, double moved, bool loops) noexcept {
        // What a step leaves: the share of it that the last one left; with a fresh derivative the square of it.
        const double rate = round_ > 0 ? size / before_ : loops ? 1.0 : size;
        const double left = rate * (fresh_ && round_ > 0 ? rate * size : size);
        if (size < exact || (size < near && (left < 1e-17 * moved || rate > 0.5))) return true;
        fresh_ = (round_ > 0 ? rate : size) > max_stale_step;
        before_ = size;
        ++round_;
        return false;
    }

private:
    static constexpr double max_step = 0.5;         // rad or sizes of a joint
    static constexpr double exact = 1e-13;          // rounding
    static constexpr double near = 3e-9;            // from where on one more step is beyond rounding
    static constexpr double max_stale_step = 0.05;  // beyond it a new derivative is cheaper than more steps

    int round_ = 0;
    double before_ = 0.0;
    bool fresh_ = true;
};

}  // namespace spook
