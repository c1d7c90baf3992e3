"""Engines wrong on purpose: in which room, by which change of the sources, and the test that catches each."""

from __future__ import annotations

from dataclasses import dataclass

SRC = "engine/native/src"


@dataclass(frozen=True)
class Mutant:
    """One change to the source, and the test that catches it."""

    room: str
    name: str
    story: str
    caught_by: str  # a scalar test, or a test of the suite: tests/test_….py::test_…, engine/native/tests/test_….cpp::…
    changes: tuple[tuple[str, str, str], ...]  # file, text as it is, text put in its place
    sweep: bool = False  # told by error against run time

    @property
    def of_the_suite(self) -> bool:
        """Whether a test of the suite catches it, and not a scalar test."""
        return "::" in self.caught_by

    @property
    def native(self) -> bool:
        return any(file.startswith(SRC) for file, _, _ in self.changes)


def wrong(room: str, name: str, story: str, caught_by: str, file: str, old: str, new: str) -> Mutant:
    """A mutant of one place in the native engine."""
    return Mutant(room, name, story, caught_by, ((f"{SRC}/{file}", old, new),))


def judged(name: str, story: str, test: str, file: str, old: str, new: str) -> Mutant:
    """A mutant of the tracker's own arithmetic."""
    return Mutant("tracker", name, story, f"tests/{test}", ((f"tracker/{file}", old, new),))


MUTANTS = (
    Mutant(
        "particles",
        "costly-solver",
        "the elimination of a path wastes time and changes no bit",
        "n_pendulum",
        (
            (
                f"{SRC}/particles/particle_kernels.cpp",
                "                link[k].u = u;\n",
                "                for (int i = 1; i < 30; ++i) { volatile double waste = 1.0 / (r.diagonal + i); (void)waste; }\n"
                "                link[k].u = u;\n",
            ),
        ),
        sweep=True,
    ),
    Mutant(
        "particles",
        "coarse-update",
        "only half of each violation is put right per step",
        "pendulum",
        (
            (f"{SRC}/particles/particle_kernels.cpp", "-r.violation_gain * g", "-0.5 * r.violation_gain * g"),
            (
                f"{SRC}/particles/distance_rows.cpp",
                "-r.violation_gain * l.g",
                "-0.5 * r.violation_gain * l.g",
            ),
        ),
    ),
    Mutant(
        "linear",
        "no-refinement",
        "solutions are not refined against the true equations",
        "lock_ring",
        (
            (f"{SRC}/linear/block_ldlt.cpp", "round < refinements", "round < 0 * refinements"),
            (
                f"{SRC}/contacts/pivot_solver.cpp",
                "    if (refined) {\n        refine(",
                "    if (false && refined) {\n        refine(",
            ),
        ),
    ),
    Mutant(
        "linear",
        "damping-sign",
        "the damping term has the sign printed in equation 2.11 of the thesis",
        "oscillator_damped",
        (
            (f"{SRC}/linear/regularisation.hpp", "spread = 1.0 + 4.0 * theta", "spread = 1.0 - 4.0 * theta"),
            (
                f"{SRC}/linear/regularisation.hpp",
                "static_assert(regularise(0.0, 0.25, 0.25).velocity_gain == 0.8);\n",
                "",
            ),
        ),
    ),
    Mutant(
        "particles",
        "fast-clock",
        "places move on by 1.0001 steps",
        "pendulum",
        (
            (
                f"{SRC}/particles/particle_system.cpp",
                "nodes_.x[node] += parts_.h * nodes_.v[node];",
                "nodes_.x[node] += 1.0001 * parts_.h * nodes_.v[node];",
            ),
            (f"{SRC}/particles/particle_kernels.cpp", "x[at] += h * moved;", "x[at] += 1.0001 * h * moved;"),
            (
                f"{SRC}/particles/particle_kernels.cpp",
                "x[top] += h * moved;",
                "x[top] += 1.0001 * h * moved;",
            ),
            (
                f"{SRC}/particles/particle_kernels.cpp",
                "x[node] += h * v[node];",
                "x[node] += 1.0001 * h * v[node];",
            ),
        ),
    ),
    wrong(
        "particles",
        "one-sided-spring",
        "a spring pulls its second end 1 % less",
        "oscillator_spring",
        "particles/particle_forces.cpp",
        "nodes.kick[s.b] -= (time_step * nodes.w[s.b]) * pull",
        "nodes.kick[s.b] -= (0.99 * time_step * nodes.w[s.b]) * pull",
    ),
    wrong(
        "particles",
        "weak-attraction",
        "planets are drawn one part in 10 000 less",
        "planetarium",
        "particles/particle_forces.cpp",
        "time_step * field.strength / (r2 * r)",
        "0.9999 * time_step * field.strength / (r2 * r)",
    ),
    Mutant(
        "particles",
        "flat-curvature",
        "curved constraints see a fifth where a quarter belongs",
        "pendulum",
        (
            (
                f"{SRC}/particles/particle_curvature.cpp",
                "(0.25 + row.relaxation) * ahead",
                "(0.2 + row.relaxation) * ahead",
            ),
            (
                f"{SRC}/particles/particle_kernels.cpp",
                "(0.25 + r.relaxation) * ahead",
                "(0.2 + r.relaxation) * ahead",
            ),
        ),
    ),
    wrong(
        "particles",
        "late-half-step",
        "velocities begin .4 of a step early, not half of one",
        "planetarium",
        "particles/particle_curvature.cpp",
        "nodes_.v[node] -= 0.5 * nodes_.kick[node];",
        "nodes_.v[node] -= 0.4 * nodes_.kick[node];",
    ),
    wrong(
        "strings",
        "slack-strings",
        "strings have a fifth of the stiffness of their tension, not a quarter",
        "hanging_chain",
        "particles/saddle_blocks.cpp",
        "held = 0.25 * stiffness",
        "held = 0.05 * stiffness",
    ),
    wrong(
        "composition",
        "short-last-stage",
        "the middle stage of order 4 is a little short",
        "tests/engine/particles/test_order.py::test_the_trajectory_has_its_order",
        "run/composition.hpp",
        "-0.65796308717750294857",
        "-0.65795",
    ),
    wrong(
        "composition",
        "drift-too-far",
        "the drift before a kick is 1 % too long",
        "tests/engine/particles/test_composition.py::test_the_order_holds_on_an_orbit",
        "particles/particle_composition.cpp",
        "state_.pending + 0.5 * tau, part = tau / h_",
        "state_.pending + 0.505 * tau, part = tau / h_",
    ),
    wrong(
        "recorder",
        "last-for-largest",
        "the largest size is the last one",
        "pendulum",
        "run/recorder.cpp",
        "return first || size > before || size != size ? size : before;",
        "return size;",
    ),
    wrong(
        "recorder",
        "forgets-the-start",
        "what is measured from the start is measured from zero",
        "rotating_box",
        "run/recorder.cpp",
        "now[i] - (what.from_start ? channel.start[i] : 0.0)",
        "now[i]",
    ),
    wrong(
        "recorder",
        "mean-of-one-more",
        "a mean divides by one sample too many",
        "tests/engine/test_recording.py::test_of_particles_with_every_force",
        "run/recorder.cpp",
        "value /= static_cast<double>(channel.count);",
        "value /= static_cast<double>(channel.count + 1);",
    ),
    wrong(
        "rotation",
        "weak-gyroscope",
        "a tenth of the turn about the momentum is lost",
        "rotating_box",
        "collision/rotation.cpp",
        "return turn_of(ahead, p) * q;",
        "return turn_of(0.9 * ahead, p) * q;",
    ),
    wrong(
        "rotation",
        "quick-spheres",
        "spheres turn a little too fast",
        "tests/engine/rigid/test_free_rotation.py::test_a_steady_spin_turns_by_its_rate_in_every_step",
        "collision/rotation.cpp",
        "case Kind::sphere: return turn_of(h, over_.x * p);",
        "case Kind::sphere: return turn_of(1.0001 * h, over_.x * p);",
    ),
    wrong(
        "joints",
        "soft-locks",
        "held turns are seen 5 % too small",
        "cantilever",
        "rigid/joint_rows.cpp",
        "write.angular(q.w * axes[k] + cross(world, axes[k]), 2.0 * dot(joint.axes[k], e));",
        "write.angular(q.w * axes[k] + cross(world, axes[k]), 1.9 * dot(joint.axes[k], e));",
    ),
    wrong(
        "joints",
        "hinge-backwards",
        "one row of a hinge pushes the wrong way",
        "door",
        "rigid/joint_rows.cpp",
        "write.angular(cross(axis, axes[1]), dot(joint.axes[1], moved));",
        "write.angular(cross(axis, axes[1]), -dot(joint.axes[1], moved));",
    ),
    wrong(
        "joints",
        "short-arm",
        "a rod pulls at 99 % of its arm",
        "tests/engine/rigid/test_oracle.py::test_each_joint_alone",
        "rigid/joint_rows.cpp",
        "put(rows.second + 3, cross(ends.second_arm, direction));",
        "put(rows.second + 3, 0.99 * cross(ends.second_arm, direction));",
    ),
    wrong(
        "joints",
        "worn-gears",
        "the ratio of a pair of gears is off by a thousandth",
        "gears",
        "rigid/general_rows.cpp",
        "const double c = term.coefficient;",
        "const double c = 0.001 + term.coefficient;",
    ),
    wrong(
        "joints",
        "long-wire",
        "wires are one part in a thousand longer than they are told",
        "wires",
        "rigid/general_rows.cpp",
        "sum.violation -= general.length;",
        "sum.violation -= 1.001 * general.length;",
    ),
    wrong(
        "loads",
        "light-fluid",
        "fluids carry 1 % less",
        "floating_box",
        "rigid/rigid_loads.cpp",
        "-(fluid.density * below.volume) * model_.gravity",
        "-(0.99 * fluid.density * below.volume) * model_.gravity",
    ),
    wrong(
        "loads",
        "thin-drag",
        "drag is 2 % too small",
        "sinking_sphere",
        "rigid/rigid_loads.cpp",
        "(0.5 * fluid.density * fluid.drag",
        "(0.49 * fluid.density * fluid.drag",
    ),
    wrong(
        "collision",
        "large-spheres",
        "the second of two spheres is 1 % too large",
        "cradle",
        "collision/round_pairs.cpp",
        "distance - first.radius - second.radius;",
        "distance - first.radius - 1.01 * second.radius;",
    ),
    wrong(
        "collision",
        "sunk-boxes",
        "boxes lie a millimetre deeper in a plane than they do",
        "resting_stack",
        "collision/plane_pairs.cpp",
        "const double gap = ground.height(point);",
        "const double gap = ground.height(point) - 1e-3;",
    ),
    wrong(
        "collision",
        "high-spheres",
        "spheres touch a plane 1 % of their radius too early",
        "bouncing_ball",
        "collision/plane_pairs.cpp",
        "plane.height(centre) - radius;",
        "plane.height(centre) - 1.01 * radius;",
    ),
    wrong(
        "contacts",
        "dull-impacts",
        "3 % of every restitution is lost",
        "bouncing_ball",
        "contacts/impact_solver.cpp",
        "const double psi = motion.surfaces().pair(contact).restitution, speed",
        "const double psi = 0.97 * motion.surfaces().pair(contact).restitution, speed",
    ),
    wrong(
        "contacts",
        "past-the-post",
        "what is pushed past a post meets the side it faced where the step began, not the one it comes to",
        "tests/engine/contacts/test_late_impacts.py::test_a_ball_pushed_past_a_post_is_turned_by_the_side_it_comes_to",
        "contacts/impact_search.cpp",
        "    if (elsewhere) return false;\n",
        "",
    ),
    wrong(
        "contacts",
        "swings-through",
        "an end that swings along its arc is stopped only along the way it faced where the step began",
        "tests/engine/contacts/test_late_impacts.py::test_the_far_end_of_a_bell_that_is_hit_meets_what_its_arc_leads_to",
        "contacts/impact_search.cpp",
        "const bool stops = contact.point.gap + motion.options().time_step * closing < 0.0;",
        "const bool stops = contact.point.gap + motion.options().time_step * closing < unbounded;",
    ),
    wrong(
        "contacts",
        "let-past",
        "a side skipped between iterations is not tested again when they end",
        "tests/engine/contacts/test_falling.py::test_a_side_skipped_between_iterations_is_met_if_the_body_gets_there",
        "contacts/solve_by_pgs.cpp",
        "const bool all = first || (was_settling && over && model_->bodies.swings);",
        "const bool all = first || (was_settling && !over && model_->bodies.swings);",
    ),
    wrong(
        "contacts",
        "early-blows",
        "a blow ahead in a step forgets what gravity adds until bodies meet and takes on the way back",
        "tests/engine/contacts/test_restitution.py::test_an_impact_ahead_in_the_step_gives_back_what_it_meets_with",
        "contacts/impact_solver.cpp",
        "if (left > 0.0) point.bounce = std::min(1.0, std::sqrt(left));",
        "if (left > 0.0) point.bounce = psi;",
    ),
    wrong(
        "contacts",
        "tight-for-ever",
        "contacts that contradict each other by rounding are searched at one tolerance, however often that stalls",
        "engine/native/tests/test_pivot_solver.cpp::a_contradiction_of_rounding_ends_the_search",
        "contacts/pivot_solver.cpp",
        "tolerance_ = std::min(10.0 * tolerance_, loosest);",
        "tolerance_ = std::min(tolerance_, loosest);",
    ),
    wrong(
        "friction",
        "sticky",
        "friction holds one part in a thousand more",
        "friction",
        "contacts/contact_rows.cpp",
        "friction.push_back({block, point.friction, soft, normal});",
        "friction.push_back({block, 1.001 * point.friction, soft, normal});",
    ),
    wrong(
        "friction",
        "smooth-rolling",
        "rolling friction is 3 % too small",
        "rolling_friction",
        "contacts/contact_rows.cpp",
        "material.rolling / scale",
        "0.97 * material.rolling / scale",
    ),
    wrong(
        "friction",
        "against-the-slip",
        "friction that differs with the direction acts more against the slip than the ellipse has it",
        "grain",
        "contacts/contact_points.cpp",
        "extras.axis_scale[0] = along / point.friction;",
        "extras.axis_scale[0] = std::sqrt(along / point.friction);",
    ),
    judged(
        "signed-errors",
        "an error is judged with its sign",
        "tracker/judge/test_verdict.py::test_a_doubled_negative_error_and_a_lost_exact_zero_are_regressed",
        "judge/verdict.py",
        "        return abs(value)\n",
        "        return value\n",
    ),
    judged(
        "ulps-by-value",
        "doubles between two values are counted by their difference",
        "tracker/judge/test_verdict.py::test_ulps_count_the_doubles_between",
        "judge/verdict.py",
        "return abs(_rank(first) - _rank(second))",
        "return int(abs(a - b))",
    ),
    judged(
        "lost-sign",
        "the sign of zero is not stored",
        "tracker/store/test_record.py::test_every_float_comes_back_with_the_same_bits",
        "store/rows.py",
        'return 0.0, "-0.0"',
        "return 0.0, None",
    ),
    judged(
        "larger-is-not-better",
        "where larger is better, more is called worse",
        "tracker/judge/test_rules.py::test_where_larger_is_better_less_is_worse",
        "judge/slower.py",
        "return -change if larger_is_better == (level > 0.0) else change",
        "return change",
    ),
)
