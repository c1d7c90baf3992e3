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

    explicit StageClock(const StageChoices& choices) {
        for (std::size_t k = 0; k < STAGES; ++k) kept_[k] = choices[k].kept;
    }

    void start() noexcept { last_ = Clock::now(); }
    /// The time since the last mark belongs to `stage`; to the stage of the next mark where it is left out.
    void mark(Stage stage) noexcept {
        if (!kept(stage)) return;
        const auto now = Clock::now();
        seconds_[static_cast<std::size_t>(stage)] += std::chrono::duration<double>(now - last_).count();
        last_ = now;
    }
    /// It belongs to the first of `stages` that is kept.
    void mark(std::initializer_list<Stage> stages) noexcept {
        for (const Stage stage : stages)
            if (kept(stage)) return mark(stage);
    }
    bool kept(Stage stage) const noexcept { return kept_[static_cast<std::size_t>(stage)]; }
    double seconds(Stage stage) const noexcept { return seconds_[static_cast<std::size_t>(stage)]; }

private:
    Clock::time_point last_ = Clock::now();
    std::array<double, STAGES> seconds_{};
    std::array<bool, STAGES> kept_{};
};

/// The clock of a run, where one was asked for.
class StageTimer {
public:
    explicit StageTimer(StageClock* clock = nullptr) noexcept : clock_(clock) {}
    bool is_on() const noexcept { return clock_ != nullptr; }
    void start() const noexcept {
        if (clock_) clock_->start();
    }
    void mark(Stage stage) const noexcept {
        if (clock_) clock_->mark(stage);
    }
    void mark(std::initializer_list<Stage> stages) const noexcept {
        if (clock_) clock_->mark(stages);
    }

private:
    StageClock* clock_;
};

}  // namespace spook
