// How contacts are solved, and what solving them has cost.
#pragma once

#include <cstdint>

#include "contacts/friction_point.hpp"
#include "run/named_enum.hpp"

namespace spook {

SPOOK_NAMED_ENUM(SolverKind, direct, iterative)

/// Bodies that touch but do not approach each other take part in an impact (simultaneous) or only points that are approached do,
/// again and again until none is, so that it runs through a row of touching balls, and the last one leaves (successive).
SPOOK_NAMED_ENUM(ImpactOrder, simultaneous, successive)

struct ContactOptions {
    double time_step = 0.0;
    FrictionModel friction = FrictionModel::cone;
    SolverKind solver = SolverKind::direct;
    int iterations = 50;
    double residual_tolerance = 1e-10;  // m/s
    double floor = 1e-12;               // of pivots, in the factor only
    int refinements = 1;
    ImpactOrder impacts = ImpactOrder::simultaneous;
    bool stops_rebound = false;       // some joint's does
    double unsettled_residual = 0.1;  // m/s; a solve that leaves more has no answer
};

struct ContactCounters {  // exact, equal on every machine
    std::uint64_t contacts = 0, impacts = 0, corrections = 0, friction_rounds = 0, pivots = 0,
                  pgs_iterations = 0,
                  unsettled = 0;  // solves that stopped at a limit of rounds
    void add(const FrictionReport& report) noexcept {
        friction_rounds += static_cast<std::uint64_t>(report.rounds);
        pivots += static_cast<std::uint64_t>(report.pivots);
        pgs_iterations += static_cast<std::uint64_t>(report.pgs_iterations);
    }
};

}  // namespace spook
