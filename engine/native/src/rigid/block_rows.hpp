// Rows of joints that all hold, bilateral ones, with the masses of their bodies: one symmetric system,
//
//     [ −Sig  G ] [ −λ ]   [ r         ]
//     [  Gᵀ   M ] [  v ] = [ M v + h f ],
//
// factored by blocks (linear/block_ldlt.hpp), refined, and redundant rows told apart (linear/redundant_rows.hpp).
#pragma once

#include <span>
#include <vector>

#include "linear/block_ldlt.hpp"
#include "linear/redundant_rows.hpp"
#include "rigid/forces.hpp"
#include "rigid/joint_set.hpp"
#include "rigid/rigid_model.hpp"
#include "rigid/run_state.hpp"

namespace spook {

class BlockRows {
public:
    BlockRows(const RigidModel& model, RigidState& live, JointSet& joints, const Forces& forces) noexcept
        : model_(model), live_(live), joints_(joints), forces_(forces) {}

    BlockLdlt matrix;  // blocks of rows, then bodies
    LargeArray<double> right, solution;
    std::vector<Mat3> stiffness;  // per constrained body, added to its inertia, kg m²; empty: none

    /// Finds out how many rows there are.
    void take();
    std::size_t rows() const noexcept { return count_; }
    void analyse();
    void reset();

    /// Jacobians into the matrix, right sides of the rows.
    void assemble();
    void fill_inertias();
    void fill_momenta();
    /// False when nothing it gives may be used.
    bool factor_and_solve();
    void solve_again();  // new right sides, same matrix
    /// The solution's multipliers to the joints.
    void deliver();
    /// Where the values of the k-th constrained body are in `solution`, and `right`.
    std::size_t body_at(std::size_t k) const noexcept {
        return matrix.offset(static_cast<int>(joints_.blocks().size() + k));
    }
    /// Whether rows that were redundant are independent of the others by now.
    bool parted() const noexcept { return redundant_.parted(); }
    const RedundantRows::Memory& memory() const noexcept { return redundant_.memory(); }
    void restore(const RedundantRows::Memory& memory) { redundant_.restore(matrix, memory); }

    /// The bodies of a block of rows as they follow each other: its first, its second, those beyond; and the Jacobian of
    /// one, rows × 6, as assembled.
    int ends(int block) const noexcept { return 2 + static_cast<int>(places_[block].other_edges.size()); }
    int end_body(int block, int end) const noexcept {
        const JointBlock& both = joints_.blocks()[block];
        return end == 0 ? both.first : end == 1 ? both.second : joints_.others(block)[end - 2];
    }
    const double* end_rows(int block, int end) const noexcept {
        return end < 2 ? jacobian(block, end == 1) : wide_.data() + places_[block].wide_at + 6 * (end - 2);
    }
    double* jacobian(int block, bool second) noexcept;
    const double* jacobian(int block, bool second) const noexcept {
        return const_cast<BlockRows*>(this)->jacobian(block, second);
    }
    /// G v of a row, with the velocities of the bodies as they are, or of the solution.
    double row_speed(int block, int row, bool solved) const;
    /// Per row, G v' for the accelerations that keep the row still.
    void find_bias(double* bias) const;
    /// Momenta += Gᵀ Λ.
    void push(const double* multipliers);
    /// The block that carries the largest force.
    int busiest_block() const noexcept;

private:
    struct Place {
        int first_edge = -1, second_edge = -1;  // in the matrix
        bool first_particle = false, second_particle = false;
        std::vector<int> other_edges;  // of a row over more than two bodies, −1: it does not move by itself
        std::size_t wide_at = 0;       // in wide_
    };
    struct Worst {  // row residual, its block, and the largest speed asked for, m/s or rad/s
        double residual = 0.0, speed = 0.0;
        int block = 0;
    };
    Worst worst_row(std::span<const double> left) const;
    bool settled(std::span<const double> left) const;
    void find_contradiction();

    const RigidModel& model_;
    RigidState& live_;
    JointSet& joints_;
    const Forces& forces_;
    RedundantRows redundant_;
    std::vector<Place> places_;
    LargeArray<double> spare_;  // Jacobians with nowhere else to go, per block 2 × rows × 6
    std::vector<std::size_t> spare_at_;
    LargeArray<double> wide_;  // Jacobians of the bodies beyond a row's first two
    std::size_t count_ = 0;
};

}  // namespace spook
