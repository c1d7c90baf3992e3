#include "collision/broad_phase.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

#include "collision/tolerances.hpp"

namespace spook {

namespace {

using namespace tolerances::broad_phase;

constexpr std::size_t few = 32;  // bodies: below, a grid costs more than comparing all
constexpr std::int64_t most_rows =
    100;  // of smaller cells: what reaches more, or longer ones, is compared with all
static_assert(most_rows < static_cast<std::int64_t>(std::bit_ceil(2 * few + 1)),
              "no row is as long as the table");

std::int32_t coordinate(double x, double size) noexcept {
    return static_cast<std::int32_t>(std::floor(std::clamp(x / size, -furthest, furthest)));
}

}  // namespace

/// What is no longer within its enlarged bounds, or far within, gets others.
void BroadPhase::find_escaped(const std::vector<Bounds>& bounds) {
    escaped_.clear();
    const double inside = loose * fatness * size_;
    const auto stays = [inside](double low, double high, double fat_low, double fat_high) {
        return fat_low <= low && low <= high && high <= fat_high && !(low - fat_low > inside) &&
               !(fat_high - high > inside);
    };
    for (std::size_t i = 0; i < bounds.size(); ++i) {
        const Bounds &own = bounds[i], &fat = fat_[i];
        if (stays(own.low.x, own.high.x, fat.low.x, fat.high.x) &&
            stays(own.low.y, own.high.y, fat.low.y, fat.high.y) &&
            stays(own.low.z, own.high.z, fat.low.z, fat.high.z))
            continue;
        escaped_.push_back(static_cast<int>(i));
        const Vec3 down = fat.low - own.low, up = own.high - fat.high;
        fatten(i, own, std::max({down.x, down.y, down.z, up.x, up.y, up.z}));
    }
}

/// Larger bounds; none for what has got so far out that it would leave them in the next call.
void BroadPhase::fatten(std::size_t i, const Bounds& bounds, double out) {
    const double by = fatness * size_, more = out <= fast * by ? by : 0.0;
    fat_[i] = {bounds.low - Vec3{more, more, more}, bounds.high + Vec3{more, more, more}};
}

/// The largest edge, m; negative if it overlaps nothing.
double BroadPhase::extent(std::size_t i) const noexcept {
    const Bounds& b = fat_[i];
    const Vec3 edge = b.high - b.low;
    const bool valid = b.low.x <= b.high.x && b.low.y <= b.high.y && b.low.z <= b.high.z;
    return valid ? std::max({edge.x, edge.y, edge.z}) : -1.0;
}

/// A little more than the median of all edges, so that most bounds fit the smallest cells.
double BroadPhase::choose_size() {
    std::vector<double>& sorted = sorted_;
    sorted.clear();
    for (std::size_t i = 0; i < fat_.size(); ++i)
        if (const double own = extent(i); own > 0.0 && std::isfinite(own)) sorted.push_back(own);
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
    const std::uint64_t mixed = static_cast<std::uint32_t>(cell.y) * 0xc2b2ae3d27d4eb4full ^
                                static_cast<std::uint32_t>(cell.z) * 0x165667b19e3779f9ull ^
                                static_cast<std::uint32_t>(cell.level) * 0xd6e8feb86659fd93ull;
    return static_cast<std::size_t>((mixed ^ mixed >> 29) + static_cast<std::uint32_t>(cell.x)) &
           (begin_.size() - 2);
}

/// Tells of every member in so many cells of a row.
template <class Visit> void BroadPhase::visit_row(const Cell& from, int cells, const Visit& visit) const {
    const std::size_t first = bucket(from), end = first + static_cast<std::size_t>(cells),
                      buckets = begin_.size() - 1;
    const auto in = [&](std::size_t begin, std::size_t end) {
        for (int e = begin_[begin]; e < begin_[end]; ++e) {
            const Entry& entry = entries_[e];
            const std::int64_t along = std::int64_t{entry.cell.x} - from.x;
            if (along >= 0 && along < cells && entry.cell.y == from.y && entry.cell.z == from.z &&
                entry.cell.level == from.level)
                visit(entry);
        }
    };
    in(first, std::min(end, buckets));
    if (end > buckets) in(0, end - buckets);
}

/// Finds the cell of one; its level, too, which is beyond the last for what is too large for any cell.
int BroadPhase::place(std::size_t i) {
    cells_[i].level = -1;
    const double own = extent(i);
    if (own < 0.0) return -1;
    const int level = level_of(own, size_);
    if (level <= most_levels) cells_[i] = cell_at(fat_[i], level);
    return level;
}

/// Lists what lies in which cell.
void BroadPhase::fill_cells() {
    const std::size_t count = cells_.size();
    levels_ = 0;
    begin_.assign(std::bit_ceil(2 * count) + 1, 0);
    std::size_t placed = 0;
    for (const Cell& cell : cells_) {
        if (cell.level < 0) continue;
        levels_ |= 1u << cell.level;
        ++begin_[bucket(cell) + 1];
        ++placed;
    }
    for (std::size_t k = 1; k < begin_.size(); ++k) begin_[k] += begin_[k - 1];
    fill_.assign(begin_.begin(), begin_.end() - 1);
    entries_.resize(placed);
    for (std::size_t i = 0; i < count; ++i)
        if (cells_[i].level >= 0) entries_[fill_[bucket(cells_[i])]++] = {cells_[i], static_cast<int>(i)};
}

/// Tells of every member in a cell and its neighbours.
template <class Visit> void BroadPhase::visit_around(const Cell& cell, const Visit& visit) const {
    for (int n = 0; n < 9; ++n)
        visit_row({cell.x - 1, cell.y + n % 3 - 1, cell.z + n / 3 - 1, cell.level}, 3, visit);
}

/// All partners of i of its own level, each pair once, and of coarser ones.
void BroadPhase::search(int i, std::vector<IndexPair>& found) const {
    const Bounds own = fat_[i];
    const auto meet = [&](const Entry& entry) {
        if (overlap(own, fat_[entry.index]))
            found.emplace_back(std::min(i, entry.index), std::max(i, entry.index));
    };
    const auto [x, y, z, level] = cells_[i];
    visit_row({x, y, z, level}, 2, [&, x = x](const Entry& entry) {
        if (entry.cell.x > x || entry.index > i) meet(entry);
    });
    // The half of the neighbours that comes later: the others find us.
    visit_row({x - 1, y + 1, z, level}, 3, meet);
    for (int n = -1; n <= 1; ++n) visit_row({x - 1, y + n, z + 1, level}, 3, meet);
    for (std::uint32_t left = levels_ >> level >> 1; left != 0; left &= left - 1)
        visit_around(cell_at(own, level + 1 + std::countr_zero(left)), meet);
}

/// Into `out` by first index and then by second: a counting sort, and short insertions.
void BroadPhase::sort_pairs(std::size_t count, std::vector<IndexPair>& out) {
    fill_.assign(count + 1, 0);
    for (const IndexPair& pair : found_) ++fill_[pair.first + 1];
    for (std::size_t k = 1; k <= count; ++k) fill_[k] += fill_[k - 1];
    out.resize(found_.size());
    for (const IndexPair& pair : found_) out[fill_[pair.first]++] = pair;
    for (std::size_t i = 0, from = 0; i < count; ++i) {
        const auto to = static_cast<std::size_t>(fill_[i]);
        std::sort(out.begin() + static_cast<std::ptrdiff_t>(from),
                  out.begin() + static_cast<std::ptrdiff_t>(to));
        from = to;
    }
}

/// The cells of a smaller level whose bounds may reach into these.
std::pair<BroadPhase::Cell, BroadPhase::Cell> BroadPhase::reach(const Bounds& b, int level) const noexcept {
    const double size = std::ldexp(size_, level), half = 0.5 * size;
    return {{coordinate(b.low.x - half, size), coordinate(b.low.y - half, size),
             coordinate(b.low.z - half, size), level},
            {coordinate(b.high.x + half, size), coordinate(b.high.y + half, size),
             coordinate(b.high.z + half, size), level}};
}

/// How many rows of smaller cells that is, in all levels; of few but long ones, how many cells one has.
std::int64_t BroadPhase::rows_below(int i) const noexcept {
    std::int64_t rows = 0;
    if (cells_[i].level < 0) return rows;
    for (std::uint32_t left = levels_ & ((1u << cells_[i].level) - 1); left != 0; left &= left - 1) {
        const auto [low, high] = reach(fat_[i], std::countr_zero(left));
        const std::int64_t x = std::int64_t{high.x} - low.x + 1, y = std::int64_t{high.y} - low.y + 1,
                           z = std::int64_t{high.z} - low.z + 1;
        rows += std::max(x, std::min(y, most_rows + 1) * std::min(z, most_rows + 1));
    }
    return rows;
}

/// All partners of one that has escaped; of another that has, too, the one of lower index finds the other.
void BroadPhase::find_partners(int i, std::vector<IndexPair>& found) const {
    const Bounds own = fat_[i];
    const auto meet = [&](int j) {
        if (j == i || (has_escaped_[j] && j < i) || !overlap(own, fat_[j])) return;
        found.emplace_back(std::min(i, j), std::max(i, j));
    };
    const Cell home = cells_[i];
    if (home.level < 0) return;
    for (const int j : everywhere_) meet(j);
    if (rows_below(i) > most_rows) {
        for (std::size_t j = 0; j < fat_.size(); ++j)
            if (cells_[j].level >= 0) meet(static_cast<int>(j));
        return;
    }
    for (std::uint32_t left = levels_ & ((1u << home.level) - 1); left != 0; left &= left - 1) {
        const auto [low, high] = reach(own, std::countr_zero(left));
        for (std::int32_t z = low.z; z <= high.z; ++z)
            for (std::int32_t y = low.y; y <= high.y; ++y)
                visit_row({low.x, y, z, low.level}, high.x - low.x + 1,
                          [&](const Entry& entry) { meet(entry.index); });
    }
    for (std::uint32_t left = levels_ >> home.level; left != 0; left &= left - 1)
        visit_around(cell_at(own, home.level + std::countr_zero(left)),
                     [&](const Entry& entry) { meet(entry.index); });
}

/// Brings the pairs up to date where few have escaped; false if all are to be searched for.
bool BroadPhase::follow() {
    bool moved = false;
    has_escaped_.assign(fat_.size(), 0);
    for (const int i : escaped_) {
        has_escaped_[i] = 1;
        const Cell before = cells_[i];
        if (place(static_cast<std::size_t>(i)) > most_levels) return false;
        moved = moved || !(cells_[i] == before);
    }
    for (const int i : everywhere_)
        if (has_escaped_[i]) return false;
    if (moved) fill_cells();
    const auto coarse = [this](int i) { return rows_below(i) > most_rows; };
    if (std::count_if(escaped_.begin(), escaped_.end(), coarse) > most_coarse) return false;
    found_.clear();
    for (const int i : escaped_) find_partners(i, found_);
    sort_pairs(fat_.size(), new_pairs_);
    std::erase_if(pairs_, [this](const IndexPair& pair) {
        return has_escaped_[pair.first] != 0 || has_escaped_[pair.second] != 0;
    });
    merged_.resize(pairs_.size() + new_pairs_.size());
    std::merge(pairs_.begin(), pairs_.end(), new_pairs_.begin(), new_pairs_.end(), merged_.begin());
    pairs_.assign(merged_.begin(), merged_.end());
    return true;
}

/// Searches for all pairs.
void BroadPhase::rebuild() {
    const int count = static_cast<int>(fat_.size());
    size_ = choose_size();
    everywhere_.clear();
    cells_.resize(fat_.size());
    for (int i = 0; i < count; ++i)
        if (place(static_cast<std::size_t>(i)) > most_levels) everywhere_.push_back(i);
    fill_cells();
    found_.clear();
    for (int i = 0; i < count; ++i)
        if (cells_[i].level >= 0) search(i, found_);
    for (const int i : everywhere_)
        for (int j = 0; j < count; ++j)
            if (j != i && (j > i || cells_[j].level >= 0) && overlap(fat_[i], fat_[j]))
                found_.emplace_back(std::min(i, j), std::max(i, j));
    sort_pairs(fat_.size(), pairs_);
}

void BroadPhase::overlapping_pairs(const std::vector<Bounds>& bounds, std::vector<IndexPair>& out) {
    out.clear();
    const int count = static_cast<int>(bounds.size());
    if (bounds.size() <= few) {
        for (int i = 0; i < count; ++i)
            for (int j = i + 1; j < count; ++j)
                if (overlap(bounds[i], bounds[j])) out.emplace_back(i, j);
        return;
    }
    const bool known = fat_.size() == bounds.size();
    if (known) {
        find_escaped(bounds);
    } else {
        fat_ = bounds;
        size_ = choose_size();
        for (std::size_t i = 0; i < bounds.size(); ++i) fatten(i, bounds[i], 0.0);
    }
    if (!known || escaped_.size() > bounds.size() / few_of || (!escaped_.empty() && !follow())) rebuild();
    for (const IndexPair& pair : pairs_)
        if (overlap(bounds[pair.first], bounds[pair.second])) out.push_back(pair);
}

}  // namespace spook
