"""Where machines, wires, chains and what floats must break: each band found again without the engine."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import simulate
from spook_tracker.scalar_tests import floating_box, wires
from spook_tracker.scalar_tests.bracket import is_stable
from spook_tracker.scalar_tests.case import StabilityMap
from spook_tracker.scalar_tests.catalogue import CATALOGUE


def band(test: str, study: str) -> tuple[float, float]:
    found = next(one.expected for one in CATALOGUE[test].stability if one.name == study)
    assert found is not None
    return found


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
