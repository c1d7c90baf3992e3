"""Where limits and set points of our own come from: each found again without the engine."""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping
from pathlib import Path
from types import FunctionType

import numpy as np
import pytest

from spook_tracker.engine import simulate, theory
from spook_tracker.engine.theory import one_row_matrix
from spook_tracker.scalar_tests.case import Measurement, Simulate
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.scalar_tests.oscillators import double_pendulum
from spook_tracker.scalar_tests.oscillators.oscillator import damped
from spook_tracker.scalar_tests.oscillators.oscillator import scene as oscillator
from spook_tracker.scalar_tests.ropes.chain import GRAVITY
from spook_tracker.scalar_tests.ropes.hanging_chain import scene as hanging
from spook_tracker.scalar_tests.thesis.beam import scene as beam
from spook_tracker.scalar_tests.thesis.cantilever import statics
from spook_tracker.scalar_tests.thesis.pendulum import scene as pendulum
from spook_tracker.scalar_tests.thesis.planetarium.metrics import OUR_SET_POINT
from spook_tracker.scalar_tests.thesis.planetarium.scene import (
    DURATION,
    GAUSS,
    SPEED,
    TIME_STEP,
    exact_position,
    orbit_radius,
)
from tests.oracles import chain as oracle_chain
from tests.oracles import rigid_simulate as oracle_rigid_simulate
from tests.oracles import simulate as oracle_simulate
from tests.places import ROOT
from tests.scalar_tests.limits import measurement
from tests.toys.broken_engines import off_by


def assert_derived(asked: Measurement, values: Mapping[str, float]) -> None:
    """Bands hold the value that was found without the engine, limits do, and hardly more."""
    for metric in asked.metrics:
        value = values.get(metric.name)
        if value is not None:
            assert metric.passes(value), (metric.name, value)
            assert metric.holds_set_point(value), (metric.name, value, metric.set_point)
            owed = "discrete solution" in metric.limit_source and "roundings" not in metric.limit_source
            if owed and metric.better != "larger":
                assert isinstance(metric.limit, float)
                assert metric.limit <= 1.03 * abs(value), (metric.name, value, metric.limit)


@pytest.mark.parametrize(
    ("asked", "prototype"),
    [
        pytest.param(asked, prototype, id=f"{test} {asked.configuration} {number}")
        for prototype, tests in (
            (oracle_simulate.simulate, ("falling_object", "pendulum", "hanging_chain")),
            (oracle_simulate.simulate, ("oscillator_row", "oscillator_damped", "oscillator_filter")),
            (oracle_rigid_simulate.simulate, ("spinning_top", "swinging_door")),
        )
        for test in tests
        for number, asked in enumerate(CATALOGUE[test].measurements)
        if asked.configuration not in ("long run", "string")
    ],
)
def test_the_dense_prototype_gives_what_is_published(asked: Measurement, prototype: Simulate) -> None:
    dense, native = asked.measure(prototype), asked.measure(simulate)

    assert_derived(asked, dense)
    assert dense.keys() == native.keys()
    for metric, value in dense.items():
        assert native[metric] == pytest.approx(value, rel=1e-9, abs=1e-9), metric


@pytest.mark.parametrize(
    ("configuration", "count", "substeps", "corrections"),
    [
        ("plain", 26, 1, 0),
        ("curved twice", 26, 1, 2),
        ("two substeps", 26, 2, 0),
        ("eight substeps", 400, 8, 0),
        ("eight substeps, curved", 400, 8, 1),
    ],
)
def test_the_chain_prototype_gives_what_is_published(
    configuration: str, count: int, substeps: int, corrections: int
) -> None:
    run = oracle_chain.swing(
        oracle_chain.level(count), 1 / 60, 1320, substeps=substeps, corrections=corrections
    )
    stretch = 100.0 * np.abs(run.violation)
    energy = 100.0 * run.energy / (9.81 * count * (count + 1) / 2)
    values = {
        "length_deviation": float(stretch.max()),
        "length_deviation_early": float(stretch[:241].max()),
        "weakest_link": float(stretch.max(axis=0).argmax()) + 1.0,
        "energy_at_10_s": float(energy[600]),
        "energy_at_the_end": float(energy[-1]),
        "energy_gain": float(energy.max()),
    }

    assert_derived(measurement("n_pendulum", configuration), values)


def test_a_chain_that_falls_may_read_its_energy_off_by_half_a_step() -> None:
    limits = {m.name: m.limit for m in measurement("n_pendulum", "eight substeps").metrics}
    bound = 100.0 * math.sqrt(9.81 / 401.0) / 60.0  # ½ h g √(2 M/E) of everything fallen

    assert limits["energy_gain"] == pytest.approx(bound, rel=0.04)
    assert limits["energy_at_10_s"] == pytest.approx(-bound, rel=0.04)


def small_motion(ratio: float, *, string: bool) -> dict[str, float]:
    """What the linear map of the leaning chain does: (M + K̃ + D̃)(v₊ − v) = −D̃ v − h K x, x₊ = x + h v₊."""
    count, h = hanging.COUNT, hanging.TIME_STEP
    mass = np.append(np.ones(count - 1), ratio)
    tension = GRAVITY * np.cumsum(mass[::-1])[::-1]
    apart = np.eye(count) - np.eye(count, k=-1)
    light = 1.0 / mass + np.append(0.0, 1.0 / mass[:-1])
    held = 0.25 * h**2 * tension if string else 0.0 * tension
    damping = np.where(0.5 * h**2 * tension * light > 0.3, held, 0.0)
    stiffness, drag = (apart.T @ np.diag(part) @ apart for part in (tension, damping))
    heavy = np.diag(mass) + apart.T @ np.diag(held) @ apart + drag
    x, v = math.sin(hanging.TILT) * np.arange(1.0, count + 1.0), np.zeros(count)
    load, energy = [x[-1]], [0.5 * x @ stiffness @ x]
    for _ in range(hanging.STEPS):
        v = v + np.linalg.solve(heavy, -drag @ v - h * stiffness @ x)
        x = x + h * v
        load.append(x[-1])
        energy.append(0.5 * v @ (mass * v) + 0.5 * x @ stiffness @ x)
    above = (np.array(energy) - energy[0]) / hanging.lift(ratio)
    exact = hanging.exact_load(ratio, h * np.arange(hanging.STEPS + 1))
    return {
        "path_error": float(np.abs(np.array(load) - exact).max()) / (count * hanging.TILT),
        "energy_gain": float(above.max()),
        "energy_lost": float(-above[-hanging.STEPS // 4 :].mean()),
    }


def test_string_stiffness_costs_what_its_map_of_small_motion_costs() -> None:
    asked, values = measurement("hanging_chain", "string"), small_motion(hanging.HEAVY, string=True)

    assert_derived(asked, values)
    limits = {metric.name: metric.limit for metric in asked.metrics}
    assert limits["path_error"] == pytest.approx(values["path_error"], rel=0.015)
    assert limits["energy_lost"] == pytest.approx(values["energy_lost"], rel=0.015)


def test_string_stiffness_costs_next_to_nothing_where_it_is_not_needed() -> None:
    with_it, without = (small_motion(hanging.LIGHT, string=string)["energy_lost"] for string in (True, False))
    (cost,) = measurement("hanging_chain", "string", 1).metrics

    assert cost.limit == pytest.approx(with_it - without, rel=0.05)


def test_the_links_of_a_swinging_chain_leave_out_the_curvature_of_their_turn() -> None:
    turn = hanging.TILT * math.sqrt(GRAVITY / hanging.COUNT)
    (length, *_) = measurement("hanging_chain", "string").metrics

    assert length.holds_set_point(0.75 * (hanging.TIME_STEP * turn) ** 2)


@pytest.mark.parametrize(("configuration", "leap"), [("plain", False), ("half-step", True)])
def test_the_orbit_errs_as_its_map_iterated_by_itself(configuration: str, leap: bool) -> None:
    h, x, v = TIME_STEP, 1.0 + 0.0j, complex(*SPEED[:2])

    def pull(x: complex) -> complex:
        return -(GAUSS**2) * x / abs(x) ** 3

    start, swing, radius = 0.5 * abs(v) ** 2 - GAUSS**2, 0.0, 0.0
    v = v - 0.5 * h * pull(x) if leap else v
    for step in range(1, round(DURATION / h) + 1):
        v = v + h * pull(x)
        x = x + h * v
        seen = v + 0.5 * h * pull(x) if leap else v
        away = abs(x)
        swing = max(swing, abs((0.5 * abs(seen) ** 2 - GAUSS**2 / away) / start - 1.0))
        if step % 60 == 0:
            radius = max(radius, abs(away - orbit_radius(math.atan2(x.imag, x.real))))
    values = {
        "energy_oscillation": 100.0 * swing,
        "radius_error": radius,
        "position_error": abs(x - complex(*exact_position(DURATION))),
    }
    asked = measurement("planetarium", configuration)

    for metric in asked.metrics:
        if metric.name in values:
            assert metric.passes(values[metric.name]), (metric.name, values[metric.name])
            assert metric.holds_set_point(values[metric.name]), (metric.name, values[metric.name])
            if metric.role != "gate":
                assert isinstance(metric.limit, float) and metric.limit <= 1.02 * values[metric.name], (
                    metric.name
                )


def test_damping_leaves_the_continuum_as_far_as_the_map_does() -> None:
    step = one_row_matrix(oscillator.MASS, 1.0 / oscillator.STIFFNESS, damped.DAMPING, oscillator.TIME_STEP)
    path = [np.array([oscillator.START, 0.0])]
    for _ in range(oscillator.STEPS):
        path.append(step @ path[-1])
    exact = damped._damped_wave(oscillator.TIME_STEP * np.arange(oscillator.STEPS + 1))
    value = float(np.abs(np.array(path)[:, 0] - exact).max())
    metric = next(
        m for m in measurement("oscillator_damped", "plain").metrics if m.name == "against_continuum"
    )

    assert metric.passes(value) and metric.holds_set_point(value)
    assert metric.limit == pytest.approx(value, rel=1e-3)


def test_a_cantilever_of_pieces_differs_from_the_elastica_by_its_own_statics() -> None:
    metric = next(m for m in measurement("cantilever", "dynamic").metrics if m.name == "tip_against_elastica")
    exact = statics.chain_tip(80) / statics.elastica_tip() - 1.0

    assert metric.limit == pytest.approx(exact + 1e-7, rel=0.01)


# --- what a gate would catch that can hardly fail ---------------------------------------------------------


@pytest.mark.parametrize(
    ("test", "index", "quantity", "caught", "missed"),
    [
        ("falling_object", 0, "gravity", 1.00170, 1.00160),
        ("planetarium", 1, "strength", 1.00065, 1.00050),
        ("door", 0, "gravity", 1.00021, 1.00019),
        ("friction", 0, "friction", 0.99975, 0.99985),
    ],
)
def test_a_wide_gate_catches_what_it_says(
    test: str, index: int, quantity: str, caught: float, missed: float
) -> None:
    asked = CATALOGUE[test].measurements[0]
    gate = [metric for metric in asked.metrics if metric.role == "gate"][index]

    assert "would catch" in gate.limit_source
    assert not gate.passes(asked.measure(off_by(caught, quantity))[gate.name])
    assert gate.passes(asked.measure(off_by(missed, quantity))[gate.name])


def test_explicit_euler_passes_the_printed_limit_of_the_orbit_and_misses_its_set_point() -> None:
    x, v = 1.0 + 0.0j, complex(*SPEED[:2])
    start = 0.5 * abs(v) ** 2 - GAUSS**2
    for _ in range(round(DURATION / TIME_STEP)):
        x, v = x + TIME_STEP * v, v - TIME_STEP * GAUSS**2 * x / abs(x) ** 3
    creep = 100.0 * abs((0.5 * abs(v) ** 2 - GAUSS**2 / abs(x)) / start - 1.0)
    gate = next(m for m in measurement("planetarium", "plain").metrics if m.name == "energy_oscillation")

    assert creep == pytest.approx(1.16, abs=0.01)
    assert gate.passes(creep) and not gate.holds_set_point(creep)


def test_the_gate_of_the_beam_catches_the_compliance_it_says() -> None:
    """The sag of compliant locks is proportional to the compliance: 2.134e-7 m of 10 m at 1e-12."""
    gate = CATALOGUE["beam"].measurements[0].metrics[0]
    sag = 100.0 * beam.sag_of_compliant_beam(beam.COUNT, 2.3e-15) / (beam.COUNT * beam.SIZE[0])

    assert "would catch" in gate.limit_source
    assert gate.limit == pytest.approx(sag, rel=0.01)


def test_the_double_pendulum_may_be_half_a_step_off() -> None:
    times = np.arange(0.0, double_pendulum.DURATION, 1e-4)
    rates = np.gradient(double_pendulum.exact(tuple(times.tolist())), times, axis=0)
    gate = CATALOGUE["double_pendulum"].measurements[0].metrics[0]

    assert gate.limit == pytest.approx(0.5 * double_pendulum.TIME_STEP * np.abs(rates).max(), rel=2e-3)


def test_the_closed_forms_of_theory_are_the_limits_and_references_of_the_pendulum_and_the_orbit() -> None:
    length = measurement("pendulum", "plain").metrics[0]
    swing = 100.0 * theory.kepler_energy_swing(GAUSS, 0.017, TIME_STEP)  # %

    assert theory.pendulum_period(9.81, 1.0, math.pi / 2) == pytest.approx(pendulum.period(), rel=1e-15)
    assert length.limit == pytest.approx(
        100.0 * theory.pendulum_length_deviation(9.81, 1.0, 1 / 60, 1 / 60), rel=1e-3
    )
    assert swing == pytest.approx(9.76e-4, rel=1e-3)
    assert f"{9.76e-4:.2e} %".replace("e-04", "e-4") in OUR_SET_POINT


def called_from_theory(path: Path) -> set[str]:
    """The closed forms a file calls: imported from engine.theory by name, or read off that module."""
    text = path.read_text(encoding="utf-8")
    if "theory" not in text:
        return set()
    tree = ast.parse(text)
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    names = {
        alias.asname or alias.name: alias.name
        for node in imports
        if node.module == "spook_tracker.engine.theory"
        for alias in node.names
    }
    modules = {
        alias.asname or alias.name
        for node in imports
        if node.module == "spook_tracker.engine"
        for alias in node.names
        if alias.name == "theory"
    }
    asked = [node.func for node in ast.walk(tree) if isinstance(node, ast.Call)]
    by_name = {names[f.id] for f in asked if isinstance(f, ast.Name) and f.id in names}
    by_module = {
        f.attr
        for f in asked
        if isinstance(f, ast.Attribute) and isinstance(f.value, ast.Name) and f.value.id in modules
    }
    return by_name | by_module


def test_every_closed_form_of_theory_is_called_by_a_scalar_test_or_a_test() -> None:
    files = [*(ROOT / "scalar_tests").rglob("*.py"), *(ROOT / "tests").rglob("*.py")]
    called = set().union(*map(called_from_theory, files))
    forms = {
        name
        for name, form in vars(theory).items()
        if isinstance(form, FunctionType) and form.__module__ == theory.__name__
    }

    assert len(forms) >= 8
    assert forms - called == set()


def test_the_coefficients_of_a_row_are_those_of_the_limit_of_no_damping_and_of_the_map() -> None:
    """θ = 0 leaves half the correction of a violation a step to every row; of the map det A = 1 there."""
    free = theory.row_coefficients(1e-3, 0.0, 0.01)
    soft = theory.row_coefficients(1e-3, 0.02, 0.01)

    assert free.upsilon == 1.0
    assert soft.upsilon == pytest.approx(1.0 / 9.0)
    assert np.linalg.det(one_row_matrix(1.0, 1e-3, 0.0, 0.01)) == pytest.approx(1.0, rel=1e-13)
