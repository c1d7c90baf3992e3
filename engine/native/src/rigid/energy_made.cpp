// Energy that comes out of nothing: an outcome, not "completed". Asked of compositions, by the final state, and of corrections, on the
// way: they keep energy, and their rows can add to it. Plain SPOOK dissipates, and is asked by the books (engine/books.py).
// And energy that impacts were to give back and did not, by whatever method.
//
// reads: places and velocities of bodies, drives. writes: what the run has known of its energy.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "rigid/energy_made.hpp"
#include "rigid/readings.hpp"
#include "rigid/tolerances.hpp"
#include "run/energy_made.hpp"

namespace spook {

using namespace tolerances::energy_made;

void EnergyMade::begin() {
    live_.energy.most_kinetic = kinetic_energy(model_, live_, joints_);
    live_.energy.begun = live_.energy.most = live_.energy.most_kinetic + forces_.potential_energy();
    live_.energy.is_powered = false;
    live_.energy.noted = -1;
    if (model_.composed) return;
    // Of rows that begin violated, and of limits that begin overstepped, nothing says how much they give.
    double off[6];
    for (int k = 0; k < static_cast<int>(joints_.blocks().size()); ++k) {
        joints_.overstep(k, live_.bodies, off);
        live_.energy.is_powered |= std::any_of(off, off + joints_.blocks()[k].size, [](double each) {
            return std::fabs(each) > initial_overstep;
        });
    }
}

/// Whether something gives energy that no book of the run has: loads, drives, fluids, what moves as it is told.
bool EnergyMade::has_power() const noexcept {
    if (forces_.have_power() || joints_.drives().give_energy()) return true;
    for (int i = 0; i < model_.bodies(); ++i) {
        const bool led = !model_.constants[i].moves() &&
                         !(is_zero(live_.bodies[i].velocity) && is_zero(live_.bodies[i].angular_velocity));
        if (led || !is_zero(model_.constants[i].force) || !is_zero(model_.constants[i].torque)) return true;
    }
    return false;
}

bool EnergyMade::is_due() const noexcept {
    if (live_.energy.is_powered) return false;
    // In a plane each look costs a tenth of a step, and space is to answer alike. Half steps are noted in pairs.
    return model_.curved || live_.moved % steps_between_looks <= (model_.half_step ? 1 : 0);
}

/// What the mean of the velocities half a step before and after has less than theirs in the mean [J].
double EnergyMade::lost_in_the_mean() const noexcept {
    double sum = 0.0;
    for (int i = 0; i < model_.bodies(); ++i) {
        if (!model_.constants[i].moves()) continue;
        const Vec3 dv = live_.bodies[i].velocity - live_.before[i].velocity,
                   dl = live_.bodies[i].angular_momentum - live_.before[i].angular_momentum;
        sum += 0.125 * model_.constants[i].mass * dot(dv, dv);
        sum += 0.125 * dot(turned_by(model_.constants[i], live_.bodies[i], dl), dl);
    }
    return sum;
}

void EnergyMade::note(double penetration) {
    live_.energy.is_powered = has_power() || (live_.moved == 1 && penetration > initial_overstep);
    RigidState::Energy& known = live_.energy;
    const double kinetic = kinetic_energy(model_, live_, joints_), potential = forces_.potential_energy();
    known.most_kinetic = std::max(known.most_kinetic, kinetic);
    double met = kinetic + potential;
    if (model_.half_step) {
        met = known.noted == live_.moved - 1
                  ? 0.5 * (known.kinetic + kinetic) - lost_in_the_mean() + known.potential
                  : known.begun;
        known.noted = live_.moved, known.kinetic = kinetic, known.potential = potential;
    }
    known.most = std::max(known.most, met);
}

/// What was stopped without the rebound that is asked for is lost; what is plastic, or nearly, may be.
void judge_stopped(const RigidModel& model, const RigidState& live, RunReport& report) {
    const auto& stopped = live.stopped;
    if (report.status != Status::completed || !(stopped.energy > max_energy_share * stopped.most_kinetic))
        return;
    const std::int64_t step = (stopped.step + model.method.substeps - 1) / model.method.substeps;
    char said[220];
    std::snprintf(
        said, sizeof said,
        "was stopped where it was to rebound; such impacts have lost %.3g J, of %.3g J at most; take "
        "smaller steps, or more substeps, each of which meets others",
        stopped.energy, stopped.most_kinetic);
    report.leave_unsettled(stopped.body, said);
    report.failed_step = step;
}

/// Asked once the final state was read.
void EnergyMade::judge(RunReport& report) const {
    if (!(model_.composed || model_.method.corrections > 0) || report.status != Status::completed ||
        model_.constrained.empty())
        return;
    if (live_.energy.is_powered || has_power()) return;
    const double kinetic = kinetic_energy(model_, live_, joints_),
                 most = std::max(live_.energy.most_kinetic, kinetic);
    double reached = kinetic + forces_.potential_energy();
    if (!model_.composed) reached = std::max(reached, live_.energy.most);
    double least = 0.0;
    if (!model_.composed) {  // what a step's fall is worth: the first order of the step
        const double fall = model_.h * norm(model_.gravity);
        for (const int i : model_.constrained)
            if (model_.constants[i].moves()) least += model_.constants[i].mass * fall * fall;
    }
    const int lightest = *std::min_element(
        model_.constrained.begin(), model_.constrained.end(),
        [this](int a, int b) { return model_.constants[a].mass < model_.constants[b].mass; });
    judge_energy({live_.energy.begun, reached, most, least}, lightest,
                 model_.method.runge_kutta ? "take smaller steps, or give the method a smaller tolerance"
                 : model_.composed ? taut_cure
                                   : "where bodies turn far in a step, take smaller steps or no corrections",
                 report);
}

}  // namespace spook
