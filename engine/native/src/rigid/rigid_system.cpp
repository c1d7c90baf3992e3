#include "rigid/rigid_system.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "rigid/runaway.hpp"
#include "rigid/solver_table.hpp"

namespace spook {

namespace {

/// A particle with a rotation that is not seen, to measure what its stages cost.
RigidBodySpec turning(RigidBodySpec body) {
    body.particle = false;
    body.inertia = {body.mass, body.mass, body.mass};
    return body;
}

/// Whether no stop is connected to another: what one sends back does not reach any. Unless they `may_float`, on what does not move.
bool stops_are_apart(const JointSet& joints, std::span<const int> index, int bodies, bool may_float) {
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
        if (!may_float && std::min(own(block.first), own(block.second)) >= 0) return false;
        if (std::exchange(known[static_cast<std::size_t>(islands.of_body[body])], 1) != 0) return false;
    }
    return true;
}

/// Plain steps do, but of loops: their rows depend on each other, and what is taken from one would contradict another.
bool follows_turns(const RigidModel& model, JointSet& joints) {
    return !model.method.linear_turns && model.method.corrections == 0 && !model.composed &&
           !model.half_step && !model.stiff && joints.find_trees(model.constants);
}

}  // namespace

RigidSystem::RigidSystem(const RigidScene& scene, StageList stages)
    : model_(std::move(stages), scene.gravity, scene.method),
      joints_(scene, model_.h),
      forces_(model_, live_, joints_, clock_),
      rows_(model_, live_, joints_, forces_),
      curvature_(model_, live_, joints_, rows_),
      mixed_(model_, live_, joints_, forces_, curvature_, scratch_, clock_),
      bilateral_(model_, live_, joints_, forces_, rows_, mixed_, curvature_, scratch_, clock_),
      plane_(model_, live_, joints_, forces_, bilateral_.loops),
      composition_(model_, live_, joints_, forces_, rows_, clock_),
      runge_kutta_(model_, live_, joints_, forces_, clock_),
      half_step_(model_, live_, joints_, forces_, rows_),
      sleeping_(model_, live_, joints_, forces_, rows_, mixed_, scratch_),
      projection_(model_, live_, joints_, forces_, mixed_, scratch_),
      energy_(model_, live_, joints_, forces_),
      readings_(model_, live_, joints_, forces_, rows_, bilateral_, plane_, mixed_) {
    take_stages(scene);
    take_bodies(scene);
    forces_.take(scene);
    rows_.take();
    if (model_.stages.runs(Stage::collision)) mixed_.take_contacts(scene);
    const RigidMethod& method = model_.method;
    const bool may_touch = mixed_.may_touch();
    model_.composed = method.composition > 2;
    model_.rebounds =
        stops_rebound(scene) || std::ranges::any_of(scene.bodies, [](const RigidBodySpec& body) {
            return body.material.restitution > 0.0;
        });
    model_.half_step = model_.stages.runs(Stage::half_step) && !model_.composed;
    model_.stiff = model_.stages.runs(Stage::string_stiffness) && model_.bilateral;
    model_.curved =
        method.corrections > 0 && !model_.composed && rows_.rows() > 0 && (!model_.bilateral || may_touch);
    if (follows_turns(model_, joints_)) joints_.turning = model_.constants;
    mixed_.stops_are_apart = stops_are_apart(joints_, model_.solver_index,
                                             static_cast<int>(model_.constrained.size()), !may_touch);
    SolverChoice choice =
        choose_solver({scene, model_, mixed_, forces_, bilateral_, plane_, composition_, runge_kutta_});
    model_.solver = choice.solver;
    notes_ = std::move(choice.notes);
    bilateral_.take();
    sleeping_.take(scene);
}

/// Constants and start of all bodies, and which of them have rows.
void RigidSystem::take_bodies(const RigidScene& scene) {
    const bool loaded = model_.stages.runs(Stage::apply_loads);
    const bool turns = model_.stages.runs(Stage::integrate_rotations);
    for (RigidBodySpec spec : scene.bodies) {
        if (spec.particle && model_.method.force_rotation) spec = turning(spec);
        if (!spec.particle && spec.motion != Motion::fixed && !turns)
            throw std::invalid_argument("bodies that turn need the stage integrate_rotations");
        if (!loaded) spec.force = spec.torque = {};
        model_.constants.push_back(constants_of(spec));
        model_.start.push_back(start_of(spec, model_.constants.back()));
    }
    model_.solver_index.assign(model_.constants.size(), -1);
    const auto has_rows = [this](int body) {
        if (body >= 0 && model_.constants[body].moves()) model_.solver_index[body] = 0;
    };
    for (int k = 0; k < static_cast<int>(joints_.blocks().size()); ++k) {
        has_rows(joints_.blocks()[k].first);
        has_rows(joints_.blocks()[k].second);
        for (int body : joints_.others(k)) has_rows(body);
    }
    const bool touching = model_.stages.runs(Stage::collision);
    for (int body = 0; body < model_.bodies(); ++body) {
        const BodyConstants& of = model_.constants[body];
        if (model_.solver_index[body] == 0 || (touching && of.moves())) {
            model_.solver_index[body] = static_cast<int>(model_.constrained.size());
            model_.constrained.push_back(body);
        } else if (of.moves()) {
            model_.free.push_back(body);
        } else if (of.motion == Motion::kinematic) {
            model_.driven.push_back(body);
        }
    }
}

/// Which stages run here; what the scene has and no stage handles is refused.
void RigidSystem::take_stages(const RigidScene& scene) {
    const bool joints = !scene.joints.empty();
    mixed_.take_stages(model_);
    const bool rub = model_.stages.runs(Stage::rub_joints);
    const bool coupled = model_.stages.take(Stage::couple_joints),
               held = model_.stages.take(Stage::hold_wires);
    const bool wound = model_.stages.take(Stage::wind_wires), meshes = model_.stages.take(Stage::meet_meshes);
    for (const JointSpec& joint : scene.joints)
        if ((joint.kind == JointKind::relation && !coupled) || (joint.kind == JointKind::wire && !held) ||
            (joint.kind == JointKind::wire && !joint.terms.empty() && !wound) || (rubs(joint) && !rub))
            throw std::invalid_argument(
                "a relation, a wire or a joint that rubs needs the stage named for it");
    for (const Collider& collider : scene.colliders)
        if (collider.shape.kind == ShapeKind::triangle && model_.stages.runs(Stage::collision) && !meshes)
            throw std::invalid_argument("meshes need the stage meet_meshes");
    bool solved = false;
    if (model_.stages.take(Stage::assemble_rows)) {
        const bool block = model_.stages.take(Stage::solve_block),
                   iterative = model_.stages.take(Stage::solve_iterative);
        const bool pivot = model_.stages.take(Stage::pivot);
        solved = block || iterative || pivot;
        model_.bilateral = joints && block && !iterative;
    }
    if (joints && !solved)
        throw std::invalid_argument("joints need the stage assemble_rows and one that solves them");
    forces_.take_stages(scene);
    model_.stages.take(Stage::string_stiffness);
    model_.stages.take(Stage::half_step);
    model_.stages.take(Stage::correct_curvature);
    model_.stages.take(Stage::integrate_positions);
    model_.stages.take(Stage::integrate_rotations);
    model_.stages.take(Stage::project_positions);
    model_.stages.take(Stage::sleep);
    model_.stages.take(Stage::observe);
    model_.stages.expect_all_taken("rigid bodies");
}

void RigidSystem::reset(StageClock* clock) {
    clock_ = StageTimer(clock);
    live_ = {};
    live_.bodies = model_.start;
    readings_.tell_kept({});
    replaying_ = false;
    early_joints_.clear();
    plane_.forget();
    forces_.end_shares();
    sleeping_.begin();
    if (forces_.follow_the_time()) forces_.follow_time();
    rows_.reset();
    std::fill(joints_.states.begin(), joints_.states.end(), JointSet::State{});
    joints_.breaks.clear();
    bilateral_.begin();
    rows_.matrix.clear_counters();
    work_kept_ = work_taken_back_ = {};
    mixed_.begin();
    const bool corrected = model_.method.corrections > 0, may_touch = mixed_.may_touch();
    if (model_.composed) composition_.begin();
    if (model_.method.runge_kutta) composition_.project();
    if (model_.composed || corrected) energy_.begin();
    if (model_.stiff) bilateral_.stiffness.find_tensions();
    if (model_.half_step || corrected) curvature_.begin();
    if (model_.half_step && !may_touch) half_step_.start();
    if (corrected && !may_touch && model_.bilateral && !model_.curved) curvature_.begin_where_it_stands();
    rows_.matrix.clear_counters();
    plane_.begin();
    if (model_.half_step && may_touch)
        half_step_.start_touching([this] { find_velocities(); }, [this] { mixed_.begin_again(); });
}

void RigidSystem::advance(std::int64_t steps) {
    readings_.tell_kept({});
    if (model_.method.runge_kutta) return runge_kutta_.advance(steps * model_.method.substeps);
    if (model_.composed) return composition_.compose(steps * model_.method.substeps);
    for (std::int64_t n = steps * model_.method.substeps; n > 0; --n) step();
    deliver();
}

Health RigidSystem::health() const {
    const auto cause = [this](bool known = false) {
        return cause_of_runaway(model_, joints_, early_joints_, mixed_.contacts() != nullptr, known,
                                !bilateral_.loops.empty() && joints_.drives().give_energy());
    };
    if (live_.whirling >= 0) return {Status::diverged, live_.whirling, cause(true)};
    if (live_.lost >= 0)
        return {
            Status::diverged, live_.lost,
            model_.method.runge_kutta
                ? "accelerates so that no part of the step is within the tolerance; is a force without bounds near it?"
                : "is held by joints that no motion satisfies, even in a small part of the step; start it where its "
                  "joints can move, or take a smaller time step"};
    if (live_.contradicted >= 0)
        return {Status::diverged, live_.contradicted,
                "is held by rows that contradict each other, of {joints}; give one of them a compliance",
                live_.named};
    if (live_.locked >= 0)
        return {
            Status::diverged, live_.locked,
            model_.method.corrections > 0
                ? "is locked by redundant joints, {joints}: they say nearly the same and yet not quite; put the loop "
                  "together more exactly, or give them more compliance"
                : "is locked by redundant joints, {joints}: linearised rows pull them apart, or the loop does not fit; "
                  "use corrections=1 or a composition, or give them more compliance",
            live_.named};
    for (int body = 0; body < model_.bodies(); ++body) {
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

std::vector<double> RigidSystem::final_state() {
    if (live_.lost < 0 && live_.not_solved < 0) {
        if (model_.composed) composition_.read();
        if (model_.half_step) {
            solve_ahead();
            half_step_.read();
        }
    }
    return readings_.states(true);
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
    const LockedTree::Counters locked = bilateral_.counters();
    Work done{rows_.matrix.counters(), mixed_.rounds, mixed_.pgs_iterations};
    done = done + Work{mixed_.counters()};
    done = done + Work{{locked.factorisations, locked.block_operations, 0, locked.solves}};
    const std::uint64_t readings = (1 + static_cast<std::uint64_t>(model_.method.refinements)) *
                                   (1 + static_cast<std::uint64_t>(model_.method.corrections));
    done = done +
           Work{{plane_.solves(), plane_.solves() * plane_.step().blocks(), 0, plane_.solves() * readings}};
    return mixed_.contacts() ? done + Work{mixed_.contacts()->factor_counters()} : done;
}

void RigidSystem::judge_end(RunReport& report) {
    energy_.judge(report);
    judge_stopped(model_, live_, report);
    judge_open_joints(model_, live_, joints_, report);
    bilateral_.loops.judge_forced(report);
}

void RigidSystem::count(RunReport& report, std::int64_t steps) const {
    const std::int64_t substeps = steps * model_.method.substeps;
    for (const Break& at : joints_.breaks)
        report.broken.push_back({at.joint, (at.step + model_.method.substeps - 1) / model_.method.substeps,
                                 static_cast<double>(at.step) * model_.h, at.force, at.torque});
    report.counters["steps"] = steps;
    report.counters["substeps"] = substeps;
    report.counters["rows_assembled"] = static_cast<std::int64_t>(rows_.rows()) * substeps;
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
    if (model_.composed) {
        report.counters["newton_iterations"] = live_.newton_iterations;
        report.counters["halved_steps"] = live_.halved_steps;
    }
    if (!bilateral_.loops.empty()) report.counters["redundancy_looks"] = live_.looks;
    if (sleeping_.is_on()) {
        report.counters["asleep"] = static_cast<std::int64_t>(live_.sleep.sleepers);
        report.counters["slept_steps"] = live_.sleep.slept;
    }
    put("stopped_impacts", live_.stopped.count);
    put("contacts", 0);  // the same names with and without a collision stage, so that runs can be compared
    report.counters["force_evaluations"] = substeps * forces_.evaluations();
    report.residual = live_.residual;
    if (const Unsettled& left = live_.unsettled; left.body >= 0) {
        report.residual = std::max(report.residual, left.residual);
        if (report.status == Status::completed) {
            report.status = Status::unsettled;
            report.failed_body = left.body;
            if (left.sunk)
                report.reason =
                    "has sunk into another by a fiftieth of the smaller one's radius; use more iterations, "
                    "smaller time steps or the direct solver";
            report.failed_step = (left.step + model_.method.substeps - 1) / model_.method.substeps;
        }
    }
    if (!mixed_.contacts()) return;
    const ContactCounters contact = mixed_.contacts()->counters();
    put("contacts", contact.contacts);
    put("impacts", contact.impacts);
    put("corrections", contact.corrections);
    put("friction_rounds", contact.friction_rounds);
    put("pivots", contact.pivots);
    put("sweeps", done.pgs_iterations + contact.pgs_iterations);
    put("unsettled_solves", contact.unsettled);
}

}  // namespace spook
