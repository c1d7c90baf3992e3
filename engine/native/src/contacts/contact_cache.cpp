#include "contacts/contact_cache.hpp"

#include <algorithm>
#include <limits>

#include "run/quantities.hpp"

namespace spook {

namespace {

bool by_key(const CachedContact& a, const CachedContact& b) noexcept { return a.contact.key < b.contact.key; }

/// Takes what `goes` names out of one array in order, and merges it into another.
template <class Goes>
void move_over(std::vector<CachedContact>& from, std::vector<CachedContact>& to, const Goes& goes) {
    const auto gone = std::stable_partition(from.begin(), from.end(),
                                            [&](const CachedContact& cached) { return !goes(cached); });
    const auto old = static_cast<std::ptrdiff_t>(to.size());
    to.insert(to.end(), gone, from.end());
    from.erase(gone, from.end());
    std::inplace_merge(to.begin(), to.begin() + old, to.end(), by_key);
}

}  // namespace

const CachedContact* ContactCache::find(std::uint64_t key) const noexcept {
    const auto at =
        std::lower_bound(points.begin(), points.end(), key,
                         [](const CachedContact& cached, std::uint64_t k) { return cached.contact.key < k; });
    return at != points.end() && at->contact.key == key ? &*at : nullptr;
}

std::vector<CachedContact>::const_iterator ContactCache::first_of(std::uint64_t pair) const noexcept {
    return std::lower_bound(
        points.begin(), points.end(), pair,
        [](const CachedContact& cached, std::uint64_t k) { return pair_of(cached.contact) < k; });
}

bool ContactCache::has_pair(std::uint64_t pair) const noexcept {
    const auto at = first_of(pair);
    return at != points.end() && pair_of(at->contact) == pair;
}

bool ContactCache::pressed(std::uint64_t pair) const noexcept {
    for (auto at = first_of(pair); at != points.end() && pair_of(at->contact) == pair; ++at)
        if (at->normal > 0.0 && !(at->impact > 0.0)) return true;
    return false;
}

void ContactCache::put_to_sleep(const std::vector<int>& sleepers, std::size_t bodies) {
    asleep.resize(bodies, 0);
    for (const int body : sleepers) asleep[body] = 1;
    move_over(points, sleeping, [this](const CachedContact& cached) {
        return sleeps(cached.contact.first) || sleeps(cached.contact.second);
    });
}

void ContactCache::wake(const std::vector<int>& sleepers) {
    for (const int body : sleepers) asleep[body] = 0;
    move_over(sleeping, points, [this](const CachedContact& cached) {
        return !sleeps(cached.contact.first) && !sleeps(cached.contact.second);
    });
}

std::vector<int> ContactCache::touching(const std::vector<char>& is_moving) const {
    std::vector<int> found;
    for (const CachedContact& cached : sleeping) {
        if (is_moving[cached.contact.first]) found.push_back(cached.contact.second);
        if (is_moving[cached.contact.second]) found.push_back(cached.contact.first);
    }
    return found;
}

Vec3 ContactCache::force(int body, int other, double h) const noexcept {
    Vec3 sum;
    for (const std::vector<CachedContact>* each : {&points, &sleeping})
        for (const CachedContact& cached : *each) {
            const bool first = cached.contact.first == body, second = cached.contact.second == body;
            if (!first && !second) continue;
            if (other >= 0 && (first ? cached.contact.second : cached.contact.first) != other) continue;
            sum += (first ? 1.0 : -1.0) * cached.impulse;
        }
    return (1.0 / h) * sum;
}

int ContactCache::count() const noexcept {
    const auto active = [](const CachedContact& cached) { return cached.active; };
    return static_cast<int>(std::count_if(points.begin(), points.end(), active) +
                            std::count_if(sleeping.begin(), sleeping.end(), active));
}

double ContactCache::penetration() const noexcept {
    double depth = 0.0;
    for (const CachedContact& cached : points) depth = std::max(depth, -cached.contact.point.gap);
    for (const CachedContact& cached : sleeping) depth = std::max(depth, -cached.contact.point.gap);
    return depth;
}

void ContactCache::tell(int most, double h, double* out) const noexcept {
    double* const end = out + CONTACT_NUMBERS * most;
    auto kept = sleeping.begin();
    const auto tell = [&](const CachedContact& cached) {
        if (out == end || !cached.active) return;
        put(out, cached.contact.point.position);
        put(out + 3, cached.contact.point.normal);
        put(out + 6, (1.0 / h) * cached.impulse);
        out[9] = cached.friction;
        out += CONTACT_NUMBERS;
    };
    for (const CachedContact& cached : points) {
        for (; kept != sleeping.end() && kept->contact.key < cached.contact.key; ++kept) tell(*kept);
        tell(cached);
    }
    for (; kept != sleeping.end(); ++kept) tell(*kept);
    std::fill(out, end, std::numeric_limits<double>::quiet_NaN());
}

}  // namespace spook
