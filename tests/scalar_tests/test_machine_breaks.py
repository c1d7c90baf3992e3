"""Where machines, wires, chains and what floats must break: each band found again without the engine."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import PLAIN, simulate
from spook_tracker.scalar_tests.bracket import is_stable
from spook_tracker.scalar_tests.case import StabilityMap
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.scalar_tests.fluids import floating_box
from spook_tracker.scalar_tests.mechanisms import slider_crank
from spook_tracker.scalar_tests.ropes import falling_chain, wires
from tests.oracles.crank import cranked
from tests.scalar_tests.limits import band


def heave(state: np.ndarray, ratio: float, time_step: float, stream: float = 0.0) -> np.ndarray:
    """One step of the height [m] and speed [m/s] of a log over its draught, by Archimedes and the law of drag."""
    f, (z, v) = floating_box, state
    below = min(1.0, max(0.0, ratio - z / f.SIDE))  # share of the section under water
    mass, volume = ratio * f.WATER * f.LENGTH * f.SIDE**2, below * f.LENGTH * f.SIDE**2
    speed = math.hypot(v, stream)
    # what a box shows to a flow that comes a little from below: its side, and its bottom aslant
    shadow = f.LENGTH * f.SIDE * (abs(stream) + abs(v)) / speed if speed > 0.0 else 0.0
    drag = 0.5 * f.WATER * f.DRAG * shadow * below * speed * v if stream else 0.0
    v = v + time_step * (f.WATER * f.GRAVITY * volume - drag - mass * f.GRAVITY) / mass
    return np.array((z + time_step * v, v))


def farthest(ratio: float, time_step: float, stream: float = 0.0) -> float:
    """How far from its start a lifted log gets, over how far it was lifted; within the steps of the study."""
    f = floating_box
    state, found = np.array((f.LIFTED, 0.0)), 0.0
    for _ in range(f.BOBS):
        state = heave(state, ratio, time_step, stream)
        found = max(found, abs(state[0] - f.LIFTED) / f.LIFTED)
    return found


def test_a_log_bobs_up_to_half_a_turn_a_step() -> None:
    f = floating_box
    low, high = band("floating_box", "longest-step")
    assert farthest(f.RATIO, low * math.exp(f.SEARCHED)) < 100.0 < farthest(f.RATIO, high)
    low, high = band("floating_box", "lightest")
    assert farthest(high * math.exp(-f.SEARCHED), f.TIME_STEP) < 100.0 < farthest(low, f.TIME_STEP)


def test_a_stream_damps_a_heave_at_short_steps_and_drives_it_at_long_ones() -> None:
    f = floating_box
    for h in f.STEPS:
        for stream in f.STREAMS:
            size = 1e-6
            columns: Any = [
                (heave(size * e, f.RATIO, h, stream) - heave(-size * e, f.RATIO, h, stream)) / (2.0 * size)
                for e in np.eye(2)
            ]
            growth = float(np.abs(np.linalg.eigvals(np.column_stack(columns))).max())
            assert f.heave_growth(h, stream) == pytest.approx(growth, rel=1e-4)
            damped = (h * f.heave_rate()) ** 2 + h * f.DRAG * stream / f.SIDE
            assert (growth <= 1.0 + 1e-4) == (damped < 4.0)


def test_logs_do_in_a_stream_what_their_eigenvalues_say() -> None:
    (study,) = (s for s in CATALOGUE["floating_box"].stability if s.name == "stream")
    found = study.study(simulate)
    assert isinstance(found, StabilityMap) and found.prediction is not None
    for cells, growths in zip(found.cells, found.prediction, strict=True):
        assert [is_stable(kind) for kind in cells] == [growth <= 1.0 + 1e-9 for growth in growths]


def crane_energy(places: np.ndarray, load: float) -> float:
    """Potential [J] of block, load and weight, at the sideways places [m] of the first two; wires as long as ever.

    The block may hang anywhere: it stays at its height, and the weight gives way.
    """
    w, (block, hung) = wires, places
    strands = 2.0 * (math.hypot(block, w.STRAND) - w.STRAND)  # what the weight is drawn up by
    lower = math.sqrt(w.SLING**2 - (hung - block) ** 2)
    return w.GRAVITY * (0.5 * (w.BLOCK + load) * strands - load * lower)


def swayed(load: float) -> float:
    """How far from its start a nudged block gets in the steps of the study, over the nudge."""
    size, h = 1e-3, wires.TIME_STEP
    stiff = np.zeros((2, 2))
    for i, j, a, b in ((i, j, a, b) for i in (0, 1) for j in (0, 1) for a in (1, -1) for b in (1, -1)):
        corner = size * (a * np.eye(2)[i] + b * np.eye(2)[j])
        stiff[i, j] += a * b * crane_energy(corner, load) / (4.0 * size * size)
    pull = stiff / np.array(((wires.BLOCK,), (load,)))
    x, v, found = np.array((1.0, 0.0)), np.zeros(2), 0.0
    for _ in range(wires.SWAYS):
        v = v - h * pull @ x
        x = x + h * v
        found = max(found, abs(x[0] - 1.0))
    return found


def test_a_light_block_carries_what_its_sway_allows() -> None:
    low, high = band("wires", "heaviest-load")
    assert swayed(low * math.exp(wires.SEARCHED)) < 100.0 < swayed(high)


def test_weights_on_a_wire_lose_nothing_but_rounding_at_any_ratio() -> None:
    """One row in floating point against the same in fractions, where λ = −(G v − h G g)/(1/M + 1/m)."""
    assert band("wires", "mass-ratio") == (wires.RATIOS, wires.RATIOS)
    for ratio in (10.0 ** np.arange(1.0, 13.0)).tolist():
        found = []
        for number in (float, Fraction):
            heavy, h, g = number(ratio), number(wires.TIME_STEP), number(wires.GRAVITY)
            down, up, pull = number(0), number(0), number(0)  # m/s downwards of both, N s
            for _ in range(30):
                down, up = down + h * g, up + h * g
                pull = (down + up) / (1 / heavy + number(1))
                down, up = down - pull / heavy, up - pull
            found.append((pull / h, down))
        (pull, down), (exact_pull, exact_down) = found
        closed = 2 * Fraction(ratio) * Fraction(wires.GRAVITY) / (Fraction(ratio) + 1)
        assert exact_pull == closed
        assert abs(Fraction(pull) / exact_pull - 1) < 1e-3 * wires.HELD
        assert abs(Fraction(down) / exact_down - 1) < 1e-3 * wires.HELD


def test_a_crank_runs_as_fast_as_the_rows_of_its_plane_can_be_stepped() -> None:
    s = slider_crank
    low, high = band("slider_crank", "fastest")
    assert [len(cranked(s.CRANK, speed, 200)) for speed in (low, 0.9999 * s.FASTEST)] == [201, 201]
    assert len(cranked(s.CRANK, 1.0001 * s.FASTEST, 200)) < 30
    assert low < s.FASTEST * math.exp(-2e-3) < s.FASTEST < high


def folded(gap: float) -> float:
    """How far off the slider gets in the turns of the study [m], the crank so much shorter than the rod."""
    s = slider_crank
    turn, crank = s.TIME_STEP * s.SPEED, (1.0 - gap) * s.ROD
    places = cranked(crank, s.SPEED, round(s.TURNS_RUN * math.tau / turn))
    angles = s.START + turn * np.arange(len(places))
    exact = crank * np.cos(angles) + np.sqrt(s.ROD**2 - (crank * np.sin(angles)) ** 2)
    return float(np.abs(places - exact).max())


def test_a_slider_comes_through_a_fold_as_narrow_as_its_steps_in_the_plane_allow() -> None:
    s = slider_crank
    low, high = band("slider_crank", "narrowest-fold")
    assert folded(1.0001 * s.NARROWEST) < s.OFF < folded(0.9999 * s.NARROWEST)
    assert low < s.NARROWEST < s.NARROWEST * math.exp(0.01) < high


def test_a_slider_so_heavy_leaves_a_crank_below_the_floor_of_pivots() -> None:
    """What the motor's row moves, rows of pin and wrist held, over what it would move with the crank alone."""
    s = slider_crank

    def share(mass: float, angle: float) -> float:
        """By energies: of crank, rod and slider at a unit speed of the crank, by differences of the closed path."""
        d = 1e-5

        def places(theta: float) -> np.ndarray:
            x, lean, height = (float(value) for value in s.pin(theta))
            return np.array((x, 0.5 * (s.CRANK * math.cos(theta) + x), 0.5 * height, lean))

        x, y, z, lean = (places(angle + d) - places(angle - d)) / (2.0 * d)
        rod = s.ROD_MASS * (y * y + z * z + s.ROD**2 / 12.0 * lean * lean)
        return s.TURNING / (s.TURNING + rod + mass * x * x)

    low, high = band("slider_crank", "heaviest-slider")
    lost = [min(share(mass, angle) for angle in np.linspace(0.0, math.tau, 361)) for mass in (low, high)]
    assert lost[0] > PLAIN.floor > lost[1]
    assert min(share(s.HEAVIEST, angle) for angle in np.linspace(0.0, math.tau, 3601)) == pytest.approx(
        PLAIN.floor, rel=1e-3
    )


def solid(radius: float, length: float, mass: float) -> tuple[float, float]:
    """Moments [kg m²] of a capsule across and along its axis, summed over slices."""
    count = 200_000
    along = (np.arange(count) + 0.5) / count * length - 0.5 * length
    cap = np.maximum(0.0, np.abs(along) - 0.5 * length + radius)
    square = radius**2 - cap**2
    density = mass / float(square.sum())
    across = density * float((square**2 / 4.0 + square * along**2).sum())
    return across, 0.5 * density * float((square**2).sum())


def strayed(time_step: float) -> float:
    """How far sideways a link of the drawn chain gets in the steps of the study, over the nudge.

    In the joints' places y and the links' rolls about themselves, small: (M + h C) w₊ = M w − h K y. Every contact, two
    a link, rubs with µ N against the way on and, turned by what slips across, with µ N/v of that slip across.
    """
    c, h, n = falling_chain, time_step, falling_chain.LINKS
    arm, weight = 0.5 * c.LENGTH - c.RADIUS, c.MASS * c.GRAVITY
    across, along = solid(c.RADIUS, c.LENGTH, c.MASS)
    # Friction a radius below the joints presses the front down: 2 arm d = µ radius of the weight
    front = 0.5 + c.FRICTION * c.RADIUS / (2.0 * arm)
    mass, stiff, rubs = (np.zeros((2 * n + 1, 2 * n + 1)) for _ in range(3))
    for k in range(n):
        centre, yaw, roll = (np.zeros(2 * n + 1) for _ in range(3))
        centre[k], centre[k + 1] = 0.5, 0.5
        yaw[k], yaw[k + 1] = 1.0 / c.LENGTH, -1.0 / c.LENGTH
        roll[n + 1 + k] = 1.0
        mass += c.MASS * np.outer(centre, centre) + across * np.outer(yaw, yaw) + along * np.outer(roll, roll)
        pull = c.FRICTION * weight * (n - 1 - k)  # of all that is behind
        for share, place in ((front, arm), (1.0 - front, -arm)):
            rubbing = c.FRICTION * weight * share
            pull += rubbing * (0.5 * c.LENGTH - place) / c.LENGTH
            slip = centre + place * yaw + c.RADIUS * roll
            rubs += rubbing / c.DRAWN * np.outer(slip, slip)
        stiff += pull * c.LENGTH * np.outer(yaw, yaw)
    mass, stiff, rubs = mass[1:, 1:], stiff[1:, 1:], rubs[1:, 1:]  # the head stays on its line
    y, w, found = np.zeros(2 * n), np.zeros(2 * n), 0.0
    y[:n] = (-1.0) ** np.arange(n)
    for _ in range(c.SLIDES):
        w = np.linalg.solve(mass + h * rubs, mass @ w - h * stiff @ y)
        y = y + h * w
        joints = np.concatenate(((0.0,), y[:n]))
        found = max(found, float(np.abs(0.5 * (joints[1:] + joints[:-1])).max()))
    return found


def test_a_chain_is_drawn_straight_in_steps_as_long_as_its_swing_sideways_allows() -> None:
    c = falling_chain
    low, high = band("falling_chain", "longest-step")
    assert strayed(0.9999 * c.LONGEST) < 100.0 < strayed(1.0001 * c.LONGEST)
    assert strayed(0.99 * c.LONGEST) < 10.0 < 1000.0 < strayed(1.01 * c.LONGEST)
    assert low < c.LONGEST * math.exp(-c.SEARCHED) < c.LONGEST < high


def test_links_that_land_flat_slide_as_fast_as_one_in_exact_steps() -> None:
    """A link in fractions: the floor's impulses up add up to the weight's, and friction is µ of each while it slides."""
    c = falling_chain
    h, g, friction = Fraction(1, 60), Fraction(c.GRAVITY), Fraction(c.FRICTION)
    gap, up, ahead = Fraction(c.LOW), Fraction(0), Fraction(c.ALONG)
    for _ in range(round(c.LANDED / c.TIME_STEP)):
        free = up - h * g
        pressed = max(Fraction(0), -gap / h - free)  # a gap may close, no more
        up = free + pressed
        gap += h * up
        ahead -= friction * pressed
        assert ahead > 0
    assert gap == up == 0
    assert float(ahead) == pytest.approx(c.ALONG - c.FRICTION * c.GRAVITY * c.LANDED, rel=1e-14)
    assert band("falling_chain", "most-links") == (c.COUNTS[-1], c.COUNTS[-1])
