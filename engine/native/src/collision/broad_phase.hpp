// Which bounded shapes may touch: all pairs for few, a grid of grids for many.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "collision/bounds.hpp"
#include "run/team.hpp"

namespace spook {

using IndexPair = std::pair<int, int>;

/// Finds overlapping bounds in time proportional to their number and that of the pairs. Each lies, by its centre, in
/// a cell of a grid whose cells are at least as large as it is: the cells of level 0 hold most, those of each further
/// level are twice as large. Two that overlap are then in neighbouring cells of the coarser one's level. The cells are
/// found by hashing. Built anew in each call, which costs less than what hangs on the pairs; memory is kept.
class BroadPhase {
public:
    /// Replaces `out` by all pairs (i, j), i < j, of overlapping bounds, in ascending order. Bounds with a coordinate
    /// that is not a number overlap nothing. With a `team` many are searched for on all its threads.
    void overlapping_pairs(const std::vector<Bounds>& bounds, std::vector<IndexPair>& out,
                           Team* team = nullptr);

private:
    struct Cell {
        std::int32_t x, y, z, level;
        bool operator==(const Cell&) const = default;
    };
    struct Entry {
        Cell cell;
        int index;
    };
    double choose_size(const std::vector<Bounds>& bounds);
    static int level_of(double extent, double size) noexcept;
    Cell cell_at(const Bounds& b, int level) const noexcept;
    std::size_t bucket(const Cell& cell) const noexcept;
    void fill_cells(const std::vector<Bounds>& bounds);
    void search(const std::vector<Bounds>& bounds, int i, std::vector<IndexPair>& found) const;
    void sort_pairs(std::size_t count, std::vector<IndexPair>& out);

    double size_ = 1.0;            // of the cells of level 0, m
    std::uint32_t levels_ = 0;     // those that hold something, a bit each
    std::vector<double> extents_;  // largest edge of each, m; negative if it overlaps nothing
    std::vector<double> sorted_;
    std::vector<int> everywhere_;                // those too large for any cell
    std::vector<Cell> cells_;                    // of each
    std::vector<Entry> entries_;                 // by bucket
    std::vector<int> begin_, fill_;              // of buckets in entries_; of first indices in the result
    std::vector<std::vector<IndexPair>> found_;  // by each thread
};

}  // namespace spook
