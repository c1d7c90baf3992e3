"""Where the limits of blocks that rock come from: integrations with events, and one blow by Newton's laws."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from spook_tracker.scalar_tests.stacks import rocking_block, shaken_block
from tests.scalar_tests.limits import measurement


def test_the_rocking_block_by_angular_momentum_and_a_tight_integration() -> None:
    """Angular momentum about the new corner, from positions and velocities; times by events of an integration."""
    r = rocking_block
    inertia = r.MASS * ((2 * r.HALF_WIDTH) ** 2 + (2 * r.HALF_HEIGHT) ** 2) / 12.0
    # Turning at 1 rad/s about the left corner; the centre stands (b, h) from it, and (−b, h) from the right one.
    moving = np.array((r.HALF_HEIGHT, -r.HALF_WIDTH))
    kept = inertia + r.MASS * (r.HALF_HEIGHT * moving[0] - (-r.HALF_WIDTH) * moving[1])
    assert kept / (inertia + r.MASS * r.RADIUS**2) == pytest.approx(r.KEPT, rel=1e-12)

    def fall(_: float, y: np.ndarray) -> tuple[float, float]:
        return y[1], -(r.RATE**2) * math.sin(r.SLENDER - y[0])

    def upright(_: float, y: np.ndarray) -> float:
        return float(y[0])

    def turning(_: float, y: np.ndarray) -> float:
        return float(y[1])

    upright.terminal, turning.terminal, turning.direction = True, True, -1  # type: ignore[attr-defined]
    tight = {"rtol": 1e-11, "atol": 1e-13}
    down = solve_ivp(fall, (0.0, 5.0), (r.START, 0.0), events=upright, **tight)
    assert down.t[-1] == pytest.approx(r.quarter(r.START), rel=1e-8)
    assert -down.y[1, -1] == pytest.approx(r.speed(r.START), rel=1e-8)
    up = solve_ivp(fall, (0.0, 5.0), (0.0, -r.KEPT * down.y[1, -1]), events=turning, **tight)
    assert up.y[0, -1] == pytest.approx(r.next_lean(), rel=1e-7)
    assert up.t[-1] == pytest.approx(r.quarter(r.next_lean()), rel=1e-7)


def shaken_fall(side: float, strength: float, frequency: float, half: bool, **tight: Any) -> Any:
    """solve_ivp of Housner's equation about the edge of that side, with its own events: upright, and a turn."""
    r, sb = rocking_block, shaken_block

    def fall(t: float, y: np.ndarray) -> tuple[float, float]:
        quiet = half and t > 0.5 / frequency
        floor = 0.0 if quiet else strength * sb.UPLIFT * math.sin(2.0 * math.pi * frequency * t)
        # Moments about the edge, of the weight and of −m a at the centre, over I = 4/3 m R².
        out, up = r.RADIUS * math.sin(r.SLENDER - side * y[0]), r.RADIUS * math.cos(r.SLENDER - side * y[0])
        return y[1], (-side * r.GRAVITY * out - floor * up) / (4.0 / 3.0 * r.RADIUS**2)

    def upright(_: float, y: np.ndarray) -> float:
        return float(side * y[0])

    def turning(_: float, y: np.ndarray) -> float:
        return float(side * y[1])

    upright.terminal, upright.direction, turning.direction = True, -1, -1  # type: ignore[attr-defined]
    return lambda span, start: solve_ivp(fall, span, start, events=(upright, turning), max_step=0.01, **tight)


def test_the_shaken_block_by_a_tight_integration_with_events() -> None:
    s, tight = shaken_block, {"rtol": 1e-11, "atol": 1e-14}
    uplift = math.asin(1.0 / s.SHAKE) / (2.0 * math.pi * s.FREQUENCY)
    swing = shaken_fall(-1.0, s.SHAKE, s.FREQUENCY, False, **tight)((uplift, 2.0), (-1e-13, -1e-14))
    back = shaken_fall(1.0, s.SHAKE, s.FREQUENCY, False, **tight)(
        (swing.t[-1], 2.0), (1e-13, s.KEPT * swing.y[1, -1])
    )
    right = s.rocking()
    assert (right.before, right.turned) == pytest.approx(
        (swing.y_events[1][-1][0], swing.t_events[1][-1]), abs=1e-7
    )
    assert (right.blow, right.speed) == pytest.approx((swing.t[-1], swing.y[1, -1]), rel=1e-6)
    assert (right.after, right.returned) == pytest.approx(
        (back.y_events[1][0][0], back.t_events[1][0]), rel=1e-6
    )


def test_the_least_half_sine_that_throws_a_block_over() -> None:
    s = shaken_block

    def falls(strength: float) -> bool:
        start = math.asin(1.0 / strength) / (2.0 * math.pi * s.PULSE)
        fly = shaken_fall(-1.0, strength, s.PULSE, True, rtol=1e-9, atol=1e-13)
        found = fly((start, s.FALLS), (-1e-13, -1e-14))
        return not len(found.t_events[0]) and bool(found.y[0, -1] < -s.SLENDER)

    def thrown(strength: float) -> bool:
        """The same stepped by 1/60 s, the floor's speed of mid-step: v₊ = v + h f, θ₊ = θ + h v₊."""
        lean = speed = floor = 0.0
        for k in range(round(s.FALLS / s.COARSE)):
            turned = 2.0 * math.pi * s.PULSE * min((k + 0.5) * s.COARSE, 0.5 / s.PULSE)
            now = strength * s.UPLIFT / (2.0 * math.pi * s.PULSE) * (1.0 - math.cos(turned))
            apart = s.SLENDER + lean
            kick = s.COARSE * math.sin(apart) - (now - floor) / s.GRAVITY * math.cos(apart)
            floor, speed = now, speed + s.RATE**2 * kick
            if lean >= 0.0 and speed > 0.0:
                lean = speed = 0.0  # both edges stand
            lean += s.COARSE * speed
        return lean < -s.SLENDER

    for outcome, within in ((falls, 1e-5), (thrown, 1e-3)):
        low, high = 1.5, 2.5
        for _ in range(20):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if outcome(middle) else (middle, high)
        assert low == pytest.approx(s.LEAST, rel=within)


WIDE, TALL, MASS = rocking_block.HALF_WIDTH, rocking_block.HALF_HEIGHT, rocking_block.MASS
ABOUT = MASS * (WIDE**2 + TALL**2) / 3.0  # kg m², about the centre


def turned(spin: float, arm: Any) -> Any:
    """Velocity in x and z of a point so far from where the block turns about."""
    return spin * np.array((arm[1], -arm[0]))


def struck(velocity: Any, spin: float, arm: Any, wanted: Any, about: float = ABOUT) -> tuple[Any, float]:
    """After the impulse at a corner that gives it the wanted velocity."""

    def moment(push: Any) -> float:
        return float(arm[1] * push[0] - arm[0] * push[1]) / about

    yielding = np.array([push / MASS + turned(moment(push), arm) for push in np.eye(2)]).T
    push = np.linalg.solve(yielding, wanted - velocity - turned(spin, arm))
    return velocity + push / MASS, spin + moment(push)


def kept(speed: float, h: float, part: float, floor: float = 0.0) -> float:
    """What a step's blow leaves of the energy of a block that would pass upright at `speed`, if it does after that part of a
    step; the floor accelerates sideways. The new corner's gap closes within the step, no more, and the next step finds it
    closed."""

    def energy(lean: float, spin: float) -> float:
        high = math.cos(rocking_block.SLENDER - abs(lean)) - math.cos(rocking_block.SLENDER)
        return (
            0.5 * (ABOUT + MASS * (WIDE**2 + TALL**2)) * spin**2 + MASS * 9.81 * rocking_block.RADIUS * high
        )

    pull, lean = h * np.array((-floor, -9.81)), part * h * speed
    spin = -math.sqrt(2.0 * (energy(0.0, speed) - energy(lean, 0.0)) / (4.0 * ABOUT))
    c, s = math.cos(lean), math.sin(lean)
    arm = np.array(
        (-WIDE * c - TALL * s, WIDE * s - TALL * c)
    )  # from the centre to the new corner, on the left
    velocity = turned(spin, np.array((-WIDE * c + TALL * s, WIDE * s + TALL * c))) + pull
    velocity, spin = struck(velocity, spin, arm, np.array((0.0, -2.0 * WIDE * s / h)))
    lean += h * spin
    c, s = math.cos(lean), math.sin(lean)
    arm = np.array((-WIDE * c - TALL * s, WIDE * s - TALL * c))
    _, spin = struck(velocity + pull, spin, arm, np.zeros(2))
    return energy(lean + h * spin, spin) / energy(0.0, speed)


def worst(speed: float, h: float, floors: tuple[float, ...] = (0.0,)) -> float:
    """The largest relative error of that, wherever in the step the blow falls."""
    right = rocking_block.KEPT**2
    return max(
        abs(kept(speed, h, part, a) / right - 1.0) for part in np.linspace(0.02, 0.98, 25) for a in floors
    )


def test_a_step_that_holds_an_impact_keeps_as_much_as_the_limits_allow() -> None:
    r, s = rocking_block, shaken_block
    limits = {m.name: m.limit for m in measurement("rocking_block", "plain").metrics}
    off = worst(r.speed(r.START), r.TIME_STEP)
    assert off < limits["kept_error"] < 2.0 * off
    # A swing's time grows with its energy by less than twice in proportion; each of two blows is found within two steps.
    swings = [2.0 * r.quarter(lean) for lean in (r.next_lean(), 1.001 * r.next_lean())]
    share = (swings[1] / swings[0] - 1.0) / (r.energy(1.001 * r.next_lean()) / r.energy(r.next_lean()) - 1.0)
    assert 0.3 < share < 2.0
    assert limits["swing_error"] == pytest.approx(2.0 * limits["kept_error"] + 4.0 * r.TIME_STEP / swings[0])
    # Started at rest half a step off, fallen v₊ = v + h f, θ₊ = θ + h v₊, it passes upright within two steps.
    lean, spin, steps = r.START, 0.0, 0
    while lean > 0.0:
        spin -= r.TIME_STEP * r.RATE**2 * math.sin(r.SLENDER - lean)
        lean, steps = lean + r.TIME_STEP * spin, steps + 1
    assert abs(steps - r.quarter(r.START) / r.TIME_STEP) < limits["first_blow_late"]

    limits = {m.name: m.limit for m in measurement("shaken_block", "plain").metrics}
    strongest = s.SHAKE * s.UPLIFT
    off = worst(abs(s.rocking().speed), s.TIME_STEP, (-strongest, 0.0, strongest))
    assert off < 2.0 * s.blow_error(s.TIME_STEP) < 2.0 * off
    # The swing after the blow by a tight integration: with a blow that keeps less, or comes two steps late.
    right, tight = s.rocking(), {"rtol": 1e-11, "atol": 1e-14}

    def after(kept_part: float, delay: float) -> float:
        fly = shaken_fall(1.0, s.SHAKE, s.FREQUENCY, False, **tight)
        return float(fly((right.blow + delay, 2.0), (1e-13, kept_part * right.speed)).y_events[1][0][0])

    less = after(s.KEPT * (1.0 - s.blow_error(s.TIME_STEP)), 0.0)
    late = after(s.KEPT, 2.0 * s.TIME_STEP)
    start = math.asin(1.0 / s.SHAKE) / (2.0 * math.pi * s.FREQUENCY) + s.TIME_STEP
    fly = shaken_fall(-1.0, s.SHAKE, s.FREQUENCY, False, **tight)
    before = abs(float(fly((start, 2.0), (-1e-13, -1e-14)).y_events[1][-1][0]) / right.before - 1.0)
    assert limits["before_error"] == pytest.approx(before + s.RATE * s.TIME_STEP, rel=1e-3)
    parts = abs(less / right.after - 1.0) + abs(late / right.after - 1.0) + limits["before_error"]
    assert limits["after_error"] == pytest.approx(parts, rel=1e-3)
    # Stepped as v₊ = v + h f, θ₊ = θ + h v₊ from standing it strikes within two steps of that.
    h, lean, spin, step = s.TIME_STEP, 0.0, 0.0, 0
    while step * h < 0.5 * right.blow or lean < 0.0:
        spin += h * s.pull(-1.0, lean, step * h)
        spin = min(spin, 0.0) if lean >= 0.0 else spin  # both edges stand
        lean, step = lean + h * spin, step + 1
    assert abs(step - right.blow / h) < limits["blow_late"]


def test_a_block_falls_over_from_where_its_centre_is_highest() -> None:
    r = rocking_block
    study = next(one for one in r.TEST.stability if one.name == "farthest")
    low, high = study.expected or (0.0, 0.0)
    leans = np.linspace(0.0, 0.5, 500_001)
    highest = leans[np.argmax(WIDE * np.sin(leans) + TALL * np.cos(leans))]
    assert highest == pytest.approx(r.SLENDER, abs=2e-6)

    def returns(lean: float) -> bool:
        """Moments about the edge: m g (b cos θ − h sin θ) over 4/3 m R², by the step of the study."""
        place, spin = lean, 0.0
        for _ in range(60):
            arm = WIDE * math.cos(place) - TALL * math.sin(place)
            spin -= r.COARSE * 9.81 * arm / (4.0 / 3.0 * (WIDE**2 + TALL**2))
            place += r.COARSE * spin
        return place < lean

    assert low < highest < high < 1.0004 * low
    assert returns(low) and not returns(high)


def test_no_block_broader_than_root_two_of_its_height_rocks_on() -> None:
    """One blow by Newton's laws at the corner that comes down, as a step does it: its gap closes, and then it stands."""
    r = rocking_block
    study = next(one for one in r.TEST.stability if one.name == "broadest")
    low, high = study.expected or (0.0, 0.0)

    def after(ratio: float, h: float, part: float) -> float:
        """Speed about the new corner of a block that is so broad, if it would pass upright after that part of a step."""
        wide, lean, spin = ratio * TALL, part * h * r.ARRIVING, -r.ARRIVING
        about, pull = MASS * (wide**2 + TALL**2) / 3.0, h * np.array((0.0, -9.81))
        velocity = np.zeros(2)
        for k in range(2):
            c, s = math.cos(lean), math.sin(lean)
            if k == 0:
                velocity = turned(spin, np.array((-wide * c + TALL * s, wide * s + TALL * c)))
            arm = np.array((-wide * c - TALL * s, wide * s - TALL * c))  # from the centre to the new corner
            wanted = np.array((0.0, -2.0 * wide * s / h if k == 0 else 0.0))
            velocity, spin = struck(velocity + pull, spin, arm, wanted, about)
            lean += h * spin
        return -spin

    assert after(math.sqrt(2.0), 1e-9, 0.5) == pytest.approx(0.0, abs=1e-7)
    assert after(1.0, 1e-9, 0.5) == pytest.approx(0.25 * r.ARRIVING, rel=1e-6)  # 1 − (3/2) sin² 45°
    for part in (0.02, 0.25, 0.5, 0.75, 0.98):
        # What turns on leans until gravity has taken its speed: m g b over 4/3 m R².
        pull = 9.81 * low * TALL / (4.0 / 3.0 * TALL**2 * (1.0 + low**2))
        assert after(low, r.SHORT, part) > math.sqrt(2.0 * pull * r.ROCKED)
        assert after(high, r.SHORT, part) < math.sqrt(2.0 * pull * r.ROCKED)
    assert high < 1.001 * low


def test_the_edge_that_comes_down_needs_the_friction_of_its_impulses() -> None:
    """The impulses at the new corner that stop it: by themselves, and with the step's gravity and lean."""
    r = rocking_block
    study = next(one for one in r.TEST.stability if one.name == "smoothest")
    low, high = study.expected or (0.0, 0.0)

    def needed(h: float, part: float, weight: float) -> float:
        lean, spin, pull = part * h * r.ARRIVING, -r.ARRIVING, h * np.array((0.0, -weight))
        c, s = math.cos(lean), math.sin(lean)
        velocity = turned(spin, np.array((-WIDE * c + TALL * s, WIDE * s + TALL * c))) + pull
        arm = np.array((-WIDE * c - TALL * s, WIDE * s - TALL * c))  # from the centre to the new corner
        after, _ = struck(velocity, spin, arm, np.zeros(2))
        across, up = after - velocity
        return float(abs(across) / up)

    assert needed(1e-12, 0.0, 0.0) == pytest.approx(r.GRIP, rel=1e-9)
    found = [needed(r.SHORT, part, 9.81) for part in np.linspace(0.0, 1.0, 11)]
    assert low < min(found) and max(found) * 1.0001 < high
    assert high < low * 1.0009
