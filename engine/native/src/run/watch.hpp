// The end of a run from inside a long step: wall time and Ctrl-C.
#pragma once

#include <algorithm>
#include <chrono>
#include <ctime>

#include "linear/pieces.hpp"

namespace spook {

/// Seconds of processor time this thread has had; 0 where the system has no such clock.
inline double processor_seconds() noexcept {
#if defined(CLOCK_THREAD_CPUTIME_ID) && !defined(__wasi__)
    timespec now{};
    if (clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now) == 0)
        return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
#endif
    return 0.0;
}

/// Asked at most ten times a second; true ends the run. Python's Ctrl-C comes in here.
inline bool (*interrupted)() = nullptr;

/// Thrown by Watch::look(). The loop that runs the system catches it and takes back the unfinished block of steps; before the
/// first of them and behind the last it is caught where the watch was made.
struct Stopped {};

/// One run's clock. While it lives, look() may be called anywhere in the thread that runs; without one it does
/// nothing. A look costs tens of nanoseconds: solvers look once per round or iteration.
class Watch {
public:
    static constexpr double patience = 0.02;  // s: work that takes longer is not done without a look

    explicit Watch(double time_limit) noexcept : limit_(time_limit) {
        current_ = this;
        between_pieces = look;
    }
    ~Watch() { current_ = nullptr; }
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;

    double elapsed() const noexcept { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

    /// Processor time since the run began; what the machine spent elsewhere is not in it.
    double processor() const noexcept { return processor_seconds() - processor_begin_; }

    /// For what is left to be told when the time is over: a little more of it.
    void extend() noexcept {
        if (limit_ > 0.0) limit_ = std::max(limit_, elapsed() + 2.0 * patience);
    }

    /// Whether the run is to end.
    bool over() { return over(elapsed()); }
    bool over(double now) {
        if (limit_ > 0.0 && now > limit_) return true;
        if (interrupted == nullptr || now <= asked_ + 0.1) return false;
        asked_ = now;
        return interrupted();
    }

    static void look() {
        if (current_ != nullptr && current_->over()) throw Stopped{};
    }

private:
    using Clock = std::chrono::steady_clock;
    Clock::time_point begin_ = Clock::now();
    double processor_begin_ = processor_seconds();
    double limit_, asked_ = 0.0;
    static inline thread_local Watch* current_ = nullptr;
};

}  // namespace spook
