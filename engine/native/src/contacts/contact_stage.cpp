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
    : model_(std::make_shared<ContactModel>(ContactBodies{detection, std::move(unknown), std::move(joints)},
                                            ContactSurfaces{materials}, options)),
      motion_(model_),
      search_(std::move(detection), model_),
      events_(model_),
      impacts_(model_),
      projector_(model_, std::move(yielding)) {
    resting_solver_.floor = options.floor;
    resting_solver_.refinements = options.refinements;
}

bool ContactStage::detect(const std::vector<Pose>& poses, const std::vector<Vec6>& velocity,
                          const std::vector<Vec6>& free_velocity) {
    const std::size_t bodies = model_->bodies.count();
    motion_.begin(poses, velocity, free_velocity);
    projector_.begin_step();
    // By island, of which there may be as many as bodies, however late; a copy of the stage has no room for them.
    arrays_.sums.reserve(bodies);
    correction_.clear();
    points_.clear();
    impacts_.begin_step();
    ran_away_ = false;  // of a step that was taken back, or is over

    search_.begin(motion_, free_velocity, points_);
    motion_.predict(free_velocity);
    const std::size_t closed_points = points_.all.size();
    if (!state_.initial_penetration_known) note_initial_penetrations();
    if (search_.find_impacts({motion_.predicted}, changed_, false, motion_, points_).pairs > 0) {
        events_.find(search_, motion_, points_);
        search_.move_impacts_to_start(closed_points, motion_.predicted, motion_, points_);
    }
    if (points_.all.empty()) {
        state_.cache.points.clear();
        return false;
    }
    state_.counters.contacts += points_.all.size();
    motion_.apply_half_of_forces();
    order_points();
    measure_points();
    return true;
}

/// Takes down how deep pairs overlap where the run begins: nothing but the scene has brought them there.
void ContactStage::note_initial_penetrations() {
    state_.initial_penetration_known = true;
    for (const Point& point : points_.all) {
        const double excess = -point.contact.point.gap - elastic_depth(model_->bodies, point);
        if (!(excess > 0.0)) continue;
        double& given = state_.initial_penetration[point.contact.key >> feature_bits];
        given = std::max(given, excess);
    }
}

bool ContactStage::meets(const std::vector<Vec6>& next, bool stop_hit, bool rebounds) {
    if (rebounds)
        impacts_.meet_plastic_too();    // impacts that a stop's rebound leads to are found again after it
    changed_ = model_->bodies.jointed;  // others have been cast along what they fly with
    const Cast cast{next, Cast::When::solved};
    search_.widen(cast, changed_, motion_, points_);
    const std::size_t closed_points = points_.all.size();
    CandidateSearch::Found found =
        search_.find_impacts(cast, changed_, impacts_.plastic_too(), motion_, points_);
    if (found.left_out && stop_hit) {  // as are those to a body that it only stops
        impacts_.meet_plastic_too();
        found.pairs += search_.find_impacts(cast, changed_, true, motion_, points_).pairs;
    }
    if (found.pairs > 0) search_.move_impacts_to_start(closed_points, next, motion_, points_);
    if (points_.all.empty()) return false;
    state_.counters.contacts += points_.all.size();
    motion_.apply_half_of_forces();
    order_points();
    return true;
}

/// Gives points to what bodies meet along such velocities, where the step begins.
CandidateSearch::Found ContactStage::find_impacts(const Cast& cast, bool keeps_rebounds) {
    const std::size_t from = points_.all.size();
    const CandidateSearch::Found found =
        search_.find_impacts(cast, changed_, keeps_rebounds, motion_, points_);
    if (found.pairs > 0) search_.move_impacts_to_start(from, cast.velocity, motion_, points_);
    return found;
}

void ContactStage::impact(MixedSystem& system, std::vector<Vec6>& impulses) {
    quality_ = impacts_.solve(system, search_.open(), ran_away_ ? not_too_large : 0, motion_, points_,
                              impulses, state_.counters);
    mark_rows(system.mass.size(), impacts_.hit_rows());
    after_impact(system);
}

/// Impacts set bodies in motion that meet others within the same step.
void ContactStage::after_impact(const MixedSystem& system) {
    for (std::size_t b = 0; b < model_->bodies.count(); ++b)
        if (const int u = model_->bodies.solver_index[b]; u >= 0 && has_rows_[u]) {
            motion_.release_support(static_cast<int>(b), system.velocity[u]);
            motion_.velocity[b] = system.velocity[u];
        }
    std::vector<Vec6>& next = next_ = motion_.velocity;
    for (std::size_t b = 0; b < next.size(); ++b)
        if (model_->bodies.moves(b) && motion_.is_free(b))
            next[b] = sum(motion_.velocity[b], motion_.dv_ext[b]);
    changed_.assign(next.size(), 1);
    const Cast cast{next};
    search_.widen(cast, changed_, motion_, points_);
    const std::size_t known = points_.all.size();
    if (search_.find_impacts(cast, changed_, false, motion_, points_).pairs > 0) {
        for (std::size_t k = known; k < points_.all.size(); ++k)
            if (impacts_.order().come_in_order(points_.all[k]))
                impacts_.order().move_to_last_impact(motion_, points_.all[k]);
        search_.move_impacts_to_start(known, next, motion_, points_);
        state_.counters.contacts += points_.all.size() - known;
        order_points();
    }
    measure_points();
    if (!impacts_.look_again(points_)) motion_.lay_down(points_.all);
}

/// After a solve: whether an impact is to come first. Where impacts that rebound were left out, bodies that a plastic impact
/// sets in motion may meet others with restitution in this very step. The resting rows that answer such impacts know of no
/// bounce: plastic ones, too, are then met before, so that these are found in time. If there are none, what has been left out is
/// met as if it did not rebound. So come impacts of bodies that a stop sends back with `next` with others that no row knew
/// of: `known` is how many points there were.
bool ContactStage::needs_impact_first(const MixedSystem& system, std::size_t known,
                                      const std::vector<Vec6>& next, bool left_out) {
    if (left_out) {
        impacts_.meet_plastic_too();
        if (measure_points()) {
            order_points();
            return true;
        }
        find_impacts({next, Cast::When::solved}, true);
    }
    if (points_.all.size() == known || !impacts_.stop_is_hit(system, points_)) return false;
    order_points();
    measure_points();
    return true;
}

/// What is connected by the step's points.
const Islands& ContactStage::connected(std::size_t bodies) {
    connected_.begin(static_cast<int>(bodies));
    points_.tie(model_->bodies, connected_);
    return connected_.find();
}

ContactStage::SolveEnd ContactStage::solve(MixedSystem& system, const std::vector<Vec6>& velocity) {
    const std::size_t joints = system.rows.size();
    motion_.velocity = velocity;
    ran_away_ = false;
    bool warm_started = false;
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
                if (model_->bodies.moves(b))
                    system.velocity[model_->bodies.solver_index[b]] = motion_.velocity[b];
        }
        const FrictionReport before = report;
        const bool late = round > 0 && model_->options.solver == SolverKind::direct;
        // What a resting solve leaves, the next step sees; what an impact leaves stays.
        IslandRules rules{.friction = model_->options.friction,
                          .enough = state_.by_rows ? model_->options.residual_tolerance
                                                   : model_->options.unsettled_residual,
                          .few_enough = ran_away_ ? not_too_large : 0};
        rules.warm_started = warm_started;
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
        const Cast cast{next, Cast::When::solved};
        search_.widen(cast, changed_, motion_, points_);
        search_.find_turned(next, motion_, points_);
        if (needs_impact_first(system, known, next, find_impacts(cast, impacts_.plastic_too()).left_out))
            return {};
        if (points_.all.size() == known) {
            if (passes_other_ends(system, joints, model_->options.time_step)) return {.ends_passed = true};
            break;
        }
        state_.counters.contacts += points_.all.size() - known;
        for (std::size_t k = 0; k < system.rows.size() - joints; ++k)
            store_solution(*model_, system.rows[joints + k], points_, points_.all[k]);
        if (joints == 0 && model_->options.solver == SolverKind::direct)
            warm_started = warm_start_by_pgs(system, known, round) || warm_started;
        order_points();
    }
    mark_rows(system.mass.size(),
              system.rows);  // the last round may have brought rows to bodies that had none
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

void ContactStage::mark_rows(std::size_t bodies, const std::vector<RowBlock>& rows) {
    has_rows_.assign(bodies, 0);
    for (const RowBlock& block : rows) {
        for (const int body : {block.first, block.second})
            if (body >= 0) has_rows_[body] = 1;
        for (const FurtherBody& other : block.further) has_rows_[other.body] = 1;
    }
}

/// Velocities of all bodies after a solve; those without rows fly freely.
void ContactStage::move_on(const MixedSystem& system, std::vector<Vec6>& next) {
    mark_rows(system.mass.size(), system.rows);
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
        motion_.supported.book(system, connected(system.mass.size()), model_->bodies, state_.cache.points);
}

const PositionProjection* ContactStage::project_positions(const MixedSystem& system, std::size_t joints,
                                                          const std::vector<Pose>& poses, bool again) {
    const StepEnd end{search_.detection,          motion_.poses, poses,
                      search_.margins().search(), state_.cache,  state_.initial_penetration};
    return projector_.project({system, joints, pgs_}, end, motion_.drive, again, state_.initial_penetration,
                              state_.counters, search_.woken);
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
    for (const IslandSolver* solver : {&impacts_.solver(), &projector_.solver()}) {
        const BlockLdlt::Counters more = solver->counters();
        sum.factorisations += more.factorisations;
        sum.block_operations += more.block_operations;
        sum.floored_pivots += more.floored_pivots;
        sum.solves += more.solves;
    }
    return sum;
}

}  // namespace spook
