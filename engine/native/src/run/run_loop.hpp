// The outer loop of every pipeline: blocks of steps, samples between them, one check per block.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "run/recorder.hpp"
#include "run/report.hpp"
#include "run/watch.hpp"

namespace spook {

/// Why a state is not fit to go on, and whose it is; `completed` means it is fit.
struct Health {
    Status status = Status::completed;
    int body = -1;
    const char* reason = "";       // what is wrong with the body, when the status does not say it
    std::vector<int> joints = {};  // that the reason speaks of as {joints}
};

/// A System has
///   void advance(int64 steps)             do that many steps, with no check inside
///   void observe(Recorder&, int64 sample)  recorder.sample(sample), looking ahead if velocities need it
///   Health health() const                  non-finite or runaway values
///   void save(), void restore()            keep and take back everything advance() changes, for a replay
///   int64 block() const                    steps between two checks, at most
/// The check costs nothing inside a step: a block that ends unfit is replayed step by step to find the step. Blocks
/// begin with one step, and grow as long as they are short, or keeping what a replay needs is a fiftieth of them. Long
/// steps look at the clock themselves (Watch); a block they leave unfinished is taken back: a few hundredths of a second
/// of whole steps, or a hundred times what keeping the state of a large scene costs. Throws Stopped when the time is over
/// before the sample at the start is read.
template <class System>
void run_loop(System& system, Recorder& recorder, std::int64_t steps, Watch& watch, RunReport& report) {
    const double begun = watch.elapsed(), worked = watch.processor();
    const auto stop = [&](std::int64_t done) {
        report.status = Status::timed_out;
        report.failed_step = done + 1;
    };
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
    const auto run_block = [&](std::int64_t end) {
        advance_to(done, end);
        health = system.health();
        if (health.status == Status::completed) {
            done = end;
            return;
        }
        system.restore();
        recorder.restore();
        for (std::int64_t step = done + 1; step <= end; ++step) {
            Watch::look();
            system.advance(1);
            health = system.health();
            if (health.status != Status::completed) {
                report.failed_step = step;
                return;
            }
            if (recorder.next_wanted(step) == step) system.observe(recorder, step);
            health = system.health();  // what is read may be what has no answer
            if (health.status != Status::completed) {
                report.failed_step = step;
                return;
            }
            done = step;
        }
    };
    std::int64_t length = 1;
    double now = begun;
    bool weighed =
        true;  // whether keeping is timed apart: of short blocks even a look at the clock would be felt
    while (done < steps && health.status == Status::completed) {
        if (watch.over(now)) {
            stop(done);
            break;
        }
        const double before = now;
        system.save();
        recorder.save();
        const std::int64_t from = done;
        const double began = weighed ? watch.elapsed() : before, enough = 50.0 * (began - before);
        try {
            run_block(std::min(done + length, steps));
        } catch (const Stopped&) {
            system.restore();
            recorder.restore();
            done = from;
            health = {};  // a block that ended unfit, and was not replayed to the step that made it so
            stop(done);
            break;
        }
        now = watch.elapsed();
        const double took = now - began;
        const bool apart = std::exchange(weighed, took > 0.1 * Watch::patience);
        if (took < std::max(0.5 * Watch::patience, enough)) length = std::min(2 * length, system.block());
        else if (apart && took > std::max(Watch::patience, 2.0 * enough))
            length = std::max<std::int64_t>(1, length / 2);
    }
    if (health.status != Status::completed) {
        report.status = health.status;
        report.failed_body = health.body;
        report.reason = health.reason;
        report.failed_joints = health.joints;
    }
    report.steps = done;
    report.seconds = watch.elapsed() - begun;
    report.cpu_seconds = watch.processor() - worked;
    report.recordings = recorder.recordings();
    report.counters["samples"] = recorder.samples_read();
}

}  // namespace spook
