// Energy that comes out of nothing: an outcome, not "completed".
#pragma once

#include <cmath>
#include <cstdio>

#include "run/report.hpp"

namespace spook {

struct EnergyGain {
    double begun = 0.0, reached = 0.0, most_kinetic = 0.0;  // J
    double least = 0.0;                                     // J, that a method may be off by
};

inline constexpr double max_energy_share = 0.05;       // of the largest kinetic energy
inline constexpr double energy_rounding_share = 1e-9;  // of the energy, which counts heights from anywhere

/// Makes a run unsettled that has gained more; named are the lightest `body` and what cures it.
inline void judge_energy(const EnergyGain& energy, int body, const char* cure, RunReport& report) {
    const double gained = energy.reached - energy.begun;
    const double least = energy_rounding_share * std::abs(energy.begun) + energy.least;
    if (report.status != Status::completed || !(gained > max_energy_share * energy.most_kinetic + least))
        return;
    char said[220];
    std::snprintf(said, sizeof said,
                  "was found to move with %.3g J that came out of nothing, of %.3g J at most; %s", gained,
                  energy.most_kinetic, cure);
    report.leave_unsettled(body, said);
}

inline constexpr double initial_overstep = 1e-9;  // m or rad, of rows and overlaps
inline constexpr double rigid_compliance = 1e-5;  // m/N: a row that gives way more is meant to

inline constexpr const char* taut_cure =
    "where light bodies carry much tension, T h²/(m l) above 0.3, take smaller steps or no composition";

}  // namespace spook
