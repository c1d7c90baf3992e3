// Which bodies hang together by rows.
#pragma once

#include <span>
#include <vector>

#include "contacts/pivot_system.hpp"

namespace spook {

/// Island of each body of the system: islands are numbered by their first body's index, upwards from 0; a body
/// without rows has −1. Ends that do not move (−1 in a row) join nothing, so bodies on the same ground stay apart.
struct Islands {
    struct Tie {
        int first, second;
        bool operator==(const Tie&) const = default;
    };
    std::vector<int> of_body;
    int count = 0;
};

/// Islands of ties that are told again and again: memory is kept, and the islands are while the ties stay. begin(), then
/// tie() for each, then find().
class IslandFinder {
public:
    void begin(int bodies);
    void tie(int first, int second) {
        const Islands::Tie own{first, second};
        if (ties_.empty() || ties_.back() != own) ties_.push_back(own);  // of a pair's points one says all
    }
    /// A tie per block of rows, and one for each body beyond its first two: one of the first two always moves by itself.
    void tie(const RowBlock& block);
    const Islands& find();
    const Islands& find(const MixedSystem& system);

    /// The islands of the last find().
    const Islands& islands() const noexcept { return islands_; }
    std::span<const Islands::Tie> ties() const noexcept { return ties_; }
    /// How often ties were others than before.
    long searches() const noexcept { return searches_; }

private:
    Islands islands_;
    int bodies_ = -1;                         // islands_ are of so many,
    std::vector<Islands::Tie> known_, ties_;  //   and of these; those told since begin()
    int told_ = 0;                            // bodies
    std::vector<int> parent_;
    std::vector<char> has_rows_;
    long searches_ = 0;
};

}  // namespace spook
