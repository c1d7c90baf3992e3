// Bilateral rows beside the laws of the cone's Newton method: joints, which are unknowns of its factor.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "contacts/mass_factors.hpp"
#include "contacts/pivot_system.hpp"
#include "linear/block_lu.hpp"

namespace spook {

/// The rows G v + Sig z = r of a system, block by block: each block is a node of the factored matrix beside the bodies,
///
///     M dv − Gᵀ dz = …,    G dv + (Sig + relief) dz = lack,
///
/// so that a tree is eliminated without fill. The relief is for redundant rows: it stands in the factor alone, and refinement
/// takes it out. Rows are scaled to √J as the laws of contacts are.
class BilateralRows {
public:
    static bool is_bilateral(const RowBlock& block, int row) noexcept {
        return !(block.is_contact && row > 0) && block.lower[row] == -unbounded &&
               block.upper[row] == unbounded;
    }

    /// Takes the bilateral rows of a system: their multipliers are where it starts.
    void read(const MixedSystem& system, const MassFactors& mass);
    int nodes() const noexcept { return static_cast<int>(nodes_.size()); }
    int rows() const noexcept { return rows_; }
    int size(int node) const noexcept { return nodes_[node].count; }

    /// Pairs of a body and a node, which is numbered from `bodies` on.
    void couple(int bodies, std::vector<std::pair<int, int>>& pairs) const;
    /// Where their blocks are in a matrix analysed with `pairs`.
    void place(int bodies, const std::vector<std::pair<int, int>>& pairs);
    /// Writes them into a matrix that is clear.
    void fill(int bodies, BlockLu& matrix) const;

    /// v += Gᵀ z, for impulses; and u = G v + Sig z − r.
    void push(Vec6* momentum) const;
    void measure(const Vec6* velocity);
    double largest_right() const;
    /// The largest row, as √J and as a velocity.
    struct Left {
        double map = 0.0, speed = 0.0;
    };
    Left worst() const;
    /// The sum of squares parts of the way along both directions, J.
    double merit(double length, double along) const;
    void move(double length, double along);

    /// What is to be answered: all of u, or nothing, as along the path.
    void ask(bool newton);
    /// Its square, J.
    double asked() const;
    void respond(Vec6* nodes) const;
    /// Takes the answer of the factor: change += Gᵀ of it.
    void turn(const Vec6* nodes, Vec6* change);
    /// What it leaves, for the velocities it makes: the square, J.
    double remain(const Vec6* change);
    /// Adds it to Newton's direction or the path's; the first part of an answer replaces what was there.
    void take(bool newton, bool first);
    void forget_path();

    void keep_best();
    void keep_met();
    void back_to_met();
    void back_to_best();
    /// Best multipliers into the system.
    void deliver(MixedSystem& system);

private:
    using Row = std::array<double, 6>;
    struct Tie {
        int body = -1;
        int edge = -1;
        std::array<Vec6, 6> rows{};  // G
    };
    struct Node {
        int block = 0, count = 0;
        int first_tie = 0, ties = 0;  // in ties_
        std::array<int, 6> row{};     // of the block
        Row softness{}, right{}, root{};
        Row z{}, u{}, dz{}, du{}, tz{}, tu{}, lack{}, c{}, image{}, best{}, met{};
    };
    std::vector<Node> nodes_;
    std::vector<Tie> ties_;
    int rows_ = 0;
};

}  // namespace spook
