#include "rigid/rigid_system.hpp"
#include "rigid/rotors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace spook {

namespace {

/// A particle with a rotation that is not seen, to measure what its stages cost.
RigidBodySpec turning(RigidBodySpec body) {
    body.particle = false;
    body.inertia = {body.mass, body.mass, body.mass};
    return body;
}

}  // namespace

namespace {

/// Whether no stop is connected to another: what one sends back does not reach any.
bool stops_are_apart(const JointSet& joints, std::span<const int> index, int bodies) {
    IslandFinder finder;
    finder.begin(bodies);
    const auto own = [&](int body) { return body < 0 ? -1 : index[body]; };
    for (int k = 0; k < static_cast<int>(joints.blocks().size()); ++k) {
        const JointBlock& block = joints.blocks()[k];
        finder.tie(own(block.first), own(block.second));
        for (const int body : joints.others(k))
            finder.tie(std::max(own(block.first), own(block.second)), own(body));
    }
    const Islands& islands = finder.find();
    std::vector<char> known(static_cast<std::size_t>(islands.count), 0);
    for (const JointBlock& block : joints.blocks()) {
        const int body = std::max(own(block.first), own(block.second));
        if (body < 0 || !joints.may_stop(block)) continue;
        if (std::exchange(known[static_cast<std::size_t>(islands.of_body[body])], 1) != 0) return false;
    }
    return true;
}

}  // namespace

RigidSystem::RigidSystem(const RigidScene& scene, StageList stages)
    : stages_(std::move(stages)),
      gravity_(scene.gravity),
      method_(scene.method),
      h_(scene.method.time_step / scene.method.substeps),
      joints_(scene, h_) {
    take_stages(scene);
    const bool weighs = stages_.runs(Stage::apply_gravity), loaded = stages_.runs(Stage::apply_loads);
    const bool turns = stages_.runs(Stage::integrate_rotations);
    for (RigidBodySpec spec : scene.bodies) {
        if (spec.particle && method_.force_rotation) spec = turning(spec);
        if (!spec.particle && spec.motion != Motion::fixed && !turns)
            throw std::invalid_argument("bodies that turn need the stage integrate_rotations");
        if (!loaded) spec.force = spec.torque = {};
        constants_.push_back(constants_of(spec));
        start_.push_back(start_of(spec, constants_.back()));
        const bool moves = constants_.back().moves();
        acceleration_.push_back(moves ? (weighs ? scene.gravity : Vec3{}) + (1.0 / spec.mass) * spec.force
                                      : Vec3{});
    }
    if (!springs_.empty() || !fields_.empty()) force_.resize(constants_.size());
    take_loads(scene);

    solver_index_.assign(constants_.size(), -1);
    const bool touching = stages_.runs(Stage::collision);
    std::size_t spare = 0;
    for (const JointBlock& block : joints_.blocks()) {
        rows_ += static_cast<std::uint64_t>(block.size);
        spare_at_.push_back(spare);
        spare += static_cast<std::size_t>(12 * block.size);
        for (int body : {block.first, block.second})
            if (body >= 0 && constants_[body].moves()) solver_index_[body] = 0;
        for (int body : joints_.others(static_cast<int>(spare_at_.size()) - 1))
            if (constants_[body].moves()) solver_index_[body] = 0;
    }
    spare_.assign(spare, 0.0);
    for (int body = 0; body < bodies(); ++body)
        if (solver_index_[body] == 0 || (touching && constants_[body].moves())) {
            solver_index_[body] = static_cast<int>(constrained_.size());
            constrained_.push_back(body);
        } else if (constants_[body].moves()) {
            free_.push_back(body);
        } else if (constants_[body].motion == Motion::kinematic) {
            driven_.push_back(body);
        }
    if (touching) {
        std::vector<char> dynamic;
        std::vector<SurfaceMaterial> materials;
        std::vector<IndexPair> joint_pairs;
        std::vector<char> yielding;
        for (const JointBlock& block : joints_.blocks()) {
            joint_pairs.push_back({block.first, block.second});
            yielding.push_back(joints_.has_spring(block) || gives_way(joints_.constants(block.joint).kind));
        }
        for (int k = 0; k < static_cast<int>(joints_.blocks().size()); ++k)
            for (int body : joints_.others(k)) joint_pairs.push_back({joints_.blocks()[k].first, body});
        for (const RigidBodySpec& spec : scene.bodies) {
            dynamic.push_back(spec.motion == Motion::dynamic);
            materials.push_back(spec.material);
            if (!stages_.runs(Stage::friction)) materials.back().friction = 0.0;
            if (!stages_.runs(Stage::orient_friction)) materials.back().direction = {};
            if (!stages_.runs(Stage::move_surfaces)) materials.back().surface_velocity = {};
            if (!stages_.runs(Stage::roll)) materials.back().rolling = materials.back().torsional = 0.0;
        }
        const SolverKind solver =
            stages_.runs(Stage::solve_iterative) ? SolverKind::iterative : SolverKind::direct;
        fresh_contacts_.emplace(
            Detection(scene.colliders, dynamic, scene.no_contact), materials, solver_index_,
            ContactOptions{h_, method_.friction, solver, method_.iterations, method_.residual_tolerance,
                           method_.floor, method_.refinements, method_.impacts, method_.unsettled_residual},
            joint_pairs, yielding);
        for (const JointBlock& block : joints_.blocks())
            for (const int body : {block.first, block.second})
                if (body >= 0 && joints_.may_stop(block)) fresh_contacts_->leave_at_start(body);
        for (int k = 0; k < static_cast<int>(joints_.blocks().size()); ++k)
            for (const int body : joints_.others(k))
                if (joints_.may_stop(joints_.blocks()[k])) fresh_contacts_->leave_at_start(body);
    }
    composed_ = method_.composition > 2;
    half_step_ = stages_.runs(Stage::half_step) && !composed_;
    stiff_ = stages_.runs(Stage::string_stiffness) && solver_ == RigidSolver::block;
    if ((!fresh_contacts_ || !fresh_contacts_->possible()) &&
        stops_are_apart(joints_, solver_index_, static_cast<int>(constrained_.size())))
        joints_.let_stops_fold();
    curved_ = method_.corrections > 0 && !composed_ && rows_ > 0 &&
              (solver_ != RigidSolver::block || (fresh_contacts_ && fresh_contacts_->possible()));
    if (solver_ == RigidSolver::block && !composed_ && !half_step_ && !stiff_ && method_.corrections == 0 &&
        !(method_.sleep_speed > 0.0))
        locked_.analyse(constants_, joints_, constrained_);
    if (solver_ == RigidSolver::block && locked_.empty()) analyse_block(), find_loops();
    take_sleep(scene);
    const bool tilted =  // joint coordinates see inertias along the bodies' own axes
        std::any_of(constants_.begin(), constants_.end(),
                    [](const BodyConstants& body) { return body.tilted; });
    if (composed_ && solver_ == RigidSolver::block && !tilted)
        tree_.analyse(constants_, joints_, constrained_, start_);
    if (may_lie_in_plane(scene))
        plane_.analyse(constants_, joints_, constrained_,
                       {h_, method_.refinements, method_.corrections, method_.correction_cap});
    in_tree_ = tree_.coordinates() > 0 && tree_.holds(start_);  // for those that ask before a run
    in_plane_ = !plane_.empty() && plane_.holds(constants_, acceleration_, start_);
}

/// Which stages run here; what the scene has and no stage handles is refused.
void RigidSystem::take_stages(const RigidScene& scene) {
    const bool joints = !scene.joints.empty();
    if (stages_.take(Stage::collision)) {
        stages_.take(Stage::impact);
        if (stages_.take(Stage::tangents) && stages_.take(Stage::friction)) {
            stages_.take(Stage::orient_friction);
            stages_.take(Stage::move_surfaces);
        }
        stages_.take(Stage::roll);
    }
    const bool wires = stages_.take(Stage::rub_wires), tyres = stages_.take(Stage::roll_tyres);
    const bool rub = stages_.take(Stage::rub_joints);
    load_dependent_.take(joints_, wires, tyres, rub);
    breaks_ = stages_.take(Stage::break_joints);
    const bool coupled = stages_.take(Stage::couple_joints), held = stages_.take(Stage::hold_wires);
    const bool wound = stages_.take(Stage::wind_wires), meshes = stages_.take(Stage::meet_meshes);
    for (const JointSpec& joint : scene.joints)
        if ((joint.kind == JointKind::relation && !coupled) || (joint.kind == JointKind::wire && !held) ||
            (joint.kind == JointKind::wire && !joint.terms.empty() && !wound) || (rubs(joint) && !rub))
            throw std::invalid_argument(
                "a relation, a wire or a joint that rubs needs the stage named for it");
    for (const Collider& collider : scene.colliders)
        if (collider.shape.kind == ShapeKind::triangle && stages_.runs(Stage::collision) && !meshes)
            throw std::invalid_argument("meshes need the stage meet_meshes");
    if (stages_.take(Stage::assemble_rows)) {
        const bool block = stages_.take(Stage::solve_block), iterative = stages_.take(Stage::solve_iterative);
        const bool pivot = stages_.take(Stage::pivot);
        if (joints)
            solver_ = iterative ? RigidSolver::iterative
                      : block   ? RigidSolver::block
                      : pivot   ? RigidSolver::pivot
                                : RigidSolver::none;
    }
    if (joints && solver_ == RigidSolver::none)
        throw std::invalid_argument("joints need the stage assemble_rows and one that solves them");
    stages_.take(Stage::apply_gravity);
    stages_.take(Stage::apply_loads);
    stages_.take(Stage::follow_time);
    stages_.take(Stage::apply_fluids);
    if (stages_.take(Stage::apply_central_gravity)) fields_ = scene.fields;
    if (stages_.take(Stage::apply_springs))
        for (const SpringForce& spring : scene.springs)
            (spring.turns() ? turning_springs_ : springs_).push_back(spring);
    stages_.take(Stage::string_stiffness);
    stages_.take(Stage::half_step);
    stages_.take(Stage::correct_curvature);
    stages_.take(Stage::integrate_positions);
    stages_.take(Stage::integrate_rotations);
    stages_.take(Stage::project_positions);
    stages_.take(Stage::sleep);
    stages_.take(Stage::observe);
    stages_.expect_all_taken("rigid bodies");
}

void RigidSystem::reset(StageClock* clock) {
    live_ = {};
    constrained_are_moved_ = false;
    at_hand_ = plane_values_ = false;
    plane_solves_ = 0;
    replaying_ = false;
    early_joints_.clear();
    live_.bodies = start_;
    begin_sleep();
    if (!load_follows_.empty() || !drives_.empty()) follow_time();
    redundant_.reset(matrix_);
    std::fill(joints_.states.begin(), joints_.states.end(), JointSet::State{});
    judge_loops();
    joints_.breaks.clear();
    clock_ = clock;
    rounds_ = pgs_iterations_ = 0;
    work_kept_ = work_taken_back_ = {};
    residual_ = 0.0;
    pivot_ = PivotSolver{};
    pivot_.floor = method_.floor;
    pivot_.refinements = method_.refinements;
    contacts_ = fresh_contacts_;
    share_.clear();
    matrix_.clear_counters();
    locked_.clear_counters();
    undelivered_ = false;
    mixed_ = MixedSystem{};
    mixed_values_ = solver_ != RigidSolver::block;
    if (composed_) start_composition();
    if (composed_ || method_.corrections > 0) begin_energy();
    if (stiff_) find_tensions();
    const bool may_touch = contacts_ && contacts_->possible();  // or the stage is only forced in
    if (half_step_ || method_.corrections > 0) {
        make_room_for_half_step();
        if (!may_touch) start_half_step();
    }
    in_plane_ = !plane_.empty() && plane_.holds(constants_, acceleration_, live_.bodies);
    if (!contacts_ && solver_ != RigidSolver::pivot && solver_ != RigidSolver::iterative) return;
    mixed_.mass.assign(constrained_.size(), Mat6{});
    mixed_.momentum.resize(constrained_.size());
    mixed_.velocity.resize(constrained_.size());
    for (const JointBlock& block : joints_.blocks()) {
        RowBlock rows;
        rows.first = block.first < 0 ? -1 : solver_index_[block.first];
        rows.second = block.second < 0 ? -1 : solver_index_[block.second];
        rows.size = block.size;
        rows.softness = block.softness;
        rows.rotor = block.rotor;
        mixed_.rows.push_back(rows);
    }
    if (half_step_ && may_touch) start_half_step_touching();
}

void RigidSystem::advance(std::int64_t steps) {
    if (composed_) return compose(steps * method_.substeps);
    for (std::int64_t n = steps * method_.substeps; n > 0; --n) step();
    deliver();
}

Health RigidSystem::health() const {
    if (live_.whirling >= 0) return {Status::diverged, live_.whirling, cause(true)};
    if (live_.lost >= 0)
        return {
            Status::diverged, live_.lost,
            "is held by joints that no motion satisfies, even in a small part of the step; start it where its "
            "joints can move, or take a smaller time step"};
    if (live_.contradicted >= 0)
        return {Status::diverged, live_.contradicted,
                "is held by rows that contradict each other, of {joints}; give one of them a compliance",
                live_.named};
    if (live_.locked >= 0)
        return {
            Status::diverged, live_.locked,
            method_.corrections > 0
                ? "is locked by redundant joints, {joints}: they say nearly the same and yet not quite; put the loop "
                  "together more exactly, or give them more compliance"
                : "is locked by redundant joints, {joints}: linearised rows pull them apart, or the loop does not fit; "
                  "use corrections=1 or a composition, or give them more compliance",
            live_.named};
    for (int body = 0; body < bodies(); ++body) {
        const BodyState& s = live_.bodies[body];
        if (!finite(s.displacement) || !finite(s.velocity) || !finite(s.angular_momentum) ||
            !finite(s.angular_velocity))
            return {Status::not_finite, body, cause()};
        for (int k = 0; k < 3; ++k)
            if (std::abs(s.displacement[k]) > RUNAWAY || std::abs(s.velocity[k]) > RUNAWAY)
                return {Status::diverged, body, cause()};
    }
    if (live_.not_solved >= 0)
        return {
            Status::not_finite, live_.not_solved,
            "belongs to a system of rows that cannot be solved; give its joints a compliance or the method a floor"};
    return {};
}

double RigidSystem::kinetic_energy() const noexcept {
    double sum = 0.0;
    for (int i = 0; i < bodies(); ++i) {
        if (!constants_[i].moves()) continue;
        const BodyState& s = live_.bodies[i];
        sum += 0.5 * constants_[i].mass * dot(s.velocity, s.velocity);
        if (!constants_[i].particle) sum += 0.5 * dot(s.angular_velocity, s.angular_momentum);
    }
    return sum + rotor_energy(joints_, live_.bodies);
}

double RigidSystem::potential_energy() const noexcept {
    double sum = 0.0;
    for (int i = 0; i < bodies(); ++i) {
        if (!constants_[i].moves()) continue;
        const Vec3 x = position_of(i);
        sum -= constants_[i].mass * dot(gravity_, x);
        for (const CentralField& field : fields_)
            sum -= constants_[i].mass * field.strength / norm(x - field.centre);
    }
    for (const SpringForce& spring : springs_)
        sum += energy(spring, place(spring.ends[1]) - place(spring.ends[0]));
    for (const SpringForce& spring : turning_springs_)
        sum += energy(spring, spring_end(spring.ends[1]).place - spring_end(spring.ends[0]).place);
    sum += joints_.spring_energy(live_.bodies);
    const double now = static_cast<double>(live_.moved) * h_;
    for (const TimeDrive& drive : drives_)
        if (drive.kind == DriveKind::rest)
            sum += joints_.spring_energy(drive.index, drive.function.at(now), live_.bodies);
    return sum;
}

std::vector<double> RigidSystem::places() const {
    std::vector<double> out;
    for (int i = 0; i < bodies(); ++i) {
        const Vec3 x = position_of(i);
        const Quat q = orientation_of(i);
        out.insert(out.end(), {x.x, x.y, x.z, q.w, q.x, q.y, q.z});
        out.insert(out.end(), 6, std::numeric_limits<double>::quiet_NaN());
    }
    return out;
}

std::vector<double> RigidSystem::final_state() {
    if (live_.lost < 0 && live_.not_solved < 0) {
        if (composed_) read_composition();
        if (half_step_) {
            solve_ahead();
            read_half_step();
        }
    }
    std::vector<double> out;
    out.reserve(13 * constants_.size());
    for (int i = 0; i < bodies(); ++i) {
        const BodyState& s = live_.bodies[i];
        const Vec3 x = position_of(i);
        const Quat q = orientation_of(i);
        for (double value : {x.x, x.y, x.z, q.w, q.x, q.y, q.z, s.velocity.x, s.velocity.y, s.velocity.z,
                             s.angular_velocity.x, s.angular_velocity.y, s.angular_velocity.z})
            out.push_back(value);
    }
    return out;
}

RigidSystem::Work RigidSystem::Work::operator+(const Work& more) const noexcept {
    return {{factors.factorisations + more.factors.factorisations,
             factors.block_operations + more.factors.block_operations,
             factors.floored_pivots + more.factors.floored_pivots, factors.solves + more.factors.solves},
            rounds + more.rounds,
            pgs_iterations + more.pgs_iterations};
}

RigidSystem::Work RigidSystem::Work::operator-(const Work& less) const noexcept {
    return {{factors.factorisations - less.factors.factorisations,
             factors.block_operations - less.factors.block_operations,
             factors.floored_pivots - less.factors.floored_pivots, factors.solves - less.factors.solves},
            rounds - less.rounds,
            pgs_iterations - less.pgs_iterations};
}

RigidSystem::Work RigidSystem::work_done() const noexcept {
    const LockedTree::Counters locked = locked_.counters();
    Work done{matrix_.counters(), rounds_, pgs_iterations_};
    done = done + Work{pivot_.counters()};
    done = done + Work{{locked.factorisations, locked.block_operations, 0, locked.solves}};
    const std::uint64_t readings = (1 + static_cast<std::uint64_t>(method_.refinements)) *
                                   (1 + static_cast<std::uint64_t>(method_.corrections));
    done = done + Work{{plane_solves_, plane_solves_ * plane_.blocks(), 0, plane_solves_ * readings}};
    return contacts_ ? done + Work{contacts_->factor_counters()} : done;
}

void RigidSystem::count(RunReport& report, std::int64_t steps) const {
    const std::int64_t substeps = steps * method_.substeps;
    for (const Break& at : joints_.breaks)
        report.broken.push_back({at.joint, (at.step + method_.substeps - 1) / method_.substeps,
                                 static_cast<double>(at.step) * h_, at.force, at.torque});
    report.counters["steps"] = steps;
    report.counters["substeps"] = substeps;
    report.counters["rows_assembled"] = static_cast<std::int64_t>(rows_) * substeps;
    const Work done = work_done() - work_taken_back_;
    const BlockLdlt::Counters& work = done.factors;
    const auto put = [&report](const char* name, std::uint64_t value) {
        report.counters[name] = static_cast<std::int64_t>(value);
    };
    put("factorisations", work.factorisations);
    put("block_operations", work.block_operations);
    put("floored_pivots", work.floored_pivots);
    put("back_substitutions", work.solves);
    put("pivot_rounds", done.rounds);
    put("sweeps", done.pgs_iterations);
    if (composed_) {
        report.counters["newton_iterations"] = live_.newton_iterations;
        report.counters["halved_steps"] = live_.halved_steps;
    }
    if (!loops_.empty()) report.counters["redundancy_looks"] = live_.looks;
    if (sleep_rules_.on()) {
        report.counters["asleep"] = static_cast<std::int64_t>(live_.sleep.sleepers);
        report.counters["slept_steps"] = live_.sleep.slept;
    }
    put("stopped_impacts", live_.stopped);
    put("contacts", 0);  // the same names with and without a collision stage, so that runs can be compared
    std::int64_t moving = 0;
    for (const BodyConstants& body : constants_) moving += body.moves() ? 1 : 0;
    report.counters["force_evaluations"] =
        substeps * (static_cast<std::int64_t>(springs_.size() + turning_springs_.size()) +
                    static_cast<std::int64_t>(fields_.size()) * moving);
    report.residual = residual_;
    if (const Unsettled& left = live_.unsettled; left.body >= 0) {
        report.residual = std::max(report.residual, left.residual);
        if (report.status == Status::completed) {
            report.status = Status::unsettled;
            report.failed_body = left.body;
            if (left.sunk)
                report.reason =
                    "has sunk into another by a fiftieth of the smaller one's radius; use more iterations, "
                    "smaller time steps or the direct solver";
            report.failed_step = (left.step + method_.substeps - 1) / method_.substeps;
        }
    }
    if (!contacts_) return;
    const ContactCounters contact = contacts_->counters();
    put("contacts", contact.contacts);
    put("impacts", contact.impacts);
    put("stopped_impacts", contact.stopped + live_.stopped);
    put("corrections", contact.corrections);
    put("friction_rounds", contact.friction_rounds);
    put("pivots", contact.pivots);
    put("sweeps", done.pgs_iterations + contact.pgs_iterations);
    put("unsettled_solves", contact.unsettled);
}

}  // namespace spook
