// The numbers that steps of rigid bodies are tuned by: each with its unit, and what it stands for. A part is the file that reads it.
// `make tolerances` multiplies and divides one at a time by ten, and tells which test goes red and whether any bit changes.
#pragma once

#include <cstddef>
#include <cstdint>

namespace spook {

// energy_made.cpp
namespace tolerances::energy_made {
inline constexpr int steps_between_looks = 16;  // of joints alone: a look costs a tenth of a plane step
}  // namespace tolerances::energy_made

// impact.cpp
namespace tolerances::impact {
inline constexpr double again = 1e-9;  // of a stop's rebound: slower it is not hit again in the step
}

// Read by several parts
inline constexpr double slight_tilt = 1e-17;  // its square: what K need not know of

// joint_set.cpp
namespace tolerances::joint_set {
inline constexpr double rounding_of_turn = 1e-9;  // of a rate: what spins about an axis of its own keeps it
}  // namespace tolerances::joint_set

// joint_stops.cpp
namespace tolerances::joint_stops {
inline constexpr double unreachable_rate = 1e5;  // m/s or rad/s: no gap that takes more closes within a step,
inline constexpr double unreachable_ratio = 10.0;  // nor one that takes so many times the rate it has
inline constexpr double short_flight = 1e-6;       // of a step: what returns to its end so soon rests there
}  // namespace tolerances::joint_stops

// joint_tree.cpp
namespace tolerances::joint_tree {
inline constexpr double light_mass_ratio = 1e-4;  // of the heaviest: rows' impulses would throw it about
inline constexpr int max_coordinates_with_light = 128;  // where some are so light
inline constexpr int max_coordinates_per_tree = 12;     // beyond it blocks of bodies and rows are cheaper
inline constexpr int max_loop_rows = 200;               // that close loops
inline constexpr int max_bandwidth = 24;                // off the diagonal: wider bands cost more than blocks
}  // namespace tolerances::joint_tree

// plane_step.cpp
namespace tolerances::plane_step {
inline constexpr double rounding = 4e-16;       // of a unit vector
inline constexpr double in_plane = 1e-14;       // of a state, which may come from a run in space
inline constexpr double doubtful_pivot = 1e-4;  // of a row's diagonal: a pivot below has lost four digits
}  // namespace tolerances::plane_step

// plane_step_order.cpp
namespace tolerances::plane_step_order {
inline constexpr std::size_t max_mean_width = 12;  // columns of the envelope: beyond, blocks are as fast
}

// plane_tree.cpp
namespace tolerances::plane_tree {
inline constexpr double min_half_turn_cosine = 0.3;  // cosine of half the turn of a joint in a stage
}

// project_positions.cpp
namespace tolerances::project_positions {
inline constexpr int most_rounds = 10;            // of Newton's method
inline constexpr double held = 1e-13;             // of a joint's size: a violation that is rounding
inline constexpr double nearly_held = 1e-11;      // and what may be left where rounding is worse
inline constexpr int most_halvings = 4;           // of the displacement
inline constexpr double energy_rounding = 4e-16;  // of the energy
inline constexpr int max_projections = 4;         // of a step
inline constexpr std::size_t few_members = 8;     // bodies of an island: most are no larger
}  // namespace tolerances::project_positions

// rigid_composition.cpp
namespace tolerances::rigid_composition {
inline constexpr int max_differences = 8;    // of a stage's forces from step to step, the zeroth included
inline constexpr int power_iterations = 24;  // for that rate
inline constexpr double rate_safety = 2.0;   // times what it finds, which comes near from below
inline constexpr double near_limit = 1.0 / 64.0;  // of that: nearer than this tension is looked at often
inline constexpr std::int64_t often = 8, seldom = 256;  // steps
}  // namespace tolerances::rigid_composition

// tree_runge_kutta.cpp
namespace tolerances::tree_runge_kutta {
inline constexpr double safety = 0.9;  // of the length whose error is estimated to be the tolerance
inline constexpr double min_growth = 0.2, max_growth = 6.0;  // times the length of the part before
inline constexpr double last_part = 1.01;                    // times a part: so much is left for one
inline constexpr double min_part = 1e-9;                     // of a step: no smaller part is tried
inline constexpr double resting_rate = 0.01;                 // sizes a step: rates are measured by no less
}  // namespace tolerances::tree_runge_kutta

// rigid_hold.cpp
namespace tolerances::rigid_hold {
inline constexpr double settled = 2e-15;                // of the joint's size: rounding level
inline constexpr int max_iterations = 30;               // of Newton's method, in a stage
inline constexpr int mixing_depth = 6;                  // rounds that are remembered
inline constexpr double singular_pivot = 1e-4;          // of its scale: rows below it become redundant
inline constexpr double max_predicted_violation = 0.3;  // of the joint's size: beyond lie other solutions
inline constexpr std::uint64_t max_dense_rows = 24;     // beyond, blocks are cheaper than one matrix
}  // namespace tolerances::rigid_hold

// rigid_locking.cpp
namespace tolerances::rigid_locking {
inline constexpr double near_dependence = 1e-4;  // of a row's diagonal: an angle of 1e-2 between rows
inline constexpr double few_joints = 10.0;  // of a loop: rows of longer ones move each other less, as 1/n²
inline constexpr std::int64_t soon = 8, late = 64;  // steps to the next look, least and most
inline constexpr double slight_share = 1e-2;  // of what is too much: then the next look has twice the time
inline constexpr double max_taken = 0.25;  // of the largest energy of motion, by rows that should take none
inline constexpr double at_rest = 1e-6;    // of what a step's loads would set in motion: such motion is none
inline constexpr double max_held = 0.1;    // of what the loads would set in motion
inline constexpr double min_repeated = 1e-4;   // of what the loads would set in motion
inline constexpr double standing_ratio = 3.0;  // times the speed that a loop has had
inline constexpr double point_arm = 1e-6;      // of the mean arm: shorter ones are rounding
inline constexpr double min_growth = 0.2;  // over n² of its joints: of lifts 1.8, of an axis off by 1e-2 .02
inline constexpr double forced_open = 1e-2;  // of a joint's arms, or rad: a motor has pulled it open
inline constexpr double named_share = 1e-3;  // of the largest share: a joint that is named
}  // namespace tolerances::rigid_locking

// runaway.cpp
namespace tolerances::runaway {
inline constexpr double passing_energy = 1e-6;  // of its spin's energy: what it has by going round its joint
inline constexpr double taut = 0.3;             // of h² F / (m r): a body lighter for its load is loaded
}  // namespace tolerances::runaway

// sleep.cpp
namespace tolerances::sleep {
inline constexpr double far = 1e3;  // m: as far out may a sleeper lie on a plane that begins to turn
inline constexpr double gained_share = 0.01;  // of sleep_speed: what gained more while slow is going to move
}  // namespace tolerances::sleep

// solve_velocities.cpp
namespace tolerances::solve_velocities {
inline constexpr double led_share =
    0.1;  // of the kinetic energy: a step in which joints do more work leads bodies
inline constexpr double most_of_alone =
    10.0;  // times the work of leading each row back by itself: what a chain of bodies may take
}  // namespace tolerances::solve_velocities

// step.cpp
namespace tolerances::step {
inline constexpr std::size_t looking_from = 16;  // bodies: steps of fewer are too short for a look
}

// Read by several parts
inline constexpr double fast_turn =
    0.02;  // rad in a step: linear rows are off by half its square, 1/5000 of their arms
inline constexpr double far_turn =
    0.5;  // rad in a step: twice as far, and an axle may point anywhere at its end
inline constexpr double creep_speed = 1e-3;  // m/s: a wheel that is slower creeps

// wake.cpp
namespace tolerances::wake {
inline constexpr double rounding = 1e-6;  // of sleep_speed: what a path that stands still leaves
}

}  // namespace spook
