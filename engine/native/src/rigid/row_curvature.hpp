// The curvature of the rows of joints, kept in their right sides by extra solves (corrections); see row_curvature.cpp.
#pragma once

#include <vector>

#include "contacts/pivot_system.hpp"
#include "rigid/block_rows.hpp"

namespace spook {

/// Violations per row at some poses; zero for the rows of a free coordinate, which have no curvature to speak of.
void violations_at(const JointSet& joints, const LargeArray<BodyState>& at, double* out);

class RowCurvature {
public:
    RowCurvature(const RigidModel& model, RigidState& live, const JointSet& joints, BlockRows& rows) noexcept
        : model_(model), live_(live), joints_(joints), rows_(rows) {}

    /// Places for what each step compares.
    void begin();
    /// As if the step before had ended where the bodies are.
    void begin_where_it_stands();

    // Rows in `rows`, that keep their violations from step to step:
    /// Into the right sides what the way here has bent.
    void take_past_curvature();
    /// Solves again with what the way on bends.
    void correct();

    // Rows that keep none and are solved more than once, beside contacts and with bounds:
    /// What curvature takes from the right sides. c₋ and, before the first solve, c₊ are those of the velocities at hand,
    /// so that what spins steadily is right at once; then c₊ is that of the solution: `mixed`, or of `rows`.
    void curve(bool solved, const std::vector<Vec6>* mixed = nullptr);
    double taken(std::size_t row) const noexcept { return taken_.empty() ? 0.0 : taken_[row]; }
    /// The same for `rows`, before they are solved, and again.
    void predict_curvature();
    void refine_curvature();

private:
    void take_solution(const double* x, int body, BodyState& s) const noexcept;
    void keep_right();

    const RigidModel& model_;
    RigidState& live_;
    const JointSet& joints_;
    BlockRows& rows_;
    LargeArray<BodyState> trial_, from_, behind_;  // per body
    // Per row; past_ and taken_: what is taken from the right sides for the way here, and in all.
    std::vector<double> past_, taken_, first_right_, violation_, ahead_;
};

}  // namespace spook
