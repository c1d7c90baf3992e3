#include "collision/broad_phase.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

namespace spook {

namespace {

constexpr std::size_t few = 32;    // below, a grid costs more than comparing all
constexpr int most_levels = 31;    // what is larger than the cells of the last is compared with all
constexpr std::size_t many = 512;  // worth several threads
constexpr double furthest = 1e9;   // cells from the origin; what lies further counts as there

std::int32_t coordinate(double x, double size) noexcept {
    return static_cast<std::int32_t>(std::floor(std::clamp(x / size, -furthest, furthest)));
}

}  // namespace

/// A little more than the median of all edges, so that most bounds fit the smallest cells.
double BroadPhase::choose_size(const std::vector<Bounds>& bounds) {
    extents_.clear();
    for (const Bounds& b : bounds) {
        const Vec3 edge = b.high - b.low;
        const bool valid = b.low.x <= b.high.x && b.low.y <= b.high.y && b.low.z <= b.high.z;
        extents_.push_back(valid ? std::max({edge.x, edge.y, edge.z}) : -1.0);
    }
    std::vector<double>& sorted = sorted_;
    sorted.clear();
    for (const double extent : extents_)
        if (extent > 0.0 && std::isfinite(extent)) sorted.push_back(extent);
    if (sorted.empty()) return 1.0;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    return 1.2 * *middle;
}

int BroadPhase::level_of(double extent, double size) noexcept {
    int level = 0;
    while (size < extent && level <= most_levels) size *= 2.0, ++level;
    return level;
}

BroadPhase::Cell BroadPhase::cell_at(const Bounds& b, int level) const noexcept {
    const double size = std::ldexp(size_, level);
    return {coordinate(0.5 * (b.low.x + b.high.x), size), coordinate(0.5 * (b.low.y + b.high.y), size),
            coordinate(0.5 * (b.low.z + b.high.z), size), level};
}

std::size_t BroadPhase::bucket(const Cell& cell) const noexcept {
    const std::uint64_t mixed = static_cast<std::uint32_t>(cell.x) * 0x9e3779b97f4a7c15ull ^
                                static_cast<std::uint32_t>(cell.y) * 0xc2b2ae3d27d4eb4full ^
                                static_cast<std::uint32_t>(cell.z) * 0x165667b19e3779f9ull ^
                                static_cast<std::uint32_t>(cell.level) * 0xd6e8feb86659fd93ull;
    return static_cast<std::size_t>((mixed ^ mixed >> 29) & (begin_.size() - 2));
}

void BroadPhase::fill_cells(const std::vector<Bounds>& bounds) {
    const std::size_t count = bounds.size();
    size_ = choose_size(bounds);
    levels_ = 0;
    everywhere_.clear();
    cells_.resize(count);
    begin_.assign(std::bit_ceil(2 * count) + 1, 0);
    std::size_t placed = 0;
    for (std::size_t i = 0; i < count; ++i) {
        cells_[i].level = -1;
        if (extents_[i] < 0.0) continue;
        const int level = level_of(extents_[i], size_);
        if (level > most_levels) {
            everywhere_.push_back(static_cast<int>(i));
            continue;
        }
        cells_[i] = cell_at(bounds[i], level);
        levels_ |= 1u << level;
        ++begin_[bucket(cells_[i]) + 1];
        ++placed;
    }
    for (std::size_t k = 1; k < begin_.size(); ++k) begin_[k] += begin_[k - 1];
    fill_.assign(begin_.begin(), begin_.end() - 1);
    entries_.resize(placed);
    for (std::size_t i = 0; i < count; ++i)
        if (cells_[i].level >= 0) entries_[fill_[bucket(cells_[i])]++] = {cells_[i], static_cast<int>(i)};
}

/// All partners of i of its own level, each pair once, and of coarser ones.
void BroadPhase::search(const std::vector<Bounds>& bounds, int i, std::vector<IndexPair>& found) const {
    const Bounds own = bounds[i];
    const auto look = [&](const Cell& cell, bool later_only) {
        const std::size_t k = bucket(cell);
        for (int e = begin_[k]; e < begin_[k + 1]; ++e) {
            const Entry& entry = entries_[e];
            if (!(entry.cell == cell) || (later_only && entry.index <= i)) continue;
            if (overlap(own, bounds[entry.index]))
                found.emplace_back(std::min(i, entry.index), std::max(i, entry.index));
        }
    };
    const Cell home = cells_[i];
    look(home, true);
    for (int n = 14; n < 27; ++n)  // the half of the neighbours that comes later: the others find us
        look({home.x + n % 3 - 1, home.y + n / 3 % 3 - 1, home.z + n / 9 - 1, home.level}, false);
    for (std::uint32_t left = levels_ >> home.level >> 1; left != 0; left &= left - 1) {
        const Cell there = cell_at(own, home.level + 1 + std::countr_zero(left));
        for (int n = 0; n < 27; ++n)
            look({there.x + n % 3 - 1, there.y + n / 3 % 3 - 1, there.z + n / 9 - 1, there.level}, false);
    }
}

/// Into `out` by first index and then by second: a counting sort, and short insertions.
void BroadPhase::sort_pairs(std::size_t count, std::vector<IndexPair>& out) {
    fill_.assign(count + 1, 0);
    std::size_t all = 0;
    for (const auto& found : found_) {
        all += found.size();
        for (const auto& [i, j] : found) ++fill_[i + 1];
    }
    for (std::size_t k = 1; k <= count; ++k) fill_[k] += fill_[k - 1];
    out.resize(all);
    for (const auto& found : found_)
        for (const auto& pair : found) out[fill_[pair.first]++] = pair;
    for (std::size_t i = 0, from = 0; i < count; ++i) {
        const auto to = static_cast<std::size_t>(fill_[i]);
        std::sort(out.begin() + static_cast<std::ptrdiff_t>(from),
                  out.begin() + static_cast<std::ptrdiff_t>(to));
        from = to;
    }
}

void BroadPhase::overlapping_pairs(const std::vector<Bounds>& bounds, std::vector<IndexPair>& out,
                                   Team* team) {
    out.clear();
    const int count = static_cast<int>(bounds.size());
    if (bounds.size() <= few) {
        for (int i = 0; i < count; ++i)
            for (int j = i + 1; j < count; ++j)
                if (overlap(bounds[i], bounds[j])) out.emplace_back(i, j);
        return;
    }
    fill_cells(bounds);
    found_.resize(team != nullptr ? static_cast<std::size_t>(team->size()) : 1);
    for (auto& found : found_) found.clear();
    share_out(team, bounds.size(), many, [&](int part, std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            if (cells_[i].level >= 0) search(bounds, static_cast<int>(i), found_[part]);
    });
    for (const int i : everywhere_)
        for (int j = 0; j < count; ++j)
            if (j != i && (j > i || cells_[j].level >= 0) && overlap(bounds[i], bounds[j]))
                found_[0].emplace_back(std::min(i, j), std::max(i, j));
    sort_pairs(bounds.size(), out);
}

}  // namespace spook
