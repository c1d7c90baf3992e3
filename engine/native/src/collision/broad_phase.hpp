// Which bounded shapes may touch: all pairs for few, a grid of grids for many.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "collision/bounds.hpp"

namespace spook {

using IndexPair = std::pair<int, int>;

/// Finds overlapping bounds in time proportional to their number and that of the pairs. Each lies, by its centre, in
/// a cell of a grid whose cells are at least as large as it is: the cells of level 0 hold most, those of each further
/// level are twice as large. Two that overlap are then in neighbouring cells of the coarser one's level. Rows of cells
/// along x are found by hashing; the cells of a row lie one behind the other.
///
/// What is searched for are pairs of bounds that have been made a little larger, and those are kept from call to call:
/// what stays within its own costs nothing but a look, what leaves is searched for anew, and all are where many leave.
/// What is told is the same in any case: the pairs that overlap, in order.
class BroadPhase {
public:
    /// Replaces `out` by all pairs (i, j), i < j, of overlapping bounds, in ascending order. Bounds with a coordinate
    /// that is not a number overlap nothing.
    void overlapping_pairs(const std::vector<Bounds>& bounds, std::vector<IndexPair>& out);

private:
    struct Cell {
        std::int32_t x, y, z, level;
        bool operator==(const Cell&) const = default;
    };
    struct Entry {
        Cell cell;
        int index;
    };
    void find_escaped(const std::vector<Bounds>& bounds);
    void fatten(std::size_t i, const Bounds& bounds, double out);
    bool follow();
    void rebuild();
    double choose_size();
    static int level_of(double extent, double size) noexcept;
    Cell cell_at(const Bounds& b, int level) const noexcept;
    std::size_t bucket(const Cell& cell) const noexcept;
    template <class Visit> void visit_row(const Cell& from, int cells, const Visit& visit) const;
    template <class Visit> void visit_around(const Cell& cell, const Visit& visit) const;
    double extent(std::size_t i) const noexcept;
    int place(std::size_t i);
    void fill_cells();
    void find_partners(int i, std::vector<IndexPair>& found) const;
    std::pair<Cell, Cell> reach(const Bounds& b, int level) const noexcept;
    std::int64_t rows_below(int i) const noexcept;
    void search(int i, std::vector<IndexPair>& found) const;
    void sort_pairs(std::size_t count, std::vector<IndexPair>& out);

    std::vector<Bounds> fat_;                            // of each, larger than its own
    std::vector<int> escaped_;                           // what has left them since the last call
    std::vector<char> has_escaped_;                      // of each
    std::vector<IndexPair> pairs_, new_pairs_, merged_;  // of those bounds; of what has escaped; scratch
    double size_ = 1.0;                                  // of the cells of level 0, m
    std::uint32_t levels_ = 0;                           // those that hold something, a bit each
    std::vector<double> sorted_;
    std::vector<int> everywhere_;    // those too large for any cell
    std::vector<Cell> cells_;        // of each
    std::vector<Entry> entries_;     // by bucket
    std::vector<int> begin_, fill_;  // of buckets in entries_; of first indices in the result
    std::vector<IndexPair> found_;
};

}  // namespace spook
