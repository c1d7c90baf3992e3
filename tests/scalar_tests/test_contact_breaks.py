"""Where boxes, plates, balls and piles must slide, tip or fall: each band found again without the engine."""

from __future__ import annotations

import math
import re
from fractions import Fraction

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import linprog

from spook_tracker.scalar_tests.fluids import sinking_sphere
from spook_tracker.scalar_tests.friction import edge_roll, grain, rolling_friction, seams
from spook_tracker.scalar_tests.impacts import (
    between_walls,
    blow,
    bounce_grid,
    bouncing_ball,
    cradle,
    last_bounce,
    oblique_impact,
)
from spook_tracker.scalar_tests.mechanisms import gears
from spook_tracker.scalar_tests.rotation import bowl, rolling_beats, rolling_sphere
from spook_tracker.scalar_tests.stacks import (
    falling_pile,
    leaning_cards,
    overhang,
    pile,
    resting_ball,
    resting_box,
    resting_grid,
)
from spook_tracker.scalar_tests.thesis.inclined_plane import force_ratio, slip_angle, slope_grid
from spook_tracker.scalar_tests.thesis.inclined_plane import friction as plane
from spook_tracker.scalar_tests.thesis.inclined_plane.scene import EDGE, FRICTION
from spook_tracker.scalar_tests.vehicles import vehicle
from tests.places import ROOT
from tests.scalar_tests.limits import band

CONTACTS = ROOT / "engine/native/src/contacts"
TOLERANCES = CONTACTS / "tolerances.hpp"


def rear_share(drag: float) -> float:
    """Part of its load that the rear edge of a cube bears which friction drags by that part of its load, half an edge below
    its centre: N_r + N_f = 1 and (N_f − N_r) b/2 = drag b/2."""
    rear, front = np.linalg.solve([[1.0, 1.0], [-0.5 * EDGE, 0.5 * EDGE]], [1.0, 0.5 * EDGE * drag])
    assert rear + front == pytest.approx(1.0)
    return float(rear)


def test_a_cube_slides_flat_while_its_rear_edge_bears() -> None:
    low, high = band("slip_angle", "roughest")
    assert rear_share(low) > 0.0 >= rear_share(high) - 1e-12 and rear_share(1.001 * high) < 0.0
    assert slip_angle.STEEPER > 1.0, "on all slopes it slides, or tips"


def test_a_rough_cube_stands_while_its_weight_points_between_its_edges() -> None:
    low, high = band("force_ratio", "steepest")
    assert high < force_ratio.ROUGH
    assert rear_share(low) > 0.0 >= rear_share(high) - 1e-12 and rear_share(1.001 * high) < 0.0


@pytest.mark.parametrize("time_step", [Fraction(1, 60), Fraction(slip_angle.LONGEST)])
@pytest.mark.parametrize("mass", [Fraction(1), Fraction(force_ratio.HEAVIEST)])
def test_coulombs_law_knows_neither_step_nor_mass(time_step: Fraction, mass: Fraction) -> None:
    """A step in fractions: what friction may take, µ N h/m, over what gravity gives, g h sin θ."""
    assert band("slip_angle", "longest-step") == (slip_angle.LONGEST,) * 2
    assert band("friction", "longest-step") == (plane.LONGEST,) * 2
    assert band("slope_grid", "longest-step") == (slope_grid.LONGEST,) * 2
    assert band("slope_grid", "heaviest") == (slope_grid.HEAVIEST,) * 2
    assert band("force_ratio", "heaviest") == (force_ratio.HEAVIEST,) * 2
    for slope in (Fraction(3, 10), Fraction(7, 10)):
        normal, along = time_step * mass, time_step * mass * slope  # N s, in g cos θ
        taken = min(along, Fraction(FRICTION) * normal)
        assert taken / normal == min(slope, Fraction(FRICTION))
        assert (along == taken) == (slope < FRICTION)


@pytest.mark.parametrize("time_step", [Fraction(1, 60), Fraction(rolling_sphere.LONGEST)])
def test_a_sphere_rolls_and_slides_alike_in_steps_of_any_length(time_step: Fraction) -> None:
    """Ten steps in fractions, in g cos θ: friction stops the slip that it can, h (tan θ − f (1 + 5/2)) = 0, f at most µ."""
    r = rolling_sphere
    assert band("rolling_sphere", "longest-step") == (r.LONGEST, r.LONGEST)
    for slope in (Fraction(r.ROLLING), Fraction(r.SLIDING)):
        speed = turning = Fraction(0)  # of the centre, and r ω
        for _ in range(10):
            wanted = (speed + time_step * slope - turning) / (time_step * Fraction(7, 2))
            friction = min(wanted, Fraction(r.FRICTION))
            speed += time_step * (slope - friction)
            turning += time_step * friction * Fraction(5, 2)
        linear, angular = r.accelerations(float(slope))
        scale = r.GRAVITY * math.cos(math.atan(float(slope))) * float(10 * time_step)
        found = (float(speed / (10 * time_step)), float(turning / (10 * time_step)))
        for one, right in zip(found, (linear, angular * r.RADIUS), strict=True):
            assert one * scale == pytest.approx(right * float(10 * time_step), rel=1e-12)


def test_a_ball_leaves_at_an_angle_that_knows_no_speed() -> None:
    o = oblique_impact
    low, high = band("oblique_impact", "fastest")
    assert high == o.FASTEST and low < high
    turn = math.radians(o.ANGLES[0])
    for times in np.geomspace(1.0, o.FASTEST, 13).tolist():
        along, up = times * o.SPEED * math.sin(turn), times * o.SPEED * math.cos(turn)
        left = math.atan2(along - o.FRICTION * (1.0 + o.RESTITUTION) * up, o.RESTITUTION * up)
        assert math.degrees(left) == pytest.approx(o.sliding(o.ANGLES[0])[0], rel=1e-13)


def test_a_blow_grips_where_friction_may_stop_the_slip() -> None:
    """The contact point stops for an impulse along, J (1/m + r²/I) = v, of at most µ (1 + e) m u."""
    w = between_walls
    low, high = band("between_walls", "smoothest")
    needed = w.ALONG / (1.0 + 1.0 / 0.4)  # per kg, I = 2/5 m r²
    assert low * 2.0 * w.UP == pytest.approx(needed) and high * 2.0 * w.UP > needed


def test_a_ball_leaves_the_floor_rolling_where_the_bound_lets_its_slip_end() -> None:
    """Impulses up N = (1 + e) u and along F ≤ µ N, per kg: v − F against r ω = 5/2 F."""
    low, high = band("blow", "smoothest")
    for friction, rolls in ((0.999 * low, False), (high, True)):
        bound = friction * (1.0 + blow.RESTITUTION) * blow.FALL
        assert (blow.SLIDE - bound <= 2.5 * bound) == rolls


def test_balls_touch_up_to_the_gap_that_the_core_calls_closed() -> None:
    low, high = band("cradle", "narrowest")
    (closed,) = re.findall(r"inline constexpr double closed = (\S+);", TOLERANCES.read_text())
    assert low < 1.001 * float(closed) * cradle.RADIUS < high
    apart = np.abs(cradle.passed_on(1, 1.0) - cradle.all_at_once(1)).max()
    assert apart > 0.1, "the two answers are far from each other"


def test_a_sphere_sinks_while_it_is_heavier_than_what_it_displaces() -> None:
    low, high = band("sinking_sphere", "lightest")
    r = sinking_sphere.RADIUS
    slices = np.linspace(-r, r, 200_001)
    displaced = sinking_sphere.WATER * float(np.trapezoid(math.pi * (r * r - slices**2), slices))
    volume = 4.0 / 3.0 * math.pi * r**3
    assert high * volume > displaced > 0.9999 * low * volume


def test_the_force_under_a_capsule_that_lies_is_shared_by_its_ends_whatever_the_step() -> None:
    """A level axis: half of h m g at each end of its line, and no moment about its middle."""
    g = resting_grid
    assert band("resting_grid", "longest-step") == (g.LONGEST, g.LONGEST)
    for h in np.geomspace(g.TIME_STEP, g.LONGEST, 50).tolist():
        ends = np.linalg.solve([[1.0, 1.0], [-0.5, 0.5]], [h * g.GRAVITY * g.MASS, 0.0])
        assert ends.sum() / h == pytest.approx(g.GRAVITY * g.MASS, rel=1e-14) and ends[0] == ends[1]
    assert band("resting_grid", "heaviest") == (g.HEAVIEST, g.HEAVIEST)
    for mass in np.geomspace(g.MASS, g.HEAVIEST, 13).tolist():
        rim = np.linalg.lstsq(np.array([[1.0] * 3, [1.0, -0.5, -0.5], [0.0, 1.0, -1.0]]), [mass, 0.0, 0.0])[0]
        assert rim.sum() / mass == pytest.approx(1.0, rel=1e-14), "three points of its rim carry it alike"


def test_less_of_a_higher_bounce_is_lost_between_two_steps() -> None:
    """The path between two samples sags by g h²/8 at most, whatever its height."""
    b = bounce_grid
    assert band("bounce_grid", "highest") == (b.HIGHEST, b.HIGHEST)
    sag = b.GRAVITY * b.TIME_STEP**2 / 8.0
    lost = [sag / (b.MIDDLE**4 * height) for height in np.geomspace(b.HEIGHT, b.HIGHEST, 50).tolist()]
    assert lost[0] < b.RIGHT and all(np.diff(lost) < 0.0)


def test_the_force_under_a_ball_knows_no_step() -> None:
    r = resting_ball
    assert band("resting_ball", "longest-step") == (r.LONGEST, r.LONGEST)
    for h in np.geomspace(r.TIME_STEP, r.LONGEST, 50).tolist():
        assert h * r.GRAVITY * r.MASS / h == pytest.approx(r.WEIGHT, rel=1e-15)


def test_plates_stand_while_those_above_have_their_centre_inside_every_edge() -> None:
    low, high = band("overhang", "farthest")
    assert band("overhang", "tallest") == (overhang.TALL[-1],) * 2

    def inside(count: int, share: Fraction) -> bool:
        places = [Fraction(0)]
        for level in range(1, count):
            places.append(places[-1] + share * Fraction(overhang.LENGTH) / (2 * (count - level)))
        above = (sum(places[k + 1 :]) / (count - 1 - k) - places[k] for k in range(count - 1))
        return all(centre <= Fraction(overhang.LENGTH) / 2 for centre in above)

    for count in overhang.TALL:
        assert inside(count, Fraction(low)) and inside(count, Fraction(high))
        assert inside(count, Fraction(overhang.INSIDE)) and not inside(count, Fraction(1001, 1000))


def shared(aside: float, width: float) -> np.ndarray:
    """What both ends of the face two boxes share bear of the upper one's load, or of its blow; one is aside, both as wide."""
    ends = np.array([aside - 0.5 * width, 0.5 * width])  # the upper one's end, the lower one's
    return np.linalg.solve([[1.0, 1.0], ends - aside], [1.0, 0.0])


@pytest.mark.parametrize(
    ("test", "width"), [("resting_box", resting_box.EDGE), ("falling_pile", falling_pile.EDGES[0])]
)
def test_a_box_stays_on_another_while_both_ends_of_their_face_press(test: str, width: float) -> None:
    low, high = band(test, "farthest-aside")
    assert shared(low, width).min() > 0.0 > shared(1.001 * high, width).min()
    assert shared(high, width).min() == pytest.approx(0.0, abs=1e-12)


def test_a_box_sinks_by_roundings_of_the_speed_that_contact_takes() -> None:
    """One row in floating point: no more than four units of g h are left of it in a step, h times that is the way."""
    r = resting_box
    low, high = band("resting_box", "longest-step")
    assert high == r.LONGEST
    for h in np.geomspace(r.TIME_STEP, low, 200):
        for mass in (r.MASS, 3.0, 0.7):
            speed = place = 0.0
            for _ in range(r.STEPS):
                speed -= float(h) * r.GRAVITY
                speed += (-mass * speed) / mass
                place += float(h) * speed
            assert abs(place) <= r.DEEP
    assert 4.0 * r.STEPS * 2.0**-53 * r.GRAVITY * low**2 == pytest.approx(r.DEEP)


def stands(friction: float) -> bool:
    """Whether loads in their cones hold a pile of four: of a lower sphere, N and T above, N and F below."""
    sine, cosine = math.sin(pile.LEAN), math.cos(pile.LEAN)
    balance = [
        [-sine, cosine, 0.0, 1.0],  # outward, per weight: pushed out above, held there and below
        [-cosine, -sine, 1.0, 0.0],  # upward
        [0.0, 1.0, 0.0, -1.0],  # about its centre
        [3.0 * cosine, 3.0 * sine, 0.0, 0.0],  # the upper one, upward
    ]
    cones = [
        [-friction, 1.0, 0.0, 0.0],
        [-friction, -1.0, 0.0, 0.0],
        [0.0, 0.0, -friction, 1.0],
        [0.0, 0.0, -friction, -1.0],
    ]
    free = [(0.0, None), (None, None), (0.0, None), (None, None)]
    found = linprog(np.zeros(4), cones, np.zeros(4), balance, [0.0, 1.0, 0.0, 1.0], free)
    return bool(found.status == 0)


@pytest.mark.parametrize("study", ["smoothest-direct", "smoothest-iterative"])
def test_four_spheres_stand_with_the_friction_that_loads_in_their_cones_need(study: str) -> None:
    low, high = band("pile", study)
    assert stands(high) and not stands(0.999 * low)


def test_a_ball_rolls_down_while_friction_can_turn_it() -> None:
    low, high = band("seams", "steepest")
    for slope, rolls in ((low, True), (1.001 * high, False)):
        pull = math.sin(math.atan(slope))
        needed = np.linalg.solve([[1.0, 1.0], [1.0, -2.5]], [pull, 0.0])[1]  # a + f = g sin θ, a = 5/2 f
        assert (needed <= seams.FRICTION * math.cos(math.atan(slope))) == rolls


def test_ends_of_searches_are_on_the_floor_and_beyond_all_sizes() -> None:
    s, f = seams, falling_pile
    assert band("seams", "longest-step") == (s.LONGEST, s.LONGEST)
    assert all(a + v * s.LONGEST + 0.2 < s.CELL * s.CELLS for a, v in zip(s.PLACE, s.SPEED, strict=True))
    assert math.hypot(*s.SPEED) * s.LONGEST > 10.0 * s.CELL
    assert band("falling_pile", "fastest") == (f.FASTEST, f.FASTEST)
    assert f.FASTEST * f.TIME_STEP > 50.0 * (0.6 + 3.0 * f.APART)


@pytest.mark.parametrize("time_step", [vehicle.TIME_STEP, vehicle.LONGEST])
def test_a_vehicle_rolls_by_its_energy_whatever_the_step(time_step: float) -> None:
    """What ten steps of a constant pull give, and by the work done: ½ (M + 4 J/r²) v² = M g sin θ · way of a fall in between."""
    assert band("vehicle", "longest-step") == (vehicle.LONGEST, vehicle.LONGEST)
    pull = vehicle.MASS * vehicle.GRAVITY * math.sin(math.atan(vehicle.SLOPE))
    moving = vehicle.MASS + 4.0 * vehicle.INERTIA / vehicle.RADIUS**2
    speed = 10.0 * time_step * vehicle.ROLLING
    way = 0.5 * speed * 10.0 * time_step
    assert 0.5 * moving * speed**2 == pytest.approx(pull * way, rel=1e-12)


def test_friction_at_rolling_takes_no_more_than_there_is_in_any_step() -> None:
    """Three steps in fractions: the ball's law is m v' = −F, ⅖ m r² ω' = F r − ρ N while it rolls, so v' = −(5/7) ρ g/r."""
    r = rolling_friction
    assert band("rolling_friction", "longest-step") == (r.LONGEST, r.LONGEST)
    ratio = Fraction(r.ROLLING) / Fraction(r.RADIUS)
    for h in (Fraction(1, 60), Fraction(r.LONGEST)):
        speed = Fraction(r.SPEED)
        for _ in range(3):
            speed = max(Fraction(0), speed - h * Fraction(5, 7) * ratio * Fraction(r.GRAVITY))
        assert float(speed) == pytest.approx(max(0.0, r.SPEED - 3.0 * float(h) * r.BRAKE), abs=1e-12)


def test_a_heavy_carrier_starts_by_the_energy_of_all_its_wheels() -> None:
    """Speeds of sun and planet by Willis for one of the carrier; twice the energy is the inertia at the carrier."""
    g = gears
    assert band("gears", "heaviest-carrier") == (g.HEAVIEST, g.HEAVIEST)
    sun, planet = 1.0 + g.RING / g.SUN, 1.0 - g.RING / g.PLANET
    inertia = g.INERTIA["sun"] * sun**2 + g.INERTIA["planet"] * planet**2 + g.PLANET_MASS * g.ORBIT**2
    assert g.reduced_inertia() == pytest.approx(inertia + g.INERTIA["carrier"], rel=1e-14)
    assert inertia / g.HEAVIEST > 2.0**-52, "the light wheels are still there in a sum of doubles"


def test_a_ball_rebounds_that_keeps_more_than_gravity_takes_in_a_step() -> None:
    b = bouncing_ball
    low, high = band("bouncing_ball", "gentlest-impact")
    for speed, rises in ((0.999 * low, False), (high, True)):
        after = Fraction(speed) * Fraction(b.RESTITUTION) - Fraction(b.TIME_STEP) * Fraction(b.GRAVITY)
        assert (after > 0) == rises


def unequal_cards_stand(times: float) -> bool:
    """Whether forces in their cones hold two leaning boards: of each foot load and thrust, between the tops push and rub."""
    c = leaning_cards
    out, up = c.LENGTH * math.sin(c.LEAN), c.LENGTH * math.cos(c.LEAN)
    far, high = 0.5 * c.THICK + out, 0.5 * c.THICK + up  # of the tops' point from a foot's
    balance = [
        [1.0, 0.0, 0.0, 0.0, 0.0, 1.0],  # upward, of the left board: the right one lifts it by the last
        [0.0, 0.0, 1.0, 0.0, 0.0, -1.0],
        [0.0, 1.0, 0.0, 0.0, -1.0, 0.0],  # inward
        [0.0, 0.0, 0.0, 1.0, -1.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, high, far],  # about their feet
        [0.0, 0.0, 0.0, 0.0, high, -far],
    ]
    loads = [1.0, times, 0.0, 0.0, 0.5 * out, 0.5 * out * times]
    cones = []
    for push, rub in ((0, 1), (2, 3), (4, 5)):
        for sign in (1.0, -1.0):
            row = np.zeros(6)
            row[push], row[rub] = -c.FRICTION, sign
            cones.append(row)
    free = [(0.0, None), (None, None)] * 3
    return bool(linprog(np.zeros(6), cones, np.zeros(6), balance, loads, free).status == 0)


def test_a_card_is_held_by_one_as_heavy_as_friction_of_the_tops_lets_it_be() -> None:
    low, high = band("leaning_cards", "most-unequal")
    assert unequal_cards_stand(low) and not unequal_cards_stand(high)
    assert unequal_cards_stand(0.9999 * leaning_cards.UNEQUAL)
    assert not unequal_cards_stand(1.0001 * leaning_cards.UNEQUAL)


def test_friction_on_a_grain_takes_by_the_slips_direction_however_fast_it_is() -> None:
    g = grain
    assert band("grain", "fastest") == (1e6, 1e6)
    kick = g.TIME_STEP * g.GRAVITY
    fast = (1e6 * g.THROW[0], 1e6 * g.THROW[1])
    steepest = math.hypot(g.ALONG * fast[0], g.ACROSS * fast[1])
    for before, after, mu in zip(fast, g.slid(fast, kick), (g.ALONG, g.ACROSS), strict=True):
        assert before - after == pytest.approx(kick * mu**2 * before / steepest, rel=1e-6)
    assert 10 * math.ulp(fast[0]) < 1e-6 * kick, "what rounding may take in ten steps"


def spin_in_flight(friction: float) -> float:
    """Of a ball that rolls slowly over an edge [rad/s]: it slips where µ N cannot turn it, and leaves where N ends."""
    e = edge_roll

    def load(_: float, state: np.ndarray) -> float:
        return float(e.GRAVITY * math.cos(state[0]) - state[1] ** 2 / e.RADIUS)

    def slopes(time: float, state: np.ndarray) -> tuple[float, float, float]:
        pull, most = e.GRAVITY * math.sin(state[0]), friction * load(time, state)
        rubs = min(2.0 / 7.0 * pull, most) if state[2] * e.RADIUS > state[1] - 1e-9 else most
        return state[1] / e.RADIUS, pull - rubs, 2.5 * rubs / e.RADIUS

    load.terminal = True  # type: ignore[attr-defined]
    start = (0.0, e.SLOW, e.SLOW / e.RADIUS)
    found = solve_ivp(slopes, (0.0, 3.0), start, events=load, rtol=1e-9, atol=1e-11, max_step=2e-3)
    return float(found.y[2, -1])


def test_an_edge_spins_a_ball_up_by_what_friction_there_is() -> None:
    e = edge_roll
    wanted, off = e.KEPT * e.departure(e.SLOW, True)[1] / e.RADIUS, e.GRAVITY * e.COARSE / e.RADIUS
    low, high = e.SMOOTHEST
    assert spin_in_flight(low) == pytest.approx(wanted - off, abs=0.005)
    assert spin_in_flight(high) == pytest.approx(wanted + off, abs=0.005)
    assert band("edge_roll", "smoothest")[0] == low


def test_a_ball_stays_in_its_bowl_while_its_energy_does_not_lift_it_to_the_rim() -> None:
    b = bowl
    width, start = b.facet(b.FACETS)
    path = b.BOWL * math.cos(0.5 * width) - b.BALL
    rim = b.BOWL * (1.0 - math.cos(b.REACH)) + b.BALL * math.cos(b.REACH - 0.5 * width)
    square = 10.0 / 7.0 * b.GRAVITY * (rim - b.BOWL + path * math.cos(start))
    corners = round((b.REACH - 0.5 * width - start) / width)
    kept = ((math.cos(width) + 0.4) / 1.4) ** (2 * corners)
    assert math.sqrt(square) < b.PUSH < math.sqrt(square / kept)
    low, high = band("bowl", "hardest-push")
    assert low < b.PUSH < high < 1.011 * b.PUSH


def bounce(restitution: float, late: float) -> float:
    """The height [m] of the second bounce, in steps of which `late` is left when the ball meets the table."""
    b = last_bounce
    h, speed, place = b.TIME_STEP, 0.5 * b.GRAVITY * b.FIRST, 0.0
    while place + h * (speed - h * b.GRAVITY) >= 0.0 or speed > 0.0:
        speed -= h * b.GRAVITY
        place += h * speed
    speed = -restitution * (speed - (1.0 - late) * h * b.GRAVITY) - late * h * b.GRAVITY
    place, highest = late * h * speed, 0.0
    while speed > 0.0:
        highest = max(highest, place)
        speed -= h * b.GRAVITY
        place += h * speed
    return max(highest, place)


@pytest.mark.parametrize("late", [0.0, 0.5, 1.0])
def test_a_dull_ball_comes_up_again_as_restitution_says(late: float) -> None:
    low, high = band("last_bounce", "dullest")
    assert bounce(low, late) < last_bounce.LIFT < bounce(high, late)
    newton = (low * 0.5 * last_bounce.GRAVITY * last_bounce.FIRST) ** 2 / (2.0 * last_bounce.GRAVITY)
    assert newton == pytest.approx(last_bounce.LIFT)


def test_a_slope_is_felt_that_unbalances_impulses_by_what_the_core_calls_balanced() -> None:
    """A step from velocities that stay: friction is the last step's, 2/7 of the pull; the rest of the pull is missing."""
    low, high = band("rolling_beats", "gentlest")
    (pushes,) = re.findall(r"pushes = (\S+);", (CONTACTS / "contact_judge.cpp").read_text())
    assert float(pushes) == rolling_beats.SAME
    for slope, felt in ((0.999 * low, False), (high, True)):
        pull, load = math.sin(slope), math.cos(slope)
        assert (pull - 2.0 / 7.0 * pull > float(pushes) * load) == felt
