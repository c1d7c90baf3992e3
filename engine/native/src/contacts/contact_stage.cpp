#include "contacts/contact_stage.hpp"

#include <algorithm>
#include <cmath>

#include "contacts/contact_geometry.hpp"
#include "contacts/tolerances.hpp"
#include "linear/regularisation.hpp"

namespace spook {

namespace {

using namespace tolerances::contact_stage;

}  // namespace

ContactStage::ContactStage(Detection detection, const std::vector<SurfaceMaterial>& materials,
                           std::vector<int> unknown, const ContactOptions& options,
                           std::vector<IndexPair> joints, std::vector<char> yielding)
    : detection_(std::move(detection)),
      model_(std::make_shared<ContactModel>(ContactBodies{detection_, std::move(unknown), std::move(joints)},
                                            ContactSurfaces{materials}, options)),
      motion_(model_),
      projector_(model_, std::move(yielding)) {
    for (IslandSolver* solver : {&resting_solver_, &impact_solver_}) {
        solver->floor = options.floor;
        solver->refinements = options.refinements;
    }
    const std::size_t bodies = model_->bodies.count();
    depth_.assign(bodies, 0.0);
    predicted_sinking_.assign(bodies, 0.0);
}

IslandRules ContactStage::rules_of(FrictionModel model, bool exact) const noexcept {
    return {.friction = model,
            .enough = exact ? model_->options.residual_tolerance : model_->options.unsettled_residual,
            .few_enough = ran_away_ ? not_too_large : 0};
}

ContactStage::SolveEnd ContactStage::solve(MixedSystem& system, const std::vector<Vec6>& velocity) {
    const std::size_t joints = system.rows.size();
    motion_.velocity = velocity;
    warm_started_ = ran_away_ = false;
    const auto by_rows = [&] { return state_.by_rows && joints + points_.all.size() <= few_jointed; };
    if (model_->options.solver == SolverKind::iterative && !model_->surfaces.resists_turning) {
        if (by_rows()) pgs_.start(system, model_->options.friction);  // overlaps are parted with its masses
        else if (const PgsSolveEnd end = solve_by_pgs(system); !end.unfinished) return end;
    }
    std::vector<FrictionPoint>& friction = arrays_.friction;
    std::vector<Vec6>& next = next_;
    FrictionReport report;
    std::vector<char>& answered = arrays_.answered;
    for (int round = 0;; ++round) {
        system.rows.resize(joints);
        friction.clear();
        answered.assign(joints, 1);
        for (Point& point : points_.all) {
            system.rows.push_back(rows().resting(point));
            answered.push_back(point.answered);
            if (system.rows.back().size > 1)
                rows().add_friction(point, static_cast<int>(system.rows.size()) - 1, friction);
        }
        if (round == 0) {  // at rest, the velocities before are those after
            system.velocity.resize(system.mass.size());
            for (std::size_t b = 0; b < model_->bodies.count(); ++b)
                if (model_->bodies.solver_index[b] >= 0)
                    system.velocity[model_->bodies.solver_index[b]] = motion_.velocity[b];
        }
        const FrictionReport before = report;
        const bool late = round > 0 && model_->options.solver == SolverKind::direct;
        // What a resting solve leaves, the next step sees; what an impact leaves stays.
        IslandRules rules = rules_of(model_->options.friction, state_.by_rows);
        rules.warm_started = warm_started_;
        if (by_rows()) rules.few_enough = few_jointed;
        report = solve_islands(system, friction, resting_solver_, model_->options, rules, state_.counters,
                               late ? &answered : nullptr);
        report.rounds += before.rounds, report.pgs_iterations += before.pgs_iterations;
        report.converged = report.converged && before.converged;  // islands may have been left as they were
        if (model_->options.friction == FrictionModel::box)
            for (const FrictionPoint& point : friction)
                points_.own_extras(points_.all[point.block - joints]).guessed = point.normal;
        if (!report.finite || round == late_rounds) break;
        move_on(system, next);
        const std::size_t known = points_.all.size();
        changed_.assign(next.size(), 1);
        if (margins_.outrun(model_->bodies, model_->options.time_step, next, changed_)) find_open_again();
        find_turned(next);
        const std::size_t dissipated_energy = points_.all.size();
        late_impact_ = false;
        if (find_impacts(next, true) > 0) move_impacts_to_start(dissipated_energy, next);
        if (needs_plastic_impact() || needs_stop_impact(system, known, next)) return {};
        if (late_impact_) find_deferred_impacts(next);
        if (points_.all.size() == known) {
            if (passes_other_ends(system, joints, model_->options.time_step)) return {.ends_passed = true};
            break;
        }
        state_.counters.contacts += points_.all.size() - known;
        for (std::size_t k = 0; k < system.rows.size() - joints; ++k)
            store_solution(*model_, system.rows[joints + k], points_, points_.all[k]);
        if (joints == 0 && model_->options.solver == SolverKind::direct)
            warm_start_by_pgs(system, known, round);
        points_.order(state_.cache, model_->surfaces.resists_turning);
    }
    mark_rows(system);  // the last round may have brought rows to bodies that had none
    quality_ = judge(judged(), system, friction, report);
    if (!report.converged) {
        std::vector<double>& share = arrays_.share;
        std::vector<char>& pushes = arrays_.pushes;
        pushes.clear();
        for (std::size_t k = joints; k < system.rows.size(); ++k) {
            const auto& z = system.rows[k].multiplier;
            pushes.push_back(std::any_of(z.begin(), z.begin() + system.rows[k].size,
                                         [](double each) { return each != 0.0; }));
        }
        shorten_unsettled(system, joints, pushes, share);
        for (std::size_t k = joints; k < system.rows.size(); ++k)
            for (double& z : system.rows[k].multiplier)
                z *= share[std::max(system.rows[k].first, system.rows[k].second)];
    }

    state_.cache.points.clear();
    for (std::size_t k = 0; k < points_.all.size(); ++k) {
        Point& point = points_.all[k];
        const Vec3 along = store_solution(*model_, system.rows[joints + k], points_, point);
        CachedContact& cached =
            cache_contact(rows(), system, point, point.normal, along, state_.cache.points);
        state_.counters.stopped += motion_.is_stopped(point, point.normal);
        std::copy_n(points_.extras(point).turning, 3, cached.turning);
    }
    if (report.finite) correct_events(system);
    return {.finite = report.finite};
}

void ContactStage::mark_rows(const MixedSystem& system) {
    has_rows_.assign(system.mass.size(), 0);
    for (const RowBlock& block : system.rows) {
        for (const int body : {block.first, block.second})
            if (body >= 0) has_rows_[body] = 1;
        for (const FurtherBody& other : block.further) has_rows_[other.body] = 1;
    }
}

/// Velocities of all bodies after a solve; those without rows fly freely.
void ContactStage::move_on(const MixedSystem& system, std::vector<Vec6>& next) {
    mark_rows(system);
    next.resize(model_->bodies.count());
    for (std::size_t b = 0; b < model_->bodies.count(); ++b) {
        const int u = model_->bodies.solver_index[b];
        next[b] = u >= 0 && has_rows_[u] ? system.velocity[u] : sum(motion_.velocity[b], motion_.dv_ext[b]);
    }
}

/// An event's bodies went with v₋ until its time: with v₊ for the whole step they would end elsewhere.
void ContactStage::correct_events(const MixedSystem& system) {
    for (std::size_t b = 0; b < model_->bodies.count(); ++b) {
        const int u = model_->bodies.solver_index[b];
        if (u < 0 || motion_.event_time[b] < 0.0 || !has_rows_[u]) continue;
        if (correction_.empty()) correction_.assign(system.mass.size(), Vec6{});
        // What a joint holds turns as it goes, or the joint would answer the difference with a speed.
        for (int i = 0; i < (model_->bodies.jointed[b] ? 6 : 3); ++i)
            correction_[u][i] += motion_.event_time[b] / model_->options.time_step *
                                 (motion_.predicted[b][i] - system.velocity[u][i]);
        const Vec3 more = motion_.free_fall_correction(static_cast<int>(b), linear(system.velocity[u]));
        for (int i = 0; i < 3; ++i) correction_[u][i] += more[i];
    }
    if (motion_.supported.has_released())
        motion_.supported.book(system, connected(system, 0), model_->bodies, state_.cache.points);
}

const PositionProjection* ContactStage::project_positions(const MixedSystem& system, std::size_t joints,
                                                          const std::vector<Pose>& poses, bool again) {
    const StepEnd end{detection_,        motion_.poses, poses,
                      margins_.search(), state_.cache,  state_.initial_penetration};
    return projector_.project({system, joints, pgs_}, end, motion_.drive, again, state_.initial_penetration,
                              state_.counters, woken_);
}

void ContactStage::apply_balancing_impulse(const Islands& islands, int island, Vec3 momentum) noexcept {
    for (CachedContact& cached : state_.cache.points) {
        const int first = model_->bodies.solver_index[cached.contact.first],
                  second = model_->bodies.solver_index[cached.contact.second];
        if (std::min(first, second) >= 0 || islands.of_body[std::max(first, second)] != island) continue;
        if (!cached.pushes()) continue;
        cached.impulse += first >= 0 ? -momentum : momentum;
        return;
    }
}

BlockLdlt::Counters ContactStage::factor_counters() const noexcept {
    BlockLdlt::Counters sum = resting_solver_.counters();
    for (const IslandSolver* solver : {&impact_solver_, &projector_.solver()}) {
        const BlockLdlt::Counters more = solver->counters();
        sum.factorisations += more.factorisations;
        sum.block_operations += more.block_operations;
        sum.floored_pivots += more.floored_pivots;
        sum.solves += more.solves;
    }
    return sum;
}

}  // namespace spook
