// Stage: the velocities v₊ of the step, for all bodies that have rows:
//
//     M v₊ − Σ Gᵀ z = M v + h f,    w = G v₊ + Sig z − r,    lower <= z <= upper, w = 0 between the bounds.
//
// Bilateral rows alone go to one factorisation (rigid_solve.cpp); rows with bounds are written into mixed_ and solved by
// pivoting, Newton's method on the cone or projected Gauss–Seidel, see contacts/. Impacts come first, and again where the
// solve brings some about.
//
// reads: points, rows of joints, masses, momenta, dv_ext. writes: velocities and angular momenta of bodies, multipliers of
// joints, the contact cache, share_; what is unsettled.
#include <algorithm>
#include <cmath>

#include "contacts/friction_pgs.hpp"
#include "rigid/rigid_system.hpp"

namespace spook {

void RigidSystem::solve_velocities() {
    if (touching_) {
        if (contacts_->woken().empty()) solve_mixed(true);  // else the step begins anew with their islands
    } else if (solver_ == RigidSolver::block && live_.sleep.sleepers == 0) {
        solve_block();
    } else if (solver_ != RigidSolver::none) {
        solve_mixed(false);
    } else {
        for (int i : constrained_) kick_free_body(i);  // bodies that could touch but do not
        if (clock_) clock_->mark({Stage::apply_gravity, Stage::apply_loads});
    }
}

void RigidSystem::solve_mixed(bool touching) {
    mixed_values_ = true;
    const auto blocks = joints_.blocks();
    fill_masses();
    if (touching) lead_events();
    const auto impact_needed = [&] {
        return touching && stages_.runs(Stage::impact) && contacts_->impact_needed(mixed_);
    };
    const Stage solver = stages_.runs(Stage::solve_iterative) ? Stage::solve_iterative : Stage::pivot;
    ContactStage::SolveEnd end;
    scratch_.other_ends.clear();
    scratch_.impulses.assign(blocks.size(), {});
    int corrected = 0;
    const auto to_correct = [&] { return curved_ && corrected++ < method_.corrections; };
    do {
        fill_rows(corrected > 0);
        if (clock_) clock_->mark(Stage::assemble_rows);
        while (impact_needed()) impact(), corrected = 0;
        if (clock_ && touching) clock_->mark(Stage::impact);
        fill_momenta(true);
        if (clock_) clock_->mark(Stage::assemble_rows);
        if (touching) end = contacts_->solve(mixed_, scratch_.velocities);
        else end.finite = solve_joints();
        if (clock_) clock_->mark(solver);
    } while (end.finite && (impact_needed() || ((!touching || end.ends_passed) && find_other_ends()) ||
                            to_correct()));  // the solve may find some that is to come first
    if (touching) judge_contacts();
    else if (solver_ == RigidSolver::iterative) judge_pgs();
    if (!end.finite) {
        live_.not_solved = constrained_.front();
        return;
    }
    if (contacts_ && !touching) {
        scratch_.next = scratch_.free_velocities;
        for (std::size_t k = 0; k < constrained_.size(); ++k)
            scratch_.next[constrained_[k]] = mixed_.velocity[k];
        if (meet_late()) return solve_mixed(true);
    }
    if (touching && !load_dependent_.empty()) {
        load_dependent_.begin();
        load_dependent_.follow(mixed_, joints_, true);  // for the next step: here bounds are a step late
    }
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        if (rests(static_cast<int>(k))) continue;
        JointSet::State& state = joints_.states[blocks[k].joint];
        double* multiplier = blocks[k].axial ? state.axial_multiplier.data() : state.multiplier.data();
        for (int i = 0; i < blocks[k].size; ++i)
            multiplier[i] = mixed_.rows[k].multiplier[i] + scratch_.impulses[k][i];
        live_.stopped += mixed_.rows[k].stop.cut;
        if (breaks_ && !blocks[k].axial) joints_.break_overloaded(blocks[k].joint, live_.step);
    }
    std::size_t row = blocks.size();
    scratch_.impulses.resize(row + scratch_.other_ends.size());
    for (const int k : scratch_.other_ends) {
        joints_.states[blocks[k].joint].axial_multiplier[mixed_.rows[k].stop.row] +=
            mixed_.rows[row].multiplier[0] + scratch_.impulses[row][0];
        ++row;
    }
    if (touching) take_velocities(false, [this](int k) { return !contacts_->has_rows(k); });
    else take_velocities(false, {});
    share_.clear();
    if (clock_) clock_->mark(solver);
}

void RigidSystem::fill_masses() {
    for (std::size_t k = 0; k < constrained_.size(); ++k) {
        const BodyConstants& body = constants_[constrained_[k]];
        const BodyState& s = live_.bodies[constrained_[k]];
        Mat6& mass = mixed_.mass[k];
        for (int row = 0; row < 3; ++row) {
            mass[7 * row] = body.mass;
            for (int column = 0; column < 3; ++column)  // a particle's rotation is never touched
                mass[6 * (row + 3) + column + 3] =
                    body.particle ? (row == column ? body.mass : 0.0) : s.inertia.m[3 * row + column];
        }
    }
}

void RigidSystem::fill_momenta(bool forces) {
    for (std::size_t k = 0; k < constrained_.size(); ++k) {
        const int i = constrained_[k];
        const BodyState& s = live_.bodies[i];
        const Vec3 p = constants_[i].mass * (forces ? s.velocity + kick(i) : s.velocity);
        const Vec3 l = forces ? s.angular_momentum + twist(i) : s.angular_momentum;
        mixed_.momentum[k] = {p.x, p.y, p.z, l.x, l.y, l.z};
    }
}

void RigidSystem::take_velocities(bool angular_too, const std::function<bool(int)>& untouched) {
    for (std::size_t k = 0; k < constrained_.size(); ++k) {
        const Vec6& v = mixed_.velocity[k];
        BodyState& s = live_.bodies[constrained_[k]];
        if (untouched && untouched(static_cast<int>(k))) {  // not a bit of it may change
            if (!angular_too) kick_free_body(constrained_[k]);
            continue;
        }
        s.velocity = {v[0], v[1], v[2]};
        if (constants_[constrained_[k]].particle) continue;
        s.angular_momentum = s.inertia * Vec3{v[3], v[4], v[5]};
        if (angular_too) s.angular_velocity = {v[3], v[4], v[5]};
    }
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
    const std::size_t known = scratch_.other_ends.size();
    for (int k = 0; k < static_cast<int>(joints_.blocks().size()); ++k)
        if (passes_other_end(mixed_.rows[k], mixed_.velocity, h_)) scratch_.other_ends.push_back(k);
    return scratch_.other_ends.size() > known;
}

bool RigidSystem::iterate_joints() {
    std::vector<FrictionPoint> none;
    const FrictionReport report =
        solve_iterative(mixed_, none, method_.friction, method_.iterations, method_.residual_tolerance);
    pgs_iterations_ += static_cast<std::uint64_t>(report.pgs_iterations);
    return report.finite && settle_joints();
}

/// Joints that iterations do not settle are solved directly where few are connected: what they leave in each step adds up.
bool RigidSystem::settle_joints() {
    const Islands* islands = nullptr;
    std::vector<std::size_t>& rows = scratch_.rows;
    while (true) {
        const RowsResidual worst = rows_residual(mixed_, {}, method_.friction);
        if (!(worst.residual > method_.residual_tolerance)) return true;
        const auto island = [&](const RowBlock& block) {
            return islands->of_body[std::max(block.first, block.second)];
        };
        if (!islands) {
            islands = &scratch_.finder.find(mixed_);
            rows.assign(islands->count, 0);
            for (const RowBlock& block : mixed_.rows) ++rows[island(block)];
        }
        const int own = island(mixed_.rows[worst.row]);
        if (rows[own] > few_rows) return true;
        rows[own] = few_rows + 1;  // once
        std::vector<char>& answered = scratch_.answered;
        answered.clear();
        for (const RowBlock& block : mixed_.rows) answered.push_back(island(block) != own);
        IslandSolver& direct = scratch_.joint_solver;
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
    note_unsettled(body_of(worst.row < blocks ? worst.row : scratch_.other_ends[worst.row - blocks]),
                   worst.residual);
}

/// Takes over what the contact stage has found of its last solve.
void RigidSystem::judge_contacts() {
    const SolveQuality& found = contacts_->quality();
    residual_ = std::max(residual_, found.residual);
    if (found.body >= 0) note_unsettled(found.body, found.by, found.sunk);
}

void RigidSystem::note_unsettled(int body, double residual, bool sunk) {
    Unsettled& first = live_.unsettled;
    if (first.body < 0) first.body = body, first.step = live_.step, first.sunk = sunk;
    first.residual = std::max(first.residual, residual);
}

}  // namespace spook
