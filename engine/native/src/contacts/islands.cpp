#include "contacts/islands.hpp"

#include <algorithm>
#include <numeric>

namespace spook {

void IslandFinder::begin(int bodies) {
    told_ = bodies;
    ties_.clear();
}

void IslandFinder::tie(const RowBlock& block) {
    tie(block.first, block.second);
    for (const Beyond& other : block.beyond) tie(std::max(block.first, block.second), other.body);
}

const Islands& IslandFinder::find(const MixedSystem& system) {
    begin(static_cast<int>(system.mass.size()));
    for (const RowBlock& block : system.rows) tie(block);
    return find();
}

const Islands& IslandFinder::find() {
    if (bodies_ == told_ && known_ == ties_) return islands_;
    ++searches_;
    known_ = ties_, bodies_ = told_;
    parent_.resize(bodies_);
    std::iota(parent_.begin(), parent_.end(), 0);
    const auto root = [this](int b) {
        while (parent_[b] != b) b = parent_[b] = parent_[parent_[b]];
        return b;
    };
    has_rows_.assign(bodies_, 0);
    for (const auto [first, second] : ties_) {
        if (first >= 0) has_rows_[first] = 1;
        if (second >= 0) has_rows_[second] = 1;
        if (first < 0 || second < 0) continue;
        const int a = root(first), b = root(second);
        parent_[std::max(a, b)] = std::min(a, b);  // the root is the island's first body
    }
    islands_.of_body.assign(bodies_, -1);
    islands_.count = 0;
    for (int b = 0; b < bodies_; ++b) {
        if (!has_rows_[b]) continue;
        const int r = root(b);
        islands_.of_body[b] = r == b ? islands_.count++ : islands_.of_body[r];
    }
    return islands_;
}

}  // namespace spook
