// Loops of joints, watched for redundant rows that lock; see rigid_locking.cpp.
#pragma once

#include <vector>

#include "linear/block_ldlt.hpp"
#include "rigid/block_rows.hpp"
#include "rigid/plane_step.hpp"
#include "run/report.hpp"

namespace spook {

class LoopWatch {
public:
    LoopWatch(const RigidModel& model, RigidState& live, const JointSet& joints, BlockRows& rows,
              const Forces& forces) noexcept
        : model_(model), live_(live), joints_(joints), rows_(rows), forces_(forces) {}

    /// Finds the loops that joints close.
    void take();
    bool empty() const noexcept { return loops_.empty(); }
    /// In which of them some rows repeat others, and something is left to move.
    void begin();
    /// After a solve, before its velocities are taken: whether rows lock.
    void look();
    /// Whether a step in a plane needs a look at some loop, which the rows of the space are for. If not, it is seen.
    bool wants_look(const PlaneStep& plane);
    /// A loop that leaves a motor nothing to move, and whose joints it has pulled open all the same, is unsettled. Asked at the end of a run.
    void judge_forced(RunReport& report);
    /// Redundant rows had to be told apart, which those that agree need not: of which loop?
    void note_projected();

private:
    struct Loop {                          // joints that close one, and all that is attached to them
        std::vector<int> blocks, members;  // of joints; places among the constrained bodies
        std::vector<int> drives;           // blocks of motors, limits and springs
        std::vector<int> edges;            // of the matrix, in the probe's order
        BlockLdlt probe;                   // the matrix of these with rigid rows
        bool may_lock = false;             // whether its redundant rows are watched
        std::vector<double> weakness, repeated, square;  // per row; per unknown; per member, m²

        /// How many ways it can move, by its rows as they are, and how many of these repeat others.
        std::int64_t freedom = 0, redundant = 0;

        void repeat();
        double held_back(const LargeArray<BodyConstants>& constants, std::span<const BodyState> bodies,
                         const std::vector<int>& constrained) const;
        bool bends(const JointSet& joints, const LargeArray<BodyConstants>& constants,
                   std::vector<BodyState> along, const std::vector<int>& constrained, double floor) const;
    };
    class Ties;
    void analyse_probes(Ties& ties, const std::vector<int>& at);
    void take_probe(Loop& loop, double part);
    void find_extents(Loop& loop);
    bool find_freedom(Loop& loop);
    void watch(Loop& loop, RigidState::Watched& seen);
    double motion_of(const Loop& loop) const;
    double driven(const Loop& loop);
    bool find_repeated(Loop& loop);
    bool stops(const RigidState::Watched& seen, double motion) const noexcept;
    void note_locked(const Loop& loop);
    std::vector<double> shares(const Loop& loop) const;

    const RigidModel& model_;
    RigidState& live_;
    const JointSet& joints_;
    BlockRows& rows_;
    const Forces& forces_;
    std::vector<Loop> loops_;
    std::vector<Vec6> push_;  // per constrained body: of drives
};

}  // namespace spook
