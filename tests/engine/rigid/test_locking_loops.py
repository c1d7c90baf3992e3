"""Loops with redundant joints: moved rightly, or refused with the names of the joints that lock; never in silence."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from spook_tracker.engine import (
    PLAIN,
    WORLD,
    ConstraintForce,
    Distance,
    Hinge,
    JointCoordinate,
    JointSpring,
    Method,
    Motor,
    Orientation,
    Position,
    Result,
    RigidBody,
    Scene,
    Sinusoid,
    simulate,
)
from spook_tracker.scalar_tests.mechanisms import scissor_lift
from spook_tracker.scalar_tests.multibody import bricard
from spook_tracker.scalar_tests.multibody.library import turned
from spook_tracker.scalar_tests.thesis.door import scene as door
from tests.scenes.seen import finals, traces

G = 9.81  # m/s²
H = 1 / 240  # s
EAST = np.array([1.0, 0.0, 0.0])
CURVED = Method(half_step_velocities=True, corrections=1)


def third_after_a_second(compliance: float, h: float, scene: Scene | None = None) -> tuple[Result, float]:
    """Bricard's mechanism, and how far its third point is from its place [m]."""
    observe = traces(centre=Position("rod 3"), turn=Orientation("rod 3"))
    built = scene or bricard.scene(h, compliance)
    run = simulate(built, time_step=h, duration=1.0, observe=observe)
    if not run.completed:
        return run, math.inf
    third = run["centre"][-1] + turned(run["turn"][-1:], (0.0, 0.0, 0.5))[0]
    return run, float(np.linalg.norm(third - bricard.EXACT[1.0]))


@pytest.mark.parametrize("h", [1 / 60, 1 / 240, 1 / 960])
@pytest.mark.parametrize("compliance", [0.0, *(10.0**k for k in range(-14, -5))])
def test_bricards_mechanism_is_right_or_refused(compliance: float, h: float) -> None:
    """A time step moves it by .0044 m and less at h = 1/240 s; what is further off was locked."""
    run, off = third_after_a_second(compliance, h)

    if run.completed:
        assert off < 0.02
        return
    assert run.status == "diverged"
    assert all(f"'P{k}'" in run.failure for k in range(6))
    assert "locked by redundant joints" in run.failure and "corrections=1" in run.failure


def test_it_is_refused_only_where_the_rows_hold_it_up() -> None:
    """What damping takes where rows contradict each other is of order h⁵ over the compliance."""
    refused = {
        h: [c for c in 10.0 ** np.arange(-14, -5) if not third_after_a_second(c, h)[0].completed]
        for h in (1 / 60, 1 / 240, 1 / 960)
    }

    assert max(refused[1 / 60]) > 1e-10 and max(refused[1 / 60]) < 1e-8
    assert max(refused[1 / 240]) > 1e-13 and max(refused[1 / 240]) < 1e-11
    assert not refused[1 / 960]


def moved_points(by: float) -> np.ndarray:
    return bricard.POINTS + by * np.random.default_rng(0).normal(size=(6, 3))


@pytest.mark.parametrize("compliance", [0.0, 1e-12])
@pytest.mark.parametrize("by", [1e-9, 1e-6, 1e-4, 1e-3])
def test_a_loop_that_does_not_fit_is_refused(
    monkeypatch: pytest.MonkeyPatch, by: float, compliance: float
) -> None:
    """Six hinges in a loop that is no Bricard mechanism are a truss: it stands, which it was not asked to."""
    monkeypatch.setattr(bricard, "POINTS", moved_points(by))
    run, _ = third_after_a_second(compliance, H)

    assert "'P2'" in run.failure and "locked by redundant joints" in run.failure


def link(name: str, a: np.ndarray, b: np.ndarray, mass: float = 1.0) -> RigidBody:
    """A rod of one kilogram from a to b, its own x axis along it."""
    along = (b - a) / np.linalg.norm(b - a)
    half = np.array([1.0 + along[0], 0.0, -along[2], along[1]])  # from x to along, by half the turn
    half /= np.linalg.norm(half)
    across = mass * float(np.dot(b - a, b - a)) / 12.0
    return RigidBody(
        name=name,
        mass=mass,
        inertia=(1e-3, across, across),
        position=tuple(0.5 * (a + b)),
        orientation=tuple(half),
    )


PINS = np.array([(0, 0, 0), (0.3, 0.4, 0), (1.2, 1.0, 0), (1.5, 0, 0)], float)  # m


def four_bar(compliance: float, tilt: float = 0.0) -> Scene:
    """Crank, coupler and rocker of three lengths on hinges about z, three of whose rows say what others say; with the
    last axis `tilt` [rad] out of line they are a truss."""
    names = ("crank", "coupler", "rocker")
    rods = tuple(link(n, a, b) for n, (a, b) in zip(names, itertools.pairwise(PINS), strict=True))
    ends = [(WORLD, "crank"), ("crank", "coupler"), ("coupler", "rocker"), (WORLD, "rocker")]
    axes = [(0.0, 0.0, 1.0)] * 3 + [(math.sin(tilt), 0.0, math.cos(tilt))]
    hinges = tuple(
        Hinge(name=f"pin {k}", between=ends[k], at=tuple(PINS[k]), axis=axes[k], compliance=compliance)
        for k in range(4)
    )
    return Scene(bodies=rods, constraints=hinges, gravity=(0.0, -G, 0.0), contacts=False)


FOOT, BAR, SLOPE, PLATE = 0.2, 0.5, 0.9, 1.0  # m, m, rad, kg


def sarrus(compliance: float, tilt: float = 0.0) -> Scene:
    """A plate on two pairs of bars that fold in planes at right angles, so that it only goes up and down: six hinges,
    one of whose 30 rows is redundant; `tilt` [rad] of one axis stops it."""
    height = BAR * math.sin(SLOPE)
    plate = RigidBody(name="plate", mass=PLATE, inertia=(0.1, 0.1, 0.2), position=(0.0, 0.0, 2.0 * height))
    bodies, hinges = [plate], []
    for name, out, axis in (("x", (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), ("y", (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))):
        foot = FOOT * np.array(out)
        knee = foot + BAR * math.cos(SLOPE) * np.array(out) + (0.0, 0.0, height)
        top = np.array([*foot[:2], 2.0 * height])
        bodies += [link(f"low {name}", foot, knee), link(f"high {name}", knee, top)]
        ends = [(WORLD, f"low {name}"), (f"low {name}", f"high {name}"), (f"high {name}", "plate")]
        for part, between, at in zip(("foot", "knee", "top"), ends, (foot, knee, top), strict=True):
            turned_axis = (0.0, math.cos(tilt), math.sin(tilt)) if (name, part) == ("x", "knee") else axis
            hinges.append(
                Hinge(
                    name=f"{part} {name}",
                    between=between,
                    at=tuple(at),
                    axis=turned_axis,
                    compliance=compliance,
                )
            )
    return Scene(bodies=tuple(bodies), constraints=tuple(hinges), gravity=(0.0, 0.0, -G), contacts=False)


def plate_height(time: float) -> float:
    """[m], of the one equation that is left: I θ̈ + I'/2 θ̇² = −(4 m + 2 M) g l cos θ."""
    square = BAR * BAR

    def inertia(angle: float) -> float:
        return square * (4.0 / 3.0 + (4.0 + 4.0 * PLATE) * math.cos(angle) ** 2)

    def flow(_: float, state: np.ndarray) -> list[float]:
        angle, rate = state
        bend = -square * (4.0 + 4.0 * PLATE) * math.cos(angle) * math.sin(angle)  # half of I'
        pull = (4.0 + 2.0 * PLATE) * G * BAR * math.cos(angle)
        return [rate, (-pull - bend * rate * rate) / inertia(angle)]

    end = solve_ivp(flow, (0.0, time), (SLOPE, 0.0), method="DOP853", rtol=1e-11, atol=1e-11).y[0, -1]
    return 2.0 * BAR * math.sin(end)


def crank_end(time: float) -> tuple[float, float]:
    """Centre of the crank [m], of the one equation that is left of the four-bar, its coupler found by two circles."""
    ground, (crank, coupler, rocker) = PINS[3], (np.linalg.norm(b - a) for a, b in itertools.pairwise(PINS))

    def centres(angle: float) -> np.ndarray:
        """x, y of the three centres and their angles × length / √12, so that m |d/dt|² is twice the energy."""
        tip = crank * np.array([math.cos(angle), math.sin(angle), 0.0])
        apart = ground - tip
        length = float(np.linalg.norm(apart))
        along = (coupler**2 - rocker**2 + length**2) / (2.0 * length)
        normal = np.array([-apart[1], apart[0], 0.0]) / length
        joint = tip + along / length * apart + math.sqrt(coupler**2 - along**2) * normal
        found = []
        for a, b in ((np.zeros(3), tip), (tip, joint), (joint, ground)):
            turn = math.atan2(b[1] - a[1], b[0] - a[0])
            found += [*(0.5 * (a + b))[:2], turn * float(np.linalg.norm(b - a)) / math.sqrt(12.0)]
        return np.array(found)

    def slope(angle: float, step: float = 1e-4) -> np.ndarray:
        near, far = (
            centres(angle + step) - centres(angle - step),
            centres(angle + 2 * step) - centres(angle - 2 * step),
        )
        return np.asarray((8.0 * near - far) / (12.0 * step))

    def flow(_: float, state: np.ndarray) -> list[float]:
        angle, rate = state
        step, here = 1e-4, slope(angle)
        bend = (slope(angle + step) - slope(angle - step)) / (2.0 * step)
        return [rate, float((-G * here[1::3].sum() - here @ bend * rate * rate) / (here @ here))]

    start = math.atan2(PINS[1, 1], PINS[1, 0])
    end = solve_ivp(flow, (0.0, time), (start, 0.0), method="DOP853", rtol=1e-9, atol=1e-9).y[0, -1]
    return 0.5 * float(crank) * math.cos(end), 0.5 * float(crank) * math.sin(end)


def end_of(scene: Scene, body: str, h: float, duration: float, method: Method = CURVED) -> np.ndarray:
    run = simulate(scene, time_step=h, duration=duration, method=method, observe=finals(x=Position(body)))
    return np.asarray(run["x"])


@pytest.mark.parametrize("compliance", [0.0, 1e-14, 1e-8])
@pytest.mark.parametrize("method", [PLAIN, CURVED], ids=["plain", "curved"])
def test_redundant_rows_that_agree_move_rightly(compliance: float, method: Method) -> None:
    """Out of the plane of a four-bar nothing bends, and in Sarrus' linkage the rows that repeat each other stay true."""
    share = 0.05 if method == PLAIN else 1e-3  # of a metre: of order h and h²

    x, y, _ = end_of(four_bar(compliance), "crank", H, 0.5, method)
    assert math.hypot(*(np.array(crank_end(0.5)) - (x, y))) < share
    z = end_of(sarrus(compliance), "plate", H, 0.25, method)[2]
    assert abs(z - plate_height(0.25)) < share


@pytest.mark.parametrize("compliance", [0.0, 1e-12])
@pytest.mark.parametrize("tilt", [1e-4, 1e-3, 1e-2])
@pytest.mark.parametrize(("make", "joint"), [(four_bar, "'pin 3'"), (sarrus, "'knee x'")])
def test_an_axis_out_of_line_is_named(
    make: Callable[[float, float], Scene], joint: str, tilt: float, compliance: float
) -> None:
    result = simulate(make(compliance, tilt), time_step=H, duration=1.0)

    assert result.status == "diverged"
    assert "locked by redundant joints" in result.failure and joint in result.failure


def test_a_structure_at_rest_is_not_called_locked() -> None:
    """A door that hangs still on four hinges, and a bar that leans on a rope of hinged links between two walls."""
    door = RigidBody(name="door", mass=45.0, inertia=(15.0, 19.0, 4.0), position=(0.5, 0.0, 1.0))
    hinges = tuple(
        Hinge(name=f"hinge {k}", between=(WORLD, "door"), at=(0.0, 0.0, 0.2 + 0.5 * k), compliance=compliance)
        for k, compliance in enumerate((0.0, 0.0, 1e-9, 1e-8))
    )
    hung = Scene(bodies=(door,), constraints=hinges, gravity=(0.0, 0.0, -G))
    angle = math.pi * (np.arange(41) / 40.0)
    places = np.stack([-np.cos(angle), np.zeros(41), 0.0 * angle], axis=1)  # flat, hinges about y
    places[:, 2] = -np.sin(angle)
    links = tuple(link(f"{k}", a, b) for k, (a, b) in enumerate(itertools.pairwise(places)))
    names = [WORLD, *(body.name for body in links), WORLD]
    pins = tuple(
        Hinge(name=f"pin {k}", between=(names[k], names[k + 1]), at=tuple(places[k]), axis=(0.0, 1.0, 0.0))
        for k in range(41)
    )
    rope = Scene(bodies=links, constraints=pins, gravity=(0.0, 0.0, -G), contacts=False)

    assert simulate(hung, time_step=1 / 60, duration=5.0).status == "completed"
    assert simulate(rope, time_step=1 / 240, duration=2.0).status == "completed"


@pytest.mark.parametrize(("stages", "degrees"), [(1, 0.6), (1, 0.001), (3, 0.3), (10, 0.1), (20, 0.05)])
def test_a_lift_that_lies_nearly_flat_is_held(stages: int, degrees: float) -> None:
    """Its rows resist at first order by the sine of that angle; what they resist grows as it moves."""
    angle = math.radians(degrees)
    observe = finals(pull=ConstraintForce("actuator"))
    run = simulate(scissor_lift.scene(stages, angle), time_step=1 / 60, steps=20, observe=observe)

    exact = scissor_lift.holding_force(stages, angle, scissor_lift.LOAD, scissor_lift.ARM)
    assert float(run["pull"]) == pytest.approx(exact, rel=1e-6)


def beside(scene: Scene, other: str) -> Scene:
    """The same, and something that no joint ties to it."""
    heavy = other == "a heavy pendulum"
    count, mass, length = (1, 1e4, 1.0) if heavy else (200, 1.0, 0.1)
    arms = [np.array([5.0 + k, 5.0, 5.0]) for k in range(count)]
    rods = tuple(link(f"arm {k}", a, a + length * EAST, mass) for k, a in enumerate(arms))
    hinges = tuple(
        Hinge(name=f"axle {k}", between=(WORLD, f"arm {k}"), at=tuple(a), axis=(0.0, 1.0, 1.0))
        for k, a in enumerate(arms)
    )
    return dataclasses.replace(scene, bodies=scene.bodies + rods, constraints=scene.constraints + hinges)


@pytest.mark.parametrize("other", ["a heavy pendulum", "many hinges"])
@pytest.mark.parametrize("compliance", [0.0, 1e-12])
@pytest.mark.parametrize("tilt", [1e-4, 1e-2])
def test_what_is_not_tied_to_a_loop_does_not_hide_that_it_locks(
    other: str, compliance: float, tilt: float
) -> None:
    """Neither by the energy it moves with nor by the number of its joints."""
    alone = simulate(four_bar(compliance, tilt), time_step=H, duration=1.0)
    result = simulate(beside(four_bar(compliance, tilt), other), time_step=H, duration=1.0)

    assert "locked by redundant joints" in result.failure and "axle" not in result.failure
    assert result.failure == alone.failure and result.failed_step == alone.failed_step


@pytest.mark.parametrize("other", ["a heavy pendulum", "many hinges"])
def test_bricards_lock_is_seen_beside_others(other: str) -> None:
    result = simulate(beside(bricard.scene(H, 1e-14), other), time_step=H, duration=1.0)

    assert all(f"'P{k}'" in result.failure for k in range(6)) and "axle" not in result.failure


def test_a_truss_is_not_called_a_mechanism_for_what_swings_beside_it() -> None:
    """A four-bar between two walls and a fifth rod across stand; a pendulum beside them is all that moves."""
    truss = four_bar(1e-9)
    brace = Distance(name="brace", between=((0.0, 0.0, 0.0), "coupler"), compliance=1e-9)
    stands = dataclasses.replace(truss, constraints=(*truss.constraints, brace))

    for scene in (stands, beside(stands, "a heavy pendulum")):
        assert simulate(scene, time_step=H, duration=2.0).status == "completed"


@pytest.mark.parametrize("gravity", [0.0, 1e-9, 1e-3])
@pytest.mark.parametrize("compliance", [0.0, 1e-12, 1e-9])
@pytest.mark.parametrize("pace", [0.5, 20.0])
def test_a_loop_that_is_driven_is_not_called_locked(gravity: float, compliance: float, pace: float) -> None:
    """What motors and springs push is a load: next to gravity alone the little that rows repeat looked large."""
    driven = four_bar(compliance)
    drives = (
        {"motor": Motor(speed=pace)},
        {"spring": JointSpring(stiffness=pace**2, rest=0.3)},
        {"spring": JointSpring(stiffness=1e6, rest=Sinusoid(amplitude=0.2, frequency=pace / 5.0))},
    )
    for drive in drives:
        crank = dataclasses.replace(driven.constraints[0], **drive)
        scene = dataclasses.replace(
            driven, constraints=(crank, *driven.constraints[1:]), gravity=(0.0, -gravity, 0.0)
        )
        h = H if pace < 1.0 else H / 8
        run = simulate(scene, time_step=h, duration=0.25)
        assert run.status == "completed", run.failure


def three_cranks(third: float, motor: Motor) -> Scene:
    """Of .3 m, the last of another length, that one rod couples: with another length it cannot move."""
    cranks = [
        RigidBody(name=f"crank {k}", mass=5.0, inertia=(0.3,) * 3, position=(k, 0.0, 0.0)) for k in range(3)
    ]
    rod = RigidBody(name="rod", mass=2.0, inertia=(0.01, 0.5, 0.5), position=(1.0, 0.0, 0.3))
    joints = [
        Hinge(
            name=f"axle {k}",
            between=(WORLD, f"crank {k}"),
            at=(k, 0, 0),
            axis=(0, 1, 0),
            motor=None if k else motor,
        )
        for k in range(3)
    ]
    for k, length in enumerate((0.3, 0.3, third)):
        joints.append(
            Hinge(name=f"pin {k}", between=(f"crank {k}", "rod"), at=(k, 0, length), axis=(0, 1, 0))
        )
    return Scene(bodies=(*cranks, rod), constraints=tuple(joints), gravity=(0.0, 0.0, -G), contacts=False)


@pytest.mark.parametrize("speed", [0.3, 1.0])
def test_a_motor_that_forces_a_loop_open_is_told_and_one_with_a_bound_is_held(speed: float) -> None:
    """Cranks with one too short, which turn only as far as joints give way: a motor without a bound opens them, one with a bound stops."""
    free = Motor(speed=speed)

    def run(third: float, motor: Motor) -> Result:
        observe = finals(angle=JointCoordinate("axle 0"))
        return simulate(three_cranks(third, motor), time_step=1 / 120, duration=4.0, observe=observe)

    forced = run(0.2, free)
    assert forced.status in ("unsettled", "diverged") and "bound the motor" in forced.failure
    fits = run(0.3, free)
    assert fits.completed and float(fits["angle"]) == pytest.approx(4.0 * speed, rel=0.01)
    bounded = run(0.2, Motor(speed=speed, max_force=50.0))
    assert bounded.completed and abs(float(bounded["angle"])) < 0.1


@pytest.mark.parametrize("tilt", [0.3, 0.8])
def test_so_is_one_that_forces_an_axis_out_of_line(tilt: float) -> None:
    bar = four_bar(1e-8, tilt)

    def driven(motor: Motor) -> Result:
        crank = dataclasses.replace(bar.constraints[0], motor=motor)
        scene = dataclasses.replace(bar, constraints=(crank, *bar.constraints[1:]))
        return simulate(scene, time_step=H, duration=1.0)

    forced = driven(Motor(speed=0.5))
    assert forced.status == "unsettled" and "bound the motor" in forced.failure
    assert driven(Motor(speed=0.5, max_force=1.0)).completed


@pytest.mark.parametrize("compliance", [0.0, 1e-12])
@pytest.mark.parametrize("stiffness", [1.0, 1e4])
def test_a_spring_on_a_joint_does_not_hide_that_its_loop_locks(stiffness: float, compliance: float) -> None:
    """A spring holds no coordinate: the loop has as much to move as without it."""
    tilted = four_bar(compliance, 1e-3)
    sprung = dataclasses.replace(tilted.constraints[0], spring=JointSpring(stiffness=stiffness, rest=0.5))
    scene = dataclasses.replace(
        tilted, constraints=(sprung, *tilted.constraints[1:]), gravity=(0.0, 0.0, 0.0)
    )

    assert "locked by redundant joints" in simulate(scene, time_step=H, duration=1.0).failure


@pytest.mark.parametrize("h", [1 / 30, 1 / 60, 1 / 240])
def test_a_door_that_stands_is_hardly_looked_at(h: float) -> None:
    """Five hinges on one axis repeat each other and hold nothing back: a look costs more than a step, so they are few.

    What stands moves by rounding, which halves and doubles from step to step; that is no motion that was stopped.
    """
    steps = 960
    run = simulate(door.scene(5, damping=2.0 * h), time_step=h, steps=steps)

    assert run.completed
    assert 1 <= run.counters["redundancy_looks"] <= 4 + steps / 64
