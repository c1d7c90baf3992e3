// What a step's contacts did, as observables and counters read it: those of sleepers as they were last.
#include <algorithm>
#include <limits>

#include "contacts/contact_stage.hpp"
#include "run/quantities.hpp"

namespace spook {

Vec3 ContactStage::force(int body, int other) const noexcept {
    Vec3 sum;
    const auto add = [&](const CachedContact& cached) {
        const bool first = cached.contact.first == body, second = cached.contact.second == body;
        if (!first && !second) return;
        if (other >= 0 && (first ? cached.contact.second : cached.contact.first) != other) return;
        sum += (first ? 1.0 : -1.0) * cached.impulse;
    };
    for (const CachedContact& cached : cache_) add(cached);
    for (const CachedContact& cached : sleeping_cache_) add(cached);
    return (1.0 / options_.time_step) * sum;
}

int ContactStage::count() const noexcept {
    const auto active = [](const CachedContact& cached) { return cached.active; };
    return static_cast<int>(std::count_if(cache_.begin(), cache_.end(), active) +
                            std::count_if(sleeping_cache_.begin(), sleeping_cache_.end(), active));
}

double ContactStage::penetration() const noexcept {
    double depth = 0.0;
    for (const CachedContact& cached : cache_) depth = std::max(depth, -cached.contact.point.gap);
    for (const CachedContact& cached : sleeping_cache_) depth = std::max(depth, -cached.contact.point.gap);
    return depth;
}

void ContactStage::points(int most, double* out) const noexcept {
    double* const end = out + CONTACT_NUMBERS * most;
    auto kept = sleeping_cache_.begin();
    const auto tell = [&](const CachedContact& cached) {
        if (out == end || !cached.active) return;
        put(out, cached.contact.point.position);
        put(out + 3, cached.contact.point.normal);
        put(out + 6, (1.0 / options_.time_step) * cached.impulse);
        out[9] = cached.friction;
        out += CONTACT_NUMBERS;
    };
    for (const CachedContact& cached : cache_) {
        for (; kept != sleeping_cache_.end() && kept->contact.key < cached.contact.key; ++kept) tell(*kept);
        tell(cached);
    }
    for (; kept != sleeping_cache_.end(); ++kept) tell(*kept);
    std::fill(out, end, std::numeric_limits<double>::quiet_NaN());
}

BlockLdlt::Counters ContactStage::factor_counters() const noexcept {
    BlockLdlt::Counters sum = resting_solver_.counters();
    for (const IslandSolver* solver : {&impact_solver_, &projection_solver_}) {
        const BlockLdlt::Counters more = solver->counters();
        sum.factorisations += more.factorisations;
        sum.block_operations += more.block_operations;
        sum.floored_pivots += more.floored_pivots;
        sum.solves += more.solves;
    }
    return sum;
}

}  // namespace spook
