// The numbers that contacts are tuned by: each with its unit, and what it stands for. A part is the file that reads it.
// `make tolerances` multiplies and divides one at a time by ten, and tells which test goes red and whether any bit changes.
//
// Shares are without unit. Speeds "in the system" are the largest of the bodies that are solved for, m/s.
#pragma once

#include <cstddef>

namespace spook {

// bilateral_rows.cpp
namespace tolerances::bilateral_rows {
inline constexpr double relief = 1e-10;  // of a row's own G M⁻¹ Gᵀ, in the factor only
}

// cone_newton.cpp
namespace tolerances::cone_newton {
inline constexpr double tightest = 1e-14, loosest = 1e-9;  // residuals, of the speeds in the system
inline constexpr double known = 1e-13;                     // of a start that is an answer already
inline constexpr double refined = 1e-16;   // of the square of what Newton's direction is to answer
inline constexpr double roughly = 1e-6;    // the same along the path, which only leads to the next point
inline constexpr double start_blur = 0.2;  // of the largest natural map
inline constexpr double nearest = 1.0;     // of the blur: how far units may be from the path, in the mean
inline constexpr double narrow = 0.03;     // a step so short has lost the path
// Of a unit's own inverse mass: dz/dv is at most its mass over hold. The loosest leaves the matrix well conditioned
// however redundant the points; with the tightest, what holding leaves is rounding soon after.
inline constexpr double loosest_hold = 3e-4, tightest_hold = 1e-10;
inline constexpr double hardest_hold = 0.1, brief = 0.3;  // beside joints, after a step so short
inline constexpr double behind = 10.0, slow = 0.1;  // of the blur, and of itself: what holding back leaves
inline constexpr double far = 1e-3;  // a residual, of the speeds, from which the path may crawl
inline constexpr int backoff = 3, long_patience = 12;  // iterations without half the residual, or less blur
inline constexpr int max_jumps = 3;                    // without half the least they met
inline constexpr double back = 10.0;                   // blurs: so far away the path is sought again,
inline constexpr double nearer = 0.1;                  //   and kept so much nearer to
}  // namespace tolerances::cone_newton

// contact_bodies.cpp
namespace tolerances::contact_bodies {
inline constexpr double slack_share = 1e-10;  // of the smaller body's radius
inline constexpr double rounding = 1e-15;     // of a place and of a size: four roundings
}  // namespace tolerances::contact_bodies

// contact_points.cpp
namespace tolerances::contact_points {
inline constexpr double vanishing = 1e-8;  // a direction so steep on the surface has no shadow
}

// Read by several parts
inline constexpr double closed = 1e-9;  // gaps up to this part of the larger body's radius count as closed
inline constexpr unsigned pairs_a_look = 256;  // of shapes, between two looks at the clock

// impact_solver.cpp
namespace tolerances::impact_solver {
inline constexpr int simultaneous_rounds = 20;  // of impacts that follow from impacts in one step
inline constexpr double gain = 1e-14;           // rise of kinetic energy that is rounding, relative
inline constexpr double impact_compliance =
    1e-3;                                  // of a point's own inverse inertia: its give in a shared impact
inline constexpr int determined = 3;       // points of a pair whose normal impulses its motion fixes
inline constexpr int most_again = 8;       // solves until the give is gone: each leaves about that of it
inline constexpr double left = 1e-16;      // of the fastest row: a give that is rounding
inline constexpr double broken = 1e-6;     // of the fastest row: what a row may be short of
inline constexpr double tolerated = 1e-9;  // of the fastest row: a give that need not be told
}  // namespace tolerances::impact_solver

// Read by several parts
inline constexpr std::size_t few_rows = 24;     // blocks: so many are solved directly at little cost
inline constexpr std::size_t few_jointed = 64;  // the same where joints are left unsettled

// contact_judge.cpp
namespace tolerances::contact_judge {
inline constexpr double sunk = 0.02;  // of the smaller body's radius: an overlap that a solve has left
}

// impact_queue.cpp
namespace tolerances::impact_queue {
inline constexpr int event_bodies = 8;  // larger islands that something holds keep to the step's start
inline constexpr double falls = 2.0;    // of a step: what is not a ball and slower meets nothing by itself
inline constexpr double still = 1e-9;  // of where bodies may get to in the step: an approach that is rounding
}  // namespace tolerances::impact_queue

// contact_pgs.cpp
namespace tolerances::contact_pgs {
inline constexpr double too_much = 1e6;  // times the energy there is
inline constexpr double focus = 0.5;     // of the residual allowed: what changes more goes on
}  // namespace tolerances::contact_pgs

// contact_stage.cpp
namespace tolerances::contact_stage {
inline constexpr std::size_t not_too_large = 500;  // row blocks: solved directly after a run-away
inline constexpr int late_rounds = 64;             // of solves: each sets others in motion
inline constexpr double falls =
    2.0;  // of a step, of both bodies: slower approaches are no impacts that rebound
}  // namespace tolerances::contact_stage

// contact_turning.cpp
namespace tolerances::contact_turning {
inline constexpr double deep = 2e-3;       // of the larger body's radius: what curved paths may overlap
inline constexpr double same_place = 0.1;  // of it: points of one feature
inline constexpr double same_direction_cosine = 0.95;  // cosine of their normals
}  // namespace tolerances::contact_turning

// friction_direct.cpp
namespace tolerances::friction_direct {
inline constexpr double settled = 1e-10;  // of the largest normal impulse
inline constexpr double exact = 1e-12;    // the same: an answer that another round would not better
inline constexpr double falling = 0.1;    // of the residual before: worth another round
inline constexpr double loosest = 1e-6;   // the same, after 25 rounds
inline constexpr double direction_hysteresis =
    0.01;                                      // of a stuck point to leave the direction it was turned to
inline constexpr std::size_t few_blocks = 24;  // pivoting shares their loads evenly at little cost
inline constexpr int plain_rounds = 3;         // most systems settle within these
inline constexpr double poor = 1e-4;           // a residual, of the speeds: beyond it another way is tried
inline constexpr double fair = 1e-10;          // one that is an answer
inline constexpr double near = 1e-6, redundant_near = 3e-5;     // residuals, of the speeds: answers
inline constexpr int pgs_turns = 1, iterations_per_turn = 100;  // where Newton's path ends without an answer
}  // namespace tolerances::friction_direct

// jointed_friction.cpp
namespace tolerances::jointed_friction {
// Beside joints Newton's method, which takes a factor of all bodies an iteration, comes first from so many points on, redundant ones,
// if there is one in so many bodies; and follows no convex part then.
inline constexpr std::size_t many_points = 16, bodies_a_point = 2;
inline constexpr std::size_t few_points = 9;  // below, a turn costs little: only a fair answer ends them
// Beside joints: iterations, four times as many each turn, and paths of the convex part where points are few.
inline constexpr int joint_turns = 3, first_iterations = 8, max_frozen = 8;
inline constexpr double turning_near =
    1e-7;  // with friction of turning: an answer of Newton's method on the whole
}  // namespace tolerances::jointed_friction

// impact_search.cpp
namespace tolerances::impact_search {
inline constexpr double same_side = 1.0 - 1e-9;  // cosine of normals
inline constexpr double other_side = 0.5;        // the same
inline constexpr double most_met = 0.1;          // of the open pairs: more are not kept in the list
}  // namespace tolerances::impact_search

// internal_edges.cpp
namespace tolerances::internal_edges {
inline constexpr double flush = 10.0;  // of the overlap at which pairs are met: less stands out of no face
inline constexpr double same_face_cosine = 0.9;  // cosine of normals: what both lie on
inline constexpr std::size_t max_earlier = 8;    // of the meetings of a body, that may occlude later ones
inline constexpr double simultaneous = 0.05;     // of a step: which of two meetings comes first is not known
inline constexpr double same_direction_cosine = 1.0 - 1e-12;  // the same of one face met twice
inline constexpr double side_cosine = 0.5;                    // of the normal of a meeting with what holds
}  // namespace tolerances::internal_edges

// overlap_search.cpp
namespace tolerances::overlap_search {
inline constexpr double search_factor = 4.0;  // of the deepest overlap: gaps that the projection may close
inline constexpr double min_separation_to_propagate =
    1e-9;  // of the smaller body's radius: less pushes no other
inline constexpr double min_separation_to_propagate_pgs = 5e-4;  // the same for PGS, whose rows cost more
inline constexpr std::size_t max_neighbours = 32;  // of a ring of bodies: else the next step tells
inline constexpr int max_hops = 4;                 // of neighbours that the projection sees
}  // namespace tolerances::overlap_search

// pgs_schedule.cpp
namespace tolerances::pgs_schedule {
inline constexpr double few_late = 0.1;  // of all items: so many get levels of their own
}

// pgs_solver.cpp
namespace tolerances::pgs_solver {
inline constexpr int late_rounds = 3;            // of iterations for contacts found after the last one
inline constexpr double skip_cost = 1.0 / 16.0;  // of what iterating a contact costs: to see that it is cold
inline constexpr double residual_cost = 0.5;     // the same: to see how far off it is
inline constexpr std::size_t bodies_ahead = 6, contacts_ahead = 12;  // asked for while others are updated
inline constexpr double few_off = 1.0 / 16.0;  // of contacts that are further off than is cared for
inline constexpr double nearly = 0.9;          // of what is allowed: then they care for what is that far off
inline constexpr double few_left = 0.75;       // of the contacts in the list: a shorter one is made
inline constexpr int plain_iterations = 2;     // the last ones, which are not over-relaxed
}  // namespace tolerances::pgs_solver

// pivot_solver.cpp
namespace tolerances::pivot_solver {
inline constexpr int backoff = 5;       // rounds without fewer offenders before Murty's rule
inline constexpr int max_restarts = 7;  // then Murty's rule
inline constexpr int short_search = 4;  // rounds: too few for more offenders at its start than these
inline constexpr int few_offenders = 4, offending_share = 25;  // and one row in so many
inline constexpr double tightest = 1e-11;      // tolerance of a velocity, relative to the system's scale
inline constexpr double loosest = 1e-7;        // where contradicting rigid contacts leave no exact answer
inline constexpr std::size_t kept_graphs = 3;  // beside the one in use: of the last solves
inline constexpr std::size_t most_kept_rows = 256;  // blocks: larger systems hardly come back
}  // namespace tolerances::pivot_solver

// position_projection.cpp
namespace tolerances::position_projection {
inline constexpr double contact_compliance_share = 1e-3;  // of 1/m of all that is jointed to it
inline constexpr double joint_compliance_share = 1e-6;    // and a joint, of its row's own inertia
inline constexpr double joint_share = 1e-3;               // and of what the contacts do
inline constexpr double min_joint_compliance =
    1e-12;                                       // of its row's own inertia: repeated joints share by it
inline constexpr double parted = 0.01;           // of the slack: what a projection leaves is rounding
inline constexpr double over_relaxation = 1.25;  // of PGS that separates balls, not boxes
inline constexpr double same_place = 0.1;        // of the larger body's radius: one point, seen again
inline constexpr double least_parted = 0.1;      // of what a first overlap was to part: less is none
inline constexpr double still_jammed = 0.9;      // of its depth when it did not: less is another place
}  // namespace tolerances::position_projection

// reduced_contacts.cpp
namespace tolerances::reduced_contacts {
inline constexpr int sharing_iterations = 30;     // over pairs of bodies with new points
inline constexpr double exact = 1e-14;            // a residual, of the speeds in the system: rounding
inline constexpr double good = 1e-11;             // one that is an answer
inline constexpr int rounds = 3;                  // of iterations and Newton's method
inline constexpr double held = 1e-10;             // of what a row moves without joints: joints hold it
inline constexpr int passes = 3;                  // measured anew with the true equations
inline constexpr double floor_of_pivots = 1e-12;  // of the largest: smaller ones are redundant rows
inline constexpr int refinements_of_floored = 2;  // what the factor lacks there is found against the matrix
}  // namespace tolerances::reduced_contacts

// reduced_newton.cpp
namespace tolerances::reduced_newton {
inline constexpr int polish_steps = 24;  // of Newton, at most
inline constexpr int many_rows = 100;    // from which on a step is dear:
inline constexpr int patience = 8;       //   so many without half the best residual end it
// Of a row's own entry of W, in Newton's matrix only: a part of what is left, of the speeds, so that steps stay short where points
// are redundant (Levenberg, Marquardt); in turn the least, since systems that hardly move ask for large impulses.
inline constexpr double relief = 1e-9, most_relief = 1e-3, relief_share = 0.1;
}  // namespace tolerances::reduced_newton

// solve_by_pgs.cpp
namespace tolerances::solve_by_pgs {
inline constexpr int most_turns = 16;              // times `iterations`, where a step would be unsettled
inline constexpr int joint_turns = 4;              // the same where a joint is furthest off
inline constexpr int warm_start_iterations = 100;  // at most, before points found late are solved for
inline constexpr double warm_started = 1e-6;       // of the speeds: what changes less is
inline constexpr std::size_t few_points = 100;     // of an island: solved for again at less cost
inline constexpr int many_rounds = 8;              //   unless that has been done so often
}  // namespace tolerances::solve_by_pgs

// step_motion.cpp
namespace tolerances::step_motion {
inline constexpr double furthest_mean = 3.0;  // rad: what tumbles further in a step has no mean turn
}  // namespace tolerances::step_motion

// supported_bodies.cpp
namespace tolerances::supported_bodies {
inline constexpr double pressed_by = 1e-9;  // of a kick: what presses less does not
inline constexpr double level = 1e-6;       // of a kick, or a speed: a part along the forces that is none
}  // namespace tolerances::supported_bodies

}  // namespace spook
