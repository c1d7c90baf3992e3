// Stage: the velocities v₊ of the step, for all bodies that have rows:
//
//     M v₊ − Σ Gᵀ z = M v + h f,    w = G v₊ + Sig z − r,    lower <= z <= upper, w = 0 between the bounds.
//
// Bilateral rows alone go to one factorisation (rigid_solve.cpp). Rows with bounds, stops of joints among them (joint_stops.hpp), are
// written into MixedRows::system and solved island by island (contacts/solve_islands.cpp): by pivoting and Newton's method on the
// cone (contacts/friction_direct.hpp says when), or by projected Gauss–Seidel. Impacts come first, and where the solve brings some about.
//
// reads: points, rows of joints, masses, momenta, dv_ext. writes: velocities and angular momenta of bodies, multipliers of
// joints, the contact cache, share_; what is unsettled.
#include <algorithm>
#include <cmath>

#include "contacts/friction_pgs.hpp"
#include "contacts/friction_point.hpp"
#include "rigid/mixed_rows.hpp"
#include "rigid/tolerances.hpp"

namespace spook {

using namespace tolerances::solve_velocities;

void MixedRows::take_stages(RigidModel& model) {
    StageList& stages = model.stages;
    if (stages.take(Stage::collision)) {
        stages.take(Stage::impact);
        if (stages.take(Stage::tangents) && stages.take(Stage::friction)) {
            stages.take(Stage::orient_friction);
            stages.take(Stage::move_surfaces);
        }
        stages.take(Stage::roll);
    }
    const bool wires = stages.take(Stage::rub_wires), tyres = stages.take(Stage::roll_tyres);
    const bool rub = stages.take(Stage::rub_joints);
    load_dependent_.take(joints_, wires, tyres, rub);
    breaks_ = stages.take(Stage::break_joints);
}

namespace {

std::vector<Tumbler> tumblers(const RigidModel& model) {
    std::vector<Tumbler> found;
    for (int b = 0; b < model.bodies(); ++b) {
        const BodyConstants& body = model.constants[b];
        if (body.moves() && !body.particle && !isotropic(body.inertia))
            found.push_back(
                {b, body.rotor, body.inertia, transpose(body.start_rotation) * body.start_principal});
    }
    return found;
}

}  // namespace

void MixedRows::take_contacts(const RigidScene& scene) {
    std::vector<char> dynamic;
    std::vector<SurfaceMaterial> materials;
    std::vector<JointTie> ties;
    std::vector<char> yielding;
    for (const JointBlock& block : joints_.blocks()) {
        ties.push_back({block.first, block.second, joints_.may_stop(block), is_driven(block)});
        yielding.push_back(joints_.has_spring(block) || gives_way(joints_.constants(block.joint).kind));
    }
    for (int k = 0; k < static_cast<int>(joints_.blocks().size()); ++k)
        for (int body : joints_.others(k))
            ties.push_back({ties[k].first, body, ties[k].stops, ties[k].driven});
    for (const RigidBodySpec& spec : scene.bodies) {
        dynamic.push_back(spec.motion == Motion::dynamic);
        materials.push_back(spec.material);
        if (!model_.stages.runs(Stage::friction)) materials.back().friction = 0.0;
        if (!model_.stages.runs(Stage::orient_friction)) materials.back().direction = {};
        if (!model_.stages.runs(Stage::move_surfaces)) materials.back().surface_velocity = {};
        if (!model_.stages.runs(Stage::roll)) materials.back().rolling = materials.back().torsional = 0.0;
    }
    std::vector<PairFriction> pairs = scene.pair_frictions;
    for (PairFriction& pair : pairs) {
        if (!model_.stages.runs(Stage::friction)) pair.friction = 0.0;
        if (!model_.stages.runs(Stage::roll)) pair.rolling = pair.torsional = 0.0;
    }
    const SolverKind solver =
        model_.stages.runs(Stage::solve_iterative) ? SolverKind::iterative : SolverKind::direct;
    fresh_contacts_.emplace(
        Detection(scene.colliders, dynamic, scene.no_contact), materials, model_.solver_index,
        ContactOptions{model_.h, model_.method.friction, solver, model_.method.iterations,
                       model_.method.residual_tolerance, model_.method.floor, model_.method.refinements,
                       model_.method.impacts, stops_rebound(scene), model_.method.unsettled_residual},
        std::move(ties), yielding, std::move(pairs), tumblers(model_));
}

void MixedRows::begin() {
    pivot_ = PivotSolver{};
    pivot_.floor = model_.method.floor;
    pivot_.refinements = model_.method.refinements;
    live_.last_rows = model_.bilateral ? LastRows::block : LastRows::mixed;
    begin_again();
}

void MixedRows::begin_again() {
    rounds = pgs_iterations = 0;
    contacts_ = fresh_contacts_;
    system = MixedSystem{};
    if (!contacts_ && model_.solver != Solver::pivot && model_.solver != Solver::iterative) return;
    system.mass.assign(model_.constrained.size(), Mat6{});
    system.momentum.resize(model_.constrained.size());
    system.velocity.resize(model_.constrained.size());
    for (const JointBlock& block : joints_.blocks()) {
        RowBlock rows;
        rows.first = block.first < 0 ? -1 : model_.solver_index[block.first];
        rows.second = block.second < 0 ? -1 : model_.solver_index[block.second];
        rows.size = block.size;
        rows.softness = block.softness;
        rows.rotor = block.rotor;
        system.rows.push_back(rows);
    }
}

void MixedRows::begin_solve(bool touching) {
    for (std::size_t k = 0; k < model_.constrained.size(); ++k)
        fill_mass(model_.constants[model_.constrained[k]], live_.bodies[model_.constrained[k]],
                  system.mass[k]);
    scratch_.gone.clear();
    joints_.stops().fold(stops_are_apart && !touching, joints_.states);
    scratch_.other_ends.clear();
    scratch_.impulses.assign(joints_.blocks().size(), {});
    scratch_.left_open.assign(joints_.blocks().size(), 0);
    scratch_.led_by_joints = false;
    scratch_.anew.clear();
}

void MixedRows::solve(bool touching) {
    live_.last_rows = LastRows::mixed;
    const auto blocks = joints_.blocks();
    begin_solve(touching);
    if (touching) act_before_events();
    const auto impact_needed = [&] {
        return touching && model_.stages.runs(Stage::impact) && contacts_->impact_needed(system);
    };
    const Stage solver = model_.stages.runs(Stage::solve_iterative) ? Stage::solve_iterative : Stage::pivot;
    ContactStage::SolveEnd end;
    int corrected = 0;
    const auto to_correct = [&] { return model_.curved && corrected++ < model_.method.corrections; };
    do {
        fill_rows(corrected > 0);
        clock_.mark(Stage::assemble_rows);
        while (impact_needed()) impact(), corrected = 0;
        if (touching) clock_.mark(Stage::impact);
        fill_momenta(true);
        clock_.mark(Stage::assemble_rows);
        if (touching) end = contacts_->solve(system, scratch_.velocities, scratch_.anew);
        else end.finite = solve_joints();
        clock_.mark(solver);
    } while (end.finite && (impact_needed() || ((!touching || end.ends_passed) && find_stops()) ||
                            to_correct() || leave_open()));  // the solve may find some that is to come first
    touching ? judge_contacts() : judge_pgs();
    if (!end.finite) {
        live_.not_solved = model_.constrained.front();
        return;
    }
    if (contacts_ && !touching) {
        scratch_.next = scratch_.free_velocities;
        for (std::size_t k = 0; k < model_.constrained.size(); ++k)
            scratch_.next[model_.constrained[k]] = system.velocity[k];
        if (find_late_contacts()) return solve(true);
    }
    if (touching && !load_dependent_.empty()) {
        load_dependent_.begin();
        load_dependent_.follow(system, joints_, true);  // for the next step: here bounds are a step late
    }
    take_multipliers();
    if (touching) take_velocities(false, [this](int k) { return !contacts_->has_rows(k); });
    else take_velocities(false, {});
    forces_.end_shares();
    clock_.mark(solver);
}

void MixedRows::take_multipliers() {
    const auto blocks = joints_.blocks();
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        if (rests(blocks[k], live_)) continue;
        JointSet::State& state = joints_.states[blocks[k].joint];
        double* multiplier = state.multipliers(blocks[k].axial);
        for (int i = 0; i < blocks[k].size; ++i)
            multiplier[i] = system.rows[k].multiplier[i] + scratch_.impulses[k][i];
        const StopRow& stop = system.rows[k].stop;
        live_.note_stopped(stop.cut * std::abs(system.rows[k].multiplier[std::max(0, stop.row)]),
                           model_.mover(blocks[k]));
        if (breaks_ && !blocks[k].axial) joints_.break_overloaded(blocks[k].joint, live_.step);
    }
    std::size_t row = blocks.size();
    scratch_.impulses.resize(row + scratch_.other_ends.size());
    for (const int k : scratch_.other_ends) {
        joints_.states[blocks[k].joint].axial_multiplier[system.rows[k].stop.row] +=
            system.rows[row].multiplier[0] + scratch_.impulses[row][0];
        ++row;
    }
}

void fill_mass(const BodyConstants& body, const BodyState& at, Mat6& mass) noexcept {
    for (int row = 0; row < 3; ++row) {
        mass[7 * row] = body.mass;
        for (int column = 0; column < 3; ++column)  // a particle's rotation is never touched
            mass[6 * (row + 3) + column + 3] =
                body.particle ? (row == column ? body.mass : 0.0) : at.inertia.m[3 * row + column];
    }
}

void MixedRows::fill_momenta(bool forces) {
    for (std::size_t k = 0; k < model_.constrained.size(); ++k) {
        const int i = model_.constrained[k];
        const BodyState& s = live_.bodies[i];
        const Vec3 p = model_.constants[i].mass * (forces ? s.velocity + forces_.kick(i) : s.velocity);
        const Vec3 l = forces ? s.angular_momentum + forces_.angular_impulse(i) : s.angular_momentum;
        system.momentum[k] = {p.x, p.y, p.z, l.x, l.y, l.z};
    }
}

void MixedRows::take_velocities(bool angular_too, const std::function<bool(int)>& untouched) {
    for (std::size_t k = 0; k < model_.constrained.size(); ++k) {
        const Vec6& v = system.velocity[k];
        BodyState& s = live_.bodies[model_.constrained[k]];
        if (untouched && untouched(static_cast<int>(k))) {  // not a bit of it may change
            if (!angular_too) forces_.kick_free_body(model_.constrained[k]);
            continue;
        }
        s.velocity = {v[0], v[1], v[2]};
        if (model_.constants[model_.constrained[k]].particle) continue;
        const int i = model_.constrained[k];
        const bool gone = !scratch_.gone.empty() && scratch_.gone[i].time > 0.0;
        s.angular_momentum = (gone ? scratch_.gone[i].there : s).inertia * Vec3{v[3], v[4], v[5]};
        if (angular_too) s.angular_velocity = {v[3], v[4], v[5]};
    }
}

/// The work, J, of a joint that is led back to where it holds.
double MixedRows::leading_work(std::size_t k) const {
    if (!joints_.always_holds(joints_.blocks()[k])) return 0.0;
    const RowBlock& block = system.rows[k];
    double work = 0.0;
    for (int i = 0; i < block.size; ++i)
        work += block.multiplier[i] * (block.right[i] - block.softness[i] * block.multiplier[i]);
    return work;
}

/// Whether a motor or a kinematic body moves a joint.
bool MixedRows::is_driven(const JointBlock& block) const {
    const auto moves = [&](int body) {
        return std::ranges::find(model_.driven, body) != model_.driven.end();
    };
    return joints_.has_motor(block) || moves(block.first) || moves(block.second);
}

/// Whether that of some island's joints is more than all its bodies move with, and far more than it would take without the
/// others: these are jammed, or a light one would have to go far round. Not where something drives the island: a heavy load that
/// turns back takes as much of them. What has opened stays so until the island has moved on,
/// and the impulses met so far, which jams multiply, are forgotten. Asked of the first solve that settles.
bool MixedRows::leave_open() {
    std::vector<char>& open = scratch_.left_open;
    if (std::any_of(open.begin(), open.end(), [](char each) { return each != 0; }))
        return scratch_.led_by_joints = false;
    double work = 0.0, energy = 0.0;
    for (std::size_t k = 0; k < open.size(); ++k) work += std::max(0.0, leading_work(k));
    if (work > 0.0)
        for (std::size_t b = 0; b < system.mass.size(); ++b)
            for (int a = 0; a < 3; ++a)
                energy += 0.5 * system.momentum[b][a] * system.momentum[b][a] / system.mass[b][0];
    scratch_.led_by_joints = work > led_share * energy;
    if (!(work > energy)) return false;
    const Islands& islands = scratch_.finder.find(system);
    std::vector<double>& spare = scratch_.dissipated;
    spare.assign(islands.count, 0.0);
    for (std::size_t b = 0; b < system.mass.size(); ++b) {
        if (islands.of_body[b] < 0) continue;
        Vec6 free = system.momentum[b];
        solve_six(factor_six(system.mass[b]), free);
        spare[islands.of_body[b]] += 0.5 * dot(free, system.momentum[b]);
    }
    for (std::size_t k = 0; k < open.size(); ++k) {
        const RowBlock& block = system.rows[k];
        double alone = 0.0;
        for (int i = 0; i < block.size && joints_.always_holds(joints_.blocks()[k]); ++i)
            if (const double own = own_inertia(system, block, i); own > 0.0)
                alone += 0.5 * block.right[i] * block.right[i] / own;
        spare[islands.of(block)] +=
            is_driven(joints_.blocks()[k]) ? unbounded : most_of_alone * alone - leading_work(k);
    }
    bool any = false;
    for (std::size_t k = 0; k < open.size(); ++k) {
        if (!(spare[islands.of(system.rows[k])] < 0.0)) continue;
        open[k] = any = true;
        system.rows[k].multiplier = {}, system.rows[k].state = {};
    }
    scratch_.anew.resize(system.mass.size());
    for (std::size_t b = 0; b < system.mass.size(); ++b)
        scratch_.anew[b] = islands.of_body[b] >= 0 && spare[islands.of_body[b]] < 0.0;
    return any;
}

/// The row of the other end of a block's stop: the coordinate may get there within the step, no further.
RowBlock MixedRows::other_end(const RowBlock& block) {
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

/// Whether stops are to be solved again: velocities lead past such ends, which have rows in the next solve of this step.
bool MixedRows::find_stops() {
    if (find_pushes()) return true;
    const std::size_t known = scratch_.other_ends.size();
    for (int k = 0; k < static_cast<int>(joints_.blocks().size()); ++k)
        if (passes_other_end(system.rows[k], system.velocity, model_.h)) scratch_.other_ends.push_back(k);
    return scratch_.other_ends.size() > known;
}

bool MixedRows::iterate_joints() {
    std::vector<FrictionPoint> none;
    const FrictionReport report = solve_iterative(system, none, model_.method.friction,
                                                  model_.method.iterations, model_.method.residual_tolerance);
    pgs_iterations += static_cast<std::uint64_t>(report.pgs_iterations);
    return report.finite && settle_joints();
}

/// Joints that iterations do not settle are solved directly where few are connected: what they leave in each step adds up.
bool MixedRows::settle_joints() {
    const Islands* islands = nullptr;
    std::vector<std::size_t>& rows = scratch_.rows;
    while (true) {
        const RowsResidual worst = rows_residual(system, {}, model_.method.friction);
        if (!(worst.residual > model_.method.residual_tolerance)) return true;
        const auto island = [&](const RowBlock& block) {
            return islands->of_body[std::max(block.first, block.second)];
        };
        if (!islands) {
            islands = &scratch_.finder.find(system);
            rows.assign(islands->count, 0);
            for (const RowBlock& block : system.rows) ++rows[island(block)];
        }
        const int own = island(system.rows[worst.row]);
        if (rows[own] > few_rows) return true;
        rows[own] = few_rows + 1;  // once
        std::vector<char>& answered = scratch_.answered;
        answered.clear();
        for (const RowBlock& block : system.rows) answered.push_back(island(block) != own);
        IslandSolver& direct = scratch_.joint_solver;
        direct.set_backoff({});
        direct.floor = model_.method.floor, direct.refinements = model_.method.refinements;
        std::vector<FrictionPoint> none;
        const FrictionReport report = direct.run(
            system, none,
            [this](MixedSystem& part, std::vector<FrictionPoint>& points, DirectSolver& solver) {
                return solve_friction_direct(part, points, model_.method.friction, solver);
            },
            &answered);
        rounds += static_cast<std::uint64_t>(report.pivots);
        if (!report.finite) return false;
    }
}

/// What PGS may leave of a row, m/s.
double MixedRows::pgs_tolerance() const {
    double speed = 0.0;
    for (const Vec6& v : system.velocity) speed = std::max(speed, norm(Vec3{v[0], v[1], v[2]}));
    return model_.method.unsettled_residual + 1e-6 * speed;
}

/// Holds PGS over joints alone to what contacts are held to.
void MixedRows::judge_pgs() {
    if (model_.solver != Solver::iterative) return;
    const RowsResidual worst = rows_residual(system, {}, model_.method.friction);
    live_.residual = std::max(live_.residual, worst.residual);
    if (!(worst.residual > pgs_tolerance())) return;
    const int blocks = static_cast<int>(joints_.blocks().size());
    live_.note_unsettled(
        model_.mover(
            joints_.blocks()[worst.row < blocks ? worst.row : scratch_.other_ends[worst.row - blocks]]),
        worst.residual);
}

/// The bodies of a row beyond its first two: into it those that move by themselves, of others their speed.
void MixedRows::fill_further(int block, RowBlock& rows, BlockRight& numbers,
                             std::vector<FurtherBody>& beyond) const {
    beyond.clear();
    const double* gradient = joints_.other_rows();
    for (int body : joints_.others(block)) {
        FurtherBody other{model_.solver_index[body], {}};
        std::copy_n(gradient, 6, other.jacobian.data());
        gradient += 6;
        const BodyState& s = live_.bodies[body];
        if (other.body >= 0) beyond.push_back(other);
        else
            numbers.right[0] -=
                dot(other.jacobian, {s.velocity.x, s.velocity.y, s.velocity.z, s.angular_velocity.x,
                                     s.angular_velocity.y, s.angular_velocity.z});
    }
    rows.further = beyond;
}

/// `solved`: whether the curvature of the rows is that of a solution, not of the velocities at hand.
void MixedRows::fill_rows(bool solved) {
    if (model_.curved) curvature_.curve(solved, &system.velocity);
    find_what_touches(touching_ ? &*contacts_ : nullptr, model_.constants, joints_, scratch_.touched);
    const auto blocks = joints_.blocks();
    system.rows.resize(blocks.size());
    further_.resize(blocks.size());
    std::size_t first_row = 0;
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        RowBlock& rows = system.rows[k];
        const std::size_t at = std::exchange(first_row, first_row + static_cast<std::size_t>(blocks[k].size));
        if (rests(blocks[k], live_)) {
            rows.right = rows.lower = rows.upper = rows.multiplier = Vec6{};
            rows.stop = {};
            continue;
        }
        BlockRight numbers;
        joints_.assemble(static_cast<int>(k), live_.bodies, rows.first_jacobian[0].data(),
                         rows.second_jacobian[0].data(), numbers,
                         follows_turns(joints_, blocks[k], scratch_.touched));
        if (scratch_.left_open[k] && joints_.always_holds(blocks[k])) numbers.right = {};
        if (!joints_.others(static_cast<int>(k)).empty())
            fill_further(static_cast<int>(k), rows, numbers, further_[k]);
        for (int body : {blocks[k].first, blocks[k].second}) {
            if (body < 0 || model_.constants[body].motion != Motion::kinematic) continue;
            const BodyState& s = live_.bodies[body];
            const Vec6 given{s.velocity.x,         s.velocity.y,         s.velocity.z,
                             s.angular_velocity.x, s.angular_velocity.y, s.angular_velocity.z};
            const auto& jacobian = body == blocks[k].first ? rows.first_jacobian : rows.second_jacobian;
            for (int i = 0; i < rows.size; ++i) numbers.right[i] -= dot(jacobian[i], given);
            if (const int i = numbers.stop.row; i >= 0) numbers.stop.given += dot(jacobian[i], given);
        }
        for (int i = 0; i < rows.size; ++i)
            numbers.right[i] -=
                scratch_.left_open[k] ? 0.0 : curvature_.taken(at + static_cast<std::size_t>(i));
        if (const int i = rows.rotor; i >= 0) numbers.right[i] -= rows.softness[i] * scratch_.impulses[k][i];
        rows.leads = joints_.always_holds(blocks[k]) && !is_driven(blocks[k]);
        rows.right = numbers.right;
        rows.lower = numbers.lower;
        rows.upper = numbers.upper;
        rows.stop = numbers.stop;
        if (numbers.softness) std::copy_n(numbers.softness, rows.size, rows.softness.data());
        if (const int i = rows.stop.row;
            i >= 0)  // an impact is over long before the step is: its row does not give way
            rows.softness[i] = rows.stop.rebound != 0.0 ? 0.0 : blocks[k].softness[i];
    }
    for (const int k : scratch_.other_ends) {
        system.rows[k].stop.both = true;
        system.rows.push_back(other_end(system.rows[k]));
    }
}

/// Rows without contacts: solved again while bounds that follow other rows move. Iterations that do not get there in a few
/// rounds bound the next step by this one.
bool MixedRows::solve_joints() {
    load_dependent_.begin();
    const bool iterative = model_.solver == Solver::iterative;
    bool same_matrix = false;
    for (int round = 0;; ++round) {
        bool finite = true;
        if (iterative) {
            finite = iterate_joints();
        } else {
            const PivotReport report = pivot_.solve(system, same_matrix);
            rounds += static_cast<std::uint64_t>(report.rounds);
            finite = report.finite;
        }
        if (!finite || load_dependent_.empty()) return finite;
        if (iterative && round == LoadDependentBounds::patient_rounds) {
            load_dependent_.begin();
            load_dependent_.follow(system, joints_, true);
            return true;
        }
        const auto [off, same] = load_dependent_.follow(system, joints_);
        same_matrix = same;
        if (off <= LoadDependentBounds::agreed) return true;
        if (round < LoadDependentBounds::max_rounds) continue;
        // In speeds: what the missing impulse would have given the lightest of its bodies.
        const RowBlock& rows = system.rows[load_dependent_.worst()];
        const int body = model_.constrained[rows.second >= 0 ? rows.second : rows.first];
        double most = 0.0;
        for (int i = 0; i < rows.size; ++i) most = std::max(most, std::abs(rows.multiplier[i]));
        const double missed = off * most / model_.constants[body].mass;
        live_.residual = std::max(live_.residual, missed);
        if (missed > model_.method.unsettled_residual) live_.note_unsettled(body, missed);
        return true;
    }
}

}  // namespace spook
