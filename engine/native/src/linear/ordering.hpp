// The order in which the blocks of a sparse symmetric saddle matrix are eliminated, found once per topology.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace spook {

/// Two coupled blocks, first < second.
struct BlockEdge {
    int first, second;
};

/// An elimination order and the columns of the block factor it leads to.
struct Ordering {
    std::vector<int> order;                  ///< order[k] is the block eliminated k-th
    std::vector<std::int64_t> column_start;  ///< column k couples to column_rows[column_start[k] .. [k + 1])
    std::vector<int> column_rows;            ///< blocks not yet eliminated, in order of their elimination
};

/// Minimum weighted degree on the block graph, with one rule for saddle systems: a constraint waits until the
/// bodies eliminated next to it have degrees of freedom left to resist it (its pivot would be its compliance
/// alone, perhaps zero), unless its body has so many constraints that eliminating the body first would couple
/// them all. Trees and chains, child before parent, get no block fill. Linear for trees and chains; otherwise the
/// work is that of the block pattern of one factorisation. `strict`: no pivot of a constraint may be its compliance, for
/// factors that have nothing to put in its place. Memory is kept, of `result` and of what leads to it.
void order_blocks(std::span<const int> sizes, std::span<const BlockEdge> edges,
                  std::span<const std::uint8_t> is_constraint, Ordering& result, bool strict = false);

}  // namespace spook
