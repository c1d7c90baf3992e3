// By which solver the rows of a scene are solved. The first of the table that takes the scene runs; contacts, where bodies touch, go
// to MixedRows beside it. A run that is placed elsewhere than the scene begins may still find that joint coordinates, or a plane, do
// not hold there (RigidComposition::begin(), PlanePath::begin()): then it is composed, or factored.
#include "rigid/solver_table.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

namespace spook {

namespace {

constexpr Refusal not_asked = "";  // the method, or the kind of rows, asks for another one

struct SolverRule {
    Solver solver;
    Refusal (*refuses)(const SolverParts&);  // null: takes the scene, and is ready for it
    std::string (*why)(const SolverParts&);  // of solve_block, after its reason to be kept
    const char *rows = "", *curvature = "";  // of assemble_rows and of correct_curvature, the same
};

std::string no_words(const SolverParts&) { return ""; }

Refusal refuses_runge_kutta(const SolverParts& parts) {
    if (!parts.model.method.runge_kutta) return not_asked;
    if (parts.runge_kutta.take()) return nullptr;
    throw std::invalid_argument(
        "method: runge_kutta needs joints that make trees; those that slide and turn are to name first what carries them");
}

Refusal refuses_links(const SolverParts& parts) {
    const RigidMethod& method = parts.model.method;
    if (parts.model.half_step || parts.model.stiff || method.corrections > 0 || method.sleep_speed > 0.0)
        return "the method asks for more than plain steps";
    return parts.bilateral.take_links();
}

/// Nothing of the scene but its joints, steady forces and steps of the plain kind may bear on the bodies.
Refusal refuses_plane(const SolverParts& parts) {
    const RigidModel& model = parts.model;
    if (model.stiff || model.method.force_block) return "the method asks for other rows";
    if (parts.mixed.surfaces()) return "surfaces may touch";
    if (!parts.forces.act_steadily() || parts.scene.loads_change) return "forces are not steady";
    if (!model.free.empty() || !model.driven.empty()) return "some body has no rows";
    return parts.plane.take();
}

std::string of_joint_tree(const SolverParts& parts) {
    const JointTree& tree = parts.composition.tree();
    if (tree.pivots())
        return "bodies on balls of the world, each of which turns about its own as a free body does";
    std::string words = "trees of " + std::to_string(tree.coordinates()) + " joint coordinates, " +
                        std::to_string(tree.rows()) + " rows to close loops, by Newton's method in a band";
    if (tree.across() >= 0) words += std::string(", in the plane across ") + "xyz"[tree.across()];
    return words;
}

constexpr const char* by_construction = "joint coordinates keep the joints by construction";

constexpr std::array TABLE{
    SolverRule{Solver::runge_kutta, refuses_runge_kutta,
               [](const SolverParts& parts) {
                   return "trees of " + std::to_string(parts.runge_kutta.coordinates()) +
                          " joint coordinates, accelerated by articulated bodies";
               },
               "for what is read", by_construction},
    SolverRule{Solver::joint_tree,
               [](const SolverParts& parts) {
                   return parts.model.composed && parts.model.bilateral ? parts.composition.take()
                                                                        : not_asked;
               },
               of_joint_tree, "where joint coordinates find no step, and for what is read", by_construction},
    SolverRule{Solver::composed,
               [](const SolverParts& parts) { return parts.model.composed ? nullptr : not_asked; },
               [](const SolverParts&) -> std::string {
                   return "the impulses that end each stage on its rows, by Newton's method";
               }},
    SolverRule{Solver::none,
               [](const SolverParts& parts) { return parts.scene.joints.empty() ? nullptr : not_asked; },
               no_words},
    SolverRule{Solver::iterative,
               [](const SolverParts& parts) {
                   return parts.model.stages.runs(Stage::solve_iterative) ? nullptr : not_asked;
               },
               no_words},
    SolverRule{Solver::pivot,
               [](const SolverParts& parts) { return parts.model.bilateral ? not_asked : nullptr; },
               no_words},
    SolverRule{Solver::links, refuses_links,
               [](const SolverParts&) -> std::string {
                   return "trees of locks, solved link by link, leaves first, without a matrix";
               }},
    SolverRule{Solver::plane, refuses_plane,
               [](const SolverParts& parts) {
                   const PlaneStep& step = parts.plane.step();
                   return std::string("in the plane across ") + "xyz"[step.normal()] + ", " +
                          std::to_string(step.rows()) + " rows of it, factored in an envelope";
               }},
    SolverRule{Solver::factor, [](const SolverParts&) -> Refusal { return nullptr; },
               [](const SolverParts&) -> std::string { return "one sparse LDLᵀ per step, ordered once"; }},
};

}  // namespace

SolverChoice choose_solver(const SolverParts& parts) {
    std::string others;
    for (const SolverRule& rule : TABLE) {
        if (const Refusal refusal = rule.refuses(parts)) {
            if (*refusal)
                others += (others.empty() ? " (not " : "; not ") + to_text(rule.solver) + ": " + refusal;
            continue;
        }
        std::string why = rule.why(parts);
        if (parts.mixed.surfaces()) why += ", while nothing touches";
        if (!others.empty()) why += others + ")";
        return {rule.solver,
                {{Stage::solve_block, why},
                 {Stage::assemble_rows, rule.rows},
                 {Stage::correct_curvature, rule.curvature}}};
    }
    return {};
}

}  // namespace spook
