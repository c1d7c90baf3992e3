// What a step's contacts did, as observables and counters read it: those of sleepers as they were last.
#include <algorithm>
#include <limits>

#include "contacts/contact_stage.hpp"
#include "run/quantities.hpp"

namespace spook {

Vec3 ContactStage::force(int body, int other) const noexcept {
    Vec3 sum;
    const auto add = [&](const Touch& touch) {
        const bool first = touch.contact.first == body, second = touch.contact.second == body;
        if (!first && !second) return;
        if (other >= 0 && (first ? touch.contact.second : touch.contact.first) != other) return;
        sum += (first ? 1.0 : -1.0) * touch.impulse;
    };
    for (const Touch& touch : touches_) add(touch);
    for (const Touch& touch : kept_) add(touch);
    return (1.0 / options_.time_step) * sum;
}

int ContactStage::count() const noexcept {
    const auto active = [](const Touch& touch) { return touch.active; };
    return static_cast<int>(std::count_if(touches_.begin(), touches_.end(), active) +
                            std::count_if(kept_.begin(), kept_.end(), active));
}

double ContactStage::penetration() const noexcept {
    double depth = 0.0;
    for (const Touch& touch : touches_) depth = std::max(depth, -touch.contact.point.gap);
    for (const Touch& touch : kept_) depth = std::max(depth, -touch.contact.point.gap);
    return depth;
}

void ContactStage::points(int most, double* out) const noexcept {
    double* const end = out + CONTACT_NUMBERS * most;
    auto kept = kept_.begin();
    const auto tell = [&](const Touch& touch) {
        if (out == end || !touch.active) return;
        put(out, touch.contact.point.position);
        put(out + 3, touch.contact.point.normal);
        put(out + 6, (1.0 / options_.time_step) * touch.impulse);
        out[9] = touch.friction;
        out += CONTACT_NUMBERS;
    };
    for (const Touch& touch : touches_) {
        for (; kept != kept_.end() && kept->contact.key < touch.contact.key; ++kept) tell(*kept);
        tell(touch);
    }
    for (; kept != kept_.end(); ++kept) tell(*kept);
    std::fill(out, end, std::numeric_limits<double>::quiet_NaN());
}

BlockLdlt::Counters ContactStage::factor_counters() const noexcept {
    BlockLdlt::Counters sum = resting_solver_.counters();
    for (const IslandSolver* solver : {&impact_solver_, &parting_solver_}) {
        const BlockLdlt::Counters more = solver->counters();
        sum.factorisations += more.factorisations;
        sum.block_operations += more.block_operations;
        sum.floored_pivots += more.floored_pivots;
        sum.solves += more.solves;
    }
    return sum;
}

}  // namespace spook
