// Bodies whose contacts are to be updated, where islands have reached their limit.
#pragma once

#include <cstdint>
#include <vector>

#include "contacts/pgs_schedule.hpp"

namespace spook {

class ActiveBodies {
public:
    void begin(int bodies);
    /// Their order is another one; `anew`: not only longer.
    void reorder(bool anew) noexcept {
        marked_ = false;
        if (anew) listed_ = 0;
    }
    /// Bodies whose rows were changed much are active in this iteration and the next.
    void activate(int first, int second) noexcept;
    void next_iteration() noexcept {
        for (unsigned char& body : active_) body >>= 1;
    }
    void forget_marks() noexcept { marked_ = false; }
    bool any(int first, int second) const noexcept { return (active_[first] | active_[second]) != 0; }

    /// An iteration goes by marks from here on, until it ends: the contacts of active bodies, a bit each by their place.
    void begin_marks(const LargeArray<PgsSchedule::Scheduled>& order);
    void end_marks() noexcept { marking_ = false; }
    const std::vector<std::uint64_t>& marks() const noexcept { return marked_now_; }

private:
    static constexpr unsigned char active_now = 2;  // and 1 in the iteration after
    void mark_active(const LargeArray<PgsSchedule::Scheduled>& order);
    void mark(int body) noexcept;

    int bodies_ = 0;
    std::vector<unsigned char> active_;                    // 2 in this iteration, 1 in the one before
    std::vector<std::uint64_t> marked_now_, marked_next_;  // contacts in this iteration and the next
    // Of each body a list of twice the places of its contacts, plus one for the second body.
    std::vector<int> first_marked_, next_marked_;
    std::size_t listed_ = 0;                 // places in those lists
    bool marked_ = false, marking_ = false;  // these are right; an iteration goes by them
};

}  // namespace spook
