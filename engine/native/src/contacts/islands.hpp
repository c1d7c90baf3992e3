// Which bodies are connected by rows.
#pragma once

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "contacts/pivot_system.hpp"
#include "linear/disjoint_sets.hpp"

namespace spook {

/// Island of each body of the system: islands are numbered by their first body's index, upwards from 0; a body
/// without rows has −1. Ends that do not move (−1 in a row) join nothing, so bodies on the same ground stay apart.
struct Islands {
    struct Tie {
        int first, second;
        bool operator==(const Tie&) const = default;
    };
    int of(const RowBlock& block) const noexcept { return of_body[std::max(block.first, block.second)]; }
    std::vector<int> of_body;
    int count = 0;
};

/// Islands from step to step: begin(), then tie() for each, then find(). New ties join what they tie; where one has gone all are
/// found anew (10 000 bodies with 20 000 ties: 110 us, of a step of 25 ms).
class IslandFinder {
public:
    void begin(int bodies);
    /// The same, with a tie for each of the first `rows` blocks of rows.
    void begin(const MixedSystem& system, std::size_t rows) {
        begin(static_cast<int>(system.mass.size()));
        for (std::size_t k = 0; k < rows; ++k) tie(system.rows[k]);
    }
    void tie(int first, int second) {
        const Islands::Tie own{first, second};
        if (ties_.empty() || ties_.back() != own) ties_.push_back(own);  // of a pair's points one says all
    }
    void tie(std::pair<int, int> bodies) { tie(bodies.first, bodies.second); }
    /// A tie per block of rows, and one for each body beyond its first two: one of the first two always moves by itself.
    void tie(const RowBlock& block);
    const Islands& find();
    const Islands& find(const MixedSystem& system);

    /// The islands of the last find().
    const Islands& islands() const noexcept { return islands_; }
    std::span<const Islands::Tie> ties() const noexcept { return ties_; }
    /// How often they were found anew.
    long searches() const noexcept { return searches_; }

private:
    bool only_more();
    bool join(Islands::Tie tie);
    void number();

    Islands islands_;
    int bodies_ = -1;                         // islands_ are of so many,
    std::vector<Islands::Tie> known_, ties_;  //   and of these; those told since begin()
    std::vector<Islands::Tie> more_;          // of those, which were not known
    int told_ = 0;                            // bodies
    DisjointSets sets_;
    std::vector<char> has_rows_;
    long searches_ = 0;
};

}  // namespace spook
