// What a run of rigid bodies goes on from, beside its joints and contacts.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "contacts/solve_quality.hpp"
#include "linear/large_array.hpp"
#include "linear/vec.hpp"
#include "rigid/joint_set.hpp"
#include "rigid/rigid_state.hpp"
#include "rigid/sleep.hpp"

namespace spook {

/// What mid-step velocities are averaged from.
struct BodyMomenta {
    Vec3 velocity, angular_momentum;
};

/// The first step with a solve that left its rows further from their law than the method allows, the body it
/// concerns, and the largest such residual of the run.
struct Unsettled {
    int body = -1;
    std::int64_t step = 0;  // of h, counted from 1
    double residual = 0.0;  // m/s
    bool sunk = false;      // no row is off, but the body was left in another
};

/// Which rows hold the Jacobians of the last solve.
enum class LastRows { block, mixed, plane };

/// Changes from step to step; copying it back goes back.
struct RigidState {
    LargeArray<BodyState> bodies;
    int not_solved = -1;     // a body of a system that could not be factored
    int contradicted = -1;   // a body held by rows that cannot hold together
    std::int64_t step = 0;   // steps of h begun
    std::int64_t moved = 0;  // steps of h after which positions are known
    Unsettled unsettled;
    int whirling = -1;  // a body that tension has made turn by a radian a step
    Sleep sleep;
    struct Stopped : StoppedImpacts {  // by contacts, or by a stop's other end
        std::int64_t step = 0;         // of the one that lost most
        double most_kinetic = 0.0;     // J, as steps begin
    } stopped;
    // Velocities at mid-step:
    bool velocity_ready = false;         // the velocities of the coming step are found already
    LargeArray<BodyMomenta> before;      // those of the step before
    std::vector<double> last_violation;  // per row, where the step before began
    struct Energy {                      // see energy_made.cpp
        double begun = 0.0, most = 0.0, most_kinetic = 0.0;  // J
        bool is_powered = false;  // some came, or may have come, from what is in no book
        // With velocities at mid-step: the step noted last, where it ended and how fast it went there.
        std::int64_t noted = -1;
        double potential = 0.0, kinetic = 0.0;  // J
    } energy;
    // Compositions:
    double pending = 0.0;  // s: half a stage still to be kicked
    int locked = -1;       // a body of redundant rows that contradict each other by now
    int lost = -1;         // a body of rows that no motion satisfies
    struct Watched {       // of the redundant rows of a loop, see rigid_locking.cpp
        double work = 0.0, motion = 0.0, last = 0.0;  // J: taken so far; the largest, and the last
        double held = 0.0, load = 0.0;                // √(2 J): what they held back, and what the loads gave
        double given = 0.0;                           // 2 J: what the loads gave at the last look
        std::int64_t next = 0, wait = 1;              // steps: of the next look, and to it
    };
    std::vector<Watched> watched;
    std::int64_t looks = 0;  // at loops, for rows that lock
    std::vector<int> named;  // joints that health() tells of
    std::int64_t stage_steps = 0, newton_iterations = 0, halved_steps = 0;
    // Stages × differences × unknowns: of the rows' forces [N], or of the paces of joint coordinates, from step
    // to step; per stage: how many of them tell the next.
    std::vector<double> history;
    std::vector<int> guess_order;
    int parts = 1;                  // of a step, each of which tension allows
    std::int64_t tension_look = 0;  // steps until the next look at it
    double part = 0.0;              // s: of a Runge–Kutta step within its tolerance, the next
    double residual = 0.0;          // m/s: the largest that an iterative solve has stopped at
    LastRows last_rows = LastRows::block;

    bool asleep(int body) const noexcept { return sleep.sleepers > 0 && sleep.island[body] != 0; }
    void note_stopped(const StoppedImpacts& these) noexcept {
        if (stopped.add(these)) stopped.step = step;
    }
    /// Of one, J: a stop whose rebound ends at the other end.
    void note_stopped(double lost, int body) noexcept {
        StoppedImpacts one;
        one.note(lost, body);
        note_stopped(one);
    }
    void note_unsettled(int body, double residual, bool sunk = false) {
        if (unsettled.body < 0) unsettled.body = body, unsettled.step = step, unsettled.sunk = sunk;
        unsettled.residual = std::max(unsettled.residual, residual);
    }
};

/// Nothing is asked of a joint of sleepers: it holds what it held.
inline bool rests(const JointBlock& block, const RigidState& live) noexcept {
    return (block.first >= 0 && live.asleep(block.first)) || (block.second >= 0 && live.asleep(block.second));
}

}  // namespace spook
