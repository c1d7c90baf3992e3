"""Where what falls, spins, swings and bends must fail: each band found again without the engine."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from spook_tracker.engine.theory import one_row_matrix
from spook_tracker.scalar_tests.impacts import between_walls
from spook_tracker.scalar_tests.mechanisms import lock_ring, motor
from spook_tracker.scalar_tests.oscillators import bar_pendulum, double_pendulum, seconds_pendulum
from spook_tracker.scalar_tests.oscillators.oscillator import filter as low_pass
from spook_tracker.scalar_tests.oscillators.oscillator.scene import (
    MASS,
    START,
    TIME_STEP,
    stiffness_of_period,
)
from spook_tracker.scalar_tests.rotation import rotating_box, steady_turns, thrown_die
from spook_tracker.scalar_tests.thesis import falling_object
from spook_tracker.scalar_tests.thesis.cantilever import stability as column
from spook_tracker.scalar_tests.thesis.cantilever.scene import DENSITY, deflection
from spook_tracker.scalar_tests.thesis.planetarium import measure as planetarium
from tests.scalar_tests.limits import band


def test_a_fall_keeps_the_printed_limit_up_to_its_longest_step() -> None:
    f = falling_object

    def off(h: float) -> float:
        speed = depth = 0.0
        for _ in range(round(f.DURATION / h)):
            speed += h * f.GRAVITY
            depth += h * speed
        return depth - 0.5 * f.GRAVITY * (round(f.DURATION / h) * h) ** 2

    low, high = band("falling_object", "longest-step")
    for h in np.geomspace(f.TIME_STEP, low * 1.001, 20):
        assert off(float(h)) < f.PRINTED
    assert off(high) > f.PRINTED


def test_a_sphere_starts_to_fall_where_places_are_near_enough_to_each_other() -> None:
    low, high = band("falling_object", "highest")
    drop = falling_object.TIME_STEP * (falling_object.TIME_STEP * falling_object.GRAVITY)
    assert low - drop < low and high - drop < high
    assert (
        np.nextafter(high, math.inf) - drop == np.nextafter(high, math.inf)
        and 2.0 * high - drop == 2.0 * high
    )


def test_ten_steps_halve_the_period_that_the_map_of_a_row_says() -> None:
    def remains(period: float) -> float:
        step = one_row_matrix(MASS, 1.0 / stiffness_of_period(period), low_pass.DAMPING, TIME_STEP)
        return float(np.abs(np.linalg.eigvals(np.linalg.matrix_power(step, low_pass.STEPS))).max())

    low, high = band("oscillator_filter", "slowest")
    assert remains(low) < 0.5 < remains(1.0001 * high)
    end, _ = band("oscillator_filter", "stiffest")
    assert end == low_pass.SHORTEST
    assert remains(end) == pytest.approx(3.0**-low_pass.STEPS, rel=1e-6), "as stiff as can be"


@pytest.mark.parametrize(
    ("test", "study"), [("oscillator_spring", "softest-spring"), ("oscillator_row", "softest-row")]
)
def test_a_soft_spring_moves_a_mass_where_places_are_near_enough(test: str, study: str) -> None:
    """One step of the spring's law and of the row's own map, added to a place of 53 bits."""
    low, high = band(test, study)
    for turn, moves in ((high, True), (1.0001 * low, True), (0.9999 * low, False)):
        stiffness = MASS * (turn / TIME_STEP) ** 2
        step = one_row_matrix(MASS, 1.0 / stiffness, 0.0, TIME_STEP)
        speed = (
            -TIME_STEP * stiffness / MASS * START if test.endswith("spring") else float(step[1, 0]) * START
        )
        assert (START + TIME_STEP * speed < START) == moves


def farthest(moment: float) -> float:
    """How many times as far a nudged body's third axis comes off its momentum: Euler's equations, integrated."""
    s = steady_turns
    inertia = np.array((*s.MOMENTS[:2], moment))

    def slopes(_: float, w: np.ndarray) -> np.ndarray:
        return -np.cross(w, inertia * w) / inertia

    w = solve_ivp(
        slopes, (0.0, s.DURATION), (0.0, s.NUDGE, s.RATE), "DOP853", rtol=1e-12, atol=1e-16, max_step=0.01
    ).y
    return float(np.hypot(*(inertia[:2, None] * w[:2])).max() / (inertia[1] * s.NUDGE))


def test_a_body_spins_on_about_all_but_its_middle_axis() -> None:
    low, high = band("steady_turns", "smallest-moment")
    assert farthest(0.9999 * low) > steady_turns.GROWN > farthest(1.0002 * low)
    assert farthest(high) < 1.1 and farthest(steady_turns.MOMENTS[2]) < 1.1


def test_a_spin_is_told_to_a_ten_thousandth_however_fast_it_is() -> None:
    """A step's turn rounded in binary, and 180 of them added as angles: in units of 2^-53 of their size."""
    s = steady_turns
    assert band("steady_turns", "fastest") == (s.FASTEST, s.FASTEST)
    steps = round(s.DURATION / s.TIME_STEP)
    assert 4.0 * steps * 2.0**-53 * s.FASTEST * s.TIME_STEP < 0.1 * s.RIGHT


def over_the_top(rate: float, speed: float) -> bool:
    """Whether a pendulum of that small rate [rad/s], hanging and pushed [rad/s], goes over: φ'' = −ω² sin φ, integrated."""

    def upright(_: float, state: np.ndarray) -> float:
        return float(state[0] - math.pi)

    upright.terminal = True  # type: ignore[attr-defined]
    found = solve_ivp(
        lambda _, state: (state[1], -(rate**2) * math.sin(state[0])),
        (0.0, 40.0 / rate),
        (0.0, speed),
        "DOP853",
        events=upright,
        rtol=1e-10,
        atol=1e-12,
    )
    return len(found.t_events[0]) > 0


@pytest.mark.parametrize(
    ("test", "rate", "lever"),
    [
        ("bar_pendulum", bar_pendulum.RATE, 1.0),
        (
            "seconds_pendulum",
            math.sqrt(seconds_pendulum.GRAVITY / seconds_pendulum.LENGTH),
            seconds_pendulum.LENGTH,
        ),
    ],
)
def test_a_pushed_pendulum_goes_over_where_its_energy_is_that_of_standing(
    test: str, rate: float, lever: float
) -> None:
    low, high = band(test, "hardest-push")
    assert not over_the_top(rate, low / lever) and over_the_top(rate, 1.0001 * high / lever)


def test_a_planet_turns_back_as_kepler_has_it() -> None:
    p = planetarium
    low, high = band("planetarium", "fastest")

    def leaving(times: float) -> bool:
        """Whether it is still on its way out after ten rounds of the circle: r'' = −k²/r² + L²/r³, integrated."""
        end = p.YEARS * 2.0 * math.pi  # in units of 1/k and 1 m
        found = solve_ivp(
            lambda _, y: (y[1], -1.0 / y[0] ** 2 + times**2 / y[0] ** 3),
            (0.0, end),
            (1.0, 0.0),
            "DOP853",
            rtol=1e-11,
            atol=1e-12,
        )
        return bool(found.y[1, -1] > 0.0)

    assert not leaving(low) and leaving(high) and high < math.sqrt(2.0)


def test_a_beam_rings_in_steps_beyond_its_damping_time() -> None:
    """Ten pieces as lumps on the beam's stiffness: every mode by the map of its own row, from the static shape."""
    c = column
    low, high = band("cantilever", "longest-step")
    x = (np.arange(c.COUNT) + 0.5) * c.PIECE
    near, far = np.minimum.outer(x, x), np.maximum.outer(x, x)
    gives = near**2 * (3.0 * far - near) / (6.0 * c.STIFFNESS)  # m/N, Euler and Bernoulli
    mass = DENSITY * c.PIECE
    rates, shapes = np.linalg.eigh(np.linalg.inv(gives) / mass)
    still = deflection(x)
    parts = shapes.T @ still

    def left(h: float) -> float:
        found = []
        for n in range(c.STEPS - 4, c.STEPS + 1):
            kept = [
                np.linalg.matrix_power(one_row_matrix(1.0, 1.0 / rate, c.DAMPING, h), n)[0, 0]
                for rate in rates.tolist()
            ]
            found.append(abs(float(shapes[-1] @ (parts * kept)) / still[-1]))
        return max(found)

    assert math.sqrt(rates[0]) == pytest.approx(c.FIRST_RATE, rel=0.01)
    assert left(low) < c.LEFT < left(high)


def turned_over(nudge: float) -> bool:
    """Whether the spin about the middle axis is none within the time of the study: Euler's equations, integrated."""
    inertia = np.array(rotating_box.INERTIA)
    found = solve_ivp(
        lambda _, w: -np.cross(w, inertia * w) / inertia,
        (0.0, rotating_box.PATIENCE),
        (nudge, 1.0, 0.0),
        "DOP853",
        rtol=1e-12,
        atol=1e-16,
    )
    return bool(found.y[1].min() < 0.0)


def test_a_nudge_turns_a_spin_about_the_middle_axis_over_when_jacobi_says() -> None:
    low, high = band("rotating_box", "gentlest")
    assert turned_over(high) and not turned_over(low)


def test_a_motor_bears_the_torque_that_it_is_allowed() -> None:
    low, high = band("motor", "heaviest-load")
    for load, slows in ((low, False), (high, False), (1.001 * high, True)):
        assert (load - min(load, motor.TORQUE) > 0.0) == slows
    assert band("motor", "largest-wheel") == (motor.HEAVIEST, motor.HEAVIEST)
    assert abs(motor.HEAVIEST * motor.SPEED / motor.HEAVIEST / motor.SPEED - 1.0) < 1e-15


def hung(time_step: float, heavier: float) -> float:
    """Growth per step of a hanging pair by its energies: symplectic Euler, derivatives by differences."""
    d, length, g = 1e-4, double_pendulum.LENGTH, double_pendulum.GRAVITY
    masses, spins = np.array((1.0, heavier)), np.array((1.0, heavier)) / 12.0 * length**2

    def places(angles: np.ndarray) -> np.ndarray:
        """(4,): sideways and up, of both centres."""
        x = np.array((0.5 * math.sin(angles[0]), math.sin(angles[0]) + 0.5 * math.sin(angles[1])))
        z = -np.array((0.5 * math.cos(angles[0]), math.cos(angles[0]) + 0.5 * math.cos(angles[1])))
        return length * np.concatenate((x, z))

    slopes = np.array([(places(d * e) - places(-d * e)) / (2.0 * d) for e in np.eye(2)])
    mass = slopes @ np.diag((*masses, *masses)) @ slopes.T + np.diag(spins)

    def weight(angles: np.ndarray) -> float:
        return float(g * masses @ places(angles)[2:])

    stiff = np.zeros((2, 2))
    for i in (0, 1):
        for j in (0, 1):
            a, b = d * np.eye(2)[i], d * np.eye(2)[j]
            stiff[i, j] = (weight(a + b) - weight(a - b) - weight(b - a) + weight(-a - b)) / (4.0 * d * d)
    turn = -time_step * np.linalg.solve(mass, stiff)
    step = np.block([[np.eye(2) + time_step * turn, time_step * np.eye(2)], [turn, np.eye(2)]])
    return float(np.abs(np.linalg.eigvals(step)).max())


def test_a_hanging_pair_is_stepped_up_to_half_a_turn_of_its_faster_mode() -> None:
    d = double_pendulum
    low, high = band("double_pendulum", "longest-step")
    assert hung(low, 1.0) < 1.0 + 1e-5 and hung(high, 1.0) ** d.HUNG_STEPS > 1e3
    assert band("double_pendulum", "heaviest-below") == (d.HEAVIEST, d.HEAVIEST)
    assert all(hung(d.HUNG_STEP, ratio) < 1.0 + 1e-5 for ratio in np.geomspace(1.0, d.HEAVIEST, 25).tolist())


def test_a_ring_of_soft_locks_sinks_by_what_its_halves_give() -> None:
    """Castigliano: half a ring, cut below box 7; its force along and its moment are what makes the energy least.

    By symmetry the cut, in the lowest box's middle, bears no force across but half that box's weight.
    """
    r = lock_ring
    count, size = r.LADDER_COUNT, r.radius(r.LADDER_COUNT)
    corner = math.hypot(size, 0.5 * r.PIECE)
    weight = r.MASS * r.GRAVITY

    def loads(along: float, moment: float, more: float) -> np.ndarray:
        """(locks, 3): level force, upright force and moment at every lock, from the lowest up on one side."""
        found = []
        for k in range(count // 2, 0, -1):  # lock k is between boxes k and k + 1, counted from 1 at the top
            angle = 2.0 * math.pi * (k - 0.5) / count
            x, z = corner * math.sin(angle), corner * math.cos(angle)
            upright, turn = 0.0, moment + along * (-size - z)
            for box in range(k + 1, count // 2 + 2):
                centre = 2.0 * math.pi * (box - 1) / count
                share = 0.5 * (weight + more) if box == count // 2 + 1 else weight
                upright += share
                turn += share * (size * math.sin(centre) - x)
            found.append((along, upright, turn))
        return np.array(found)

    base = loads(0.0, 0.0, 0.0)
    push, twist, drop = (loads(*unit.tolist()) - base for unit in np.eye(3))
    normal = np.array([[(a * b).sum() for b in (push, twist)] for a in (push, twist)])
    held = np.linalg.solve(normal, [-(a * base).sum() for a in (push, twist)])
    whole = base + held[0] * push + held[1] * twist
    sinks = 2.0 * float((whole * drop).sum())  # m over the compliance: both halves
    low, high = band("lock_ring", "softest")
    assert low < r.SAGGED * 2.0 * size / sinks < high
    assert abs(r.SAGGED * 2.0 * size / sinks / r.SOFTEST - 1.0) < 1e-9
    assert band("lock_ring", "most-boxes") == (r.RINGS[-1], r.RINGS[-1])
    assert r.RINGS[-1] ** 3 * 2.0**-52 < 1e-9, "rounding of so many in a row is far from what is asked"


def aside(count: int, force: float) -> float:
    """Sideways way of the last centre per newton there, over that with no force along: rigid pieces, turns and slips."""
    piece = column.COLUMN / (count - 0.5)
    centres = (np.arange(count) + 0.5) * piece
    joints = np.concatenate(((0.25 * piece,), np.arange(1, count) * piece))
    lengths = np.concatenate(((0.5 * piece,), np.full(count - 1, piece)))
    turns, slips = lengths / column.STIFFNESS, lengths**3 / (12.0 * column.STIFFNESS)

    def way(along: float) -> float:
        """Of turns and slips at the joints: moments Q lever + P (end − place), forces across Q + P angle."""
        size = 2 * count
        angle = np.tril(np.ones((count, count)))  # of a piece, from the turns
        place = np.zeros((count, size))  # of the joints, sideways
        end = np.zeros(size)
        for i in range(count):
            end[i] = centres[-1] - joints[i]
            end[count + i] = 1.0
            for k in range(i + 1, count):
                place[k, i] = joints[k] - joints[i]
                place[k, count + i] = 1.0
        matrix, right = np.eye(size), np.zeros(size)
        for i in range(count):
            matrix[i] -= turns[i] * along * (end - place[i])
            right[i] = turns[i] * (centres[-1] - joints[i])
            if i > 0:  # a lock's shear is across the piece before it
                matrix[count + i, :count] -= slips[i] * along * angle[i - 1]
            right[count + i] = slips[i]
        return float(end @ np.linalg.solve(matrix, right))

    return way(force) / way(0.0)


def test_a_column_of_pieces_goes_aside_as_its_statics_say() -> None:
    low, high = band("cantilever", "strongest-press")
    assert column.aside(high) == pytest.approx(column.TIMES)
    assert aside(640, high) == pytest.approx(column.TIMES, rel=3e-3), "many pieces are the column"
    assert aside(column.COUNT, 1.002 * low) < column.TIMES < aside(column.COUNT, high)


def test_blows_between_walls_are_counted_by_their_flights() -> None:
    w = between_walls
    assert band("between_walls", "most-blows") == (w.COUNTS[-1], w.COUNTS[-1])
    for count in w.COUNTS:
        way = count * w.FLIGHT * w.UP  # m, across; the first wall is half a room away
        assert math.floor(way / (w.ROOM - 2.0 * w.RADIUS) + 0.5 + 1e-9) == count


def test_a_needle_turns_as_eulers_equations_say_until_its_momentum_is_rounded() -> None:
    d = thrown_die
    length = d.SIZE[0]
    low, high = band("thrown_die", "thinnest")
    for thickness in (d.SIZE[1], high, low):
        moments = np.array((2.0 * thickness**2, length**2 + thickness**2, length**2 + thickness**2)) / 12.0

        def slopes(_: float, state: np.ndarray, moments: np.ndarray = moments) -> np.ndarray:
            spin, w, v = state[:3], state[3], state[4:]
            turn = 0.5 * (w * spin + np.cross(v, spin))
            return np.concatenate((np.cross(moments * spin, spin) / moments, [-0.5 * v @ spin], turn))

        start = (*d.SPIN, 1.0, 0.0, 0.0, 0.0)
        found = solve_ivp(slopes, (0.0, d.DURATION), start, "DOP853", rtol=1e-12, atol=1e-13).y[3:, -1]
        right = d.needle(thickness)
        assert np.abs(found * np.sign(found @ right) - right).max() < 1e-7
        rounded = (
            2.0**-53 * moments[1] * math.hypot(*d.SPIN[1:]) / moments[0]
        )  # rad/s of the spin about itself
        steps = round(d.DURATION / d.TIME_STEP)
        if thickness == low:
            assert rounded * d.TIME_STEP == pytest.approx(d.WRONG, rel=1e-3)
        if thickness == high:
            assert steps * rounded * d.DURATION == pytest.approx(d.WRONG, rel=2e-3)
