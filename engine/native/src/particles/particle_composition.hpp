// Symmetric compositions of higher order of a constrained step; see particle_composition.cpp.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "particles/particle_parts.hpp"
#include "run/stage_clock.hpp"

namespace spook {

class ParticleComposition {
public:
    /// `order`: 4, 6 or 8. The parts must outlive it.
    ParticleComposition(ParticleParts& parts, int order);

    /// From the nodes' state at the start of a run; `clock` null means stages are not timed.
    void start(StageClock* clock);
    void advance(std::int64_t steps);
    /// What is seen at the end of a step, without changing what goes on: velocities kicked and projected to the
    /// sample, forces from the accelerations there.
    void read(Seen& seen);
    void catch_up();

    std::int64_t newton_iterations() const noexcept { return state_.newton_iterations; }
    std::int64_t halved_steps() const noexcept { return state_.halved_steps; }
    std::int64_t stages() const noexcept { return static_cast<std::int64_t>(gammas_.size()); }

    /// What a later step depends on, besides the nodes.
    struct State {
        double pending = 0.0;          // s: half a stage still to be kicked (with rows) or drifted (without)
        std::int64_t stage_steps = 0;  // steps the history has seen
        std::int64_t newton_iterations = 0, halved_steps = 0;
        bool lost = false;            // no step is short enough: nothing is a number from here on
        int parts = 1;                // of a step, each of which tension allows
        std::vector<double> history;  // stages × three steps × rows, N
    };

    const State& state() const noexcept { return state_; }
    void go_back(const State& state) { state_ = state; }

private:
    void drift_kick(double tau) noexcept;
    void find_kicks() noexcept;
    bool is_too_taut(double length) noexcept;
    void constrained_step(double length, int depth);
    bool constrained_stage(double tau, double* history);
    double lengthen_paths(double tau, bool fresh) noexcept;
    void shorten_paths() noexcept;
    void extrapolate(double span, const double* history) noexcept;
    bool find_impulses(double tau);
    void predict_paths(double part) noexcept;
    void predict_blocks(double part) noexcept;
    double lengthen_blocks(double tau, bool fresh);
    void shorten_blocks();
    void solve_rigidly();

    Nodes& nodes_;
    DistanceRows& rows_;
    ParticleForces& forces_;
    OpenPaths& paths_;
    SaddleBlocks& saddle_;
    const ParticleSolver solver_;
    const double h_;                  // s, of a step
    std::span<const double> gammas_;  // lengths of the stages, in steps
    double longest_;                  // s, of them
    std::vector<double> pull_;        // Σ T/l per node, N/m
    State state_;
    static constexpr int MOST_HALVINGS = 12;
    std::vector<Vec3> step_x_[MOST_HALVINGS], step_v_[MOST_HALVINGS];  // where each step began
    std::vector<double> upper_;    // super-diagonal of the Newton matrix of paths, per row
    std::vector<double> impulse_;  // of rows before an iteration, N s
    StageClock* clock_ = nullptr;
};

}  // namespace spook
