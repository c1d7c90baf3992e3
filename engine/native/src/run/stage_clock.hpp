// Where the time of a step goes; only used when the caller asks for it, because reading a clock costs more
// than many a stage.
#pragma once

#include <array>
#include <chrono>

namespace spook {

enum class Stage {
    collision,
    apply_gravity,
    apply_central_gravity,
    apply_springs,
    apply_loads,
    impact,
    string_stiffness,
    assemble_rows,
    tangents,
    solve_path,
    solve_block,
    solve_iterative,
    pivot,
    friction,
    correct_curvature,
    half_step,
    integrate_positions,
    integrate_rotations,
    observe,
    count
};

inline constexpr std::array<const char*, static_cast<std::size_t>(Stage::count)> STAGE_NAMES = {
    "collision",
    "apply_gravity",
    "apply_central_gravity",
    "apply_springs",
    "apply_loads",
    "impact",
    "string_stiffness",
    "assemble_rows",
    "tangents",
    "solve_path",
    "solve_block",
    "solve_iterative",
    "pivot",
    "friction",
    "correct_curvature",
    "half_step",
    "integrate_positions",
    "integrate_rotations",
    "observe"};

class StageClock {
public:
    using Clock = std::chrono::steady_clock;

    void start() noexcept { last_ = Clock::now(); }
    /// The time since the last mark belongs to `stage`.
    void mark(Stage stage) noexcept {
        const auto now = Clock::now();
        seconds_[static_cast<std::size_t>(stage)] += std::chrono::duration<double>(now - last_).count();
        last_ = now;
    }
    double seconds(Stage stage) const noexcept { return seconds_[static_cast<std::size_t>(stage)]; }

private:
    Clock::time_point last_ = Clock::now();
    std::array<double, static_cast<std::size_t>(Stage::count)> seconds_{};
};

}  // namespace spook
