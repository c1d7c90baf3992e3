// Joints, normals and friction together, by direct solves.
#pragma once

#include "contacts/cone_newton.hpp"
#include "contacts/friction_point.hpp"
#include "contacts/pivot_solver.hpp"
#include "contacts/reduced_contacts.hpp"

namespace spook {

/// What direct solves of one island keep from step to step.
struct DirectSolver {
    PivotSolver pivot;
    ConeNewton newton;
    ReducedContacts reduced;
    RetryBackoff backoff;
    bool warm_started = false;  // iterations have set the start: no answer that pivoting could find near
};

/// Solves `system` with the friction law `model` at `points`.
///
/// The box needs one boxed problem. The scaled box repeats it with the new normal forces until they settle. The
/// cone adds Newton's method on the exact law beta = −mu nu s/|s| (Alart and Curnier 1991): each point's first
/// tangent is turned along the slip; there the law reads beta_1 = −mu nu, a bound, and across it
/// s_2 + (|s|/(mu nu)) beta_2 = 0, a softness. The first slip is the one predicted without constraints,
/// D(v + h M⁻¹ f); then the one of the last solve. A fixed point obeys the disc exactly: no direction is preferred.
/// Rounds end when normal forces and the law's residual have settled to 1e-10 of the largest normal impulse (after
/// 25 rounds tenfold more every five, at most 1e-6), and go on while each leaves a tenth of that, down to 1e-12: where
/// points are redundant, little in a bound is much in how they share their load. After `max_rounds` without an answer
/// Gauss–Seidel iterations finish, and replace a poor end in any case: their answer obeys every bound.
/// Systems of contacts alone under the cone, or of more than 24 blocks without friction, get a few of these rounds,
/// which settle exactly what rests or slides on; where they failed they wait, up to 16 solves, and more than 24 blocks
/// that start from iterations, or have redundant points and no friction, get none. What is left goes to Newton's method
/// (`contacts/cone_newton.hpp`), where that ends beyond 1e-6 of the speeds (3e-5 where points are redundant, 1e-9 up to 24
/// blocks) to 100 iterations and Newton's method again, and up to 24 blocks to a few rounds more, which share loads evenly. The best within
/// 1e-4 of the speeds is the answer, and converged within 1e-9; else iterations finish.
/// Beside joints, and where few points resist turning, the cone, and systems without friction under any law, get a few rounds; then
/// contacts alone are solved, the joints eliminated, in turns with Newton's method on the whole (`contacts/jointed_friction.hpp`).
/// On return FrictionPoint::normal is the normal impulse; for the box it stays what bounds friction.
FrictionReport solve_friction_direct(MixedSystem& system, std::vector<FrictionPoint>& points,
                                     FrictionModel model, DirectSolver& direct, int max_rounds = 60);

}  // namespace spook
