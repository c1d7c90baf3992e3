// By which solver the rows of a scene are solved: the first of one table that takes it; see solver_table.cpp.
#pragma once

#include "rigid/bilateral_solve.hpp"
#include "rigid/plane_path.hpp"
#include "rigid/rigid_composition.hpp"
#include "rigid/tree_runge_kutta.hpp"

namespace spook {

/// What solvers look at before they take a scene, and are made ready by where they do.
struct SolverParts {
    const RigidScene& scene;
    const RigidModel& model;
    const MixedRows& mixed;
    const Forces& forces;
    BilateralSolve& bilateral;
    PlanePath& plane;
    RigidComposition& composition;
    TreeRungeKutta& runge_kutta;
};

struct SolverChoice {
    Solver solver = Solver::none;
    StageNotes notes;  // how stages run then
};

/// The only place that chooses. Throws std::invalid_argument where the method asks for a solver that does not take the scene.
SolverChoice choose_solver(const SolverParts& parts);

}  // namespace spook
