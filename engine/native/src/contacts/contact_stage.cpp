#include "contacts/contact_stage.hpp"

#include <algorithm>

#include "contacts/contact_geometry.hpp"
#include "contacts/tolerances.hpp"

namespace spook {

namespace {

using namespace tolerances::contact_stage;

/// Takes down how deep pairs overlap where the run begins: nothing but the scene has brought them there.
void note_initial_penetrations(const ContactModel& model, const ContactPoints& points,
                               ContactStage::State& state) {
    state.initial_penetration_known = true;
    for (const StepContact& point : points.all) {
        const double excess = -point.contact.point.gap - elastic_depth(model.bodies, point);
        if (!(excess > 0.0)) continue;
        double& given = state.initial_penetration[pair_of(point.contact)].depth;
        given = std::max(given, excess);
    }
}

}  // namespace

ContactStage::ContactStage(Detection detection, const std::vector<SurfaceMaterial>& materials,
                           std::vector<int> solver_index, const ContactOptions& options,
                           std::vector<JointTie> joints, std::vector<char> yielding,
                           std::vector<PairFriction> pair_frictions, std::vector<Tumbler> tumblers)
    : model_(std::make_shared<ContactModel>(
          ContactBodies{detection, std::move(solver_index), std::move(joints), std::move(tumblers)},
          ContactSurfaces{materials, std::move(pair_frictions)}, options)),
      motion_(model_),
      search_(std::move(detection)),
      projector_(model_, std::move(yielding)) {}

bool ContactStage::detect(const std::vector<Pose>& poses, const std::vector<Vec6>& velocity,
                          const std::vector<Vec6>& free_velocity) {
    motion_.begin(poses, velocity, free_velocity);
    projector_.begin_step();
    energy_.reserve(model_->bodies.count());
    points_.clear();
    impacts_.begin_step(*model_);
    ran_away_ = false;  // of a step that was taken back, or is over

    search_.begin(motion_, free_velocity, state_.cache, points_);
    motion_.predict(free_velocity);
    const std::size_t closed_points = points_.all.size();
    if (!state_.initial_penetration_known) note_initial_penetrations(*model_, points_, state_);
    const bool met = search_.find_impacts({motion_.predicted}, changed_, motion_, points_) > 0;
    if (met || impacts_.queue().possible()) impacts_.queue().find_meetings(search_, motion_, points_);
    if (met) {
        search_.move_impacts_to_start(closed_points, motion_.predicted, motion_, points_);
    }
    if (points_.all.empty()) {
        state_.cache.points.clear();
        return false;
    }
    state_.counters.contacts += points_.all.size();
    motion_.apply_half_of_forces();
    order_points();
    impacts_.measure(motion_, search_.margins().reach(), points_);
    return true;
}

bool ContactStage::meets(const std::vector<Vec6>& next) {
    changed_ = model_->bodies.jointed;  // others have been cast along what they fly with
    const Cast cast{next, Cast::When::solved};
    search_.widen(cast, changed_, motion_, points_);
    find_impacts(cast);
    if (points_.all.empty()) return false;
    state_.counters.contacts += points_.all.size();
    motion_.apply_half_of_forces();
    order_points();
    return true;
}

/// Gives points to what bodies meet along such velocities, where the step begins.
int ContactStage::find_impacts(const Cast& cast) {
    const std::size_t from = points_.all.size();
    const int found = search_.find_impacts(cast, changed_, motion_, points_);
    if (found > 0) search_.move_impacts_to_start(from, cast.velocity, motion_, points_);
    for (std::size_t k = from; k < points_.all.size() && !rebounds_late_; ++k) {
        const Contact& contact = points_.all[k].contact;
        rebounds_late_ = model_->surfaces.pair(contact).restitution > 0.0 &&
                         -relative_velocity(points_.all[k], contact.point.normal, cast.velocity) >
                             falls * motion_.fall(contact);  // what forces give is no impact
    }
    return found;
}

void ContactStage::impact(MixedSystem& system, std::vector<Vec6>& impulses) {
    quality_ =
        impacts_.solve(system, ran_away_ ? not_too_large : 0, motion_, points_, impulses, state_.counters);
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
    next_ = motion_.velocity;
    for (std::size_t b = 0; b < next_.size(); ++b)
        if (model_->bodies.moves(b) && motion_.is_free(b))
            next_[b] = sum(motion_.velocity[b], motion_.dv_ext[b]);
    changed_.assign(next_.size(), 1);
    const Cast cast{next_};
    search_.widen(cast, changed_, motion_, points_);
    const std::size_t known = points_.all.size();
    if (search_.find_impacts(cast, changed_, motion_, points_) > 0) {
        for (std::size_t k = known; k < points_.all.size(); ++k)
            if (impacts_.queue().come_in_order(*model_, points_.all[k]))
                impacts_.queue().move_to_last_impact(motion_, points_.all[k]);
        search_.move_impacts_to_start(known, next_, motion_, points_);
        state_.counters.contacts += points_.all.size() - known;
        order_points();
    }
    impacts_.measure(motion_, search_.margins().reach(), points_);
    impacts_.look_again(*model_, points_);
}

/// After a solve: whether an impact is to come first. Impacts that rebound and were found late follow from others that were too slow
/// to rebound: the resting rows that answer these know of no bounce, so they are met before, as plastic ones.
bool ContactStage::needs_impact_first() {
    if (!rebounds_late_ || !impacts_.meet_slow_too() ||
        !impacts_.measure(motion_, search_.margins().reach(), points_))
        return false;
    order_points();
    return true;
}

bool ContactStage::by_rows(std::size_t joints) const noexcept {
    return state_.by_rows && joints + points_.all.size() <= few_jointed;
}

ContactStage::SolveEnd ContactStage::solve(MixedSystem& system, const std::vector<Vec6>& velocity,
                                           const std::vector<char>& anew) {
    const std::size_t joints = system.rows.size();
    points_.forget(model_->bodies, anew);
    motion_.velocity = velocity;
    ran_away_ = rebounds_late_ = false;
    if (model_->options.solver == SolverKind::iterative && !model_->surfaces.resists_turning) {
        if (by_rows(joints))
            pgs_.start(system, model_->options.friction);  // overlaps are parted with its masses
        else if (const PgsSolveEnd end = solve_by_pgs(system); !end.unfinished) return end;
    }
    bool finite = true;
    IslandRules rules{.friction = model_->options.friction};
    for (int round = 0;; ++round) {
        // What a resting solve leaves, the next step sees; what an impact leaves stays.
        rules.enough =
            state_.by_rows ? model_->options.residual_tolerance : model_->options.unsettled_residual;
        rules.few_enough = by_rows(joints) ? few_jointed : ran_away_ ? not_too_large : 0;
        finite = resting_.solve(system, joints, rules, round > 0, motion_, points_, state_.counters).finite;
        if (!finite || round == late_rounds) break;
        move_on(system);
        const std::size_t known = points_.all.size();
        changed_.assign(next_.size(), 1);
        const Cast cast{next_, Cast::When::solved};
        search_.widen(cast, changed_, motion_, points_);
        search_.find_turned(next_, motion_, points_);
        find_impacts(cast);
        if (needs_impact_first()) return {};
        if (points_.all.size() == known) {
            if (passes_other_ends(system, joints, model_->options.time_step)) return {.ends_passed = true};
            break;
        }
        state_.counters.contacts += points_.all.size() - known;
        resting_.store(system, joints, model_->bodies, points_);
        if (joints == 0 && model_->options.solver == SolverKind::direct)
            rules.warm_started = warm_start_by_pgs(system, known, round) || rules.warm_started;
        order_points();
    }
    mark_rows(system.mass.size(), system.rows);  // the last round may have brought some
    quality_ = resting_.deliver(system, joints, judged(), points_, energy_, state_.cache.points);
    if (finite) correct_events(system);
    return {.finite = finite};
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
void ContactStage::move_on(const MixedSystem& system) {
    mark_rows(system.mass.size(), system.rows);
    next_.resize(model_->bodies.count());
    for (std::size_t b = 0; b < model_->bodies.count(); ++b) {
        const int u = model_->bodies.solver_index[b];
        next_[b] = u >= 0 && has_rows_[u] ? system.velocity[u] : sum(motion_.velocity[b], motion_.dv_ext[b]);
    }
}

void ContactStage::correct_events(const MixedSystem& system) {
    motion_.correct_events(system, has_rows_);
    if (!motion_.supported.has_released()) return;
    connected_.begin(system, 0);
    points_.tie(model_->bodies, connected_);
    motion_.supported.book(system, connected_.find(), model_->bodies, state_.cache.points);
}

const PositionProjection* ContactStage::project_positions(const MixedSystem& system, std::size_t joints,
                                                          const std::vector<Pose>& poses, bool again) {
    const StepEnd end{search_.detection,          motion_.poses, poses,
                      search_.margins().search(), state_.cache,  state_.initial_penetration};
    return projector_.project({system, joints, pgs_.solver()}, end, motion_.drive, again,
                              state_.initial_penetration, state_.counters, search_.woken);
}

bool ContactStage::parts_first_overlaps(int island, double share, const std::vector<Pose>& poses) {
    return projector_.parts(island, share, poses, search_.detection, state_.initial_penetration);
}

void ContactStage::apply_balancing_impulse(const Islands& islands, int island, Vec3 momentum) noexcept {
    for (CachedContact& cached : state_.cache.points) {
        const auto [first, second] = model_->bodies.solver_pair(cached.contact);
        if (std::min(first, second) >= 0 || islands.of_body[std::max(first, second)] != island) continue;
        if (!cached.pushes()) continue;
        cached.impulse += first >= 0 ? -momentum : momentum;
        return;
    }
}

BlockLdlt::Counters ContactStage::factor_counters() const noexcept {
    BlockLdlt::Counters sum = resting_.islands().counters();
    sum.add(impacts_.solver().counters());
    sum.add(projector_.solver().counters());
    return sum;
}

void ContactStage::put_to_sleep(const std::vector<int>& bodies) {
    for (const int body : bodies) search_.detection.set_asleep(body, true);
    state_.cache.put_to_sleep(bodies, model_->bodies.count());
}

void ContactStage::wake(const std::vector<int>& bodies) {
    for (const int body : bodies) search_.detection.set_asleep(body, false);
    state_.cache.wake(bodies);
}

void ContactStage::sleep_through() {
    search_.woken.clear();
    points_.all.clear();
    motion_.correction.clear();
}

void ContactStage::go_back(const Snapshot& kept) {
    state_ = kept.state;
    search_.woken.clear();
    for (std::size_t b = 0; b < model_->bodies.count();
         ++b) {  // what sleeps is what slept then, for the search as well
        const int body = static_cast<int>(b);
        if (const bool slept = state_.cache.sleeps(body); slept != search_.detection.is_asleep(body))
            search_.detection.set_asleep(body, slept);
    }
    resting_.islands().set_backoff(kept.resting);
    impacts_.solver().set_backoff(kept.impact);
    projector_.solver().set_backoff(kept.projection);
}

}  // namespace spook
