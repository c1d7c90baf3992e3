// One step's equations with bounds: what joints and contacts are written into and what every solver reads.
//
//     M v − Σ Gᵀ z = p,    w = G v + Sig z − r,    lower <= z <= upper,
//     w = 0 where lower < z < upper,  w >= 0 where z = lower,  w <= 0 where z = upper.
//
// z are impulses [N s] (a rotation's row: N m s). A bilateral row has infinite bounds; a contact's normal, and a
// limit, have 0 and infinity; a motor has ∓ time step times its largest force; friction has ∓ mu nu.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <vector>

namespace spook {

using Vec6 = std::array<double, 6>;   // linear part, then angular, world axes
using Mat6 = std::array<double, 36>;  // row-major

inline constexpr double unbounded = std::numeric_limits<double>::infinity();

/// Where a row stands in the complementarity problem; kept from step to step as a warm start.
enum class RowState : signed char { at_lower = -1, free = 0, at_upper = 1 };

/// A body beyond the first two of a row that ties several.
struct FurtherBody {
    int body = 0;  // index into MixedSystem::mass
    Vec6 jacobian{};
};

/// The row of a block that is a joint's stop or a wire, and what an impact is to leave there.
struct StopRow {
    int row = -1;                // of the block; −1: it has none
    bool touching = false;       // as the step begins
    bool hit = false;            // its rate leads there within the step
    double rebound = 0.0;        // where it is hit, the rate it sends back, m/s or rad/s; else 0
    bool answered = false;       // by an impact
    bool limit_reached = false;  // by the last of its step
    // Of a stop with two ends:
    double room = unbounded;   // to the other end, m or rad
    double range = 0.0;        // from one to the other
    double other = 0.0;        // right side of a row for the other end
    double given = 0.0;        // what bodies that move as they are told give to its rate, m/s or rad/s
    bool both = false;         // the other end has its row, too
    double cut = 0.0;          // J per N s of its impulse: what its rebound lacks, to end at the other end
    bool asks = false;         // left out, to find what forces give to its rate
    bool may_be_late = false;  // hit within the step if it pushes
};

/// Up to six rows between two moving bodies (or one: `second` or `first` is −1), or one row over any number.
struct RowBlock {
    int first = -1, second = -1;  // indices into MixedSystem::mass; −1 does not move
    int size = 1;
    std::array<Vec6, 6> first_jacobian{}, second_jacobian{};  // one Vec6 per row
    Vec6 softness{};                                          // Sig, or gamma/h of a velocity row
    Vec6 right{};                                             // r: of a holonomic row −(4/h) Ups g + Ups G v
    Vec6 lower{-unbounded, -unbounded, -unbounded, -unbounded, -unbounded, -unbounded};
    Vec6 upper{unbounded, unbounded, unbounded, unbounded, unbounded, unbounded};
    Vec6 multiplier{};  // z: the start of an iteration, then the result
    std::array<RowState, 6> state{};
    bool is_contact =
        false;           // rows after the normal are friction: the law bounds them, whatever is said here
    bool leads = false;  // its right sides lead back to where the rows hold, which may wait for a step
    StopRow stop;
    int rotor =
        -1;  // the row of a geared rotor: its softness is that of an inertia, its right side a speed, in impacts too
    std::span<const FurtherBody> further;  // what fills the rows keeps what it shows
};

/// Indices of bodies are those of moving bodies only; bodies that do not move appear in the rows' right sides.
struct MixedSystem {
    std::vector<Mat6> mass;      // symmetric, positive definite
    std::vector<Vec6> momentum;  // p = M v + h f
    std::vector<RowBlock> rows;
    std::vector<Vec6> velocity;  // the result v₊
};

inline double dot(const Vec6& a, const Vec6& b) noexcept {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5];
}

/// (G v)ᵢ of one row.
inline double row_velocity(const RowBlock& block, int i, const std::vector<Vec6>& velocity) noexcept {
    double sum = 0.0;
    if (block.first >= 0) sum += dot(block.first_jacobian[i], velocity[block.first]);
    if (block.second >= 0) sum += dot(block.second_jacobian[i], velocity[block.second]);
    for (const FurtherBody& other : block.further) sum += dot(other.jacobian, velocity[other.body]);
    return sum;
}

/// Whether velocities lead within a step past the end of a stop whose row is that of its other end.
inline bool passes_other_end(const RowBlock& block, const std::vector<Vec6>& velocity,
                             double time_step) noexcept {
    constexpr double passed = 1e-12;  // of its range: rounding
    const StopRow& stop = block.stop;
    if (stop.row < 0 || stop.both || stop.room == unbounded) return false;
    const bool low = block.lower[stop.row] == 0.0, high = block.upper[stop.row] == 0.0;
    if (low == high) return false;  // broken
    const double way = time_step * (row_velocity(block, stop.row, velocity) + stop.given);
    return (low ? way : -way) > std::max(0.0, stop.room) + passed * stop.range;
}

/// Whether one of the first `joints` blocks of rows does: it needs a row for that end before the step can be solved.
inline bool passes_other_ends(const MixedSystem& system, std::size_t joints, double time_step) noexcept {
    for (std::size_t k = 0; k < joints; ++k)
        if (passes_other_end(system.rows[k], system.velocity, time_step)) return true;
    return false;
}

/// wᵢ = (G v)ᵢ + Sigᵢ zᵢ − rᵢ.
inline double row_residual(const RowBlock& block, int i, const std::vector<Vec6>& velocity) noexcept {
    return row_velocity(block, i, velocity) + block.softness[i] * block.multiplier[i] - block.right[i];
}

}  // namespace spook
