#include "rigid/rigid_stages.hpp"

#include <algorithm>
#include <string>

#include "collision/detection.hpp"
#include "rigid/joint_set.hpp"

namespace spook {

namespace {

/// What the choice of a stage depends on.
struct Facts {
    const RigidScene& scene;
    bool observing = false;
    bool joints = false, bounded = false, limited = false, contacts = false, rubbing = false,
         oriented = false, conveying = false, rolling = false, turning = false, moving = false,
         loaded = false, meshes = false;
    std::string no_contact;  // why there is none

    const RigidMethod& method() const noexcept { return scene.method; }
    bool composed() const noexcept { return method().composition > 2; }
    bool rows() const noexcept { return joints || contacts; }
    bool iterative() const noexcept { return rows() && method().solver == SolverKind::iterative; }
    bool direct() const noexcept { return method().solver != SolverKind::iterative; }
    template <class Is> bool any_joint(Is is) const {
        return std::any_of(scene.joints.begin(), scene.joints.end(), is);
    }
    bool has(JointKind kind) const {
        return any_joint([kind](const JointSpec& joint) { return joint.kind == kind; });
    }
    /// Why no two surfaces rub.
    std::string smooth() const { return contacts ? "no two surfaces have friction" : no_contact; }
};

void look_at_bodies(const RigidScene& scene, Facts& facts) {
    std::vector<char> dynamic, surface(scene.bodies.size(), 0);
    for (const Collider& collider : scene.colliders) {
        surface[collider.body] = 1;
        facts.meshes |= collider.shape.kind == ShapeKind::triangle;
    }
    int with_surface = 0, rubbing = 0;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const RigidBodySpec& body = scene.bodies[i];
        dynamic.push_back(body.motion == Motion::dynamic);
        facts.moving |= body.motion != Motion::fixed;
        facts.turning |= !body.particle && body.motion != Motion::fixed;
        facts.loaded |= !is_zero(body.force) || !is_zero(body.torque);
        if (surface[i] == 0) continue;
        ++with_surface;
        rubbing += body.material.friction > 0.0;
        facts.oriented |= body.material.is_oriented();
        facts.conveying |= !is_zero(body.material.surface_velocity);
        facts.rolling |= body.material.resists_turning();
    }
    facts.contacts = Detection(scene.colliders, dynamic, scene.no_contact).possible();
    bool rubs = rubbing >= 2;
    for (const PairFriction& pair : scene.pair_frictions) {
        rubs |= pair.friction > 0.0;
        facts.rolling |= pair.resists_turning();
    }
    facts.rubbing = facts.contacts && rubs;
    facts.no_contact = !scene.contacts    ? "the scene switches contacts off"
                       : with_surface < 2 ? "fewer than two bodies have a surface"
                                          : "every pair of surfaces is tied, excluded or cannot move";
}

Facts facts_of(const RigidScene& scene, bool observing) {
    Facts facts{.scene = scene, .observing = observing, .no_contact = {}};
    look_at_bodies(scene, facts);
    facts.loaded |= scene.loads_change;
    facts.joints = !scene.joints.empty();
    facts.bounded = facts.any_joint([](const JointSpec& joint) { return can_let_go(joint); });
    facts.limited = facts.any_joint([](const JointSpec& joint) {
        return joint.one_sided || (joint.limit && joint.limit->lower < joint.limit->upper);
    });
    facts.oriented &= facts.rubbing;
    facts.conveying &= facts.rubbing;
    facts.rolling &= facts.contacts;
    return facts;
}

std::string none_for_rows(const Facts&) { return "no joints and no contacts, so nothing to solve"; }
std::string no_contact(const Facts& is) { return is.no_contact; }
std::string smooth(const Facts& is) { return is.smooth(); }
/// `words` where the scene has joints, rows or surfaces that meet; else that it has none.
std::string of_joints(const Facts& is, const char* words) { return is.joints ? words : none_for_rows(is); }
std::string of_rows(const Facts& is, const char* words) { return is.rows() ? words : none_for_rows(is); }
std::string of_contacts(const Facts& is, const char* words) { return is.contacts ? words : is.no_contact; }
constexpr const char *forced = "forced by the method", *iterates = "the method asks for the iterative solver",
                     *not_asked = "the method does not ask for it", *no_wires = "there are no wires";

bool breaks(const JointSpec& joint) { return can_break(joint); }
bool meets_friction(const JointSpec& joint) { return rubs(joint); }
bool follows_load(const JointSpec& joint) {
    return joint.load_friction[0] > 0.0 || joint.load_friction[1] > 0.0;
}
bool is_wound(const JointSpec& joint) { return joint.kind == JointKind::wire && !joint.terms.empty(); }

constexpr StageTable<Facts> TABLE{{
    {Stage::collision, [](const Facts& is) { return is.contacts || is.method().force_collision; },
     [](const Facts& is) -> std::string { return is.contacts ? "surfaces may touch" : forced; }, no_contact},
    {Stage::meet_meshes, [](const Facts& is) { return is.contacts && is.meshes; },
     "surfaces meet triangles: of their edges only what sticks out",
     [](const Facts& is) { return of_contacts(is, "no surface is a mesh or a height field"); }},
    {Stage::apply_gravity, [](const Facts& is) { return !is_zero(is.scene.gravity); }, "uniform gravity acts",
     "gravity is zero"},
    {Stage::apply_central_gravity, [](const Facts& is) { return !is.scene.fields.empty(); },
     "a centre attracts every body", "there is no central gravity"},
    {Stage::apply_springs, [](const Facts& is) { return !is.scene.springs.empty(); },
     "springs pull as plain forces", "there are no springs"},
    {Stage::apply_loads, [](const Facts& is) { return is.loaded; },
     [](const Facts& is) -> std::string {
         return is.scene.loads_change ? "loads may be set while it runs, one kick with gravity"
                                      : "constant loads act, one kick with gravity";
     },
     "there are no loads"},
    {Stage::follow_time, [](const Facts& is) { return !is.scene.drives.empty(); },
     "loads or drives are functions of time", "nothing is given as a function of time"},
    {Stage::apply_fluids,
     [](const Facts& is) { return !is.scene.fluids.empty() && !is.scene.floaters.empty(); },
     "bodies displace fluid: buoyancy and drag of what is submerged",
     [](const Facts& is) -> std::string {
         return is.scene.fluids.empty() ? "there is no fluid" : "no moving body has a surface";
     }},
    {Stage::impact, [](const Facts& is) { return is.contacts; }, "surfaces that meet exchange impulses first",
     no_contact},
    {Stage::string_stiffness, [](const Facts& is) { return is.method().string_stiffness && is.joints; },
     "the method treats the geometric stiffness of loaded joints implicitly",
     [](const Facts& is) { return of_joints(is, not_asked); }},
    {Stage::assemble_rows, [](const Facts& is) { return is.rows(); },
     [](const Facts& is) -> std::string {
         if (!is.contacts) return "joints give rows";
         return is.joints ? "joints and contacts give rows" : "contacts give rows";
     },
     none_for_rows},
    {Stage::couple_joints, [](const Facts& is) { return is.has(JointKind::relation); },
     "relations tie the coordinates of joints: a row each", "there are no relations between joints"},
    {Stage::hold_wires, [](const Facts& is) { return is.has(JointKind::wire); },
     "wires keep their length: a row each", no_wires},
    {Stage::wind_wires, [](const Facts& is) { return is.any_joint(is_wound); },
     "drums wind wires in and out: their hinges are in the wires' rows",
     [](const Facts& is) -> std::string {
         return is.has(JointKind::wire) ? "no wire is wound on a drum" : no_wires;
     }},
    {Stage::tangents, [](const Facts& is) { return is.rubbing; }, "friction needs two directions per contact",
     smooth},
    {Stage::solve_path, "rigid bodies couple in blocks"},
    {Stage::solve_block, [](const Facts& is) { return is.direct() && is.joints && !is.bounded; },
     "joints are bilateral",
     [](const Facts& is) -> std::string {
         if (is.iterative()) return iterates;
         return is.joints ? "some joint row has a bound" : "there are no joints";
     }},
    {Stage::solve_iterative, [](const Facts& is) { return is.iterative(); },
     "the method asks for projected Gauss–Seidel",
     [](const Facts& is) { return of_rows(is, "the method asks for a direct solver"); }},
    {Stage::pivot, [](const Facts& is) { return is.direct() && (is.contacts || (is.joints && is.bounded)); },
     [](const Facts& is) -> std::string {
         return is.contacts ? "contacts can let go"
                            : "a limit, a bounded motor, a wire, friction or a joint that breaks can let go";
     },
     [](const Facts& is) -> std::string {
         return is.iterative() ? iterates : of_joints(is, "all rows are bilateral: no row can let go");
     }},
    {Stage::friction, [](const Facts& is) { return is.rubbing; },
     [](const Facts& is) { return "surfaces rub: " + to_text(is.method().friction) + " model"; }, smooth},
    {Stage::orient_friction, [](const Facts& is) { return is.oriented; },
     "a surface has another friction along it than across",
     [](const Facts& is) {
         return is.rubbing ? "every surface has the same friction in all directions" : is.smooth();
     }},
    {Stage::move_surfaces, [](const Facts& is) { return is.conveying; },
     "a surface moves along itself and takes along what rubs on it",
     [](const Facts& is) { return is.rubbing ? "no surface moves along itself" : is.smooth(); }},
    {Stage::roll, [](const Facts& is) { return is.rolling; }, "rolling or turning on the spot meets friction",
     [](const Facts& is) { return of_contacts(is, "no surface resists rolling or turning"); }},
    {Stage::rub_wires, [](const Facts& is) { return is.has(JointKind::eye); },
     "wires rub where they bend: bounds follow their pull until both agree", "no wire has friction"},
    {Stage::roll_tyres, [](const Facts& is) { return is.has(JointKind::tyre); },
     "tyres slip: bounds follow their load until both agree", "there are no tyres"},
    {Stage::rub_joints, [](const Facts& is) { return is.any_joint(meets_friction); },
     [](const Facts& is) -> std::string {
         return is.any_joint(follows_load) ? "joints rub: bounds follow their load until both agree"
                                           : "joints rub: a row with bounds for each";
     },
     [](const Facts& is) -> std::string {
         return is.joints ? "no joint has friction" : "there are no joints";
     }},
    {Stage::break_joints, [](const Facts& is) { return is.any_joint(breaks); },
     "what joints carry is compared with their strength after each solve",
     [](const Facts& is) -> std::string {
         return is.joints ? "no joint has a strength" : "there are no joints";
     }},
    {Stage::correct_curvature,
     [](const Facts& is) { return is.joints && (is.composed() || is.method().corrections > 0); },
     [](const Facts& is) {
         return is.composed() ? "a step ends on its joints, to rounding"
                              : std::to_string(is.method().corrections) +
                                    " extra back-substitutions keep the curvature of the rows";
     },
     [](const Facts& is) -> std::string {
         return !is.joints ? "no joints, so nothing is curved"
                : is.method().linear_turns
                    ? "rows are linear in the turn, so that what spins off its joint slows down; "
                      "turns=\"followed\" and corrections=2 keep its energy to a third of a radian a step, order4 beyond"
                    : "where bodies that something holds, or that are locked into one, turn far in a step, joints "
                      "follow the bend of the way; what spins askew by more than a third of a radian a step, chains "
                      "that float and loops lose energy: composition=\"order4\" keeps it";
     }},
    {Stage::half_step, [](const Facts& is) { return is.composed() || is.method().half_step_velocities; },
     [](const Facts& is) {
         return is.method().runge_kutta
                    ? "a Runge-Kutta of order 8 in joint coordinates, and velocities at whole steps"
                : is.composed() ? "a symmetric composition of half-step steps, order " +
                                      std::to_string(is.method().composition)
                                : "velocities live at mid-step: half-kick start, mid-step read-out";
     },
     "velocities live at whole steps"},
    {Stage::integrate_positions, [](const Facts& is) { return is.moving; }, "bodies can move",
     "nothing can move"},
    {Stage::integrate_rotations, [](const Facts& is) { return is.turning || is.method().force_rotation; },
     [](const Facts& is) -> std::string { return is.turning ? "rigid bodies can turn" : forced; },
     "no rigid body can turn"},
    {Stage::project_positions, [](const Facts& is) { return is.contacts || is.limited; },
     [](const Facts& is) -> std::string {
         return is.contacts ? "overlaps go by positions and leave no trace in velocities"
                            : "limits that are passed where the scene begins come back by positions";
     },
     [](const Facts& is) {
         return is.joints ? "nothing can overlap, and no joint has a limit" : is.no_contact;
     }},
    {Stage::sleep, [](const Facts& is) { return is.contacts && is.method().sleep_speed > 0.0; },
     "islands at rest are left out of the steps until something comes to them",
     [](const Facts& is) { return of_contacts(is, not_asked); }},
    {Stage::observe, [](const Facts& is) { return is.observing; }, "observables are reduced inside the loop",
     "nothing is read while the loop runs"},
}};
static_assert(is_in_order(TABLE));

}  // namespace

StageChoices choose_stages(const RigidScene& scene, bool observing) {
    return choose_by(TABLE, facts_of(scene, observing));
}

}  // namespace spook
