// Arrays that the contact stage fills anew in each step, kept for their memory.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace spook {

/// An array that is used again, with so many of `value` in it.
template <class T> std::vector<T>& filled(std::vector<T>& array, std::size_t count, T value = {}) {
    array.assign(count, value);
    return array;
}

/// Sorts what has contacts by their keys; those of one key stay as they are. What comes first is in order already: the rest
/// is sorted in `rest`, and merged with it from behind, so that of long items few are moved far.
template <class Items>
void order_by_key(Items& items, Items& rest, std::vector<std::pair<std::uint64_t, std::size_t>>& places) {
    const auto key = [](const auto& item) { return item.contact.key; };
    const auto end = std::is_sorted_until(items.begin(), items.end(),
                                          [&](const auto& a, const auto& b) { return key(a) < key(b); });
    auto ordered = static_cast<std::size_t>(end - items.begin());
    if (ordered == items.size()) return;
    places.clear();
    for (std::size_t k = ordered; k < items.size(); ++k) places.emplace_back(key(items[k]), k);
    std::sort(places.begin(), places.end());
    rest.clear();
    rest.reserve(items.capacity());
    for (const auto& [own, place] : places) rest.push_back(items[place]);
    for (std::size_t left = rest.size(); left > 0;) {
        const bool later = ordered == 0 || !(key(rest[left - 1]) < key(items[ordered - 1]));
        items[ordered + left - 1] = later ? rest[left - 1] : items[ordered - 1];
        --(later ? left : ordered);
    }
}

/// A depth [m] by pair of colliders, in one array.
struct DepthOfPair {
    struct Item {
        std::uint64_t pair = 0;
        double depth = 0.0;
        bool jammed = false;  // nothing parts it where it is
    };
    using Iterator = std::vector<Item>::const_iterator;
    bool empty() const noexcept { return items.empty(); }
    void clear() noexcept { items.clear(); }
    Iterator end() const noexcept { return items.end(); }
    Iterator find(std::uint64_t pair) const noexcept {
        const auto at = std::lower_bound(items.begin(), items.end(), pair, before);
        return at != items.end() && at->pair == pair ? at : items.end();
    }
    bool contains(std::uint64_t pair) const noexcept { return find(pair) != end(); }
    double at(std::uint64_t pair) const noexcept { return find(pair)->depth; }
    Item& operator[](std::uint64_t pair) {
        auto at = std::lower_bound(items.begin(), items.end(), pair, before);
        if (at == items.end() || at->pair != pair) at = items.insert(at, {pair});
        return *at;
    }

    static bool before(const Item& item, std::uint64_t pair) noexcept { return item.pair < pair; }
    std::vector<Item> items;  // in order of pairs
};

}  // namespace spook
