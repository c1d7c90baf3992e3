#include "particles/particle_stages.hpp"

#include <algorithm>
#include <string>

#include "particles/path_order.hpp"

namespace spook {

namespace {

/// A path between two points of the world without any compliance: stretched out straight, each of its rows says
/// what the others say. An open end, a bend or a compliance anywhere keeps the rows independent.
bool rigid_between_anchors(const ParticleScene& scene, const Path& path) {
    return path.nodes.front() < 0 && path.nodes.back() < 0 &&
           std::all_of(
               path.rows.begin(), path.rows.end(),
               [&](int row) { return scene.rows[row].compliance == 0.0; });
}

/// What the choice of a stage depends on.
struct Facts {
    const ParticleScene& scene;
    bool observing = false, loaded = false;
    std::string not_path;  // why rows are no paths; empty where they are

    const ParticleMethod& method() const noexcept { return scene.method; }
    bool composed() const noexcept { return method().composition > 2; }
    bool rows() const noexcept { return !scene.rows.empty(); }
    bool iterative() const noexcept { return rows() && method().iterative; }
    bool path() const noexcept { return not_path.empty(); }
    bool block() const noexcept { return rows() && !iterative() && !path(); }
};

constexpr const char *no_rows = "no constraints, so nothing to solve",
                     *no_contacts = "particles have no surface, so no contact is possible",
                     *iterates = "the method asks for the iterative solver",
                     *no_wire = "a wire brings rigid stages with it",
                     *no_coordinate = "particles have no joint coordinates";
std::string of_rows(const Facts& is, const char* words) { return is.rows() ? words : no_rows; }

Facts facts_of(const ParticleScene& scene, bool observing) {
    Facts facts{.scene = scene, .observing = observing, .not_path = {}};
    facts.loaded =
        scene.loads_change || std::any_of(scene.bodies.begin(), scene.bodies.end(),
                                          [](const ParticleBody& body) { return !is_zero(body.load); });
    const std::vector<Path> paths = find_paths(scene);
    if (!facts.rows()) facts.not_path = no_rows;
    else if (facts.iterative()) facts.not_path = iterates;
    else if (facts.method().force_block) facts.not_path = "solve_block was forced";
    else if (std::any_of(paths.begin(), paths.end(),
                         [&](const Path& path) { return rigid_between_anchors(scene, path); }))
        facts.not_path = "a path without compliance is held at both ends, so its rows may say the same";
    else if (facts.method().string_stiffness) facts.not_path = "string stiffness couples the bodies of a row";
    else if (paths.empty()) facts.not_path = "a body has more than two rows or a loop closes";
    return facts;
}

constexpr StageTable<Facts> TABLE{{
    {Stage::collision, no_contacts},
    {Stage::meet_meshes, "particles touch nothing"},
    {Stage::apply_gravity, [](const Facts& is) { return !is_zero(is.scene.gravity); }, "uniform gravity acts",
     "gravity is zero"},
    {Stage::apply_central_gravity, [](const Facts& is) { return !is.scene.fields.empty(); },
     "a centre attracts every body", "there is no central gravity"},
    {Stage::apply_springs, [](const Facts& is) { return !is.scene.springs.empty(); },
     "springs pull as plain forces", "there are no springs"},
    {Stage::apply_loads, [](const Facts& is) { return is.loaded; },
     [](const Facts& is) -> std::string {
         return is.scene.loads_change
                    ? "loads may be set while it runs; with gravity they are one kick"
                    : "constant loads act; with gravity they are one kick, found before the first step";
     },
     "there are no loads"},
    {Stage::follow_time, "nothing is given as a function of time"},
    {Stage::apply_fluids, "particles displace no fluid"},
    {Stage::impact, no_contacts},
    {Stage::string_stiffness, [](const Facts& is) { return is.method().string_stiffness && is.block(); },
     "the method treats the transverse stiffness of taut distances implicitly",
     [](const Facts& is) { return of_rows(is, "the method does not ask for it"); }},
    {Stage::assemble_rows, [](const Facts& is) { return is.rows(); },
     [](const Facts& is) { return std::to_string(is.scene.rows.size()) + " distance rows"; },
     "there are no constraints"},
    {Stage::couple_joints, no_coordinate},
    {Stage::hold_wires, no_wire},
    {Stage::wind_wires, "particles wind on no drum"},
    {Stage::tangents, no_contacts},
    {Stage::solve_path, [](const Facts& is) { return is.path(); },
     "no body has more than two rows and no loop closes: tridiagonal, one pass up and down",
     [](const Facts& is) { return is.not_path; }},
    {Stage::solve_block, [](const Facts& is) { return is.block(); },
     [](const Facts& is) { return is.not_path + ": sparse LDLᵀ in blocks, ordered once"; },
     [](const Facts& is) { return of_rows(is, is.path() ? "rows form open paths" : iterates); }},
    {Stage::solve_iterative, [](const Facts& is) { return is.iterative(); },
     "the method asks for projected Gauss–Seidel",
     [](const Facts& is) { return of_rows(is, "the method asks for a direct solver"); }},
    {Stage::pivot, [](const Facts& is) { return of_rows(is, "distances are bilateral: no row can let go"); }},
    {Stage::friction, no_contacts},
    {Stage::orient_friction, no_contacts},
    {Stage::move_surfaces, no_contacts},
    {Stage::roll, no_contacts},
    {Stage::rub_wires, no_wire},
    {Stage::roll_tyres, "particles have no wheels"},
    {Stage::rub_joints, no_coordinate},
    {Stage::break_joints, "distances have no strength"},
    {Stage::correct_curvature,
     [](const Facts& is) { return (is.method().corrections > 0 || is.composed()) && is.rows(); },
     [](const Facts& is) {
         return is.composed() ? "Newton's method keeps the curvature of the rows to rounding"
                              : std::to_string(is.method().corrections) +
                                    " extra back-substitutions keep the curvature of the rows";
     },
     [](const Facts& is) { return of_rows(is, "the method linearises the rows"); }},
    {Stage::half_step, [](const Facts& is) { return is.method().half_step_velocities || is.composed(); },
     [](const Facts& is) {
         return is.composed() ? "a symmetric composition of half-step steps, order " +
                                    std::to_string(is.method().composition)
                              : "velocities live at mid-step: half-kick start, mid-step read-out";
     },
     "velocities live at whole steps"},
    {Stage::integrate_positions, [](const Facts&) { return true; }, "every body can move", ""},
    {Stage::integrate_rotations, "a particle has no rotation"},
    {Stage::project_positions, no_contacts},
    {Stage::sleep, no_contacts},
    {Stage::observe, [](const Facts& is) { return is.observing; }, "observables are reduced inside the loop",
     "nothing is read while the loop runs"},
}};
static_assert(is_in_order(TABLE));

}  // namespace

StageChoices choose_stages(const ParticleScene& scene, bool observing) {
    return choose_by(TABLE, facts_of(scene, observing));
}

}  // namespace spook
