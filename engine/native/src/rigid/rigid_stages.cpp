#include "rigid/rigid_stages.hpp"

#include <algorithm>
#include <string>

#include "rigid/rigid_system.hpp"

namespace spook {

namespace {

/// What the choice of a stage depends on.
struct Facts {
    bool joints, bounded, limited, contacts, rubbing, oriented, conveying, rolling, iterative, turning,
        moving, loaded;
    int with_surface = 0;
};

Facts facts_of(const RigidScene& scene) {
    Facts facts{};
    std::vector<char> dynamic, surface(scene.bodies.size(), 0);
    for (const Collider& collider : scene.colliders) surface[collider.body] = 1;
    int rubbing = 0;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const RigidBodySpec& body = scene.bodies[i];
        dynamic.push_back(body.motion == Motion::dynamic);
        facts.with_surface += surface[i];
        rubbing += surface[i] && body.material.friction > 0.0;
        facts.oriented = facts.oriented || (surface[i] && body.material.is_oriented());
        facts.conveying = facts.conveying || (surface[i] && !is_zero(body.material.surface_velocity));
        facts.rolling = facts.rolling || (surface[i] && body.material.resists_turning());
        facts.moving = facts.moving || body.motion != Motion::fixed;
        facts.turning = facts.turning || (!body.particle && body.motion != Motion::fixed);
        facts.loaded = facts.loaded || !is_zero(body.force) || !is_zero(body.torque);
    }
    facts.loaded = facts.loaded || scene.loads_change;
    facts.joints = !scene.joints.empty();
    facts.bounded = std::any_of(scene.joints.begin(), scene.joints.end(),
                                [](const JointSpec& joint) { return can_let_go(joint); });
    facts.limited = std::any_of(scene.joints.begin(), scene.joints.end(), [](const JointSpec& joint) {
        return joint.one_sided || (joint.limit && joint.limit->lower < joint.limit->upper);
    });
    facts.contacts = Detection(scene.colliders, dynamic, scene.no_contact).possible();
    facts.rubbing = facts.contacts && rubbing >= 2;
    facts.oriented = facts.rubbing && facts.oriented;
    facts.conveying = facts.rubbing && facts.conveying;
    facts.rolling = facts.contacts && facts.rolling;
    facts.iterative = scene.method.solver == SolverKind::iterative && (facts.joints || facts.contacts);
    return facts;
}

}  // namespace

StageChoices choose_stages(const RigidScene& scene, bool observing) {
    const Facts is = facts_of(scene);
    const RigidMethod& method = scene.method;
    const bool composed = method.composition > 2;
    const bool rows = is.joints || is.contacts, direct = method.solver != SolverKind::iterative;
    const bool pivots = direct && (is.contacts || (is.joints && is.bounded));
    const std::string no_rows = "no joints and no contacts, so nothing to solve";
    const std::string forced = "forced by the method";
    const std::string asks_iterative = "the method asks for the iterative solver";
    const std::string no_contact = !scene.contacts ? "the scene switches contacts off"
                                   : is.with_surface < 2
                                       ? "fewer than two bodies have a surface"
                                       : "every pair of surfaces is tied, excluded or cannot move";
    const auto any_joint = [&scene](auto is_one) {
        return std::any_of(scene.joints.begin(), scene.joints.end(), is_one);
    };
    const auto has = [&any_joint](JointKind kind) {
        return any_joint([kind](const JointSpec& joint) { return joint.kind == kind; });
    };
    const bool wound = any_joint(
        [](const JointSpec& joint) { return joint.kind == JointKind::wire && !joint.terms.empty(); });
    const bool meshes =
        std::any_of(scene.colliders.begin(), scene.colliders.end(),
                    [](const Collider& collider) { return collider.shape.kind == ShapeKind::triangle; });
    const std::string smooth = is.contacts ? "no two surfaces have friction" : no_contact;
    return choose_each([&](Stage stage) -> StageChoice {
        switch (stage) {
            case Stage::collision:
                return choose_if(is.contacts || method.force_collision,
                                 is.contacts ? "surfaces may touch" : forced, no_contact);
            case Stage::apply_gravity:
                return choose_if(!is_zero(scene.gravity), "uniform gravity acts", "gravity is zero");
            case Stage::apply_central_gravity:
                return choose_if(!scene.fields.empty(), "a centre attracts every body",
                                 "there is no central gravity");
            case Stage::apply_springs:
                return choose_if(!scene.springs.empty(), "springs pull as plain forces",
                                 "there are no springs");
            case Stage::apply_loads:
                return choose_if(is.loaded,
                                 scene.loads_change ? "loads may be set while it runs, one kick with gravity"
                                                    : "constant loads act, one kick with gravity",
                                 "there are no loads");
            case Stage::follow_time:
                return choose_if(!scene.drives.empty(), "loads or drives are functions of time",
                                 "nothing is given as a function of time");
            case Stage::apply_fluids:
                return choose_if(!scene.fluids.empty() && !scene.floaters.empty(),
                                 "bodies displace fluid: buoyancy and drag of what is submerged",
                                 scene.fluids.empty() ? "there is no fluid" : "no moving body has a surface");
            case Stage::impact:
                return choose_if(is.contacts, "surfaces that meet exchange impulses first", no_contact);
            case Stage::assemble_rows:
                return choose_if(rows,
                                 !is.contacts ? "joints give rows"
                                 : is.joints  ? "joints and contacts give rows"
                                              : "contacts give rows",
                                 no_rows);
            case Stage::meet_meshes:
                return choose_if(is.contacts && meshes,
                                 "surfaces meet triangles: of their edges only what sticks out",
                                 is.contacts ? "no surface is a mesh or a height field" : no_contact);
            case Stage::couple_joints:
                return choose_if(has(JointKind::relation),
                                 "relations tie the coordinates of joints: a row each",
                                 "there are no relations between joints");
            case Stage::hold_wires:
                return choose_if(has(JointKind::wire), "wires keep their length: a row each",
                                 "there are no wires");
            case Stage::wind_wires:
                return choose_if(wound, "drums wind wires in and out: their hinges are in the wires' rows",
                                 has(JointKind::wire) ? "no wire is wound on a drum" : "there are no wires");
            case Stage::rub_joints:
                return choose_if(any_joint([](const JointSpec& joint) { return rubs(joint); }),
                                 any_joint([](const JointSpec& joint) {
                                     return joint.load_friction[0] > 0.0 || joint.load_friction[1] > 0.0;
                                 })
                                     ? "joints rub: bounds follow their load until both agree"
                                     : "joints rub: a row with bounds for each",
                                 is.joints ? "no joint has friction" : "there are no joints");
            case Stage::break_joints:
                return choose_if(any_joint([](const JointSpec& joint) { return can_break(joint); }),
                                 "what joints carry is compared with their strength after each solve",
                                 is.joints ? "no joint has a strength" : "there are no joints");
            case Stage::tangents:
                return choose_if(is.rubbing, "friction needs two directions per contact", smooth);
            case Stage::solve_path: return leave_out("rigid bodies couple in blocks");
            case Stage::solve_block:
                return choose_if(direct && is.joints && !is.bounded,
                                 std::string("joints are bilateral: one sparse LDLᵀ per step, ordered once") +
                                     (is.contacts ? " (while nothing touches)" : ""),
                                 is.iterative ? asks_iterative
                                 : is.joints  ? "some joint row has a bound"
                                              : "there are no joints");
            case Stage::solve_iterative:
                return choose_if(is.iterative, "the method asks for projected Gauss–Seidel",
                                 rows ? "the method asks for a direct solver" : no_rows);
            case Stage::pivot:
                return choose_if(
                    pivots,
                    is.contacts ? "contacts can let go"
                                : "a limit, a bounded motor, a wire, friction or a joint that breaks can "
                                  "let go",
                    is.iterative ? asks_iterative
                    : is.joints  ? "all rows are bilateral: no row can let go"
                                 : no_rows);
            case Stage::friction:
                return choose_if(is.rubbing, "surfaces rub: " + to_text(method.friction) + " model", smooth);
            case Stage::orient_friction:
                return choose_if(
                    is.oriented, "a surface has another friction along it than across",
                    is.rubbing ? "every surface has the same friction in all directions" : smooth);
            case Stage::move_surfaces:
                return choose_if(is.conveying, "a surface moves along itself and takes along what rubs on it",
                                 is.rubbing ? "no surface moves along itself" : smooth);
            case Stage::roll:
                return choose_if(is.rolling, "rolling or turning on the spot meets friction",
                                 is.contacts ? "no surface resists rolling or turning" : no_contact);
            case Stage::rub_wires:
                return choose_if(has(JointKind::eye),
                                 "wires rub where they bend: bounds follow their pull until both agree",
                                 "no wire has friction");
            case Stage::roll_tyres:
                return choose_if(has(JointKind::tyre),
                                 "tyres slip: bounds follow their load until both agree",
                                 "there are no tyres");
            case Stage::string_stiffness:
                return choose_if(method.string_stiffness && is.joints,
                                 "the method treats the geometric stiffness of loaded joints implicitly",
                                 is.joints ? "the method does not ask for it" : no_rows);
            case Stage::correct_curvature:
                return choose_if(
                    is.joints && (composed || method.corrections > 0),
                    composed ? "iteration keeps the curvature of the rows to rounding"
                             : std::to_string(method.corrections) +
                                   " extra back-substitutions keep the curvature of the rows",
                    is.joints
                        ? "the method linearises the rows, so that what spins off its joint slows down; "
                          "corrections=2 keep its energy"
                        : "no joints, so nothing is curved");
            case Stage::half_step:
                return choose_if(composed || method.half_step_velocities,
                                 composed ? "a symmetric composition of half-step steps, order" +
                                                std::to_string(method.composition)
                                          : "velocities live at mid-step: half-kick start, mid-step read-out",
                                 "velocities live at whole steps");
            case Stage::integrate_positions:
                return choose_if(is.moving, "bodies can move", "nothing can move");
            case Stage::integrate_rotations:
                return choose_if(is.turning || method.force_rotation,
                                 is.turning ? "rigid bodies can turn" : forced, "no rigid body can turn");
            case Stage::project_positions:
                return choose_if(is.contacts || is.limited,
                                 is.contacts
                                     ? "overlaps go by positions and leave no trace in velocities"
                                     : "limits that are passed where the scene begins come back by positions",
                                 is.joints ? "nothing can overlap, and no joint has a limit" : no_contact);
            case Stage::sleep:
                return choose_if(is.contacts && method.sleep_speed > 0.0,
                                 "islands at rest are left out of the steps until something comes to them",
                                 is.contacts ? "the method does not ask for it" : no_contact);
            case Stage::observe:
                return choose_if(observing, "observables are reduced inside the loop",
                                 "nothing is read while the loop runs");
        }
        return {};
    });
}

void RigidSystem::tell(StageChoices& choices) const {
    std::string& solve = choices[static_cast<std::size_t>(Stage::solve_block)].reason;
    if (bilateral_.by_links())
        solve = std::string("locks make trees: solved link by link, leaves first, without a matrix") +
                (mixed_.contacts() ? " (while nothing touches)" : "");
    if (plane_.is_used())
        solve = std::string("the mechanism lies in the plane across ") + "xyz"[plane_.step().normal()] +
                ": " + std::to_string(plane_.step().rows()) + " rows of that plane, factored in an envelope";
    if (!composition_.in_tree()) return;
    const JointTree& tree = composition_.tree();
    solve = "joints make trees: " + std::to_string(tree.coordinates()) + " joint coordinates, " +
            std::to_string(tree.rows()) + " rows to close loops, by Newton's method in a band";
    if (tree.across() >= 0) solve += std::string(", in the plane across ") + "xyz"[tree.across()];
    if (tree.pivots()) solve = "bodies on balls of the world: each turns about its own as a free body does";
    choices[static_cast<std::size_t>(Stage::correct_curvature)].reason =
        "joint coordinates keep the joints by construction";
    choices[static_cast<std::size_t>(Stage::assemble_rows)].reason =
        "all rows only where joint coordinates find no step, and for what is read";
}

}  // namespace spook
