// Overlapping bodies are parted by positions, and nothing else is to be seen of it; see project_positions.cpp.
#pragma once

#include <vector>

#include "contacts/position_projection.hpp"
#include "rigid/mixed_rows.hpp"

namespace spook {

class OverlapProjection {
public:
    OverlapProjection(const RigidModel& model, RigidState& live, JointSet& joints, const Forces& forces,
                      MixedRows& mixed, StepScratch& scratch) noexcept
        : model_(model), live_(live), joints_(joints), forces_(forces), mixed_(mixed), scratch_(scratch) {}

    /// The stage: overlaps of the step's end, and limits that the scene began beyond.
    void project_positions();

private:
    void project_overlaps();
    void project_limits();
    void gather_islands();
    void project_bodies();
    bool sleeps(const std::vector<int>& members) const;
    double affordable_share(int island) const;
    bool project_island(int island, double share);
    bool parts_first_overlaps(int island, double share);
    bool take_back(int island);
    bool keep_energy(int island);
    double hold_row(int k, int row, double now, RowBlock& block) const;
    bool hold_joints(const std::vector<int>& members, const std::vector<int>& own_blocks);
    void keep_spin_energy(int body);
    bool keep_momenta(const std::vector<int>& members, double limit);
    double dissipated_energy(const std::vector<int>& members, const std::vector<int>& own_blocks) const;
    double lifting_energy(const std::vector<int>& members) const;

    const RigidModel& model_;
    RigidState& live_;
    JointSet& joints_;
    const Forces& forces_;
    MixedRows& mixed_;
    StepScratch& scratch_;
    PositionProjection limit_projection_;             // of bodies beyond their joints' limits
    const PositionProjection* projection_ = nullptr;  // what is at hand
    PivotSolver holding_pivot_;
};

}  // namespace spook
