// Which bounded shapes may touch: all pairs for few, sweep and prune along the longest axis for many.
#pragma once

#include <utility>
#include <vector>

#include "collision/bounds.hpp"

namespace spook {

using IndexPair = std::pair<int, int>;

/// Replaces `out` by all pairs (i, j), i < j, of overlapping bounds, in ascending order.
/// Bounds with a coordinate that is not a number overlap nothing.
void overlapping_pairs(const std::vector<Bounds>& bounds, std::vector<IndexPair>& out);

}  // namespace spook
