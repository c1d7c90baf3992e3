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

}  // namespace

StageChoices choose_stages(const ParticleScene& scene, bool observing) {
    const ParticleMethod& method = scene.method;
    const bool rows = !scene.rows.empty(), iterative = rows && method.iterative;
    const std::vector<Path> paths = find_paths(scene);
    const bool held_twice = std::any_of(paths.begin(), paths.end(),
                                        [&](const Path& path) { return rigid_between_anchors(scene, path); });
    const bool loaded =
        scene.loads_change || std::any_of(scene.bodies.begin(), scene.bodies.end(),
                                          [](const ParticleBody& body) { return !is_zero(body.load); });
    const bool composed = method.composition > 2;
    const std::string no_rows = "no constraints, so nothing to solve";
    const std::string no_contacts = "particles have no surface, so no contact is possible";
    const std::string asks_iterative = "the method asks for the iterative solver";
    const std::string not_path =
        !rows                ? no_rows
        : iterative          ? asks_iterative
        : method.force_block ? "solve_block was forced"
        : held_twice         ? "a path without compliance is held at both ends, so its rows may say the same"
        : method.string_stiffness ? "string stiffness couples the bodies of a row"
        : paths.empty()           ? "a body has more than two rows or a loop closes"
                                  : "";
    const bool path = not_path.empty(), block = rows && !iterative && !path;
    return choose_each([&](Stage stage) -> StageChoice {
        switch (stage) {
            case Stage::collision:
            case Stage::impact:
            case Stage::tangents:
            case Stage::friction:
            case Stage::orient_friction:
            case Stage::move_surfaces:
            case Stage::roll: return leave_out(no_contacts);
            case Stage::apply_gravity:
                return choose_if(!is_zero(scene.gravity), "uniform gravity acts", "gravity is zero");
            case Stage::apply_central_gravity:
                return choose_if(!scene.fields.empty(), "a centre attracts every body",
                                 "there is no central gravity");
            case Stage::apply_springs:
                return choose_if(!scene.springs.empty(), "springs pull as plain forces",
                                 "there are no springs");
            case Stage::apply_loads:
                return choose_if(
                    loaded,
                    scene.loads_change
                        ? "loads may be set while it runs; with gravity they are one kick"
                        : "constant loads act; with gravity they are one kick, found before the first step",
                    "there are no loads");
            case Stage::follow_time: return leave_out("nothing is given as a function of time");
            case Stage::apply_fluids: return leave_out("particles displace no fluid");
            case Stage::string_stiffness:
                return choose_if(method.string_stiffness && block,
                                 "the method treats the transverse stiffness of taut distances implicitly",
                                 rows ? "the method does not ask for it" : no_rows);
            case Stage::assemble_rows:
                return choose_if(rows, std::to_string(scene.rows.size()) + " distance rows",
                                 "there are no constraints");
            case Stage::solve_path:
                return choose_if(
                    path,
                    "no body has more than two rows and no loop closes: tridiagonal, one pass up and down",
                    not_path);
            case Stage::solve_block:
                return choose_if(block, not_path + ": sparse LDLᵀ in blocks, ordered once",
                                 !rows  ? no_rows
                                 : path ? "rows form open paths"
                                        : asks_iterative);
            case Stage::solve_iterative:
                return choose_if(iterative, "the method asks for projected Gauss–Seidel",
                                 rows ? "the method asks for a direct solver" : no_rows);
            case Stage::pivot:
                return leave_out(rows ? "distances are bilateral: no row can let go" : no_rows);
            case Stage::rub_wires: return leave_out("a wire brings rigid stages with it");
            case Stage::roll_tyres: return leave_out("particles have no wheels");
            case Stage::meet_meshes: return leave_out("particles touch nothing");
            case Stage::couple_joints: return leave_out("particles have no joint coordinates");
            case Stage::hold_wires: return leave_out("a wire brings rigid stages with it");
            case Stage::wind_wires: return leave_out("particles wind on no drum");
            case Stage::rub_joints: return leave_out("particles have no joint coordinates");
            case Stage::break_joints: return leave_out("distances have no strength");
            case Stage::correct_curvature:
                return choose_if((method.corrections > 0 || composed) && rows,
                                 composed ? "Newton's method keeps the curvature of the rows to rounding"
                                          : std::to_string(method.corrections) +
                                                " extra back-substitutions keep the curvature of the rows",
                                 rows ? "the method linearises the rows" : no_rows);
            case Stage::half_step:
                return choose_if(method.half_step_velocities || composed,
                                 composed ? "a symmetric composition of half-step steps, order " +
                                                std::to_string(method.composition)
                                          : "velocities live at mid-step: half-kick start, mid-step read-out",
                                 "velocities live at whole steps");
            case Stage::integrate_positions: return {true, "every body can move"};
            case Stage::integrate_rotations: return leave_out("a particle has no rotation");
            case Stage::project_positions:
            case Stage::sleep: return leave_out(no_contacts);
            case Stage::observe:
                return choose_if(observing, "observables are reduced inside the loop",
                                 "nothing is read while the loop runs");
        }
        return {};
    });
}

}  // namespace spook
