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
      bodies_(std::make_shared<ContactBodies>(detection_, std::move(unknown), std::move(joints))),
      surfaces_(std::make_shared<ContactSurfaces>(materials)),
      options_(options),
      projector_(bodies_, surfaces_, options, std::move(yielding)) {
    for (IslandSolver* solver : {&resting_solver_, &impact_solver_}) {
        solver->floor = options.floor;
        solver->refinements = options.refinements;
    }
    const std::size_t bodies = bodies_->count();
    depth_.assign(bodies, 0.0);
    predicted_sinking_.assign(bodies, 0.0);
    toi_fraction_.assign(bodies, 0.0);
    event_time_.assign(bodies, -1.0);
}

/// How fast the surfaces move along themselves, the first against the second, along `direction`, m/s.
double ContactStage::surface_speed(const Point& point, Vec3 direction) const noexcept {
    if (!surfaces_->conveys) return 0.0;
    const int a = point.contact.first, b = point.contact.second;
    return dot(direction, poses_[a].rotation * (*surfaces_)[a].surface_velocity -
                              poses_[b].rotation * (*surfaces_)[b].surface_velocity);
}

/// The first `rows` of normal, tangents and turning: 1, 3 or 6.
RowBlock ContactStage::row_block(const Point& point, int rows) const {
    const Contact& contact = point.contact;
    RowBlock block;
    block.is_contact = true;
    block.first = bodies_->solver_index[contact.first];
    block.second = bodies_->solver_index[contact.second];
    block.size = std::min(rows, 3);
    const double* const axis_scale = extras_.of(point).axis_scale;
    const Vec3 directions[3] = {contact.point.normal, axis_scale[0] * point.tangent,
                                axis_scale[1] * cross(contact.point.normal, point.tangent)};
    for (int i = 0; i < block.size; ++i) {
        if (block.first >= 0) block.first_jacobian[i] = contact_row(directions[i], point.first_arm);
        if (block.second >= 0) block.second_jacobian[i] = contact_row(-directions[i], point.second_arm);
        block.right[i] = drive_.any() ? -relative_velocity(point, directions[i], drive_.prescribed()) : -0.0;
        if (i > 0) block.right[i] -= surface_speed(point, directions[i]);
    }
    block.lower[0] = 0.0;
    if (rows == 6) add_turning_rows(point, block);
    return block;
}

/// Rolling about both tangents and turning about the normal, as speeds at the larger body's radius: what is left of
/// them then compares with that of other rows.
void ContactStage::add_turning_rows(const Point& point, RowBlock& block) const {
    const double scale = bodies_->size(point.contact);
    const Vec3 n = point.contact.point.normal;
    const Vec3 axes[3] = {point.tangent, cross(n, point.tangent), n};
    for (int i = 0; i < 3; ++i) {
        const Vec3 axis = scale * axes[i];
        const Vec6 row{0.0, 0.0, 0.0, axis.x, axis.y, axis.z};
        if (block.first >= 0) block.first_jacobian[3 + i] = row;
        if (block.second >= 0) block.second_jacobian[3 + i] = {0.0, 0.0, 0.0, -axis.x, -axis.y, -axis.z};
        block.right[3 + i] = -dot(axis, angular(drive_.prescribed()[point.contact.first]) -
                                            angular(drive_.prescribed()[point.contact.second]));
        block.lower[3 + i] = block.upper[3 + i] = 0.0;  // until its friction bounds it
    }
    block.size = 6;
}

/// The rows of a block that friction bounds.
void ContactStage::add_friction(const Point& point, int block, std::vector<FrictionPoint>& friction) const {
    const PairMaterial material = surfaces_->pair(point.contact);
    const double soft = material.slip_compliance / options_.time_step, scale = bodies_->size(point.contact);
    double normal = point.before;
    if (options_.friction == FrictionModel::box) normal = normal < 0.0 ? extras_.of(point).guessed : normal;
    else if (point.solved) normal = point.normal;
    if (point.friction > 0.0) {
        friction.push_back({block, point.friction, soft, normal});
        friction.back().anisotropic = extras_.of(point).is_anisotropic();
    }
    if (material.rolling > 0.0) friction.push_back({block, material.rolling / scale, 0.0, normal, 3, 2});
    if (material.torsional > 0.0) friction.push_back({block, material.torsional / scale, 0.0, normal, 5, 1});
}

IslandRules ContactStage::rules_of(FrictionModel model, bool exact) const noexcept {
    return {.friction = model,
            .enough = exact ? options_.residual_tolerance : options_.unsettled_residual,
            .few_enough = ran_away_ ? not_too_large : 0};
}

/// What is left of the step after a point's event, s.
double ContactStage::time_left(const Point& point) const noexcept {
    const double h = options_.time_step;
    return point.event ? std::max(h - point.toi, 1e-3 * h) : h;
}

/// What the normal's resting row adds to the right side of the bodies that do not move by themselves, m/s.
double ContactStage::resting_right(Point& point) const {
    const double h = options_.time_step, gap = bodies_->gap(point.contact);
    measure(point);
    const bool touching = bodies_->is_closed(point.contact);
    if (point.event)  // another point of a pair that meets may still be open
        return -(touching ? 0.0 : gap / time_left(point));
    if (!touching) return -gap / h;
    const PairMaterial material = surfaces_->pair(point.contact);
    const Regularisation row = regularise(material.compliance, material.damping, h);
    const double depth = -row.violation_gain * std::max(gap, -elastic_depth(*bodies_, point));
    // A rigid contact that opens is not pushed after its own speed.
    return material.compliance > 0.0 ? depth + row.upsilon * point.resting_approach() : depth;
}

/// Whether a point is likely to push: what a solver starts from.
bool ContactStage::is_pressed(const Point& point) const noexcept {
    const double h = options_.time_step, gap = point.contact.point.gap;
    if (point.solved) return point.normal > 0.0;
    return point.before > 0.0 || point.toi >= 0.0 ||
           (point.before < 0.0 &&
            (bodies_->is_closed(point.contact) || gap + h * (point.resting_approach() + point.dv_ext) < 0.0));
}

/// The resting row of a point; the tangents' bounds are left to the friction law.
RowBlock ContactStage::resting_row(Point& point) const {
    const double h = options_.time_step;
    const PairMaterial material = surfaces_->pair(point.contact);
    const bool turning = material.resists_turning();
    RowBlock block = row_block(point, turning ? 6 : point.friction > 0.0 ? 3 : 1);
    if (turning && !(point.friction > 0.0))
        for (int i = 1; i <= 2; ++i) block.lower[i] = block.upper[i] = 0.0;
    block.right[0] += resting_right(point);
    block.softness[0] = regularise(material.compliance, material.damping, h).softness;
    block.state[0] = is_pressed(point) ? RowState::free : RowState::at_lower;
    block.multiplier[0] = point.solved ? point.normal : std::max(0.0, point.before);
    const ContactExtras& extras = extras_.of(point);
    if (point.friction > 0.0) {
        block.softness[1] = block.softness[2] = material.slip_compliance / h;
        for (int i = 1; i <= 2; ++i) block.multiplier[i] = point.tangents[i - 1] / extras.axis_scale[i - 1];
    }
    for (int i = 3; i < block.size; ++i) block.multiplier[i] = extras.turning[i - 3];
    return block;
}

ContactStage::SolveEnd ContactStage::solve(MixedSystem& system, const std::vector<Vec6>& velocity) {
    const std::size_t joints = system.rows.size();
    velocity_ = velocity;
    warm_started_ = ran_away_ = false;
    const auto by_rows = [&] { return state_.by_rows && joints + points_.size() <= few_jointed; };
    if (options_.solver == SolverKind::iterative && !surfaces_->resists_turning) {
        if (by_rows()) pgs_.start(system, options_.friction);  // overlaps are parted with its masses
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
        for (Point& point : points_) {
            system.rows.push_back(resting_row(point));
            answered.push_back(point.answered);
            if (system.rows.back().size > 1)
                add_friction(point, static_cast<int>(system.rows.size()) - 1, friction);
        }
        if (round == 0) {  // at rest, the velocities before are those after
            system.velocity.resize(system.mass.size());
            for (std::size_t b = 0; b < bodies_->solver_index.size(); ++b)
                if (bodies_->solver_index[b] >= 0) system.velocity[bodies_->solver_index[b]] = velocity_[b];
        }
        const FrictionReport before = report;
        const bool late = round > 0 && options_.solver == SolverKind::direct;
        // What a resting solve leaves, the next step sees; what an impact leaves stays.
        IslandRules rules = rules_of(options_.friction, state_.by_rows);
        rules.warm_started = warm_started_;
        if (by_rows()) rules.few_enough = few_jointed;
        report = solve_islands(system, friction, resting_solver_, options_, rules, state_.counters,
                               late ? &answered : nullptr);
        report.rounds += before.rounds, report.pgs_iterations += before.pgs_iterations;
        report.converged = report.converged && before.converged;  // islands may have been left as they were
        if (options_.friction == FrictionModel::box)
            for (const FrictionPoint& point : friction)
                extras_.own(points_[point.block - joints]).guessed = point.normal;
        if (!report.finite || round == late_rounds) break;
        move_on(system, next);
        const std::size_t known = points_.size();
        changed_.assign(next.size(), 1);
        if (margins_.outrun(*bodies_, options_.time_step, next, changed_)) find_open_again();
        find_turned(next);
        const std::size_t dissipated_energy = points_.size();
        late_impact_ = false;
        if (find_impacts(next, true) > 0) move_impacts_to_start(dissipated_energy, next);
        if (needs_plastic_impact() || needs_stop_impact(system, known, next)) return {};
        if (late_impact_) find_deferred_impacts(next);
        if (points_.size() == known) {
            if (passes_other_ends(system, joints, options_.time_step)) return {.ends_passed = true};
            break;
        }
        state_.counters.contacts += points_.size() - known;
        for (std::size_t k = 0; k < system.rows.size() - joints; ++k)
            store_solution(system.rows[joints + k], points_[k]);
        if (joints == 0 && options_.solver == SolverKind::direct) warm_start_by_pgs(system, known, round);
        order_points();
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
    for (std::size_t k = 0; k < points_.size(); ++k) {
        Point& point = points_[k];
        const Vec3 along = store_solution(system.rows[joints + k], point);
        CachedContact& cached = cache_contact(system, point, point.normal, along);
        std::copy_n(extras_.of(point).turning, 3, cached.turning);
    }
    if (report.finite) correct_events(system);
    return {.finite = report.finite};
}

/// What a solve found for a point, along world tangents: it may have turned its own. Gives the impulse along the surface.
Vec3 ContactStage::store_solution(const RowBlock& block, Point& point) {
    Vec3 along, turning;
    for (int i = 1; i < block.size; ++i) {
        const Vec6& row = block.first >= 0 ? block.first_jacobian[i] : block.second_jacobian[i];
        const double sign = block.first >= 0 ? block.multiplier[i] : -block.multiplier[i];
        if (i < 3) along += sign * linear(row);
        else turning += sign * angular(row);
    }
    const Vec3 n = point.contact.point.normal, t = point.tangent;
    const double scale = 1.0 / bodies_->size(point.contact);
    point.solved = point.answered = true;
    point.normal = block.multiplier[0];
    point.tangents[0] = dot(along, t);
    point.tangents[1] = dot(along, cross(n, t));
    if (block.size > 3) {
        double* const own = extras_.own(point).turning;
        own[0] = scale * dot(turning, t);
        own[1] = scale * dot(turning, cross(n, t));
        own[2] = scale * dot(turning, n);
    }
    return along;
}

/// Whether a point that is to rebound was stopped instead, faster than a fall in a step.
bool ContactStage::is_stopped(const Point& point, double normal) const {
    const double fall = std::abs(relative_velocity(point, point.contact.point.normal, whole_dv_ext_));
    return normal > 0.0 && point.approach < -(point.rounding + fall) &&
           surfaces_->pair(point.contact).restitution > 0.0;
}

/// How far a compliant contact is pressed in at the end of the step: where it was, and the way its bodies go.
double ContactStage::compression(const MixedSystem& system, const Point& point) const {
    if (!(surfaces_->pair(point.contact).compliance > 0.0)) return 0.0;
    const Contact& contact = point.contact;
    double speed = 0.0;
    for (const int b : {contact.first, contact.second}) {
        const Vec6& v =
            bodies_->solver_index[b] < 0 ? velocity_[b] : system.velocity[bodies_->solver_index[b]];
        const bool first = b == contact.first;
        speed += dot(contact_row(first ? contact.point.normal : -contact.point.normal,
                                 first ? point.first_arm : point.second_arm),
                     v);
    }
    const double before = std::min(point.compression_before, -contact.point.gap);  // an open gap comes first
    return std::max(0.0, before - time_left(point) * speed);
}

/// Takes down what a point did: its normal impulse, and that along the surface.
CachedContact& ContactStage::cache_contact(const MixedSystem& system, const Point& point, double normal,
                                           Vec3 along) {
    CachedContact& cached = state_.cache.points.emplace_back();
    const Vec3 n = point.contact.point.normal;
    cached.contact = point.contact;
    cached.normal = normal;
    cached.compression = compression(system, point);
    cached.impact = point.impact;
    state_.counters.stopped += is_stopped(point, normal);
    cached.impulse = normal * n + along + extras_.of(point).impact_impulse;
    cached.tangent[0] = dot(along, point.tangent);
    cached.tangent[1] = dot(along, cross(n, point.tangent));
    cached.friction = extras_.of(point).axis_scale[0] * point.friction;
    cached.active = cached.normal > 0.0 || cached.impact > 0.0 || bodies_->is_closed(point.contact);
    return cached;
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
    next.resize(bodies_->solver_index.size());
    for (std::size_t b = 0; b < bodies_->solver_index.size(); ++b) {
        const int u = bodies_->solver_index[b];
        next[b] = u >= 0 && has_rows_[u] ? system.velocity[u] : sum(velocity_[b], dv_ext_[b]);
    }
}

/// An event's bodies went with v₋ until its time: with v₊ for the whole step they would end elsewhere.
void ContactStage::correct_events(const MixedSystem& system) {
    for (std::size_t b = 0; b < bodies_->solver_index.size(); ++b) {
        const int u = bodies_->solver_index[b];
        if (u < 0 || event_time_[b] < 0.0 || !has_rows_[u]) continue;
        if (correction_.empty()) correction_.assign(system.mass.size(), Vec6{});
        // What a joint holds turns as it goes, or the joint would answer the difference with a speed.
        for (int i = 0; i < (bodies_->jointed[b] ? 6 : 3); ++i)
            correction_[u][i] +=
                event_time_[b] / options_.time_step * (predicted_[b][i] - system.velocity[u][i]);
        const Vec3 more = free_fall_correction(static_cast<int>(b), linear(system.velocity[u]));
        for (int i = 0; i < 3; ++i) correction_[u][i] += more[i];
    }
    if (supported_.has_released())
        supported_.book(system, connected(system, 0), *bodies_, state_.cache.points);
}

const PositionProjection* ContactStage::project_positions(const MixedSystem& system, std::size_t joints,
                                                          const std::vector<Pose>& poses, bool again) {
    const StepEnd end{detection_, poses_, poses, margins_.search(), state_.cache, state_.initial_penetration};
    return projector_.project({system, joints, pgs_}, end, drive_, again, state_.initial_penetration,
                              state_.counters, woken_);
}

void ContactStage::apply_balancing_impulse(const Islands& islands, int island, Vec3 momentum) noexcept {
    for (CachedContact& cached : state_.cache.points) {
        const int first = bodies_->solver_index[cached.contact.first],
                  second = bodies_->solver_index[cached.contact.second];
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
