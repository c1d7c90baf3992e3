// In which order contacts are updated: islands, and levels of contacts that share no body.
#pragma once

#include <vector>

#include "linear/disjoint_sets.hpp"
#include "linear/large_array.hpp"

namespace spook {

/// The order of an iteration: levels, in each of them contacts that share no moving body, and every contact in a later one
/// than those before it that share one. Whatever is done at a level together, the bits are those of one after the other.
class PgsSchedule {
public:
    struct Both {
        int first, second;  // bodies; the spare one, behind the last, for one that does not move
    };
    /// A contact in the order of an iteration.
    struct Scheduled {
        int item, first, second, island;  // joints and its place; its bodies and root
    };

    void begin(int bodies);
    /// Adds an item between two bodies, −1 for what does not move, and joins their islands; `active`: these are. Joints come
    /// first: those so far are.
    void link(int first, int second, bool is_active);
    void end_joints() noexcept { joints = static_cast<int>(items.size()); }
    void join(int first, int second);
    int root(int body) noexcept { return sets_.root(body); }

    bool complete() const noexcept { return scheduled_ == items.size(); }
    /// Islands of all items, and levels of those that have none yet; contacts that have no place yet get one in that order.
    /// Whether the order was begun anew: levels would be short.
    bool complete_order();
    /// Chooses the contacts of islands that are active.
    void select();
    /// The order of contacts that are to be updated, and where its levels end.
    const LargeArray<Scheduled>& scheduled() const noexcept { return whole ? order : active_order_; }
    const std::vector<std::size_t>& scheduled_end() const noexcept {
        return whole ? level_end : active_level_end_;
    }

    std::vector<Both> items;  // joints first
    int joints = 0;           // so many
    std::vector<int> place;   // of each contact, by index
    // Islands, by their root:
    std::vector<int> roots;
    std::vector<char> active, limit_reached;
    std::vector<double> last_change;  // the last iteration's; the largest since it has reached its limit
    std::vector<int> size;            // contacts
    // Those that come late have levels of their own, behind.
    LargeArray<Scheduled> order;
    std::vector<std::size_t> level_end;
    bool whole = true;  // all islands are active

private:
    int bodies_ = 0;
    DisjointSets sets_;          // bodies of an island
    std::vector<char> known_;    // those that are in the list, or were before they joined another
    std::size_t scheduled_ = 0;  // items
    std::size_t sized_ = 0;      // places of `order` that `size` counts
    bool joined_ = false;        // islands have, since
    LargeArray<Scheduled> active_order_;
    std::vector<std::size_t> active_level_end_;
    std::vector<int> level_, next_level_;  // of items, and of bodies
};

}  // namespace spook
