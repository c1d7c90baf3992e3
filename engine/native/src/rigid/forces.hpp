// What acts on the bodies of a scene: gravity, loads, springs, fields, fluids, and what follows the time.
#pragma once

#include <vector>

#include "rigid/joint_set.hpp"
#include "rigid/rigid_model.hpp"
#include "rigid/run_state.hpp"
#include "run/stage_clock.hpp"

namespace spook {

class Forces {
public:
    Forces(RigidModel& model, RigidState& live, JointSet& joints, const StageTimer& clock) noexcept
        : model_(model), live_(live), joints_(joints), clock_(clock) {}

    /// Which stages run here; before the bodies are known.
    void take_stages(const RigidScene& scene);
    /// Once they are.
    void take(const RigidScene& scene);

    /// The stage: dv_ext of this step, which bodies that never have rows get at once.
    void apply_forces();
    /// Of central fields and of springs between centres.
    void find() {
        if (!force_.empty()) find_all();
    }
    /// The same, and loads and rests of springs as the time asks for, within a step.
    void find_at(double time);
    /// When one of these bends next after a time.
    double next_knot(double time) const noexcept;
    /// Whether they are others within a step.
    bool change_within_steps() const noexcept {
        return !force_.empty() || !load_follows_.empty() || !drives_.empty();
    }
    /// Loads, drives and paces as the time asks for.
    void follow_time();
    bool follow_the_time() const noexcept { return !load_follows_.empty() || !drives_.empty(); }
    /// Loads that change from step to step.
    void find_loads(double time);
    bool loads_change() const noexcept { return !load_follows_.empty(); }
    /// A body that has no rows in this step.
    void kick_free_body(int body) noexcept;

    /// m/s², N, and per step m/s and N m s.
    Vec3 acceleration(int body) const noexcept { return acceleration_[body]; }
    Vec3 force(int body) const noexcept {
        const Vec3 f = model_.constants[body].mass * acceleration_[body];
        return force_.empty() ? f : f + force_[body];
    }
    Vec3 kick(int body) const noexcept {
        Vec3 dv = model_.h * acceleration_[body];
        if (!force_.empty()) dv += (model_.h / model_.constants[body].mass) * force_[body];
        return share_.empty() ? dv : share_[body] * dv;
    }
    Vec3 angular_impulse(int body) const noexcept {
        return share(body) * model_.h * model_.constants[body].torque;
    }
    const std::vector<Vec3>& accelerations() const noexcept { return acceleration_; }
    const std::vector<Vec3>& of_springs_and_fields() const noexcept { return force_; }

    /// The part of a body's forces that is still to act in this step: all of it, until shares are given out.
    double share(int body) const noexcept { return share_.empty() ? 1.0 : share_[body]; }
    void begin_shares() { share_.assign(model_.constants.size(), 1.0); }
    void set_share(int body, double share) noexcept { share_[body] = share; }
    void leave_out_sleepers() noexcept {
        if (live_.sleep.sleepers == 0) return;
        for (const int body : model_.constrained)
            if (live_.asleep(body)) share_[body] = 0.0;
    }
    void end_shares() noexcept { share_.clear(); }

    double potential_energy() const noexcept;
    /// Whether they may give energy that no book has.
    bool have_power() const noexcept { return !fluids_.empty() || !load_follows_.empty(); }
    /// Whether another load is set than what acts.
    bool is_new_load(int body, Vec3 force, Vec3 torque) const noexcept;
    void set_load(int body, Vec3 force, Vec3 torque) noexcept;

    const std::vector<TimeDrive>& drives() const noexcept { return drives_; }
    bool floats(int body) const noexcept {
        return !floaters_.empty() && !floaters_[static_cast<std::size_t>(body)].empty();
    }
    /// Calls each(spring) for all springs.
    template <class Each> void each_spring(const Each& each) const {
        for (const SpringForce& spring : springs_) each(spring);
        for (const SpringForce& spring : turning_springs_) each(spring);
    }
    /// Evaluations of forces in a step.
    std::int64_t evaluations() const noexcept;
    bool act_steadily() const noexcept { return force_.empty() && load_follows_.empty() && drives_.empty(); }

private:
    struct SpringEnd {
        Vec3 place, velocity, arm;  // the arm in world axes
    };
    struct Load {
        Vec3 force, torque;
    };
    Vec3 place(const End& end) const noexcept {
        return end.body < 0 ? end.point : model_.position(end.body, live_.bodies);
    }
    Vec3 gravity() const noexcept {
        return model_.stages.runs(Stage::apply_gravity) ? model_.gravity : Vec3{};
    }
    void find_all();
    SpringEnd spring_end(const End& end) const noexcept;
    void pull_aside(const SpringForce& spring) noexcept;
    void add_fluid(const Fluid& fluid, int body, Vec3& force, Vec3& torque) const noexcept;

    RigidModel& model_;
    RigidState& live_;
    JointSet& joints_;
    const StageTimer& clock_;
    std::vector<Vec3> acceleration_;                      // gravity and loads
    std::vector<Vec3> force_;                             // of springs and centres, per body
    std::vector<double> share_;                           // empty: all of it
    std::vector<SpringForce> springs_, turning_springs_;  // between centres; beside them
    std::vector<CentralField> fields_;
    std::vector<TimeDrive> drives_;
    std::vector<Fluid> fluids_;
    std::vector<std::vector<Collider>> floaters_;  // per body
    std::vector<int> load_follows_;                // bodies whose load changes from step to step
    std::vector<Load> steady_;  // per body, if some follow: the part of its load that does not change
};

}  // namespace spook
