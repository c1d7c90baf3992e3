// The outer loop of every pipeline: blocks of steps, samples between them, one check per block.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <utility>

#include "run/recorder.hpp"
#include "run/report.hpp"

namespace spook {

/// Why a state is not fit to go on, and whose it is; `completed` means it is fit.
struct Health {
    Status status = Status::completed;
    int body = -1;
    const char* reason = "";  // what is wrong with the body, when the status does not say it
};

/// Asked between blocks of steps, at most ten times a second; true ends the run. Python's Ctrl-C comes in here.
inline bool (*interrupted)() = nullptr;

/// A System has
///   void advance(int64 steps)             do that many steps, with no check inside
///   void observe(Recorder&, int64 sample)  recorder.sample(sample), looking ahead if velocities need it
///   Health health() const                  non-finite or runaway values
///   void save(), void restore()            keep and take back everything advance() changes
///   int64 block() const                    steps between two checks
/// The check costs nothing inside a step: a block that ends unfit is replayed step by step to find the step.
template <class System>
void run_loop(System& system, Recorder& recorder, std::int64_t steps, double time_limit, RunReport& report) {
    using Clock = std::chrono::steady_clock;
    const auto begin = Clock::now();
    const auto elapsed = [&] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
    const auto advance_to = [&](std::int64_t from, std::int64_t to) {
        for (std::int64_t done = from; done < to;) {
            const std::int64_t next = std::min(recorder.next_wanted(done + 1), to);
            system.advance(next - done);
            done = next;
            if (recorder.next_wanted(done) == done) system.observe(recorder, done);
        }
    };
    if (recorder.next_wanted(0) == 0) system.observe(recorder, 0);
    std::int64_t done = 0;
    Health health = system.health();
    if (health.status != Status::completed) report.failed_step = 0;
    double asked = 0.0;
    while (done < steps && health.status == Status::completed) {
        if (interrupted != nullptr && elapsed() > asked + 0.1) {
            asked = elapsed();
            if (interrupted()) {
                report.status = Status::timed_out;
                report.failed_step = done + 1;
                break;
            }
        }
        if (time_limit > 0.0 && elapsed() > time_limit) {
            report.status = Status::timed_out;
            report.failed_step = done + 1;
            break;
        }
        const std::int64_t end = std::min(done + system.block(), steps);
        system.save();
        recorder.save();
        advance_to(done, end);
        health = system.health();
        if (health.status != Status::completed) {
            system.restore();
            recorder.restore();
            for (std::int64_t step = done + 1; step <= end; ++step) {
                system.advance(1);
                health = system.health();
                if (health.status != Status::completed) {
                    report.failed_step = step;
                    break;
                }
                if (recorder.next_wanted(step) == step) system.observe(recorder, step);
                done = step;
            }
            break;
        }
        done = end;
    }
    if (health.status != Status::completed) {
        report.status = health.status;
        report.failed_body = health.body;
        report.reason = health.reason;
    }
    report.steps = done;
    report.seconds = elapsed();
    report.recordings = recorder.recordings();
    report.counters["samples"] = recorder.samples_read();
}

}  // namespace spook
