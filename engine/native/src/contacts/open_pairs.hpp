// Pairs that are apart at the start of the step and may meet in it, in order; and the points of each body.
#pragma once

#include <algorithm>
#include <iterator>
#include <span>
#include <vector>

#include "contacts/contact_bodies.hpp"
#include "contacts/step_contact.hpp"
#include "linear/large_array.hpp"

namespace spook {

struct OpenPairs {
    LargeArray<OpenPair> pairs;
    std::vector<IndexPair> bodies;  // of each, to look through many that did not move; made by drop_met()

    void clear() noexcept { pairs.clear(), bodies.clear(), met_ = 0; }
    static bool in_order(const OpenPair& a, const OpenPair& b) noexcept { return a.pair < b.pair; }
    /// Whether it is one of the pairs, which are in order.
    bool has(const IndexPair& pair) const noexcept {
        const auto at = std::lower_bound(pairs.begin(), pairs.end(), pair,
                                         [](const OpenPair& a, const IndexPair& b) { return a.pair < b; });
        return at != pairs.end() && at->pair == pair;
    }
    /// Those from `from` on, which are in order themselves, among the others.
    void merge(std::ptrdiff_t from) {
        merged_.clear();
        merged_.reserve(pairs.capacity());
        std::merge(pairs.begin(), pairs.begin() + from, pairs.begin() + from, pairs.end(),
                   std::back_inserter(merged_), in_order);
        pairs.swap(merged_);
    }
    void meet(OpenPair& pair) noexcept { pair.first = -1, ++met_; }
    /// Leaves out those that have met, once they are more than `most` of all, or where their bodies are not listed.
    void drop_met(double most) {
        if (bodies.size() == pairs.size() && !(met_ > most * static_cast<double>(pairs.size()))) return;
        std::erase_if(pairs, [](const OpenPair& open) { return open.has_met(); });
        met_ = 0;
        bodies.clear();
        for (const OpenPair& open : pairs) bodies.emplace_back(open.first, open.second);
    }

private:
    int met_ = 0;
    LargeArray<OpenPair> merged_;
};

/// Which points each body has that moves by itself: what holds it is asked of each that it would meet.
class PointsOfBodies {
public:
    void find(const LargeArray<StepContact>& points, const ContactBodies& bodies) {
        begin_.assign(bodies.count() + 2, 0);
        const auto both = [&](auto&& each) {
            for (std::size_t k = 0; k < points.size(); ++k)
                for (const int b : {points[k].contact.first, points[k].contact.second})
                    if (bodies.moves(b)) each(static_cast<std::size_t>(b), static_cast<int>(k));
        };
        both([&](std::size_t b, int) { ++begin_[b + 2]; });
        for (std::size_t b = 2; b < begin_.size(); ++b) begin_[b] += begin_[b - 1];
        points_.resize(static_cast<std::size_t>(begin_.back()));
        both([&](std::size_t b, int k) { points_[static_cast<std::size_t>(begin_[b + 1]++)] = k; });
    }
    std::span<const int> operator[](int body) const noexcept {
        const auto b = static_cast<std::size_t>(body);
        return {points_.data() + begin_[b], points_.data() + begin_[b + 1]};
    }

private:
    std::vector<int> points_, begin_;
};

}  // namespace spook
