// Which items of very many are due, where few are: what is not costs nothing.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace spook {

/// Items in an order, each of one or two bodies, taken round by round. Calling a body makes its items due. They are
/// bits in their order, and chained by body.
class DueItems {
public:
    /// Forgets all items; bodies are 0 … `bodies` − 1.
    void start(int bodies) {
        bodies_ = bodies;
        last_.assign(static_cast<std::size_t>(bodies), -1);
        before_.clear();
        now_.clear();
        soon_.clear();
    }
    int items() const noexcept { return static_cast<int>(before_.size() / 2); }

    /// Adds an item behind the others; a body beyond the last is none.
    void add(int first, int second) {
        const int item = items();
        if (static_cast<std::size_t>(item) / width == now_.size()) now_.push_back(0), soon_.push_back(0);
        before_.resize(before_.size() + 2, -1);
        for (const auto [body, end] : {std::pair{first, 2 * item}, std::pair{second, 2 * item + 1}})
            if (body < bodies_) before_[end] = std::exchange(last_[body], end);
    }

    /// Makes an item due.
    void call_item(int item) noexcept { now_[at(item)] |= bit(item); }
    /// Makes the items of a body due, in a round those whose turn is still to come.
    void call(int body) noexcept {
        for (int end = last_[body]; end >= 0; end = before_[end]) call_item(end / 2);
    }
    /// The same, and all of them again in the round after it.
    void call_twice(int body) noexcept {
        for (int end = last_[body]; end >= 0; end = before_[end]) {
            call_item(end / 2);
            soon_[at(end / 2)] |= bit(end / 2);
        }
    }
    /// Lets nothing be due.
    void dismiss() noexcept { std::fill(now_.begin(), now_.end(), 0); }

    /// Gives what is due to `take(item, next)`, in order; `next` is due soon after it, or −1 if none is known.
    template <class Take> void round(const Take& take) {
        for (std::size_t word = 0; word < now_.size(); ++word) {
            const auto item = [word](std::uint64_t bits) {
                return static_cast<int>(word * width) + std::countr_zero(bits);
            };
            std::uint64_t ahead = ~std::uint64_t{0};
            while ((now_[word] & ahead) != 0) {
                const std::uint64_t due = now_[word] & ahead;
                const std::uint64_t rest = due & (due - 1);
                ahead = ~(due ^ (due - 1));
                take(item(due), rest != 0 ? item(rest) : -1);
            }
        }
        dismiss();  // also those called when their turn was over
        now_.swap(soon_);
    }

private:
    static constexpr std::size_t width = 64;
    static std::size_t at(int item) noexcept { return static_cast<std::size_t>(item) / width; }
    static std::uint64_t bit(int item) noexcept {
        return std::uint64_t{1} << static_cast<std::size_t>(item) % width;
    }

    int bodies_ = 0;
    std::vector<int> last_, before_;         // of a body, of an item's end: 2 × item, + 1 for the second
    std::vector<std::uint64_t> now_, soon_;  // due in this round, and in the next
};

}  // namespace spook
