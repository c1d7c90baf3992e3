// One step of the rigid-body pipeline, stage by stage.
#include <algorithm>
#include <cmath>

#include "rigid/rigid_system.hpp"

namespace spook {

namespace {

constexpr std::size_t looking_from =
    16;  // bodies: steps of fewer that cannot touch are too short for a look at the clock in each
constexpr double again = 1e-9;  // of a stop's rebound: slower than this it is not hit again in the step

}  // namespace

void RigidSystem::apply_forces() {
    std::fill(force_.begin(), force_.end(), Vec3{});
    for (const CentralField& field : fields_)
        for (int i = 0; i < bodies(); ++i) {
            if (!constants_[i].moves()) continue;
            const Vec3 d = position_of(i) - field.centre;
            const double r2 = dot(d, d);
            force_[i] -= (constants_[i].mass * field.strength / (r2 * std::sqrt(r2))) * d;
        }
    if (clock_ && !fields_.empty()) clock_->mark(Stage::apply_central_gravity);
    for (const SpringForce& spring : springs_) {
        const auto velocity = [&](const End& end) {
            return end.body < 0 ? Vec3{} : live_.bodies[end.body].velocity;
        };
        const auto& [first, second] = spring.ends;
        const Vec3 pull =
            spook::pull(spring, place(second) - place(first), velocity(second) - velocity(first));
        if (first.body >= 0 && constants_[first.body].moves()) force_[first.body] += pull;
        if (second.body >= 0 && constants_[second.body].moves()) force_[second.body] -= pull;
    }
    if (clock_ && !springs_.empty()) clock_->mark(Stage::apply_springs);
}

void RigidSystem::step() {
    if (contacts_ || constants_.size() >= looking_from) Watch::look();
    ++live_.step;
    if (clock_) clock_->start();
    if (sleep_rules_.on()) note_places();
    if (!live_.velocity_ready) velocity_stage();
    live_.velocity_ready = false;
    if (replaying_ && early_joints_.empty()) {
        deliver();
        early_joints_ = joints_.states;
    }
    if (in_plane_ && half_step_ && !at_hand_) take_plane();  // also where its velocities were found in space
    if (at_hand_) move_in_plane();
    else integrate_all();
    ++live_.moved;
    if (at_hand_ && joints_.follows()) write_plane();
    joints_.follow(live_.bodies);
    if (sleep_rules_.on()) fall_asleep();
}

/// What the coming steps do not read, and a reader between them does.
void RigidSystem::deliver() {
    if (undelivered_) locked_.deliver(joints_.states);
    undelivered_ = false;
    if (at_hand_) write_plane();
    if (at_hand_ && plane_values_) plane_.deliver(joints_.states);
}

void RigidSystem::velocity_stage() {
    if (in_plane_ && plane_velocities()) return;
    if (half_step_)
        for (int i = 0; i < bodies(); ++i)
            live_.before[i] = {live_.bodies[i].velocity, live_.bodies[i].angular_momentum};
    if (!load_follows_.empty() || !drives_.empty()) follow_time();
    if (live_.sleep.sleepers > 0) velocities_beside_sleepers();
    else find_velocities();
}

void RigidSystem::find_velocities() {
    if (!force_.empty()) apply_forces();
    joints_.begin_step();
    kick_free_bodies();
    if (contacts_ && find_contacts()) {
        if (contacts_->woken().empty()) solve_mixed(true);
    } else if (solver_ == RigidSolver::block && live_.sleep.sleepers == 0) {
        solve_block();
    } else if (solver_ != RigidSolver::none) {
        solve_mixed(false);
    } else {
        for (int i : constrained_) kick_free_body(i);  // bodies that could touch but do not
    }
}

/// The velocities of the coming step, before it is begun.
void RigidSystem::solve_ahead() {
    if (live_.velocity_ready) return;
    if (contacts_) keep(before_solve_ahead_);
    velocity_stage();
    if (at_hand_) deliver();
    live_.velocity_ready = true;
}

void RigidSystem::kick_free_body(int i) noexcept {
    BodyState& s = live_.bodies[i];
    s.velocity += kick(i);
    s.angular_momentum += twist(i);
}

void RigidSystem::kick_free_bodies() {
    for (int i : free_) kick_free_body(i);
    if (clock_) clock_->mark(Stage::apply_gravity);
}

bool RigidSystem::find_contacts() {
    const std::size_t count = constants_.size();
    poses_.resize(count);
    velocities_.resize(count);
    free_velocities_.resize(count);
    for (int i = 0; i < bodies(); ++i) {
        const BodyState& s = live_.bodies[i];
        poses_[i] = {position_of(i), axes(constants_[i], s)};
        const Vec3 v = s.velocity, w = s.angular_velocity;
        velocities_[i] = free_velocities_[i] = {v.x, v.y, v.z, w.x, w.y, w.z};
        if (!constants_[i].moves()) continue;
        const Vec3 dv = kick(i);
        for (int k = 0; k < 3; ++k) free_velocities_[i][k] += dv[k];
        if (dot(constants_[i].torque, constants_[i].torque) > 0.0 && !constants_[i].particle) {
            const Vec3 dw = turned_by(constants_[i], s, twist(i));
            for (int k = 0; k < 3; ++k) free_velocities_[i][3 + k] += dw[k];
        }
    }
    touching_ = contacts_->detect(poses_, velocities_, free_velocities_);
    if (touching_) note_start_of_contacts();
    if (clock_) clock_->mark(Stage::collision);
    return touching_;
}

/// In a step that began without contacts, whether bodies meet because of what joints make of their velocities, next_:
/// cast along their own they do not. Then the step is to be solved with contacts.
bool RigidSystem::meet_late() {
    const auto any = [this](auto is) {
        return mixed_values_ && std::any_of(mixed_.rows.begin(), mixed_.rows.end(), is);
    };
    const bool stop_hit = any([](const RowBlock& block) { return block.stop.hit; }),
               rebounds = any([](const RowBlock& block) { return block.stop.rebound != 0.0; });
    if (!contacts_->meets(next_, stop_hit, rebounds)) return false;
    touching_ = true;
    note_start_of_contacts();
    return true;
}

/// Rows are those of the velocities before, and after it of those it leaves.
void RigidSystem::impact() {
    fill_momenta(false);
    contacts_->impact(mixed_);
    judge_contacts();
    for (const int i : constrained_)
        if (contacts_->toi_fraction(i) > 0.0) share_[i] = 1.0 - contacts_->toi_fraction(i);
    take_velocities(true, [this](int k) { return !contacts_->has_rows(k); });
    for (std::size_t k = 0; k < constrained_.size(); ++k)
        if (contacts_->has_rows(static_cast<int>(k))) velocities_[constrained_[k]] = mixed_.velocity[k];
    for (std::size_t k = 0; k < joints_.blocks().size(); ++k)
        if (const StopRow& stop = mixed_.rows[k].stop; stop.answered || stop.limit_reached) {
            JointSet::State& state = joints_.states[joints_.blocks()[k].joint];
            const bool once = method_.impacts == ImpactOrder::simultaneous || stop.limit_reached;
            state.rebounds = once ? unbounded : again * std::abs(stop.rebound);
            if (!stop.answered) continue;
            if (stop.rebound == 0.0) state.met = mixed_.rows[k].lower[stop.row] == 0.0 ? 1 : -1;
        }
    fill_rows();
    if (clock_) clock_->mark(Stage::impact);
}

/// The row of the other end of a block's stop: the coordinate may get there within the step, no further.
RowBlock RigidSystem::other_end(const RowBlock& block) {
    const int i = block.stop.row;
    RowBlock row;
    row.first = block.first, row.second = block.second;
    row.first_jacobian[0] = block.first_jacobian[i], row.second_jacobian[0] = block.second_jacobian[i];
    row.softness[0] = block.softness[i];
    row.right[0] = block.stop.other - block.stop.given;
    (block.lower[i] == 0.0 ? row.upper : row.lower)[0] = 0.0;
    row.stop.row = 0;
    return row;
}

/// Whether velocities lead past such ends; in the next solve of this step they have rows.
bool RigidSystem::find_other_ends() {
    const std::size_t known = other_ends_.size();
    for (int k = 0; k < static_cast<int>(joints_.blocks().size()); ++k)
        if (passes_other_end(mixed_.rows[k], mixed_.velocity, h_)) other_ends_.push_back(k);
    return other_ends_.size() > known;
}

/// Rows without contacts.
bool RigidSystem::solve_joints() {
    if (solver_ != RigidSolver::iterative) return pivot_rows();
    std::vector<FrictionPoint> none;
    const FrictionReport report =
        solve_iterative(mixed_, none, method_.friction, method_.iterations, method_.residual_tolerance);
    pgs_iterations_ += static_cast<std::uint64_t>(report.pgs_iterations);
    return report.finite && settle_joints();
}

/// Joints that iterations have left further off than the method allows are solved directly where few are connected, and from
/// then on wherever iterations do not settle: what many of these leave adds up.
bool RigidSystem::settle_joints() {
    const Islands* islands = nullptr;
    std::vector<std::size_t>& rows = arrays_.rows;
    while (true) {
        const RowsResidual worst = rows_residual(mixed_, {}, method_.friction);
        live_.by_rows = live_.by_rows || worst.residual > pgs_tolerance();
        if (!live_.by_rows || !(worst.residual > method_.residual_tolerance)) return true;
        const auto island = [&](const RowBlock& block) {
            return islands->of_body[std::max(block.first, block.second)];
        };
        if (!islands) {
            islands = &arrays_.finder.find(mixed_);
            rows.assign(islands->count, 0);
            for (const RowBlock& block : mixed_.rows) ++rows[island(block)];
        }
        const int own = island(mixed_.rows[worst.row]);
        if (rows[own] > few_rows) return true;
        rows[own] = few_rows + 1;  // once
        std::vector<char>& answered = arrays_.answered;
        answered.clear();
        for (const RowBlock& block : mixed_.rows) answered.push_back(island(block) != own);
        IslandSolver& direct = arrays_.joint_solver;
        direct.set_backoff({});
        direct.floor = method_.floor, direct.refinements = method_.refinements;
        std::vector<FrictionPoint> none;
        const FrictionReport report = direct.run(
            mixed_, none,
            [this](MixedSystem& part, std::vector<FrictionPoint>& points, DirectSolver& solver) {
                return solve_friction_direct(part, points, method_.friction, solver);
            },
            &answered);
        rounds_ += static_cast<std::uint64_t>(report.pivots);
        if (!report.finite) return false;
    }
}

/// What PGS may leave of a row, m/s.
double RigidSystem::pgs_tolerance() const {
    double speed = 0.0;
    for (const Vec6& v : mixed_.velocity) speed = std::max(speed, norm(Vec3{v[0], v[1], v[2]}));
    return method_.unsettled_residual + 1e-6 * speed;
}

/// Holds PGS over joints alone to what contacts are held to.
void RigidSystem::judge_pgs() {
    const RowsResidual worst = rows_residual(mixed_, {}, method_.friction);
    residual_ = std::max(residual_, worst.residual);
    if (!(worst.residual > pgs_tolerance())) return;
    const int blocks = static_cast<int>(joints_.blocks().size());
    note_unsettled(body_of(worst.row < blocks ? worst.row : other_ends_[worst.row - blocks]), worst.residual);
}

void RigidSystem::integrate_body(int i) {
    if (!integrate(constants_[i], h_, live_.bodies[i]) && live_.too_fast < 0) live_.too_fast = i;
}

void RigidSystem::integrate_all() {
    if (!constrained_are_moved_)
        for (int i : constrained_)
            if (!asleep(i)) integrate_body(i);
    constrained_are_moved_ = false;
    for (int i : free_) integrate_body(i);
    for (int i : driven_) integrate_body(i);
    if (contacts_ && !contacts_->correction().empty()) {
        const std::vector<Vec6>& extra = contacts_->correction();
        for (std::size_t k = 0; k < constrained_.size(); ++k)
            if (!asleep(constrained_[k]))
                displace(constants_[constrained_[k]], h_, {extra[k][0], extra[k][1], extra[k][2]},
                         {extra[k][3], extra[k][4], extra[k][5]}, live_.bodies[constrained_[k]]);
    }
    if (joints_.take_given()) project_limits();
    if (touching_) project_overlaps();
    if (clock_) clock_->mark(Stage::integrate_positions);
}

}  // namespace spook
