#include "collision/broad_phase.hpp"

#include <algorithm>
#include <cstddef>

namespace spook {

namespace {

constexpr std::size_t few = 32;  // below, sorting costs more than comparing all

int longest_axis(const std::vector<Bounds>& bounds) {
    int axis = 0;
    double largest = -1.0;
    for (int i = 0; i < 3; ++i) {
        double sum = 0.0, squares = 0.0;
        for (const Bounds& b : bounds) {
            const double centre = b.low[i] + b.high[i];
            sum += centre;
            squares += centre * centre;
        }
        const double variance = squares - sum * sum / static_cast<double>(bounds.size());
        if (variance > largest) largest = variance, axis = i;
    }
    return axis;
}

}  // namespace

void overlapping_pairs(const std::vector<Bounds>& bounds, std::vector<IndexPair>& out) {
    out.clear();
    const int count = static_cast<int>(bounds.size());
    if (bounds.size() <= few) {
        for (int i = 0; i < count; ++i)
            for (int j = i + 1; j < count; ++j)
                if (overlap(bounds[i], bounds[j])) out.emplace_back(i, j);
        return;
    }
    const int axis = longest_axis(bounds);
    std::vector<std::pair<double, int>> order;  // lower end, index: ties broken by index
    order.reserve(bounds.size());
    for (int i = 0; i < count; ++i)
        if (bounds[i].low[axis] <= bounds[i].high[axis]) order.emplace_back(bounds[i].low[axis], i);
    std::sort(order.begin(), order.end());
    for (std::size_t k = 0; k < order.size(); ++k) {
        const int i = order[k].second;
        const double end = bounds[i].high[axis];
        for (std::size_t next = k + 1; next < order.size() && order[next].first <= end; ++next) {
            const int j = order[next].second;
            if (overlap(bounds[i], bounds[j])) out.emplace_back(std::min(i, j), std::max(i, j));
        }
    }
    std::sort(out.begin(), out.end());
}

}  // namespace spook
