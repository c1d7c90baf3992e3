// The solvers there are for the rows of joints; which of them a scene gets, solver_table.cpp says.
#pragma once

#include "run/named_enum.hpp"

namespace spook {

/// In joint coordinates; by compositions on rows; with bounds; where all rows hold link by link, by numbers of a plane, or in one
/// factorisation.
SPOOK_NAMED_ENUM(Solver, none, runge_kutta, joint_tree, composed, iterative, pivot, links, plane, factor)

/// Why a solver does not take a scene; null: it does.
using Refusal = const char*;

}  // namespace spook
