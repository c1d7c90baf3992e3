// The impulses of one stage of a composition for which it ends on the rows; see rigid_hold.cpp.
#pragma once

#include <vector>

#include "linear/dense_rows.hpp"
#include "rigid/block_rows.hpp"

namespace spook {

class StageHold {
public:
    StageHold(const RigidModel& model, RigidState& live, const JointSet& joints, BlockRows& rows) noexcept
        : model_(model), live_(live), joints_(joints), rows_(rows) {}

    void begin();
    /// Seeks the multipliers for which the rows, assembled at the start of the stage, hold at its end, from those given, with
    /// which the momenta have been pushed; then the bodies are there. False if there are none near.
    bool hold(double tau, std::vector<double>& multiplier);

private:
    bool seek(double tau);
    bool factor_dense();
    bool iterate(double tau, bool dense);
    double violations_ahead(double tau);
    void mix(int iteration, int& kept);

    const RigidModel& model_;
    RigidState& live_;
    const JointSet& joints_;
    BlockRows& rows_;
    LargeArray<BodyState> trial_;  // per body
    std::vector<Mat3> axes_;       // per constrained body, those of its inertia where the stage starts
    // Per row:
    std::vector<double> violation_, extent_, step_, change_, last_plain_, last_step_, mixing_;
    double* multiplier_ = nullptr;
    bool dense_ = false;
    DenseRows dense_rows_;
    struct Coupling {                   // of two blocks on one moving body
        int block, other, row, column;  // row and column: the first of each
        int end, other_end, body;
    };
    std::vector<Coupling> couplings_;
};

}  // namespace spook
