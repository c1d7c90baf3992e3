// Where the time of a step goes; only used when the caller asks for it, because reading a clock costs more
// than many a stage.
#pragma once

#include <array>
#include <chrono>

#include "run/stages.hpp"

namespace spook {

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
    std::array<double, STAGES> seconds_{};
};

}  // namespace spook
