// One system of rows by the method's solver: island by island, directly or by iterations.
#pragma once

#include <vector>

#include "contacts/contact_islands.hpp"
#include "contacts/contact_options.hpp"

namespace spook {

struct IslandRules {
    FrictionModel friction = FrictionModel::cone;
    double enough = 0.0;         // m/s: what iterations may leave before few rows are solved directly
    std::size_t few_enough = 0;  // row blocks of an island that are solved directly under iterations
    bool warm_started = false;   // iterations have set the start
};

/// Fills velocity, multipliers and points of `system`, and counts what that took. Rows that `answered` names are left as they
/// are where all of their island's are named.
FrictionReport solve_islands(MixedSystem& system, std::vector<FrictionPoint>& points, IslandSolver& islands,
                             const ContactOptions& options, const IslandRules& rules,
                             ContactCounters& counters, const std::vector<char>* answered = nullptr);

}  // namespace spook
