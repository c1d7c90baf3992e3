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
    for (const CachedContact& cached : state_.cache) add(cached);
    for (const CachedContact& cached : state_.sleeping) add(cached);
    return (1.0 / options_.time_step) * sum;
}

int ContactStage::count() const noexcept {
    const auto active = [](const CachedContact& cached) { return cached.active; };
    return static_cast<int>(std::count_if(state_.cache.begin(), state_.cache.end(), active) +
                            std::count_if(state_.sleeping.begin(), state_.sleeping.end(), active));
}

double ContactStage::penetration() const noexcept {
    double depth = 0.0;
    for (const CachedContact& cached : state_.cache) depth = std::max(depth, -cached.contact.point.gap);
    for (const CachedContact& cached : state_.sleeping) depth = std::max(depth, -cached.contact.point.gap);
    return depth;
}

void ContactStage::points(int most, double* out) const noexcept {
    double* const end = out + CONTACT_NUMBERS * most;
    auto kept = state_.sleeping.begin();
    const auto tell = [&](const CachedContact& cached) {
        if (out == end || !cached.active) return;
        put(out, cached.contact.point.position);
        put(out + 3, cached.contact.point.normal);
        put(out + 6, (1.0 / options_.time_step) * cached.impulse);
        out[9] = cached.friction;
        out += CONTACT_NUMBERS;
    };
    for (const CachedContact& cached : state_.cache) {
        for (; kept != state_.sleeping.end() && kept->contact.key < cached.contact.key; ++kept) tell(*kept);
        tell(cached);
    }
    for (; kept != state_.sleeping.end(); ++kept) tell(*kept);
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
