"""Where the limits of machines, vehicles, ropes and things that float come from: each found again without the engine."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from spook_tracker.scalar_tests.fluids import floating_box, rolling_log, sinking_sphere
from spook_tracker.scalar_tests.mechanisms import loose_bearing, motor, scissor_lift, slider_crank
from spook_tracker.scalar_tests.robots import grasp, robot_arm
from spook_tracker.scalar_tests.ropes import rope
from spook_tracker.scalar_tests.rotation import bowl
from spook_tracker.scalar_tests.vehicles import cornering
from tests.oracles.crank import cranked, stepped
from tests.scalar_tests.limits import band, measurement


def test_the_motor_leads_by_the_sum_of_the_turns_of_its_steps() -> None:
    """A step turns by h ω, the speed after it."""
    h = motor.TIME_STEP
    speed = np.minimum(
        motor.TORQUE / motor.INERTIA * h * np.arange(1, round(motor.DURATION / h) + 1), motor.SPEED
    )
    turned = float(np.sum(h * speed))
    lead = (turned - float(motor.exact_angle(motor.DURATION))) / motor.LEAD - 1.0
    metric = next(m for m in measurement("motor", "bounded").metrics if m.name == "angle_lead")

    assert metric.passes(lead), lead


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
                    ((f * c.AHEAD - r * c.BACK) / c.SPEED, (f * c.AHEAD**2 + r * c.BACK**2) / c.SPEED),
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


def test_cranks_and_pins_lag_as_damped_rows_do_and_run_ahead_by_the_turn_of_a_step() -> None:
    """The rows of a step in the plane, run by themselves; the crank's place by its speed and the time."""
    s, b, h = slider_crank, loose_bearing, slider_crank.TIME_STEP

    def off(duration: float, guided: bool) -> np.ndarray:
        steps = round(duration / h)
        angles = s.START + s.SPEED * h * np.arange(steps + 1)
        exact = s.CRANK * np.cos(angles) + np.sqrt(s.ROD**2 - (s.CRANK * np.sin(angles)) ** 2)
        return cranked(s.CRANK, s.SPEED, steps, guided) - exact

    first = round(s.SETTLED / h)
    limits = {m.name: m.limit for m in measurement("slider_crank", "plain").metrics}
    found = off(s.DURATION, False)[first:]
    assert float(np.abs(found).max()) < limits["place_error"] < 1.04 * float(np.abs(found).max())
    np.testing.assert_allclose(found, s.strayed(h, s.DURATION), atol=h * s.SPEED * float(np.abs(found).max()))
    times = h * (np.arange(1, round(s.DURATION / h) + 1) - 0.5)
    carried = stepped(s.CRANK, s.SPEED, len(times))[1] - s.torque(s.START + s.SPEED * times)
    off_torque = float(np.abs(carried[first - 1 :]).max() / np.abs(s.torque(s.TURN)).max())
    assert off_torque < limits["torque_error"] < 1.002 * off_torque

    limits = {m.name: m.limit for m in measurement("loose_bearing", "plain").metrics}
    found = off(b.DURATION, True)
    assert float(np.abs(found).max()) < limits["stuck_error"] < 1.04 * float(np.abs(found).max())
    left, strikes, flies = b.flights()[0]
    swings = float(np.abs(np.gradient(found, h)[first:]).max())
    jerk = abs(b.acceleration(left + 1e-4) - b.acceleration(left - 1e-4)) / 2e-4
    short = jerk * h * h / 6.0
    assert short + swings < limits["flight_error"] * abs(flies) < 1.05 * (short + swings)
    assert limits["place_error"] == pytest.approx(
        limits["stuck_error"] + (strikes - left) * (short + swings), rel=0.04
    )


def test_a_slider_with_play_flies_and_hits_where_an_integration_with_events_says() -> None:
    """Pin and slider as masses on a line: pressed at a wall until the force would pull, free until the gap has closed."""
    b, s = loose_bearing, slider_crank
    crank, rod = s.CRANK, s.ROD

    def moved(t: float) -> tuple[float, float, float]:
        """Place, speed and acceleration of the pin: x = r cos θ + q, q² = l² − r² sin²θ."""
        c, n, w = math.cos(s.START + s.SPEED * t), math.sin(s.START + s.SPEED * t), s.SPEED
        q = math.sqrt(rod**2 - (crank * n) ** 2)
        first = -(crank**2) * n * c * w / q
        second = (-(crank**2) * (c * c - n * n) * w * w - first**2) / q
        return crank * c + q, -crank * n * w + first, -crank * c * w * w + second

    def event(function: object, rising: float) -> object:
        function.terminal, function.direction = True, rising  # type: ignore[attr-defined]
        return function

    time, side, found = 0.0, 1.0, []
    tight = {"rtol": 1e-10, "atol": 1e-12, "max_step": 0.01}
    while True:
        pressed = event(lambda t, y, side=side: -side * moved(t)[2], -1.0)
        left = solve_ivp(lambda t, y: (0.0,), (time, 9.0), (0.0,), events=pressed, **tight).t[-1]
        apart = event(lambda t, y, side=side: side * (y[0] - moved(t)[0]) + b.PLAY, -1.0)
        start = (moved(left)[0] + side * b.PLAY, moved(left)[1])
        flight = solve_ivp(lambda t, y: (y[1], 0.0), (left, 9.0), start, events=apart, **tight)
        time, side = float(flight.t[-1]), -side
        if time > b.DURATION:
            break
        found.append((left, time, flight.y[1, -1]))
        assert b.path(np.array((0.5 * (left + time),)))[0] == pytest.approx(
            float(start[0] + start[1] * 0.5 * (time - left)), abs=1e-8
        )
    np.testing.assert_allclose(b.flights(), found, atol=1e-7)
    # The fastest mean speed of a step, wherever the fastest moment lies in it, is short by j h²/6 at most.
    h, left = b.TIME_STEP, found[0][0]
    slowest = max if moved(left)[1] > 0.0 else min
    short = max(
        abs(
            slowest((moved(t + h)[0] - moved(t)[0]) / h for t in left + shift + h * np.arange(-2, 2))
            - moved(left)[1]
        )
        for shift in np.linspace(0.0, h, 9)
    )
    assert 0.0 < short < b.flight_error(h)


def test_a_preload_shuts_a_bearing_that_takes_as_much_to_turn_back() -> None:
    """The pin of a crank in steps, its joints behind by 5/4 h² of what the ends they tie turn apart."""
    b, s, h = loose_bearing, slider_crank, loose_bearing.TIME_STEP
    low, high = band("loose_bearing", "preload")

    def needed(behind: float, times: np.ndarray) -> float:
        """The largest push of a wall that holds the slider back [N]; rod's middle and lean give way to the gaps."""
        angle = s.SPEED * times
        lean = np.arcsin(s.CRANK * np.sin(angle) / s.ROD)
        turned = s.CRANK * np.cos(angle) * s.SPEED / (s.ROD * np.cos(lean))
        out = np.array((np.cos(lean), -np.sin(lean)))
        bends = behind * h * h * 0.5 * s.ROD * turned**2 * out  # of the near end; the far one's is opposite
        crank = -behind * h * h * s.SPEED**2 * s.CRANK * np.array((np.cos(angle), np.sin(angle)))
        gap = bends - crank
        # The near end is off by the gap; across the guide the far one by what it bends, the other way.
        more = (bends[1] + gap[1]) / (s.ROD * np.cos(lean))
        shift = gap[0] - s.ROD * np.sin(lean) * more
        x = s.CRANK * np.cos(angle) + s.ROD * np.cos(lean) + shift
        return s.SLIDER * float(np.max(2.0 * x[1:-1] - x[2:] - x[:-2])) / (times[1] - times[0]) ** 2

    assert needed(0.0, np.arange(-20, 21) * 1e-4) == pytest.approx(b.PRELOAD, rel=1e-6)
    found = [needed(1.25, np.arange(-3, 245) * h + part * h) for part in np.linspace(0.0, 1.0, 9)]
    assert low < min(found) and 1.001 * max(found) < high
    assert max(found) / b.PRELOAD > 1.0 + 0.2 * (high / b.PRELOAD - 1.0)  # nor is the band much wider


def test_a_load_so_many_arms_heavy_is_seen_through_the_floor_of_pivots() -> None:
    """An arm gives way by 4/m at its ends and by 1/m in its middle, pushed across; a load by 1/M."""
    s = scissor_lift
    moment = s.ARM * s.BAR**2 / 12.0
    yielding = [1.0 / s.ARM + x**2 / moment for x in (0.0, 0.5 * s.BAR)]
    assert yielding == pytest.approx([1.0 / s.ARM, 4.0 / s.ARM])
    ratio = s.RATIOS[-1]
    off = s.FLOOR * yielding[1] * ratio * s.ARM  # of a pivot 1/M, by a floor of the diagonal's
    assert s.loaded(ratio) == pytest.approx(off**2)
    assert s.loaded(s.TEST.stability[0].expected[0]) == pytest.approx(1e-6)  # type: ignore[index]
    assert s.loaded(s.TEST.stability[0].expected[1]) == pytest.approx(1.0)  # type: ignore[index]
    # Lift rate and force are one leverage: height n √(l² − w²) by the width.
    for angle in s.ANGLES:
        w, d = s.BAR * math.cos(angle), 1e-6
        rate = (math.sqrt(s.BAR**2 - (w - d) ** 2) - math.sqrt(s.BAR**2 - (w + d) ** 2)) / (2.0 * d)
        assert s.holding_force(7, angle, 3.0, 0.0) == pytest.approx(4.0 * s.GRAVITY * 7.0 * rate, rel=1e-6)


def test_what_is_pressed_a_little_too_weakly_has_slipped_a_millimetre_in_a_second() -> None:
    g = grasp
    (study,) = (s for s in g.TEST.stability if s.name == "least-force")
    assert study.expected is not None
    assert g.slips_after(study.expected[0]) < g.DURATION
    assert g.slips_after(0.9999) > g.DURATION
    weight, pressed = g.MASS * g.GRAVITY, 2.0 * g.FRICTION * g.LEAST
    assert pressed == pytest.approx(weight)
    fallen = 0.5 * g.acceleration(0.99) * g.slips_after(0.99) ** 2
    assert fallen == pytest.approx(g.SLIPPED)


def test_a_small_roll_rights_itself_with_its_metacentre_and_a_little_more() -> None:
    """The pendulum of GZ by quadrature of its period, no heave; and the heave that a roll drives is not near resonance."""
    f, hull = rolling_log, floating_box
    u, weights = np.polynomial.legendre.leggauss(40)
    for ratio in f.ROLLED:
        amplitude = 0.01
        # ½ φ'² = ∫ GZ g m/I: with φ = A sin s the quarter of the period is ∫ A cos s/φ' ds
        s = 0.25 * math.pi * (u + 1.0)
        gain = hull.GRAVITY * 6.0 / hull.SIDE**2
        fine = np.polynomial.legendre.leggauss(12)

        def work(low: float, high: float, ratio: float = ratio, fine: tuple = fine) -> float:
            angles = 0.5 * (high - low) * (fine[0] + 1.0) + low
            return (
                0.5
                * (high - low)
                * sum(w * hull.righting_arm(ratio, a) for a, w in zip(angles, fine[1], strict=True))
            )

        speeds = np.array([math.sqrt(2.0 * gain * work(amplitude * math.sin(x), amplitude)) for x in s])
        quarter = float(np.sum(0.25 * math.pi * weights * amplitude * np.cos(s) / speeds))
        faster = 0.5 * math.pi / quarter / f.roll_rate(ratio) - 1.0

        # The limit is in parts of that; beside it what the step adds, (h ω)²/24.
        assert abs(faster) < f.swing_limit(ratio) / hull.NUDGE**2 * amplitude**2
        assert not 0.75 < 2.0 * f.roll_rate(ratio) / hull.heave_rate(ratio) < 1.33
    limits = {m.name: m.limit for m in measurement("rolling_log", "plain").metrics}
    turn = hull.TIME_STEP * f.roll_rate(f.ROLLED[0])
    assert limits["continuous_error"] == pytest.approx(math.acos(1.0 - 0.5 * turn**2) / turn - 1.0, rel=0.06)
    for place in (f.LIGHT, f.HEAVY):
        assert hull.metacentric_height(place) == pytest.approx(0.0, abs=1e-15)
        beyond = place + (f.blurred(place) - 1e-3 * place) * (1.0 if place < 0.5 else -1.0)
        grows = math.sqrt(-hull.GRAVITY * hull.metacentric_height(beyond) * 6.0 / hull.SIDE**2)
        assert math.cosh(20.0 * grows) == pytest.approx(10.0, rel=0.01)
