"""Limits, set points and closed forms that statics, one-step maps and prototypes give, found without the engine."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, ClassVar, cast

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.special import ellipj, ellipk

from spook_tracker.scalar_tests.case import Metric
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.scalar_tests.friction import conveyor, rolling_friction, seams, sorting
from spook_tracker.scalar_tests.mechanisms import scissor_lift
from spook_tracker.scalar_tests.multibody import simple_pendulum
from spook_tracker.scalar_tests.multibody.library import library_error
from spook_tracker.scalar_tests.robots import grasp
from spook_tracker.scalar_tests.ropes import loaded_rods, rope
from spook_tracker.scalar_tests.ropes.chain import small_motion
from spook_tracker.scalar_tests.rotation import rotating_box
from spook_tracker.scalar_tests.stacks import card_house, leaning_cards
from spook_tracker.scalar_tests.thesis.beam import scene as beam
from spook_tracker.scalar_tests.thesis.cantilever import scene as cantilever
from spook_tracker.scalar_tests.thesis.cantilever import statics
from spook_tracker.scalar_tests.thesis.inclined_plane import scene as inclined_plane
from spook_tracker.scalar_tests.thesis.inclined_plane import slip_angle
from spook_tracker.scalar_tests.thesis.n_pendulum import measure as chain
from spook_tracker.scalar_tests.thesis.pendulum.scene import angle
from spook_tracker.scalar_tests.thesis.planetarium import scene as planetarium
from spook_tracker.scalar_tests.vehicles import suspension
from tests.oracles import chain as oracle_chain
from tests.oracles import rigid_simulate as oracle_rigid_simulate
from tests.oracles import simulate as oracle_simulate
from tests.oracles.ball import dropped


def metric(test: str, name: str, index: int = 0) -> Metric:
    """One of the metrics of this name, in the order of the catalogue."""
    found = [m for asked in CATALOGUE[test].measurements for m in asked.metrics if m.name == name]
    return found[index]


# --- prototypes -------------------------------------------------------------------------------------------


def test_the_rigid_prototype_gives_the_first_step_of_the_door() -> None:
    for test, index, name in (("door", 0, "weight_error"), ("door", 3, "sideways_sum")):
        asked = CATALOGUE[test].measurements[index]
        values = asked.measure(oracle_rigid_simulate.simulate)

        assert name in values
        for one in asked.metrics:
            assert one.passes(values[one.name]) and one.holds_set_point(values[one.name]), (test, one.name)
        if test == "door" and name == "weight_error":
            assert values[name] == pytest.approx(-4.32e-7, rel=1e-3)


def test_flips_are_found_as_well_as_a_straight_line_between_samples_allows() -> None:
    """Jacobi's sn sampled at the steps, from every phase: the mean time between its zeros."""
    b = rotating_box
    half, count = b.flip_time(), round(b.DURATION / b.TIME_STEP)
    first, second, third = b.INERTIA
    moments, spin = np.array(b.INERTIA), np.array(b.SPIN)
    twice, square = float(moments @ spin**2), float(np.sum((moments * spin) ** 2))  # 2 E, L²
    if square < twice * second:
        first, third = third, first
    squared = (second - first) * (twice * third - square) / ((third - second) * (square - twice * first))
    rate = 2.0 * ellipk(squared) / half
    worst = 0.0
    for phase in np.linspace(0.0, half, 41):
        times = phase + b.TIME_STEP * np.arange(count + 1)
        middle = ellipj(rate * times, squared)[0]
        at = np.nonzero((middle[:-1] > 0.0) != (middle[1:] > 0.0))[0]
        zero = times[at] - middle[at] * b.TIME_STEP / (middle[at + 1] - middle[at])
        worst = max(worst, abs(float(zero[-1] - zero[0]) / (len(zero) - 1) / half - 1.0))
    limit = metric("rotating_box", "flip_time_error").limit

    assert worst < limit < 3.0 * worst


def test_the_prototype_gives_the_energy_of_the_coarse_orbit() -> None:
    asked = CATALOGUE["planetarium"].measurements[2]
    value = asked.measure(oracle_simulate.simulate)["energy_oscillation"]

    assert asked.metrics[0].holds_set_point(value)
    assert value == pytest.approx(1.04, abs=0.005)


def printed_swing(places: Any, squares: Any) -> float:
    """Largest change [%] of ½ v² + k²/r."""
    printed = 0.5 * squares + planetarium.GAUSS**2 / np.hypot(*np.array(places).T)
    return float(100.0 * np.abs(printed / printed[0] - 1.0).max())


def test_the_printed_energy_swings_by_symplectic_euler_and_less_on_the_exact_orbit() -> None:
    h, x, v = planetarium.TIME_STEP, np.array([1.0, 0.0]), np.array(planetarium.SPEED[:2])
    places, squares = [x], [v @ v]
    for _ in range(round(planetarium.DURATION / h)):
        v = v - h * planetarium.GAUSS**2 * x / math.sqrt(x @ x) ** 3
        x = x + h * v
        places.append(x)
        squares.append(v @ v)
    exact = [planetarium.exact_position(float(t)) for t in np.linspace(0.0, planetarium.DURATION, 2001)]
    by_vis_viva = planetarium.GAUSS**2 * (
        2.0 / np.hypot(*np.array(exact).T) - (1.0 - planetarium.ECCENTRICITY**2)
    )

    asked = metric("planetarium", "energy_oscillation_as_printed")
    assert asked.holds_set_point(printed_swing(places, np.array(squares)))
    assert printed_swing(exact, by_vis_viva) == pytest.approx(2.266, abs=1e-3)
    assert "2.2857 %" in asked.set_point_source and "2.266 %" in asked.set_point_source
    assert "the exact orbit swings by 2.266 %" in CATALOGUE["planetarium"].misprints[0]


def test_the_chain_prototype_gives_the_modes_as_far_off_as_compliance_takes_them() -> None:
    squares, shapes = small_motion(26)
    errors = []
    for square, shape in zip(squares, shapes.T, strict=True):
        places = np.stack([chain.AMPLITUDE * shape, -np.arange(1.0, 27.0)], axis=1)
        mode = oracle_chain.swing(places, 1 / 60, chain.SMALL_MOTION_STEPS).places[:, :, 0] @ shape
        bend = 2.0 * mode[1:-1] - mode[2:] - mode[:-2]
        errors.append(abs(mode[1:-1] @ bend / (mode[1:-1] @ mode[1:-1]) * 3600.0 / square - 1.0))
    limit = metric("n_pendulum", "frequency_error").limit

    assert isinstance(limit, float)
    assert max(errors) <= limit <= 1.03 * max(errors)


# --- statics ----------------------------------------------------------------------------------------------


def test_a_beam_of_compliant_locks_sags_by_its_stiffness_matrix() -> None:
    count, length, soft = 80, beam.SIZE[0], 1e-12
    matrix = np.zeros((2 * count, 2 * count))  # of heights and angles of the boxes
    for i in range(count - 1):
        gap = np.zeros(2 * count)
        gap[[2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 3]] = -1.0, -0.5 * length, 1.0, -0.5 * length
        turn = np.zeros(2 * count)
        turn[[2 * i + 1, 2 * i + 3]] = -1.0, 1.0
        matrix += (np.outer(gap, gap) + np.outer(turn, turn)) / soft
    load = np.zeros(2 * count)
    load[::2] = beam.MASS * beam.GRAVITY
    free = np.setdiff1d(np.arange(2 * count), [0, 2 * count - 2])
    moved = np.linalg.solve(matrix[np.ix_(free, free)], load[free])
    deepest = np.abs(moved[np.isin(free, np.arange(0, 2 * count, 2))]).max()

    allowed = metric("beam", "sag_error").limit
    assert isinstance(allowed, float)
    assert deepest == pytest.approx(beam.sag_of_compliant_beam(count, soft), rel=1e-3 * allowed)


def test_the_cantilever_bends_as_large_deflection_has_it() -> None:
    linear = metric("cantilever", "tip_against_linear")
    assert linear.passes(statics.elastica_tip() / cantilever.TIP - 1.0)
    angle = (
        cantilever.LOAD * cantilever.LENGTH**2 / (2.0 * cantilever.STIFFNESS) / 80.0 * 2.0
    )  # rad, at a lock
    assert angle**2 / 6.0 < metric("cantilever", "tip_against_statics").limit  # type: ignore[operator]

    weight = cantilever.DENSITY * cantilever.GRAVITY  # N/m

    def end(moment: float) -> Any:
        """From the clamp: angle, bending, place; the tip carries the load and no moment."""

        def slopes(s: float, y: Any) -> Any:
            pull = cantilever.LOAD + weight * (cantilever.LENGTH - s)
            return [y[1], -pull * math.cos(y[0]) / cantilever.STIFFNESS, math.sin(y[0])]

        solved = solve_ivp(slopes, (0.0, cantilever.LENGTH), [0.0, moment, 0.0], rtol=1e-11, atol=1e-13)
        return solved.y[:, -1]

    moment = brentq(lambda m: end(m)[1], 1e-4, 1.0)
    linear_sum = cantilever.TIP + weight * cantilever.LENGTH**4 / (8.0 * cantilever.STIFFNESS)
    assert metric("cantilever", "self_weight_ratio").passes(float(end(moment)[2] / linear_sum))


@pytest.mark.parametrize("lean", [0.1, leaning_cards.LEAN, 0.7])
def test_leaning_cards_are_balanced(lean: float) -> None:
    """Thrust, load of the foot and push of the other card, from forces and moments about the centre of one."""
    down = 0.5 * leaning_cards.LENGTH * math.cos(lean) + 0.5 * leaning_cards.THICK  # to the foot
    up, aside = 0.5 * leaning_cards.LENGTH * math.cos(lean), 0.5 * leaning_cards.LENGTH * math.sin(lean)
    balance = np.array([[1.0, 0.0, -1.0], [0.0, 1.0, 0.0], [down, -aside, up]])
    thrust, load, _ = np.linalg.solve(balance, [0.0, leaning_cards.CARD * leaning_cards.GRAVITY, 0.0])

    assert thrust / load == pytest.approx(leaning_cards.need(lean), rel=1e-12)


@pytest.mark.parametrize("stages", scissor_lift.STAGES)
def test_a_scissor_lift_is_held_by_the_slope_of_its_energy(stages: int) -> None:
    def energy(width: float) -> float:
        rise = math.sqrt(scissor_lift.BAR**2 - width**2)
        arms = sum(2.0 * scissor_lift.ARM * (k + 0.5) * rise for k in range(stages))
        return scissor_lift.GRAVITY * ((scissor_lift.LOAD + 1.0) * stages * rise + arms)

    width, small = scissor_lift.BAR * math.cos(scissor_lift.ANGLE), 1e-5
    force = -(energy(width + small) - energy(width - small)) / (2.0 * small)

    asked = (stages, scissor_lift.ANGLE, scissor_lift.LOAD, scissor_lift.ARM)
    assert force == pytest.approx(scissor_lift.holding_force(*asked), rel=1e-8)


def test_what_two_fingers_do_not_hold_falls() -> None:
    press = grasp.SLIPPING * grasp.LEAST
    friction = 2.0 * grasp.FRICTION * press

    assert (grasp.MASS * grasp.GRAVITY - friction) / grasp.MASS == pytest.approx(
        grasp.acceleration(grasp.SLIPPING)
    )
    assert pytest.approx(grasp.MASS * grasp.GRAVITY) == 2.0 * grasp.FRICTION * grasp.LEAST
    assert grasp.SLIPPING < 1.0 < grasp.HELD


# --- motion with friction ---------------------------------------------------------------------------------


@pytest.mark.parametrize("slope", [0.0, conveyor.CLIMB])
def test_a_belt_takes_a_box_along_by_coulombs_law(slope: float) -> None:
    tilt, v, h, time = math.atan(slope), 0.0, 1e-6, 0.0
    while v < conveyor.BELT:
        v += h * (conveyor.FRICTION * conveyor.GRAVITY * math.cos(tilt) - conveyor.GRAVITY * math.sin(tilt))
        time += h

    assert time == pytest.approx(conveyor.BELT / conveyor.gain(slope), abs=2e-6)
    if slope == 0.0:
        assert time == pytest.approx(conveyor.TAKEN, abs=2e-6)
        assert (
            pytest.approx(conveyor.BELT * time - 0.5 * conveyor.gain(0.0) * time**2, rel=1e-4) == conveyor.LAG
        )


def test_a_ball_with_rolling_friction_slows_down_by_newton_and_euler() -> None:
    """m a = −F, ⅖ m r² α = F r − ρ m g, a = r α; and about the vertical ⅖ m r² α = −τ m g."""
    r, g = rolling_friction.RADIUS, rolling_friction.GRAVITY
    system = np.array([[1.0, 0.0, 1.0], [0.0, 0.4 * r**2, -r], [1.0, -r, 0.0]])  # a, α, F/m
    a, _, force = np.linalg.solve(system, [0.0, -rolling_friction.ROLLING * g, 0.0])

    assert -a == pytest.approx(rolling_friction.BRAKE, rel=1e-12)
    assert abs(force) < rolling_friction.FRICTION * g
    assert pytest.approx(rolling_friction.TORSIONAL * g / (0.4 * r**2)) == rolling_friction.SLOWING


def test_a_ball_on_the_slope_of_the_seams_rolls_by_newton_and_euler() -> None:
    """a = g sin θ − F/m, ⅖ r α = F/m, a = r α: 5/7 of what slides, held by less than the cone's friction."""
    pull = seams.GRAVITY * math.sin(seams.TILT)
    system = np.array([[1.0, 0.0, 1.0], [0.0, 0.4 * seams.RADIUS, -1.0], [1.0, -seams.RADIUS, 0.0]])
    a, _, force = np.linalg.solve(system, [pull, 0.0, 0.0])

    assert a == pytest.approx(5.0 / 7.0 * pull, rel=1e-12)
    assert force < seams.FRICTION * seams.GRAVITY * math.cos(seams.TILT)


# --- maps of one step -------------------------------------------------------------------------------------


def test_a_discrete_ball_bounces_as_high_and_as_long_as_the_limits_allow() -> None:
    for asked in CATALOGUE["bouncing_ball"].measurements:
        if {one.name for one in asked.metrics} & {"height_error", "stop_time_error", "energy_gain"}:
            values = asked.measure(dropped)
            for one in asked.metrics:
                assert one.passes(values[one.name]), (one.name, values)
            if "height_error" in values:  # nor are they much wider
                assert abs(values["height_error"]) > 0.1 * float(asked.metrics[0].limit)  # type: ignore[arg-type]


def springs(heave: float, tilt: float) -> float:
    """Potential energy [J] of the chassis on its four springs."""
    total = suspension.MASS * suspension.GRAVITY * heave
    for x, _, stiffness in suspension.CORNERS.values():
        ahead = suspension.REAR if x > 0.0 else suspension.FRONT
        carried = 0.5 * suspension.MASS * suspension.GRAVITY * ahead / (suspension.FRONT + suspension.REAR)
        end = np.array([x * math.cos(tilt) - x, suspension.LENGTH + heave - x * math.sin(tilt)])
        stretch = math.hypot(*end) - suspension.LENGTH - carried / stiffness
        total += 0.5 * stiffness * stretch**2
    return total


def test_a_chassis_swings_by_the_curvature_of_its_springs_energy() -> None:
    d = 1e-4
    rest = springs(0.0, 0.0)
    bounce = (springs(d, 0.0) + springs(-d, 0.0) - 2.0 * rest) / d**2 / suspension.MASS
    pitch = (springs(0.0, d) + springs(0.0, -d) - 2.0 * rest) / d**2 / suspension.PITCHING
    mixed = (springs(d, d) - springs(d, -d) - springs(-d, d) + springs(-d, -d)) / (4.0 * d * d)

    assert math.sqrt(bounce) == pytest.approx(suspension.BOUNCE, rel=1e-6)
    assert math.sqrt(pitch) == pytest.approx(suspension.PITCH, rel=1e-3)
    assert abs(mixed) < 1e-3 * bounce * suspension.MASS


def test_a_bounce_in_steps_is_faster_than_the_continuum_by_its_limit() -> None:
    h, z, v, trace = suspension.TIME_STEP, 1.0, 0.0, [1.0]
    for _ in range(120):
        v -= h * suspension.BOUNCE**2 * z
        z += h * v
        trace.append(z)
    found = suspension.phase(np.array(trace)) / h / suspension.BOUNCE - 1.0

    limit = metric("suspension", "continuous_error").limit
    assert isinstance(limit, float)
    assert 0.9 * limit < found <= limit


def test_loaded_rods_swing_as_their_modes_do_step_by_step() -> None:
    """All ten modes of the straight chain from the start's lean, each with the phase of the implicit step."""
    load, h = loaded_rods.HEAVY, loaded_rods.TIME_STEP
    reach = np.tril(np.ones((10, 10)), -1) + 0.5 * np.eye(10)
    mass = load * np.ones((10, 10)) + loaded_rods.ACROSS * np.eye(10) + reach.T @ reach
    tension = loaded_rods.GRAVITY * (load + 10 - np.arange(10) - 0.5)
    squares, shapes = eigh(np.diag(tension), mass)
    share = shapes.T @ mass @ np.full(10, loaded_rods.TILT)
    phases = 2.0 * np.arctan(0.5 * h * np.sqrt(squares))
    steps = np.arange(round(loaded_rods.DURATION / h) + 1)
    angles = shapes @ (share[:, None] * np.cos(np.outer(phases, steps)))
    place = angles.sum(axis=0)

    class Swing(dict):  # type: ignore[type-arg]
        sample_times: ClassVar[dict[str, Any]] = {"load": h * steps}
        time_step = h

    run: Any = Swing(load=np.stack([place, 0.0 * place, 0.0 * place], axis=1))
    straight = loaded_rods.period(load, h) / (1.0 + loaded_rods.TILT**2 / 16.0)
    period = loaded_rods.measured_period(run) / straight - 1.0
    crest = (h * loaded_rods.rates(load)[0]) ** 2 / 8.0

    assert metric("loaded_rods", "period_error").passes(period), period
    assert crest < metric("loaded_rods", "width_change").limit <= 2.1 * crest  # type: ignore[operator]
    turn = loaded_rods.TILT * h * loaded_rods.rates(load)[0]
    missed = 0.5 * loaded_rods.LENGTH * (1.0 - math.cos(turn)) * (1.0 + 2.0 * 2.0) / 2.0
    assert missed == pytest.approx(metric("loaded_rods", "joint_violation").limit, rel=0.1)


# --- bounds -----------------------------------------------------------------------------------------------


def test_the_fall_read_a_sample_late_is_a_sum() -> None:
    n, h, g = 1199, 1 / 60, 9.81
    fallen = g * h * h * sum(range(1, n + 2))
    late = 0.5 * g * (n * h) ** 2 - fallen

    assert metric("falling_object", "position_error_read_late").holds_set_point(abs(late)), late


def test_the_slope_at_which_a_box_slips_is_as_well_known_as_it_is_searched(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Boxes that slip by Coulomb's law, and by one that is off by so much, without an engine."""

    def errors(off: float) -> tuple[float, float]:
        for module in (slip_angle, inclined_plane):
            monkeypatch.setattr(
                module, "slips", lambda simulate, slope, friction, **how: slope > friction + off
            )
        (slope,) = slip_angle._measure_slope(cast(Any, None)).values()
        (held,) = slip_angle._measure_bracket(cast(Any, None)).values()
        return slope, held

    by_slope, by_bracket = metric("slip_angle", "slip_slope_error"), metric("slip_angle", "bracket_held")
    for off in np.linspace(-0.9e-4, 0.9e-4, 7):
        slope, held = errors(float(off))
        assert by_slope.passes(slope) and by_bracket.passes(held), off
    for off in (-3.2e-4, 3.2e-4, 1e-3, -1e-2):
        slope, held = errors(off)
        assert not by_slope.passes(slope) and not by_bracket.passes(held), off


def eliminated(neighbours: dict[int, set[int]], order: Iterable[int]) -> int:
    """Blocks touched by a factorisation in that order: the pivot, those beside it, and what they change of each other."""
    left, blocks = {node: set(beside) for node, beside in neighbours.items()}, 0
    for node in order:
        beside = left.pop(node)
        blocks += 1 + len(beside) + len(beside) * (len(beside) + 1) // 2
        for other in beside:
            left[other] = (left[other] | beside) - {node, other}
    return blocks


def test_the_ends_of_a_rope_cost_a_link_in_125() -> None:
    """Links and the joints between them, eliminated from one end to the other."""

    def of_link(links: int) -> float:
        nodes = range(2 * links - 1)  # links are even, joints odd
        beside = {node: {node - 1, node + 1} & set(nodes) for node in nodes}
        return eliminated(beside, nodes) / links

    limit = metric("rope", "cost_error")
    cost = of_link(rope.LONG) / of_link(rope.SHORT) - 1.0
    assert limit.passes(cost)
    assert 0.5 * float(limit.limit) < cost  # type: ignore[arg-type]
    assert not limit.passes(math.log2(rope.LONG / rope.SHORT))  # work that grows as n log n


def test_a_search_is_as_exact_as_its_resolution(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cards that stand by statics, and by statics that are off by so much, without an engine."""

    def error(off: float) -> float:
        enough = card_house.need(3) * (1.0 + off)
        monkeypatch.setattr(card_house, "stands", lambda simulate, storeys, friction: friction >= enough)
        return abs(card_house.least(cast(Any, None)).value / card_house.need(3) - 1.0)

    limit = metric("card_house", "least_error")
    assert limit.passes(error(0.0))
    assert not any(limit.passes(error(off)) for off in (-0.0045, 0.0045, 0.02))


def test_a_box_on_the_belt_is_late_by_a_whole_step_or_not_at_all() -> None:
    """Friction takes h µ g of the slip in each step: steps counted one by one, and what is asked for."""
    limit = metric("sorting", "steps_late")
    for friction in sorting.SORTS:
        slip, steps = abs(sorting.SLIP), 0
        while slip > 1e-6:
            slip, steps = slip - sorting.TIME_STEP * friction * sorting.GRAVITY, steps + 1
        asked = math.ceil(abs(sorting.SLIP) / (friction * sorting.GRAVITY * sorting.TIME_STEP))
        assert limit.passes(float(abs(steps - asked)))
        assert not limit.passes(float(abs(steps + 1 - asked)))


SUZUKI = (0.41449077179437573714,) * 2 + (-0.65796308717750294857,) + (0.41449077179437573714,) * 2
KAHAN_LI = (
    0.13020248308889008088, 0.56116298177510838456, -0.38947496264484728641, 0.15884190655515560090,
    -0.39590389413323757734, 0.18453964097831570709, 0.25837438768632204729, 0.29501172360931029887,
    -0.60550853383003451170, 0.29501172360931029887, 0.25837438768632204729, 0.18453964097831570709,
    -0.39590389413323757734, 0.15884190655515560090, -0.38947496264484728641, 0.56116298177510838456,
    0.13020248308889008088,
)  # fmt: skip


def late(time_step: float, stages: tuple[float, ...]) -> float:
    """The library's error of 2000 s of a pendulum by its angle: leapfrog, composed of these shares of a step."""
    turn, rate, every, turns = 0.5 * math.pi, 0.0, round(simple_pendulum.EVERY / time_step), []
    for n in range(1, round(simple_pendulum.DURATION / time_step) + 1):
        for share in stages:
            k = share * time_step
            turn += 0.5 * k * rate
            rate -= 9.81 * k * math.sin(turn)
            turn += 0.5 * k * rate
        if n % every == 0:
            turns.append(turn)
    found, exact = np.array(turns), angle(simple_pendulum.EVERY * np.arange(1.0, len(turns) + 1.0))
    return library_error(
        np.stack([np.sin(found), -np.cos(found)], axis=1), np.stack([np.sin(exact), -np.cos(exact)], axis=1)
    )


def test_a_pendulum_keeps_its_time_for_2000_s_by_high_orders_alone() -> None:
    """At these steps the classes of the library measure the order of a method: an engine of order two rightly misses."""
    high, low = (asked.metrics[0] for asked in CATALOGUE["simple_pendulum"].measurements)

    assert high.passes(late(1 / 20, KAHAN_LI))
    assert low.passes(late(1 / 40, SUZUKI))
    assert late(1 / 20, (1.0,)) > 100.0 * high.limit
    assert high.limit_kind == low.limit_kind == "method"
