"""Where limits of contact scenes come from: equations of motion, moments, and limit analysis, without the engine."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import linprog

from spook_tracker.engine import RigidBody
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.scalar_tests.friction import grain, sorting, turntable
from spook_tracker.scalar_tests.ropes import hanging_cable
from spook_tracker.scalar_tests.rotation import bowl, rolling_coin
from spook_tracker.scalar_tests.stacks import card_house, falling_pile, masonry_arch, stone_bridge
from spook_tracker.scalar_tests.vehicles import climb, vehicle
from tests.scalar_tests.limits import band, measurement


def test_the_ball_on_a_turntable_lags_by_the_tangent_of_its_turn() -> None:
    turn = turntable.CIRCLE * turntable.TIME_STEP
    places = turntable.recursion(turntable.TIME_STEP, turntable.STEPS)
    angles = np.unwrap(np.angle(np.diff(places)))
    found = (angles[-1] - angles[0]) / ((turntable.STEPS - 1) * turn) - 1.0

    assert found == pytest.approx(math.atan(turn) / turn - 1.0, rel=1e-9)
    assert found == pytest.approx(-(turn**2) / 3.0 + turn**4 / 5.0, rel=1e-6)
    assert CATALOGUE["turntable"].measurements[0].metrics[0].passes(found)


def test_friction_on_a_grain_dissipates_most_and_ends_where_integration_does() -> None:
    g = grain
    angles = np.linspace(0.0, 2.0 * math.pi, 20001)
    allowed = np.stack([g.ALONG * np.cos(angles), g.ACROSS * np.sin(angles)])  # times the load
    for slip in ((1.0, 0.0), (0.3, -0.8), (-0.2, 0.01)):
        after = g.slid(slip, 0.01)
        force = (np.array(after) - slip) / 0.01
        assert force @ after == pytest.approx((np.array(after) @ allowed).min(), rel=1e-7)

    def slide(_: float, state: np.ndarray) -> list[float]:
        v, a = state[2:]
        by = g.GRAVITY / math.hypot(g.ALONG * v, g.ACROSS * a)
        return [v, a, -by * g.ALONG**2 * v, -by * g.ACROSS**2 * a]

    def rests(_: float, state: np.ndarray) -> float:
        return math.hypot(state[2], state[3]) - 1e-6

    rests.terminal = True  # type: ignore[attr-defined]
    run = solve_ivp(slide, (0.0, 5.0), (0.0, 0.0, *g.THROW), "DOP853", events=rests, rtol=1e-12, atol=1e-14)
    assert run.status == 1 and run.t[-1] < 1.4
    np.testing.assert_allclose(run.y[:2, -1], g.stop(), atol=1e-10)


def test_lanes_and_thrown_boxes_of_the_sorters_by_integration() -> None:
    """Ways of the method's own steps go to the closed form and to a tight integration; its circle grows as is said."""
    s = sorting
    for friction in s.SORTS:
        coarse, fine = (s.ride(0.0, s.SLIP, friction, 0.0, h, round(2.0 / h))[-1] for h in (1e-3, 5e-4))
        assert 2.0 * fine - coarse == pytest.approx(s.lane(friction), abs=1e-6)
        assert coarse - s.lane(friction) == pytest.approx(-0.5e-3 * s.SLIP, abs=2e-6)

    friction, start = s.SHARES[0] * s.LEAST, complex(s.RADIUS)

    def slide(_: float, state: np.ndarray) -> list[float]:
        x, v = complex(state[0], state[1]), complex(state[2], state[3])
        slip = v - 1j * s.RATE * x
        by = -friction * s.GRAVITY * (slip / abs(slip) if slip else 1.0)  # it begins outwards
        return [v.real, v.imag, by.real, by.imag]

    time = s.TABLE_STEP * s.TABLE_STEPS
    run = solve_ivp(
        slide, (0.0, time), (s.RADIUS, 0.0, 0.0, s.RATE * s.RADIUS), "DOP853", rtol=1e-10, atol=1e-12
    )
    places = [s.ride(start, 1j * s.RATE * start, friction, s.RATE, time / n, n)[-1] for n in (4000, 8000)]
    assert 2.0 * places[1] - places[0] == pytest.approx(complex(*run.y[:2, -1]), abs=1e-6)

    grown = abs(1.0 + 1j * s.RATE * s.TABLE_STEP) ** s.TABLE_STEPS - 1.0
    assert grown == pytest.approx(0.009, abs=5e-4) and grown < min(x for x in s.SHARES if x > 1.0) - 1.0
    assert band("sorting", "friction")[1] / s.LEAST == pytest.approx((1.0 + grown) ** 0.5 + 1e-3, abs=5e-4)


def test_a_slow_slide_on_a_grain_is_known_as_well_as_the_solver_stops() -> None:
    """A corner's own inverse mass along both stretched rows, times its bound: what its friction does to its slip."""
    g = grain
    x, y, z = (0.5 * edge for edge in g.EDGE)
    inertia = [g.MASS / 3.0 * (b * b + c * c) for b, c in ((y, z), (x, z), (x, y))]
    rows = [np.cross((x, y, -z), axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))]
    own = [1.0 / g.MASS + float(row @ (row / inertia)) for row in rows]
    low = min(g.ALONG, g.ACROSS)
    stretched = (g.ALONG / low) ** 2 * own[0] + (g.ACROSS / low) ** 2 * own[1]
    reach = stretched * low * g.MASS * g.GRAVITY * g.TIME_STEP / 4.0
    slowest = min(math.hypot(*g.drift(g.SLIDES * g.least_slope(way), way)) for way in g.WAYS)
    open_by = (
        1e-10 * reach * max(g.ALONG, g.ACROSS) * g.GRAVITY * sum(1.0 / n for n in range(1, 31)) / slowest
    )
    (metric,) = [m for _, m in CATALOGUE["grain"].metrics() if m.name == "slide_error"]

    assert reach == pytest.approx(0.16, abs=0.005)
    assert isinstance(metric.limit, float) and open_by < metric.limit < 2.0 * open_by


@pytest.mark.parametrize(
    "motion", [rolling_coin.COIN, rolling_coin.DISK, rolling_coin.Steady(math.radians(0.01), 0.0)]
)
def test_the_coin_rolls_steadily_by_the_equations_of_motion(motion: rolling_coin.Steady) -> None:
    """Newton's and Euler's equations with a contact that does not slip, solved for the accelerations at the start."""
    (body,) = [b for b in rolling_coin.scene(motion).bodies if b.name == "coin"]
    assert isinstance(body, RigidBody) and body.inertia is not None and body.mass is not None
    c, s = math.cos(motion.lean), math.sin(motion.lean)
    turn = np.array([(c, 0.0, s), (0.0, 1.0, 0.0), (-s, 0.0, c)])
    inertia = turn @ np.diag(body.inertia) @ turn.T
    v, w, up = np.array(body.velocity), np.array(body.angular_velocity), np.array((0.0, 0.0, motion.rate))
    arm = np.array((motion.reach, 0.0, -motion.height))
    cross = np.array([(0, -arm[2], arm[1]), (arm[2], 0, -arm[0]), (-arm[1], arm[0], 0)])
    one, none = np.eye(3), np.zeros((3, 3))
    matrix = np.block([[body.mass * one, none, -one], [none, inertia, -cross], [one, -cross, none]])
    right = np.concatenate(
        (
            (0.0, 0.0, -body.mass * rolling_coin.GRAVITY),
            -np.cross(w, inertia @ w),
            -np.cross(w, np.cross(up, arm)),
        )
    )
    found = np.linalg.solve(matrix, right)
    friction = math.hypot(found[6], found[7]) / found[8]

    np.testing.assert_allclose(v + np.cross(w, arm), 0.0, atol=1e-12)
    np.testing.assert_allclose(found[:3], np.cross(up, v), atol=1e-9)
    np.testing.assert_allclose(found[3:6], np.cross(up, w), atol=1e-9)
    assert friction < rolling_coin.FRICTION


def test_the_loads_of_a_braking_vehicle_balance_its_moments() -> None:
    v = vehicle
    parts = [(v.CHASSIS, 0.0, v.RADIUS + v.RISE)] + [(v.WHEEL, x, v.RADIUS) for x, _ in v.WHEELS.values()]
    # Two loads: forces upwards, and moments about the road under the chassis' centre, of weights and of m a.
    matrix = np.array([(1.0, 1.0), (v.FRONT, -v.REAR)])
    weights = v.GRAVITY * sum(m for m, _, _ in parts)
    moment = sum(m * (v.GRAVITY * x + v.BRAKING * z) for m, x, z in parts)
    front, rear = np.linalg.solve(matrix, (weights, moment))

    assert v.front_load(-v.BRAKING) == pytest.approx(front, rel=1e-12)
    assert v.front_load(-v.BRAKING, rise=v.TIPPING) == pytest.approx(weights, rel=1e-12)
    assert rear > 0.0 and pytest.approx(0.19e-6, rel=0.02) == v.SINK
    assert v.stopping(1e-6) == pytest.approx(v.STOPPED**2 / (2.0 * v.BRAKING), rel=1e-5)
    sinks = v.COMPLIANCE * front / 4.0  # each of two wheels on two points, within a step
    limits = {m.name: m.limit for m in measurement("vehicle", "plain").metrics}
    # Rolling down: the power of the weight is that of M v and of four wheels that turn with v/r, less their sinking.
    gains = v.MASS * v.GRAVITY * math.sin(math.atan(v.SLOPE)) / (v.MASS + 2.0 * v.WHEEL)  # I = ½ m r² each
    assert limits["speed_error"] == pytest.approx(sinks / v.RADIUS * gains * v.DURATION)
    assert limits["spin_error"] == limits["speed_error"]
    assert limits["sideways"] == pytest.approx(sinks / v.TIME_STEP)
    limits = {m.name: m.limit for m in measurement("vehicle", "braking").metrics}
    assert limits["speed_error"] == pytest.approx(sinks / v.TIME_STEP)
    assert limits["transfer_error"] == limits["load_error"] == pytest.approx(sinks / v.RADIUS)
    assert limits["stands"] == pytest.approx(sinks / v.TIME_STEP)
    assert limits["stopping_error"] == pytest.approx(sinks / v.TIME_STEP * v.DURATION)
    short = v.stopping(v.TIME_STEP) - v.STOPPED**2 / (2.0 * v.BRAKING)
    assert short == pytest.approx(-0.5 * v.STOPPED * v.TIME_STEP, rel=0.01)


def test_a_driven_vehicle_climbs_by_newton_and_slips_when_its_friction_is_used_up() -> None:
    """Accelerations, loads and the friction of each axle as unknowns of one balance."""
    v, c = vehicle, climb
    parts = [(v.CHASSIS, 0.0, v.RADIUS + v.RISE)] + [(v.WHEEL, x, v.RADIUS) for x, _ in v.WHEELS.values()]
    sine, cosine, base = math.sin(c.TILT), math.cos(c.TILT), v.FRONT + v.REAR
    for torque in (c.TORQUE, c.SLIPS):
        # a, loads of front and rear, friction of front and rear: along, across, moments, two front wheels, two rear ones.
        balance = np.array(
            (
                (v.MASS, 0.0, 0.0, -1.0, -1.0),
                (0.0, 1.0, 1.0, 0.0, 0.0),
                (sum(m * z for m, _, z in parts) + 4.0 * v.INERTIA / v.RADIUS, base, 0.0, 0.0, 0.0),
                (2.0 * v.INERTIA / v.RADIUS, 0.0, 0.0, v.RADIUS, 0.0),
                (2.0 * v.INERTIA / v.RADIUS, 0.0, 0.0, 0.0, v.RADIUS),
            )
        )
        lift = sum(m * v.GRAVITY * (cosine * (x + v.REAR) - sine * z) for m, x, z in parts)
        right = (-v.MASS * v.GRAVITY * sine, v.MASS * v.GRAVITY * cosine, lift, 0.0, 2.0 * torque)
        gain, front, rear, _, pushes = np.linalg.solve(balance, right)
        assert (gain, front) == pytest.approx((c.climbing(torque), c.climbing_load(torque)), rel=1e-12)
        assert v.FRICTION * rear - pushes == pytest.approx(c.slack(torque), abs=1e-8 * v.MASS)
    assert c.slack(c.SLIPS) == pytest.approx(0.0, abs=1e-8 * v.MASS)
    limits = {m.name: m.limit for m in measurement("climb", "plain").metrics}
    shorter = v.SINK / v.RADIUS  # a wheel that has sunk so much drives with more force and turns faster
    driven = shorter * 2.0 * c.TORQUE / v.RADIUS / v.MASS * c.DURATION
    assert limits["speed_error"] == pytest.approx(driven)
    assert limits["spin_error"] == pytest.approx(driven + shorter * c.climbing() * c.DURATION)
    assert limits["transfer_error"] == pytest.approx(shorter)


def ring_balance(
    joints: list[float], thickness: float, *, round_stones: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Three balances a stone of a ring of mean radius 1 m, and their right sides, in areas of stone.

    Two forces a joint, at its inner and outer edge, each along the ring and along the radius. `joints` are angles from x.
    """
    count, half = len(joints) - 1, 0.5 * (joints[1] - joints[0])
    inner, outer = 1.0 - 0.5 * thickness, 1.0 + 0.5 * thickness
    balance, load = np.zeros((3 * count, 4 * (count + 1))), np.zeros(3 * count)
    for k in range(count):
        # Centre of mass on the bisector: of a sector of a ring, or of the trapezium between its joints.
        if round_stones:
            area = (outer**2 - inner**2) * half
            radius = 2.0 / 3.0 * (outer**3 - inner**3) / (outer**2 - inner**2) * math.sin(half) / half
        else:
            area = (outer**2 - inner**2) * math.sin(half) * math.cos(half)
            radius = 2.0 / 3.0 * (outer**3 - inner**3) / (outer**2 - inner**2) * math.cos(half)
        bisector = joints[k] + half
        centre = radius * np.array([math.cos(bisector), math.sin(bisector)])
        for joint, sign in ((k, 1.0), (k + 1, -1.0)):
            outwards = np.array([math.cos(joints[joint]), math.sin(joints[joint])])
            for edge, at in enumerate((inner, outer)):
                arm = at * outwards - centre
                for part, force in enumerate((np.array([-outwards[1], outwards[0]]), outwards)):
                    column = 4 * joint + 2 * edge + part
                    balance[3 * k : 3 * k + 2, column] = sign * force
                    balance[3 * k + 2, column] = sign * (arm[0] * force[1] - arm[1] * force[0])
        load[3 * k + 1] = area
    return balance, load


def thrusts(balance: np.ndarray, load: np.ndarray, level: float) -> tuple[float, float] | None:
    """The least and largest thrust without sliding, none of the edges pulling; None if no thrust line fits. `level` is the
    angle of the first joint [rad]: its forces' level parts are the thrust."""
    edges = balance.shape[1] // 2
    push = np.zeros(2 * edges)
    push[[0, 2]], push[[1, 3]] = -math.sin(level), math.cos(level)
    bounds = [(0.0, None), (None, None)] * edges
    ends = [linprog(side * push, A_eq=balance, b_eq=load, bounds=bounds) for side in (1.0, -1.0)]
    if any(end.status != 0 for end in ends):
        return None
    found = sorted(abs(end.fun) for end in ends)
    return found[0], found[1]


def arch_statics(count: int, thickness: float, *, round_stones: bool = False) -> tuple[float, float] | None:
    """The least and largest thrust over the weight of a semicircle without sliding; None if no thrust line fits."""
    joints = [math.pi * k / count for k in range(count + 1)]
    balance, load = ring_balance(joints, thickness, round_stones=round_stones)
    found = thrusts(balance, load, 0.0)
    return found and (found[0] / load.sum(), found[1] / load.sum())


def least_thickness(count: int, *, round_stones: bool = False) -> float:
    low, high = 0.05, 0.2
    for _ in range(34):
        middle = 0.5 * (low + high)
        if arch_statics(count, middle, round_stones=round_stones) is None:
            low = middle
        else:
            high = middle
    return high


def test_an_arch_is_as_thin_as_limit_analysis_allows() -> None:
    for count, known in ((5, 0.0966), (9, 0.1021), (21, 0.1068)):
        assert least_thickness(count, round_stones=True) == pytest.approx(known, abs=5e-5)
        assert masonry_arch.LEAST[count] == pytest.approx(least_thickness(count), abs=5e-7)
        thrust = arch_statics(count, 1.02 * masonry_arch.LEAST[count])
        assert thrust == pytest.approx(masonry_arch.THRUST[count], abs=2e-5)


def arch_needs(count: int, thickness: float) -> tuple[float, float]:
    """The least friction with which any forces in their cones hold an arch, and the largest that any which hold it need."""
    balance, load = ring_balance([math.pi * k / count for k in range(count + 1)], thickness)
    size = balance.shape[1]
    bounds = [(0.0, None), (None, None)] * (size // 2)

    def held(rows: list[np.ndarray]) -> bool:
        found = linprog(np.zeros(size), rows, np.zeros(len(rows)), balance, load, bounds)
        return bool(found.status == 0)

    def sliding(places: list[int], sign: float, share: float) -> np.ndarray:
        """`sign` times what slides there, less that share of what presses: no more than 0."""
        row = np.zeros(size)
        row[places], row[[place + 1 for place in places]] = -share, sign
        return row

    def least(fits: Callable[[float], bool]) -> float:
        low, high = 0.0, 1.0
        for _ in range(24):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if fits(middle) else (middle, high)
        return high

    edges = [2 * edge for edge in range(size // 2)]
    enough = least(lambda mu: held([sliding([one], sign, mu) for one in edges for sign in (1.0, -1.0)]))
    most = max(
        least(lambda mu, j=joint, s=sign: not held([-sliding([4 * j, 4 * j + 2], s, mu)]))  # type: ignore[misc]
        for joint in range(count + 1)
        for sign in (1.0, -1.0)
    )
    return enough, most


def test_an_arch_slides_where_no_forces_in_their_cones_hold_it() -> None:
    m = masonry_arch
    assert arch_needs(5, 1.02 * m.LEAST[5]) == pytest.approx(m.SMOOTHEST, abs=1e-5)
    gives = (m.COMPLIANCE + m.CREEP * m.SOON) * m.weight(5, 1.02 * m.LEAST[5])
    assert gives < 0.3 * m.SLID


def bridge_limit(shares: dict[int, float]) -> tuple[float, float]:
    """The largest load over the weight, shared so by the stones, and the steepest force in a joint then: sliding over
    pressing."""
    b = stone_bridge
    balance, load = ring_balance(b.joints()[::-1], b.THICKNESS)
    column = np.zeros(len(load))
    for stone, share in shares.items():
        column[3 * (b.STONES - 1 - stone) + 1] = -share * load.sum()
    edges = balance.shape[1] // 2
    whole = np.column_stack([balance, column])
    aim = np.append(np.zeros(2 * edges), -1.0)
    found = linprog(aim, A_eq=whole, b_eq=load, bounds=[(0.0, None), (None, None)] * edges + [(0.0, None)])
    assert found.status == 0
    forces = found.x[:-1].reshape(-1, 2, 2).sum(axis=1)
    return -float(found.fun), float(np.abs(forces[:, 1] / forces[:, 0]).max())


def test_a_bridge_carries_what_limit_analysis_allows() -> None:
    b = stone_bridge
    for stone, known in b.LIMIT.items():
        limit, steepest = bridge_limit({stone: 1.0})
        assert known == pytest.approx(limit, abs=5e-7)
        assert bridge_limit({b.STONES - 1 - stone: 1.0})[0] == pytest.approx(limit, rel=1e-9)
        assert steepest < 0.4 * b.FRICTION  # nothing slides
    for stone, known in b.THRUST.items():
        balance, load = ring_balance(b.joints()[::-1], b.THICKNESS)
        asked = load.copy()
        asked[3 * (b.STONES - 1 - stone) + 1] += b.LESS * b.LIMIT[stone] * load.sum()
        found = thrusts(balance, asked, b.joints()[-1])
        assert found is not None
        assert np.array(found) / load.sum() == pytest.approx(known, abs=2e-5)
        edges = balance.shape[1] // 2
        for joint in range(b.STONES + 1):  # no joint is pressed by more than weight and load
            press = np.zeros(2 * edges)
            press[[4 * joint, 4 * joint + 2]] = -1.0
            most = linprog(press, A_eq=balance, b_eq=asked, bounds=[(0.0, None), (None, None)] * edges)
            assert most.status == 0 and -most.fun < asked.sum()
    middle = ring_balance(b.joints()[::-1], b.THICKNESS)
    middle[1][3 * (b.STONES // 2) + 1] += band("stone_bridge", "keystone-load")[1] * middle[1].sum()
    assert thrusts(*middle, b.joints()[-1]) is not None
    crossing = [
        bridge_limit({stone: 1.0 - part, stone + 1: part})[0]
        for stone in range(4)  # nearer to the keystone it carries more and more
        for part in np.linspace(0.0, 1.0, 21)[:-1]
    ]
    assert min(crossing) == pytest.approx(b.LEAST, abs=5e-5) and min(b.LIMIT.values()) == b.LEAST


@pytest.mark.parametrize(("count", "time_step"), hanging_cable.ASKED)
def test_every_link_of_the_hanging_cable_is_balanced(count: int, time_step: float) -> None:
    """Forces passed on from link to link, and moments about each link's left end; the last ends at the other support."""
    c = hanging_cable
    places, weight, pull = np.array(c.nodes(count)), c.MASS * c.GRAVITY / count, c.horizontal(count)
    held = 0.5 * c.MASS * c.GRAVITY  # upwards at the left end
    for (x, z), (u, w) in itertools.pairwise(places):
        right = held - weight  # passed on to the next link, upwards
        # About the left end: the weight in the middle, and at the right end H to the right and `right` downwards.
        assert -0.5 * weight * (u - x) - right * (u - x) - pull * (w - z) == pytest.approx(
            0.0, abs=1e-9 * pull
        )
        held = right
    assert held == pytest.approx(-0.5 * c.MASS * c.GRAVITY)
    assert places[-1] == pytest.approx((0.5 * c.SPAN, 0.0), abs=1e-9)
    assert c.horizontal(400) == pytest.approx(c.catenary(), rel=1e-5)
    tension = math.hypot(pull, 0.5 * c.MASS * c.GRAVITY)
    assert tension * time_step**2 / (c.MASS / count * c.LENGTH / count) < 0.15


def least_friction_of_a_house(storeys: int) -> float:
    """The least friction for which any forces hold every storey: a linear programme in friction, pushes, decks."""
    board, deck = 2.0 * 9.81, 1.0 * 9.81  # N
    angle, rail, end = math.radians(25.0), 0.9, 0.01
    out, up = rail * math.sin(angle), rail * math.cos(angle)
    bounded, limits, moments, turning = [], [], [], []
    for k in range(storeys):
        above = (storeys - 1 - k) * (board + 0.5 * deck)  # on each of the two boards
        push, held = 1 + 2 * k, 2 + 2 * k  # places of this storey's unknowns; the first is the friction
        for sides, carried in (((push, held), board + above), ((held,), above)):
            for sign in (1.0, -1.0):
                row = np.zeros(1 + 2 * storeys)
                row[list(sides)], row[0] = sign, -carried
                bounded.append(row)
                limits.append(0.0)
        row = np.zeros(1 + 2 * storeys)
        row[push], row[held] = end + up, 2.0 * end + up
        moments.append(row)
        turning.append((0.5 * board + above) * out)
    free = [(0.0, None), *[(0.0, None), (None, None)] * storeys]  # tops push each other, they do not pull
    aim = [1.0, *[0.0] * (2 * storeys)]
    found = linprog(aim, A_ub=bounded, b_ub=limits, A_eq=moments, b_eq=turning, bounds=free)
    return float(found.fun)


@pytest.mark.parametrize("storeys", [1, 2, 3, 5, 12])
def test_a_house_of_cards_needs_the_friction_that_no_sharing_of_forces_undercuts(storeys: int) -> None:
    assert card_house.need(storeys) == pytest.approx(least_friction_of_a_house(storeys), rel=1e-9)


def test_a_house_is_as_high_as_its_lowest_feet_have_friction() -> None:
    low, high = band("card_house", "tallest")
    assert low == high
    assert least_friction_of_a_house(int(high)) < card_house.SMOOTHER
    assert least_friction_of_a_house(int(high) + 1) > card_house.SMOOTHER


def test_what_rolls_needs_the_friction_that_spins_it_up_or_bends_its_way() -> None:
    slope = bowl.facet(bowl.FACETS)[1]
    # m a = m g sin α − F, ⅖ m r² a/r = F r: two equations; the floor presses with m g cos α.
    _, force = np.linalg.solve(np.array(((1.0, 1.0), (0.4, -1.0))), (9.81 * math.sin(slope), 0.0))
    assert force / (9.81 * math.cos(slope)) == pytest.approx(bowl.LEAST, rel=1e-12)
    motion = rolling_coin.COIN
    places = [motion.circle * np.exp(1j * motion.rate * t) for t in (-1e-4, 0.0, 1e-4)]
    bent = abs(places[0] - 2.0 * places[1] + places[2]) / 1e-8
    assert bent / rolling_coin.GRAVITY == pytest.approx(rolling_coin.LEAST, rel=1e-5)
    low, high = next(s.expected for s in CATALOGUE["rolling_coin"].stability) or (math.nan, math.nan)
    assert 0.5 * (high - low) / rolling_coin.LEAST == pytest.approx(
        abs(motion.spin) * rolling_coin.step(motion), rel=1e-9
    )


def test_what_turns_leaves_its_tangent_by_what_a_falling_pile_allows() -> None:
    """Points of a turning box against their tangents, by the matrix of the turn; and two boxes at a time."""
    rng = np.random.default_rng(4)
    most = 0.0
    for turn in (0.01, 0.1, 0.5, 2.0):
        allowed = falling_pile.bend(np.array([[0.0, turn, turn]]), np.array([True, True, True]))[0]
        for _ in range(200):
            axis, arm = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
            arm *= falling_pile.REACH
            across = np.cross(axis, arm)
            turned = (
                arm * math.cos(turn) + across * math.sin(turn) + axis * (axis @ arm) * (1.0 - math.cos(turn))
            )
            most = max(most, 2.0 * np.linalg.norm(turned - arm - turn * across) / allowed)
    assert 0.99 < most <= 1.0
    one = falling_pile.bend(np.array([[0.3, 9.0]]), np.array([True, False]))  # a ball's turn moves nothing
    assert one[0] == pytest.approx(0.5 * falling_pile.REACH * 0.3**2, rel=1e-12)
