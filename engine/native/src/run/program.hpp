// A compiled scene with its observables: what Python, and a page, hold and run.
#pragma once

#include <utility>
#include <vector>

#include "run/quantities.hpp"
#include "run/run_loop.hpp"
#include "run/stage_clock.hpp"
#include "run/stages.hpp"
#include "run/state_hash.hpp"

namespace spook {

/// A System is what run_loop() asks for, and besides
///   System(const Scene&, StageList)            built from the stages it is given, and from nothing else
///   const StageList& stages() const            with those it runs marked as taken
///   void reset(StageClock*)                    back to the start; null: stages are not timed
///   void count(RunReport&, int64 steps) const  the work of so many steps
///   std::vector<double> final_state()
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
          recorder_(samplers_of(system_, quantities), std::move(observations)) {}

    Program(const Program&) = delete;  // the samplers point into the system
    Program& operator=(const Program&) = delete;

    /// Every stage there is, kept or left out, and why.
    const StageChoices& choices() const noexcept { return choices_; }
    /// The stages some part of the system runs, in the order of the step.
    std::vector<Stage> stages() const { return system_.stages().taken(); }

    /// Run from the start. time_limit in s, 0 for none; timed asks for seconds by stage.
    RunReport run(std::int64_t steps, double time_limit, bool timed) {
        RunReport report;
        StageClock clock;
        system_.reset(timed ? &clock : nullptr);
        recorder_.prepare(steps);
        run_loop(system_, recorder_, steps, time_limit, report);
        system_.count(report, report.steps);
        report.final_state = system_.final_state();
        report.state_hash = state_hash(report.final_state);
        for (std::size_t k = 0; k < STAGES; ++k) {
            const Stage stage = static_cast<Stage>(k);
            if (timed && clock.seconds(stage) > 0.0)
                report.stage_seconds[to_text(stage)] = clock.seconds(stage);
        }
        return report;
    }

private:
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
};

}  // namespace spook
