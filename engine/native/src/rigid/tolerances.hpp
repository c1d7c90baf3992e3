// The numbers that steps of rigid bodies are tuned by: each with its unit, and what it stands for. A part is the file that reads it.
// `make tolerances` multiplies and divides one at a time by ten, and tells which test goes red and whether any bit changes.
#pragma once

#include <cstddef>
#include <cstdint>

namespace spook {

// energy_made.cpp
namespace tolerances::energy_made {
inline constexpr double MOST_GAINED = 0.05;  // of the largest kinetic energy
inline constexpr double ROUNDING = 1e-9;     // of the energy, which counts heights from anywhere
inline constexpr double OVERSTEPPED = 1e-9;  // m or rad, of rows and overlaps
inline constexpr int LOOKS =
    16;  // steps of joints alone from one look to the next: one costs a tenth of a plane step
}  // namespace tolerances::energy_made

// impact.cpp
namespace tolerances::impact {
inline constexpr double again =
    1e-9;  // of a stop's rebound: slower than this it is not hit again in the step
}

// Read by several parts
inline constexpr double SLIGHT = 1e-17;  // of the square of a tilt: what K need not know of it

// joint_stops.cpp
namespace tolerances::joint_stops {
inline constexpr double OUT_OF_REACH = 1e5;  // m/s or rad/s: no gap that takes more closes within a step,
inline constexpr double AS_FAST = 10.0;      // nor one that takes so many times the rate it has
}  // namespace tolerances::joint_stops

// joint_tree.cpp
namespace tolerances::joint_tree {
inline constexpr double LIGHT =
    1e-4;  // of the heaviest: impulses of rows would throw such a body about while they are sought
inline constexpr int MOST_WITH_LIGHT = 128;  // coordinates, where some are so light
inline constexpr int MOST_IN_A_TREE = 12;    // coordinates: beyond it blocks of bodies and rows are cheaper
inline constexpr int MOST_ROWS = 200;        // that close loops
inline constexpr int FARTHEST = 24;          // off the diagonal: wider bands cost more than blocks
}  // namespace tolerances::joint_tree

// plane_step.cpp
namespace tolerances::plane_step {
inline constexpr double ROUNDING = 4e-16;  // of a unit vector
inline constexpr double IN_PLANE = 1e-14;  // of a state, which may come from a run in space
inline constexpr double DOUBTFUL = 1e-4;   // of a row's diagonal: a pivot below has lost four digits
}  // namespace tolerances::plane_step

// plane_step_order.cpp
namespace tolerances::plane_step_order {
inline constexpr std::size_t WIDEST = 12;  // columns of the envelope, in the mean: beyond, blocks are as fast
}

// plane_tree.cpp
namespace tolerances::plane_tree {
inline constexpr double FARTHEST = 0.3;  // cosine of half the turn of a joint in a stage
}

// project_positions.cpp
namespace tolerances::project_positions {
inline constexpr int most_rounds = 10;         // of Newton's method
inline constexpr double held = 1e-13;          // of a joint's size: a violation that is rounding
inline constexpr double nearly_held = 1e-11;   // and what may be left where rounding is worse
inline constexpr int most_halvings = 4;        // of the displacement
inline constexpr double rounding = 4e-16;      // of the energy
inline constexpr int max_projections = 4;      // of a step
inline constexpr std::size_t few_members = 8;  // bodies of an island: most are no larger
}  // namespace tolerances::project_positions

// rigid_composition.cpp
namespace tolerances::rigid_composition {
inline constexpr int DIFFERENCES = 8;        // of a stage's forces from step to step, the zeroth included
inline constexpr double MOST_OF_RATE = 2.0;  // of τ² times the tension's rate: a stage τ is unstable above 4
inline constexpr int ROUNDS = 24;            // of power iteration for that rate
inline constexpr double ALIKE = 2.0;         // times what it finds, which comes near from below
inline constexpr int MOST_PARTS = 1024;      // of a step
inline constexpr double NEAR = 1.0 / 64.0;   // of that: nearer than this tension is looked at often
inline constexpr std::int64_t OFTEN = 8, SELDOM = 256;  // steps
}  // namespace tolerances::rigid_composition

// tree_runge_kutta.cpp
namespace tolerances::tree_runge_kutta {
inline constexpr double SAFE = 0.9;  // of the length whose error is estimated to be the tolerance
inline constexpr double SHORTEST = 0.2, LONGEST = 6.0;  // times the length of the part before
inline constexpr double LITTLE_MORE = 1.01;             // times a part: so much is left for one
inline constexpr double SMALLEST = 1e-9;                // of a step: no smaller part is tried
inline constexpr double RESTING =
    0.01;  // sizes a step: rates are measured by no less, which places cannot tell from rest
}  // namespace tolerances::tree_runge_kutta

// rigid_hold.cpp
namespace tolerances::rigid_hold {
inline constexpr double SETTLED = 2e-15;    // of the joint's size: rounding level
inline constexpr int MOST_ITERATIONS = 30;  // of Newton's method, in a stage
inline constexpr int MIXED = 6;             // rounds that are remembered
inline constexpr double SINGULAR =
    1e-4;  // of its scale: pivots below it belong to rows that become redundant
inline constexpr double FARTHEST =
    0.3;  // of the joint's size, at the prediction: beyond it lie other solutions
inline constexpr std::uint64_t DENSE = 24;  // rows up to which one dense matrix is cheaper than blocks
}  // namespace tolerances::rigid_hold

// rigid_locking.cpp
namespace tolerances::rigid_locking {
inline constexpr double NEARLY = 1e-4;  // of a row's diagonal: an angle of 1e-2 between rows
inline constexpr double FEW =
    10.0;  // joints of a loop: rows of longer ones move each other by less and less, as 1/n²
inline constexpr std::int64_t SOON = 8,
                              LATE = 64;  // steps to the next look; and where half of the motion goes in one
inline constexpr double LITTLE = 1e-2;    // of what is too much: then the next look has twice the time
inline constexpr double TAKEN = 0.25;     // of the largest energy of motion, by rows that should take none
inline constexpr double AT_REST =
    1e-6;                            // of what the loads of a step would set in motion: such motion is none
inline constexpr double HELD = 0.1;  // of what the loads would set in motion
inline constexpr double REPEATED = 1e-4;  // of what the loads would set in motion
inline constexpr double STANDS = 3.0;     // times the speed that a loop has had
inline constexpr double POINT = 1e-6;     // of the mean arm: shorter ones are rounding
inline constexpr double BENT =
    0.2;  // over n² of a loop's joints: 1.8 and more in lifts, .02 where an axis is off by 1e-2
inline constexpr double TOLD = 1e-3;  // of the largest share: a joint that is named
}  // namespace tolerances::rigid_locking

// rotation.cpp
namespace tolerances::rotation {
inline constexpr double PART = 0x1p-4;    // rad: up to here series and quadrature are exact to rounding
inline constexpr double SHORT = 0x1p-10;  // rad: up to here with two nodes
inline constexpr double STRETCH =
    4.0;  // rad: what its start's invariants serve for; rounding leaves them slowly
inline constexpr double FAR = 1000.0;       // rad
inline constexpr double STEADY = 0x1p-106;  // square of the rounding of a direction
}  // namespace tolerances::rotation

// runaway.cpp
namespace tolerances::runaway {
inline constexpr double ASIDE = 1e-6;  // of the energy of its spin: what a body has by going round its joint
inline constexpr double TAUT =
    0.3;  // of h² F / (m r): a body that is lighter than this for its load is loaded
}  // namespace tolerances::runaway

// sleep.cpp
namespace tolerances::sleep {
inline constexpr double far = 1e3;  // m: as far out may a sleeper lie on a plane that begins to turn
}

// step.cpp
namespace tolerances::step {
inline constexpr std::size_t looking_from =
    16;  // bodies: steps of fewer that cannot touch are too short for a look at the clock in each
}

// Read by several parts
inline constexpr double CREEP = 1e-3;  // m/s: a wheel that is slower creeps

// wake.cpp
namespace tolerances::wake {
inline constexpr double rounding =
    1e-6;  // of sleep_speed: a path that stands still leaves bodies that follow it such speeds
}

}  // namespace spook
