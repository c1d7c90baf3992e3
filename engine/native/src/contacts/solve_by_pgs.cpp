// The contact stage's solve by projected Gauss–Seidel: iterations, and looks for what else bodies meet by what they have found.
#include <algorithm>
#include <utility>

#include "contacts/contact_geometry.hpp"
#include "contacts/contact_stage.hpp"
#include "contacts/tolerances.hpp"

namespace spook {

using namespace tolerances::solve_by_pgs;

/// Pairs that meet because of what the iterations have found so far get rows in the same solve.
bool ContactStage::find_more(bool over, bool& iterating) {
    const bool first = next_.empty();  // look of this step
    if (first) next_ = motion_.velocity;
    // On the way bodies are skipped at the sides of others that they do meet in the end, and need not have changed since.
    const bool was_settling = std::exchange(iterating, !over);
    const bool all = first || (was_settling && over && model_->bodies.swings);
    pgs_.follow(model_->bodies, all, next_, changed_);
    const Cast cast{next_, over ? Cast::When::solved : Cast::When::iterating};
    search_.widen(cast, changed_, motion_, points_);
    const std::size_t known = points_.all.size();
    const bool turned = search_.find_turned(next_, motion_, points_);
    if (find_impacts(cast) == 0 && !turned) return false;
    state_.counters.contacts += points_.all.size() - known;
    pgs_.take_in(known, state_.cache, motion_, points_);
    return true;
}

/// Where a solve sets many bodies in motion towards others, each solve would find a few pairs more that meet. Iterations find
/// nearly all of them at a fraction of the cost, and the next solve starts from where they end. Islands that an earlier
/// solve has answered, and no new point ties to others, stay as they are to the last bit.
bool ContactStage::warm_start_by_pgs(MixedSystem& system, std::size_t known, int round) {
    if (model_->surfaces.resists_turning) return false;  // PGS over contacts knows no such friction
    if (points_.all.size() <= few_points && round < many_rounds) return false;
    if (pgs_.find_unanswered(model_->bodies, known, points_) <= few_points && round < many_rounds)
        return false;
    double speed = 0.0;
    for (const Vec6& v : system.velocity) speed = std::max(speed, norm(linear(v)));
    system.rows.clear();
    pgs_.start(system, model_->options.friction);
    next_.clear();
    pgs_.hand_over(motion_, points_);
    const double enough = warm_started * speed;
    bool iterating = false;
    const FrictionReport report = pgs_.solver().run(warm_start_iterations, enough, enough,
                                                    [&](bool over) { return find_more(over, iterating); });
    state_.counters.pgs_iterations += static_cast<std::uint64_t>(report.pgs_iterations);
    if (!report.finite) return false;
    pgs_.find_unanswered(model_->bodies, known, points_);
    pgs_.store_unanswered(points_);
    return true;
}

/// Iterates until the step is settled, or long enough. Whether the iterations run away.
bool ContactStage::iterate(MixedSystem& system, FrictionReport& report) {
    bool iterating = false;
    double last = unbounded;
    for (int turn = 0; turn < most_turns || pgs_.solver().work() < most_turns * model_->options.iterations;
         ++turn) {
        report = pgs_.run(model_->options, [&](bool over) { return find_more(over, iterating); });
        state_.counters.pgs_iterations += static_cast<std::uint64_t>(report.pgs_iterations);
        if (!report.finite) return true;
        const bool joint_is_worst = pgs_.judge(system, motion_, points_, quality_);
        if (quality_.body < 0 || report.converged) break;
        const bool grows = quality_.residual > std::exchange(last, quality_.residual) && system.rows.empty();
        if (grows && pgs_.runs_away(system, motion_, points_)) return true;
        if (turn + 1 >= joint_turns && joint_is_worst) break;
    }
    pgs_.solver().write(system);
    return false;
}

ContactStage::PgsSolveEnd ContactStage::solve_by_pgs(MixedSystem& system) {
    pgs_.start(system, model_->options.friction);
    next_.clear();
    pgs_.hand_over(motion_, points_);
    const std::size_t begun = points_.all.size();
    FrictionReport report;
    quality_ = {};
    if (iterate(system, report)) {
        points_.all.resize(begun);  // what was met on that way is not
        search_.find_open(motion_, points_);
        ran_away_ = true;
        return {{}, true};
    }
    if (needs_impact_first()) return {};
    if (passes_other_ends(system, system.rows.size(), model_->options.time_step))
        return {{.ends_passed = true}};
    const std::size_t blocks = system.rows.size() + points_.all.size();
    const bool unfinished =
        !report.converged && !system.rows.empty() && blocks <= (quality_.body >= 0 ? few_jointed : few_rows);
    state_.by_rows = state_.by_rows || unfinished;
    if (unfinished) return {{}, true};
    state_.counters.unsettled += !report.converged;

    if (!report.converged && quality_.body < 0) blame_sunk(quality_, judged());
    mark_rows(system.mass.size(), system.rows);  // by joints; of contacts those that push
    for (std::size_t b = 0; b < model_->bodies.count(); ++b)
        if (model_->bodies.moves(b) && motion_.event_time[b] >= 0.0)
            has_rows_[model_->bodies.solver_index[b]] = 1;
    pgs_.deliver(system, !report.converged, motion_, points_, energy_, has_rows_, state_.cache.points,
                 quality_.stopped);
    correct_events(system);
    pgs_.order(state_.cache.points);
    return {};
}

}  // namespace spook
