"""Where limits and set points of our own come from: each found again without the engine."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from types import FunctionType

import numpy as np
import pytest

from spook_tracker.engine import theory
from spook_tracker.engine.theory import one_row_matrix
from spook_tracker.scalar_tests import (
    bowl,
    capstan,
    cornering,
    double_pendulum,
    floating_box,
    gears,
    motor,
    robot_arm,
    rope,
    sinking_sphere,
    slider_crank,
    wires,
)
from spook_tracker.scalar_tests.beam import scene as beam
from spook_tracker.scalar_tests.cantilever import statics
from spook_tracker.scalar_tests.case import Measurement, Simulate
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.scalar_tests.chain import GRAVITY
from spook_tracker.scalar_tests.hanging_chain import scene as hanging
from spook_tracker.scalar_tests.oscillator import damped
from spook_tracker.scalar_tests.oscillator import scene as oscillator
from spook_tracker.scalar_tests.pendulum import scene as pendulum
from spook_tracker.scalar_tests.planetarium.metrics import OUR_SET_POINT
from spook_tracker.scalar_tests.planetarium.scene import (
    DURATION,
    GAUSS,
    SPEED,
    TIME_STEP,
    exact_position,
    orbit_radius,
)
from tests import oracle_chain, oracle_rigid_simulate, oracle_simulate
from tests.broken_engines import off_by


def measurement(test: str, configuration: str, index: int = 0) -> Measurement:
    return [m for m in CATALOGUE[test].measurements if m.configuration == configuration][index]


def assert_derived(asked: Measurement, values: Mapping[str, float]) -> None:
    """Bands hold the value that was found without the engine, limits do, and hardly more."""
    for metric in asked.metrics:
        value = values.get(metric.name)
        if value is not None:
            assert metric.passes(value), (metric.name, value)
            assert metric.holds_set_point(value), (metric.name, value, metric.set_point)
            if "discrete solution" in metric.limit_source and metric.better != "larger":
                assert isinstance(metric.limit, float)
                assert metric.limit <= 1.03 * abs(value), (metric.name, value, metric.limit)


@pytest.mark.parametrize(
    ("test", "configuration", "engine"),
    [
        ("pendulum", "plain", oracle_simulate.simulate),
        ("pendulum", "curved", oracle_simulate.simulate),
        ("pendulum", "curved twice", oracle_simulate.simulate),
        ("hanging_chain", "plain", oracle_simulate.simulate),
        ("spinning_top", "plain", oracle_rigid_simulate.simulate),
        ("swinging_door", "plain", oracle_rigid_simulate.simulate),
    ],
)
def test_the_dense_prototype_gives_what_is_published(test: str, configuration: str, engine: Simulate) -> None:
    for asked in CATALOGUE[test].measurements:
        if asked.configuration == configuration:
            assert_derived(asked, asked.measure(engine))


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
    h, x, v = TIME_STEP, np.array([1.0, 0.0]), np.array(SPEED[:2])

    def pull(x: np.ndarray) -> np.ndarray:
        return np.asarray(-(GAUSS**2) * x / math.sqrt(x @ x) ** 3)

    start, swing, radius = 0.5 * v @ v - GAUSS**2, 0.0, 0.0
    v = v - 0.5 * h * pull(x) if leap else v
    for step in range(1, round(DURATION / h) + 1):
        v = v + h * pull(x)
        x = x + h * v
        seen = v + 0.5 * h * pull(x) if leap else v
        away = math.sqrt(x @ x)
        swing = max(swing, abs((0.5 * seen @ seen - GAUSS**2 / away) / start - 1.0))
        if step % 60 == 0:
            radius = max(radius, abs(away - orbit_radius(math.atan2(x[1], x[0]))))
    values = {
        "energy_oscillation": 100.0 * swing,
        "radius_error": radius,
        "position_error": float(np.hypot(*(x - exact_position(DURATION)))),
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


def test_the_motor_leads_by_the_sum_of_the_turns_of_its_steps() -> None:
    """A step turns by 2 asin(h w/2) with √(1 − h² w²/4) w = ω, the speed after it."""
    h = motor.TIME_STEP
    speed = np.minimum(
        motor.TORQUE / motor.INERTIA * h * np.arange(1, round(motor.DURATION / h) + 1), motor.SPEED
    )
    turned = float(np.sum(2.0 * np.arcsin(np.sqrt(0.5 * (1.0 - np.sqrt(1.0 - (h * speed) ** 2))))))
    lead = (turned - float(motor.exact_angle(motor.DURATION))) / motor.LEAD - 1.0
    metric = next(m for m in measurement("motor", "bounded").metrics if m.name == "angle_lead")

    assert metric.passes(lead) and metric.holds_set_point(lead), lead
    assert metric.limit == pytest.approx(lead, rel=0.01)


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
    x, v = np.array([1.0, 0.0]), np.array(SPEED[:2])
    start = 0.5 * v @ v - GAUSS**2
    for _ in range(round(DURATION / TIME_STEP)):
        x, v = x + TIME_STEP * v, v - TIME_STEP * GAUSS**2 * x / math.sqrt(x @ x) ** 3
    creep = 100.0 * abs((0.5 * v @ v - GAUSS**2 / math.sqrt(x @ x)) / start - 1.0)
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


def test_a_discrete_oscillation_is_shorter_by_the_cube_of_its_step() -> None:
    """sin(θ/2) = h ω/2: the period of heave and swing, found by iterating the map of one step."""
    for rate, test, configuration, metric in (
        (floating_box.heave_rate(), "floating_box", "plain", "period_error"),
        (sinking_sphere.SWING_RATE, "sinking_sphere", "pendulum", "swing_error"),
    ):
        (gate,) = (m for m in measurement(test, configuration).metrics if m.name == metric)
        h, x, v, trace = 1.0 / 60.0, 1.0, 0.0, [1.0]
        for _ in range(3600):
            v -= h * rate**2 * x
            x += h * v
            trace.append(x)
        found = floating_box.period(h * np.arange(3601), trace) * rate / (2.0 * math.pi) - 1.0

        assert gate.passes(found)
        assert found == pytest.approx(-((h * rate) ** 2) / 24.0, rel=0.03)


def test_a_drum_and_a_train_of_gears_turn_more_than_their_rows_say() -> None:
    """φ with sin φ = h ω: (h ω)²/6 of a speed, θ Σ z (h ω)³/6 of the meshes."""
    spin = wires.TURNING * wires.DURATION / wires.RADIUS
    share = wires.DRUM / wires.RADIUS**2 / (wires.HEAVY + wires.LIGHT + wires.DRUM / wires.RADIUS**2)
    limits = {m.name: m.limit for m in measurement("wires", "plain").metrics}
    assert limits["drum_error"] == pytest.approx((wires.TIME_STEP * spin) ** 2 / 6.0 * share, rel=0.01)
    limits = {m.name: m.limit for m in measurement("gears", "plain").metrics}
    assert limits["ratio_error"] == pytest.approx(gears.standing(), rel=0.01)


def test_a_winch_is_faster_by_what_the_turning_of_its_drum_leaves_out() -> None:
    """The drum turns by asin(h ω) a step; starting from rest with the steady torque the same in its share of the mass."""
    h, c = capstan.TIME_STEP, capstan
    limits = {m.name: m.limit for m in measurement("capstan", "winch").metrics}
    lifted = math.asin(h * c.SPEED) / (h * c.SPEED) - 1.0
    # velocities of one step: u for the wire, ω for the drum, u = r asin(h ω)/h; energy gives the rest
    spin = slowly = 0.0
    inertia, mass, r = c.MOMENT, c.LOAD, c.DRUM
    for _ in range(60):
        spin += h * (mass * c.GRAVITY * r - c.TORQUE) / (mass * r * r + inertia)
        slowly = r * spin
    share = inertia / r**2 / (mass + inertia / r**2)
    sunk = share * (math.asin(h * slowly / r) / (h * slowly / r) - 1.0)

    assert lifted <= limits["speed_error"] <= 1.1 * lifted
    assert sunk <= limits["sinking_error"] <= 1.1 * sunk


def test_the_torques_of_a_driven_arm_are_two_steps_late_at_most() -> None:
    (gate,) = measurement("robot_arm", "driven").metrics
    assert gate.limit == pytest.approx(robot_arm.lag_bound(), rel=0.01)
    # The reference itself: torques times speeds are the rate of the energy of a driven arm.
    pose, speeds, h = np.array(robot_arm.POSES[1]), np.array(robot_arm.SPEEDS), 1e-5

    def energy(at: np.ndarray) -> float:
        _, velocities, spins = robot_arm.inverse_dynamics(at, speeds, np.zeros(6))
        arm = robot_arm.kinematics(at)
        total = 0.0
        for (_, _, centre, turn), (_, _, _, mass, inertia), v, w in zip(
            arm, robot_arm.LINKS, velocities, spins, strict=True
        ):
            total += (
                0.5 * mass * v @ v + 0.5 * w @ turn @ np.diag(inertia) @ turn.T @ w + mass * 9.81 * centre[2]
            )
        return total

    torques, _, _ = robot_arm.inverse_dynamics(pose, speeds, np.zeros(6))
    power = (energy(pose + h * speeds) - energy(pose - h * speeds)) / (2.0 * h)
    assert torques @ speeds == pytest.approx(power, rel=1e-8)


def test_the_terminal_speed_is_the_fixed_point_of_a_step_and_is_reached() -> None:
    v, h = 0.0, sinking_sphere.TIME_STEP
    for _ in range(600):
        v += h * (sinking_sphere.PULL - sinking_sphere.RESISTANCE * v * v)
    assert measurement("sinking_sphere", "plain").metrics[0].passes(v / sinking_sphere.TERMINAL - 1.0)


def test_a_square_log_falls_between_the_densities_of_its_metacentre() -> None:
    for ratio in (0.5 - math.sqrt(1.0 / 12.0), 0.5 + math.sqrt(1.0 / 12.0)):
        assert floating_box.metacentric_height(ratio) == pytest.approx(0.0, abs=1e-15)
    assert all(floating_box.metacentric_height(ratio) > 0.0 for ratio in floating_box.UPRIGHT)
    assert all(floating_box.metacentric_height(ratio) < 0.0 for ratio in floating_box.TILTED)
    # The righting arm by shoelace formula over the corners of the section below the surface.
    for ratio, roll in ((0.15, 0.1), (0.5, 0.17), (0.85, 0.05)):
        low, c, s = -0.5, math.cos(roll), math.sin(roll)
        edge = ratio - 0.5  # where the surface meets the centre line, at the same displaced area
        y = np.array([0.5, 0.5, low, low])
        z = np.array([low, edge - 0.5 * math.tan(roll), edge + 0.5 * math.tan(roll), low])
        cross = y * np.roll(z, -1) - np.roll(y, -1) * z
        area = 0.5 * cross.sum()
        centre_y = ((y + np.roll(y, -1)) * cross).sum() / (6.0 * area)
        centre_z = ((z + np.roll(z, -1)) * cross).sum() / (6.0 * area)
        assert area == pytest.approx(ratio, rel=1e-12)
        assert -(centre_y * c - centre_z * s) == pytest.approx(
            floating_box.righting_arm(ratio, roll), rel=1e-9
        )


def test_every_closed_form_of_theory_is_asked_by_a_scalar_test_or_a_test() -> None:
    root = Path(__file__).parent.parent
    files = [*(root / "scalar_tests").rglob("*.py"), *(root / "tests").glob("*.py")]
    text = "\n".join(path.read_text() for path in files)
    forms = [name for name, form in vars(theory).items() if isinstance(form, FunctionType)]

    assert len(forms) >= 8
    assert [
        name for name in forms if name != "row_coefficients" and not re.search(rf"\b{name}\b", text)
    ] == []


def test_the_slider_cranks_torque_by_newton_and_euler() -> None:
    """Forces at pin and wrist, the guide's and the motor's: six equations of three bodies in the plane."""
    s = slider_crank
    for theta in (0.3, 1.0, 2.5, 4.4):
        rod = (lambda t: s.CRANK * np.cos(t) + 0.5 * s.ROD * np.cos(s.pin(t)[1]), lambda t: 0.5 * s.pin(t)[2])
        x, y, turn = (
            s.SPEED**2 * float(s.slope(lambda t, f=f: s.slope(f, t, 1e-3), theta, 1e-3))
            for f in (*rod, lambda t: -s.pin(t)[1])
        )
        slide = s.SPEED**2 * float(s.slope(lambda t: s.slope(lambda u: s.pin(u)[0], t, 1e-3), theta, 1e-3))
        c, h = s.CRANK * math.cos(theta), s.CRANK * math.sin(theta)
        a, b = 0.5 * (float(s.pin(theta)[0]) - c), 0.5 * h  # from the rod's middle: the wrist is (a, −b) away
        # Unknown: P on the rod at the pin, Q on the slider at the wrist, N on the slider, τ on the crank.
        matrix = np.array(
            [
                (1, 0, -1, 0, 0, 0),
                (0, 1, 0, -1, 0, 0),
                (-b, -a, -b, -a, 0, 0),
                (0, 0, 1, 0, 0, 0),
                (0, 0, 0, 1, 1, 0),
                (h, -c, 0, 0, 0, 1),
            ]
        )
        inertia = s.ROD_MASS * s.ROD**2 / 12.0
        right = (s.ROD_MASS * x, s.ROD_MASS * y, inertia * turn, s.SLIDER * slide, 0.0, 0.0)

        assert np.linalg.solve(matrix, right)[5] == pytest.approx(float(s.torque(theta)), rel=1e-6)


def test_a_turning_rope_is_longer_by_what_its_damped_rows_let_through() -> None:
    """A steady circle: w h a step, r − l = r (1 − cos w h)(1 + 2θ)/2; the angular momentum stays, m r² w."""
    h, w = rope.TIME_STEP, rope.SPIN
    longer = 1.0 / (1.0 - (1.0 - math.cos(w * h)) * 2.5)
    slower = longer**-2
    pull, energy = slower**2 * longer - 1.0, slower - 1.0
    limits = {m.name: m.limit for m in measurement("rope", "plain").metrics}

    assert abs(pull) <= limits["pull_error"] <= 1.2 * abs(pull)
    assert abs(energy) <= limits["energy_error"] <= 1.2 * abs(energy)


def test_a_bend_passes_on_what_a_tyre_takes_its_speed_too_large_by() -> None:
    """The bicycle model with every stiffness C V/(V + 1 mm/s), solved as two equations of balance."""
    c = cornering
    for configuration, front, rear in (("plain", c.SOFT, c.HARD), ("oversteer", c.HARD, c.SOFT)):
        limits = {m.name: m.limit for m in measurement("cornering", configuration).metrics}
        rates = []
        for speed in (c.SPEED, c.SPEED + c.CREEP):
            f, r, share = 2.0 * front, 2.0 * rear, c.SPEED / speed
            # sideways speed v and yaw rate: forces −C (v ± x w)/V (+ C δ in front) balance m V w and have no moment
            balance = np.array(
                (
                    ((f + r) / c.SPEED, (f * c.AHEAD - r * c.BACK) / c.SPEED + c.MASS * c.SPEED / share),
                    (
                        (f * c.AHEAD - r * c.BACK) / c.SPEED,
                        (f * c.AHEAD**2 + r * c.BACK**2) / c.SPEED,
                    ),
                )
            )
            rates.append(float(np.linalg.solve(balance, c.STEER * f * np.array((1.0, c.AHEAD)))[1]))
        assert rates[0] == pytest.approx(c.yaw(c.SPEED, front, rear), rel=1e-12)
        assert abs(rates[1] / rates[0] - 1.0) <= limits["yaw_error"] <= 3.0 * abs(rates[1] / rates[0] - 1.0)


def test_many_facets_make_a_round_bowl_and_few_of_them_slow_a_ball_down_at_corners() -> None:
    times = np.linspace(0.0, 1.8, 7201)
    shares = [
        bowl.half_period(times, bowl.rolled(times, count)) * bowl.PACE / math.pi - 1.0
        for count in (bowl.FACETS, 1001)
    ]
    limits = {m.name: m.limit for m in measurement("bowl", "plain").metrics}
    smooth, period = limits["smooth_error"], limits["period_error"]

    assert isinstance(smooth, float) and isinstance(period, float)
    assert abs(shares[0]) <= smooth - period <= 1.1 * abs(shares[0])
    assert shares[1] == pytest.approx(
        bowl.facet(1001)[1] ** 2 / 16.0, rel=0.05
    )  # of a swing that is not small
    # At the first corner, after half a facet: v² = 2 a s, then the part (cos Δ + 2/5)/(7/5) of it.
    width, angle = bowl.facet(5)
    half = (bowl.BOWL * math.cos(0.5 * width) - bowl.BALL) * math.tan(0.5 * width)
    pull = 5.0 / 7.0 * bowl.GRAVITY * math.sin(angle)
    reached = math.sqrt(2.0 * half / pull)
    fine = reached + np.linspace(0.0, 1e-3, 2)
    x = bowl.rolled(fine, 5)
    slows = (math.cos(width) + 0.4) / 1.4
    after = -math.sqrt(2.0 * pull * half) * slows * math.cos(angle - width)
    assert (x[1] - x[0]) / 1e-3 == pytest.approx(after, rel=5e-3)
