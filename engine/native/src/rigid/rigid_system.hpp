// The rigid-body stepper: what a step needs, in the order of the step, and nothing else.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "rigid/bilateral_solve.hpp"
#include "rigid/block_rows.hpp"
#include "rigid/energy_made.hpp"
#include "rigid/forces.hpp"
#include "rigid/half_step.hpp"
#include "rigid/mixed_rows.hpp"
#include "rigid/overlap_projection.hpp"
#include "rigid/plane_path.hpp"
#include "rigid/readings.hpp"
#include "rigid/rigid_composition.hpp"
#include "rigid/rigid_model.hpp"
#include "rigid/row_curvature.hpp"
#include "rigid/run_state.hpp"
#include "rigid/sleeping.hpp"
#include "rigid/step_scratch.hpp"
#include "rigid/tree_runge_kutta.hpp"
#include "run/run_loop.hpp"
#include "run/stage_clock.hpp"
#include "run/stages.hpp"

namespace spook {

/// One scene with its state. One step of h, symplectic order:
///   forces → p = M v + h f;  contacts → impact;  joints → rows;  one solve → v₊, λ;
///   positions and orientations with v₊.
/// Bodies that can never have rows are moved directly. The angular momentum of a body is its state, so that a
/// free body keeps it to the last bit. A step in which nothing touches is solved as if contacts were impossible.
class RigidSystem {
public:
    /// Built from the stages; throws std::invalid_argument for those it cannot run, or joints that no stage solves.
    /// It has a state once it was reset.
    RigidSystem(const RigidScene& scene, StageList stages);
    RigidSystem(const RigidSystem&) = delete;  // its parts point at each other

    const StageList& stages() const noexcept { return model_.stages; }
    /// How stages run that have several ways.
    const StageNotes& notes() const noexcept { return notes_; }

    // For run_loop:
    void advance(std::int64_t steps);
    void observe(Recorder& recorder, std::int64_t sample);
    Health health() const;
    void save();
    void restore();
    /// Fewer steps between two checks, the larger the scene: they are taken back together.
    std::int64_t block() const noexcept {
        return std::clamp<std::int64_t>(200'000 / model_.bodies(), 16, 64);
    }

    struct Snapshot;
    /// All that the coming steps depend on, drives apart; going back to it gives the bits of going on from it. Where velocities
    /// were looked ahead for with contacts, it is what was before. keep() has what can be read at once as well.
    void keep(Snapshot& kept) const;
    void go_back(const Snapshot& kept);

    // What may be set between steps, from outside; reset() takes nothing of it back.
    /// Where the next reset() begins: 13 numbers per body, as final_state() gives them.
    void place(std::span<const double> state);
    void set_load(int body, Vec3 force, Vec3 torque);
    void set_velocity(int body, Vec3 velocity, Vec3 angular_velocity);
    void set_motor(int joint, double speed, double max_force);
    void set_rest(int joint, double rest);

    void reset(StageClock* clock);
    void count(RunReport& report, std::int64_t steps) const;
    using Unsettled = spook::Unsettled;
    std::vector<double> final_state();
    /// The same without a solve: velocities are NaN.
    std::vector<double> places() const { return readings_.states(false); }
    void judge_end(RunReport& report);

    /// What can be observed.
    const RigidReadings& read() const noexcept { return readings_; }
    /// Samples will read velocities, or forces: where those live between the samples they are looked up for it.
    void see_velocities() noexcept { velocities_seen_ = velocities_seen_ || !model_.method.runge_kutta; }
    void see_forces() noexcept { velocities_seen_ = true; }
    /// From now on the turns of this hinge are counted.
    void track(int joint) noexcept { joints_.track(joint); }

    /// What solves of the next step start from.
    struct WarmStart {
        MixedSystem mixed;
        RedundantRows::Memory redundancy;
        std::vector<double> jacobians;  // of the last step, which the stiffness of the next is made of
    };
    struct Snapshot {
        RigidState state;
        JointStates joints;
        WarmStart warm;
        ContactStage::Snapshot contacts;
        std::vector<Vec6> wrenches;  // of joints in the step before, where they may be read before the next
    };

private:
    void keep_state(Snapshot& kept) const;
    void take_stages(const RigidScene& scene);
    void take_bodies(const RigidScene& scene);
    void step();
    void begin_velocities();
    void find_velocities();
    void solve_velocities();
    void leave_out_sleepers();
    bool wake_met();
    void integrate();
    void end_step();
    void deliver();
    void solve_ahead();

    /// Work whose counters go_back() leaves alone, of solvers that are in no memory. How much of it blocks take back
    /// depends on how long they are, and that on the clock: it is no work of the run.
    struct Work {
        BlockLdlt::Counters factors;
        std::uint64_t rounds = 0, pgs_iterations = 0;
        Work operator+(const Work& more) const noexcept;
        Work operator-(const Work& less) const noexcept;
    };
    Work work_done() const noexcept;

    RigidModel model_;
    RigidState live_;
    JointSet joints_;
    StageTimer clock_;
    StepScratch scratch_;
    Forces forces_;
    BlockRows rows_;
    RowCurvature curvature_;
    MixedRows mixed_;
    BilateralSolve bilateral_;
    PlanePath plane_;
    RigidComposition composition_;
    TreeRungeKutta runge_kutta_;
    HalfStep half_step_;
    Sleeping sleeping_;
    OverlapProjection projection_;
    EnergyMade energy_;
    RigidReadings readings_;
    StageNotes notes_;

    Snapshot saved_, before_solve_ahead_;       // the latter: before solve_ahead(), with contacts
    Snapshot before_waking_;                    // before the velocities of a step in which some body may wake
    bool replaying_ = false;                    // a block that ended unfit
    LargeArray<JointSet::State> early_joints_;  // then: as its first step left them
    bool velocities_seen_ = false;
    Work work_kept_, work_taken_back_;
};

}  // namespace spook
