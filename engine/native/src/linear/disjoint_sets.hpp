// Which of some numbers are connected.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace spook {

/// Sets of the numbers 0 … n − 1, joined two at a time. The root of a set is its smallest number, whatever the order in which
/// it was joined; looking for it halves the way there.
class DisjointSets {
public:
    /// Each number alone.
    void begin(std::size_t count) {
        parent_.resize(count);
        std::iota(parent_.begin(), parent_.end(), 0);
    }
    int root(int i) noexcept {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    bool is_root(int i) const noexcept { return parent_[i] == i; }
    /// Whether they were apart.
    bool join(int first, int second) noexcept {
        const int a = root(first), b = root(second);
        parent_[std::max(a, b)] = std::min(a, b);
        return a != b;
    }

private:
    std::vector<int> parent_;
};

}  // namespace spook
