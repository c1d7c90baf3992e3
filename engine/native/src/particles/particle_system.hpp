// The particle pipeline: state, forces, distance rows and their solve, one SPOOK step at a time.
//
// The parts own their data (particle_parts.hpp): nodes, rows, forces, and a solver of the rows. Here stand the order
// of a step, the curvature and half-step velocities that go beyond plain SPOOK, and what a run asks of the state.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "particles/particle_composition.hpp"
#include "particles/particle_parts.hpp"
#include "particles/particle_readings.hpp"
#include "particles/path_order.hpp"
#include "run/recorder.hpp"
#include "run/report.hpp"
#include "run/run_loop.hpp"
#include "run/stage_clock.hpp"
#include "run/stages.hpp"

namespace spook {

class ParticleSystem {
public:
    /// Built from the stages; throws std::invalid_argument for those it cannot run, or for rows that no stage solves.
    ParticleSystem(const ParticleScene& scene, StageList stages);

    ParticleSystem(const ParticleSystem&) = delete;  // parts refer to each other
    ParticleSystem& operator=(const ParticleSystem&) = delete;

    const StageList& stages() const noexcept { return stages_; }

    ParticleSolver solver() const noexcept { return parts_.solver; }

    // --- what run_loop asks for ---
    void advance(std::int64_t steps);
    void observe(Recorder& recorder, std::int64_t sample);
    Health health() const noexcept;
    void save() {
        keep(saved_);
        note();
    }
    void restore() { go_back(saved_); }
    struct Memory;
    /// All that the coming steps depend on, loads apart; going back to it gives the bits of going on from it.
    void keep(Memory& memory) const;
    void go_back(const Memory& memory);

    // What may be set between steps, from outside; reset() takes nothing of it back.
    /// Where the next reset() begins: 13 numbers per body, as final_state() gives them.
    void place(std::span<const double> state);
    void set_load(int body, Vec3 force);
    std::int64_t block() const noexcept { return block_; }

    /// Back to the start state; `clock` null means stages are not timed.
    void reset(StageClock* clock);
    void count(RunReport& report, std::int64_t steps) const;
    void judge_end(RunReport& report);
    std::vector<double> final_state();
    /// The same without a solve: velocities are NaN.
    std::vector<double> places() const;

    /// At the current sample.
    const ParticleReadings& readings() const noexcept { return readings_; }

    struct Memory {
        std::vector<Vec3> x, v;
        std::vector<double> lambda;
        bool velocity_ready = false;
        RowPgs::Work pgs;
        RedundantRows::Memory redundancy;
        ParticleComposition::State composition;
    };

private:
    void note();
    void look_ahead();
    void lay_out_paths(const std::vector<Path>& paths);
    void lay_out_plain();

    template <bool Timed> void advance_by(std::int64_t steps);
    template <bool Timed> void velocity_stage();
    void read_composition();
    template <bool Timed> void mark(Stage stage) noexcept {
        if constexpr (Timed) clock_->mark(stage);
    }
    void position_stage() noexcept;
    void solve_rows();
    void solve_rows_again();  // new right sides, same matrix
    void kick_nodes(std::vector<Vec3>& v) const noexcept;

    // particle_curvature.cpp: the curvature of the rows, velocities at mid-step
    void bend_rows_back() noexcept;
    void correct_curvature();
    void find_tensions();
    void half_kick_back();

    // particle_kernels.cpp: the same arithmetic with the time loop inside, for scenes that need no more
    void fly(std::int64_t steps) noexcept;
    void swing(std::int64_t steps) noexcept;
    template <bool Curved> void swing_by(std::int64_t steps) noexcept;

    ParticleScene scene_;
    StageList stages_;
    ParticleParts parts_;
    Nodes& nodes_ = parts_.nodes;
    DistanceRows& rows_ = parts_.rows;
    bool stiff_strings_ = false, half_step_ = false;
    int corrections_ = 0;            // extra solves per step for the curvature of the rows
    std::vector<double> first_rhs_;  // of the rows, before the curvature ahead
    std::vector<Vec3> trial_;        // velocities the curvature ahead is found with
    std::optional<ParticleComposition> composition_;
    int unread_ = -1;  // a body whose velocity at a sample was no number

    bool velocity_ready_ = false;  // the velocity stage of the coming step is already done
    std::int64_t block_ = 1024;
    Seen seen_;
    ParticleReadings readings_{scene_, parts_, seen_};
    Memory saved_;
    struct Noted {                               // between blocks of steps, for the judge at the end of a run
        double begun = 0.0, most_kinetic = 0.0;  // J
        double open = 0.0;                       // of a row's length, that it was too long by
        int row = -1;                            // this row, of the scene; whether its compliance is why
        bool gives_way = false;
        bool is_powered = false;  // loads give energy that is in no book
        bool asked = false;       // not where rows begin violated: nothing says what energy they give
    } noted_;
    StageClock* clock_ = nullptr;
};

}  // namespace spook
