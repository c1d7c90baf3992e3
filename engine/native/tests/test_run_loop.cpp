// The outer loop: what ends a run, and what it then says.
#include "run/run_loop.hpp"

#include "expect.hpp"

using namespace spook;

namespace {

/// Counts its steps; from one on it is unfit. Taken back, it finds that the time is over, as a long step would.
struct Counting {
    std::int64_t unfit_from = 0, steps = 0, kept = 0;
    bool time_ends_in_replay = false, replays = false;

    void advance(std::int64_t more) {
        if (replays && time_ends_in_replay) throw Stopped{};
        steps += more;
    }
    void observe(Recorder&, std::int64_t) {}
    Health health() const { return {steps >= unfit_from ? Status::diverged : Status::completed, 0, "", {}}; }
    void save() { kept = steps, replays = false; }
    void restore() { steps = kept, replays = true; }
    std::int64_t block() const { return 64; }
};

RunReport run(Counting system) {
    Recorder nothing({}, {});
    nothing.prepare(1000);
    RunReport report;
    Watch watch(0.0);
    run_loop(system, nothing, 1000, watch, report);
    return report;
}

void the_step_that_makes_a_block_unfit_is_found() {
    const RunReport report = run({.unfit_from = 5});
    EXPECT(report.status == Status::diverged && report.failed_step == 5 && report.steps == 4);
}

void a_run_whose_time_is_over_before_that_step_is_found_has_not_diverged() {
    const RunReport report = run({.unfit_from = 5, .time_ends_in_replay = true});
    EXPECT(report.status == Status::timed_out);
    EXPECT(report.steps < 5 && report.failed_step == report.steps + 1 && report.failed_body == -1);
}

}  // namespace

int main() {
    the_step_that_makes_a_block_unfit_is_found();
    a_run_whose_time_is_over_before_that_step_is_found_has_not_diverged();
    return report();
}
