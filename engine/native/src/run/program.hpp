// A compiled scene with its observables: what Python, and a page, hold and run.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "run/quantities.hpp"
#include "run/run_loop.hpp"
#include "run/stage_clock.hpp"
#include "run/stages.hpp"
#include "run/state_hash.hpp"

namespace spook {

/// What a system's keep() fills, all that a later step depends on: only the type of it is asked for.
template <class System, class Kept> Kept kept_by(void (System::*keep)(Kept&) const);

/// A System is what run_loop() asks for, and besides
///   System(const Scene&, StageList)            built from the stages it is given, and from nothing else
///   const StageList& stages() const            with those it runs marked as taken
///   void reset(StageClock*)                    back to the start; null: stages are not timed
///   void count(RunReport&, int64 steps) const  the work of so many steps
///   std::vector<double> final_state()
///   void keep(Kept&) const, void go_back(const Kept&), void place(span)   for a run one holds
///   const StageNotes& notes() const            optional: how it runs stages that have several ways
/// and two functions beside it
///   StageChoices choose_stages(const Scene&, bool observing)   which stages the scene needs, and why
///   Sampler sampler_of(System&, const QuantityRequest&)        throws std::invalid_argument
template <class System> class Program {
public:
    /// Throws std::invalid_argument for a quantity the pipeline does not have.
    template <class Scene>
    Program(const Scene& scene, const std::vector<QuantityRequest>& quantities,
            std::vector<Observation> observations)
        : choices_(choose_stages(scene, reads_while_running(observations))),
          system_(scene, StageList(choices_)),
          recorder_(samplers_of(system_, quantities), std::move(observations)) {
        if constexpr (requires { system_.notes(); })
            for (const auto& [stage, how] : system_.notes())
                if (StageChoice& choice = choices_[static_cast<std::size_t>(stage)]; choice.kept)
                    choice.how = how;
    }

    Program(const Program&) = delete;  // the samplers point into the system
    Program& operator=(const Program&) = delete;

    /// Every stage there is, kept or left out, and why.
    const StageChoices& choices() const noexcept { return choices_; }
    /// The stages some part of the system runs, in the order of the step.
    std::vector<Stage> stages() const { return system_.stages().taken(); }

    /// Run from the start. time_limit in s, 0 for none; timed asks for seconds by stage.
    RunReport run(std::int64_t steps, double time_limit, bool timed) {
        RunReport report;
        StageClock clock(choices_);
        Watch watch(time_limit);
        recorder_.prepare(steps);
        bool begun = true;
        try {
            system_.reset(timed ? &clock : nullptr);
            clock = StageClock(choices_);  // of steps alone
            run_loop(system_, recorder_, steps, watch, report);
        } catch (const Stopped&) {
            begun = false;
            report.seconds = watch.elapsed();
            report.cpu_seconds = watch.processor();
            report.recordings = recorder_.recordings();
            report.counters["samples"] = recorder_.samples_read();
        }
        const StageClock spent = clock;  // the state is read after the last step
        system_.count(report, report.steps);
        watch.extend();
        if (!begun) report.final_state = system_.places();
        if (!(begun && read_state(report)) && report.status == Status::completed) {
            report.status = Status::timed_out;
            report.failed_step = report.steps + 1;
        }
        if constexpr (requires { system_.judge_end(report); }) system_.judge_end(report);
        report.state_hash = state_hash(report.final_state);
        for (std::size_t k = 0; k < STAGES; ++k) {
            const Stage stage = static_cast<Stage>(k);
            if (timed && spent.seconds(stage) > 0.0)
                report.stage_seconds[to_text(stage)] = spent.seconds(stage);
        }
        return report;
    }

    // A run one holds: start() once, then advance(), read(), keep() and go_back() as one likes.

    /// Where a held run is.
    struct Snapshot {
        decltype(kept_by(&System::keep)) state;
        std::int64_t steps = 0;
    };

    /// Back to the start, or to 13 numbers per body as a report's final_state gives them. Throws Stopped when interrupted.
    void start(std::span<const double> state) {
        if (!state.empty()) system_.place(state);
        const Watch watch(0.0);
        system_.reset(nullptr);
        steps_ = 0;
    }
    /// So many steps on. The report is of these steps; its counters are of all work since start(), work taken back
    /// included, and failed_step counts from the start.
    RunReport advance(std::int64_t steps, double time_limit) {
        RunReport report;
        Recorder nothing;
        nothing.prepare(steps);
        Watch watch(time_limit);
        run_loop(system_, nothing, steps, watch, report);
        if (report.failed_step >= 0) report.failed_step += steps_;
        done_ += report.steps;
        steps_ += report.steps;
        return report;
    }
    /// Counters, final state and the observables as they are now, each as its last sample; changes nothing. What needs a
    /// solve that is not done within the time limit [s, 0 for none] is NaN.
    void read(RunReport& report, double time_limit) {
        const Snapshot here = keep();
        const Watch watch(time_limit);
        recorder_.prepare(steps_);
        try {
            system_.observe(recorder_, steps_);
        } catch (const Stopped&) {
            report.status = Status::timed_out;
        }
        report.recordings = recorder_.recordings();
        go_back(here);
        if (!read_state(report)) report.status = Status::timed_out;
        go_back(here);
        report.state_hash = state_hash(report.final_state);
        system_.count(report, done_);
        report.steps = steps_;
    }
    Snapshot keep() const {
        Snapshot snapshot;
        system_.keep(snapshot.state);
        snapshot.steps = steps_;
        return snapshot;
    }
    void go_back(const Snapshot& snapshot) {
        system_.go_back(snapshot.state);
        steps_ = snapshot.steps;
    }
    System& system() noexcept { return system_; }

private:
    /// False if the time is over, and only the places are known.
    bool read_state(RunReport& report) {
        try {
            report.final_state = system_.final_state();
            return true;
        } catch (const Stopped&) {
            report.final_state = system_.places();
            return false;
        }
    }
    static bool reads_while_running(const std::vector<Observation>& observations) noexcept {
        return std::any_of(observations.begin(), observations.end(),
                           [](const Observation& o) { return o.reduction != Reduction::final; });
    }
    static std::vector<Sampler> samplers_of(System& system, const std::vector<QuantityRequest>& quantities) {
        std::vector<Sampler> samplers;
        for (const QuantityRequest& request : quantities) samplers.push_back(sampler_of(system, request));
        return samplers;
    }

    StageChoices choices_;
    System system_;
    Recorder recorder_;
    std::int64_t steps_ = 0, done_ = 0;  // of a held run: where it is, and all that were done
};

}  // namespace spook
