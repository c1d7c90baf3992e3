#include "contacts/islands.hpp"

#include <algorithm>

namespace spook {

void IslandFinder::begin(int bodies) {
    told_ = bodies;
    ties_.clear();
}

void IslandFinder::tie(const RowBlock& block) {
    tie(block.first, block.second);
    for (const FurtherBody& other : block.further) tie(std::max(block.first, block.second), other.body);
}

const Islands& IslandFinder::find(const MixedSystem& system) {
    begin(system, system.rows.size());
    return find();
}

/// Whether all ties that were known have been told, in their order; more_ are the others.
bool IslandFinder::only_more() {
    more_.clear();
    if (bodies_ != told_) return false;
    std::size_t known = 0;
    for (const Islands::Tie tie : ties_)
        if (known < known_.size() && known_[known] == tie) ++known;
        else more_.push_back(tie);
    return known == known_.size();
}

/// Whether a tie changes which bodies are connected.
bool IslandFinder::join(Islands::Tie tie) {
    bool changes = false;
    for (const int b : {tie.first, tie.second}) {
        if (b < 0) continue;
        changes = changes || !has_rows_[b];
        has_rows_[b] = 1;
    }
    if (tie.first < 0 || tie.second < 0) return changes;
    return sets_.join(tie.first, tie.second) || changes;
}

void IslandFinder::number() {
    islands_.of_body.assign(bodies_, -1);
    islands_.count = 0;
    for (int b = 0; b < bodies_; ++b) {
        if (!has_rows_[b]) continue;
        const int r = sets_.root(b);
        islands_.of_body[b] = r == b ? islands_.count++ : islands_.of_body[r];
    }
}

const Islands& IslandFinder::find() {
    const bool kept = only_more();
    if (!kept) {
        ++searches_;
        bodies_ = told_;
        sets_.begin(static_cast<std::size_t>(bodies_));
        has_rows_.assign(bodies_, 0);
    }
    bool changed = !kept;
    for (const Islands::Tie tie : kept ? more_ : ties_) changed = join(tie) || changed;
    if (!kept || !more_.empty()) known_ = ties_;
    if (changed) number();
    return islands_;
}

}  // namespace spook
