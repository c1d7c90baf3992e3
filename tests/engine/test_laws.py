"""The laws of mechanics over one corpus: which hold in which scene, by which methods and steps, and how closely.

A row is a scene of tests/scenes/corpus.py in all its variants, the methods and time steps that it is put to, and the laws
that hold there with their bounds. What nothing outside acts on keeps both momenta; what falls and collides only loses
energy; contacts push, within friction's cone; joints hold; what turns and swings without friction keeps its energy.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularMomentum,
    Ball,
    Box,
    Capsule,
    ContactPoints,
    Cylindrical,
    Distance,
    Energy,
    Hinge,
    JointCoordinate,
    KineticEnergy,
    Lock,
    Maximum,
    MaximumAbsolute,
    Method,
    Momentum,
    Penetration,
    Planar,
    Plane,
    PointOnLine,
    Prismatic,
    Result,
    Scene,
    Sphere,
    Trace,
    Violation,
    simulate,
)
from spook_tracker.scalar_tests.multibody import four_bars
from tests.engine.rigid import test_joint_trees as joint_trees
from tests.engine.rigid import test_plane_trees as plane_trees
from tests.scenes import blows, corpus
from tests.scenes.sleep import heap as dropped_boxes

H = 1 / 60  # s
SLOW = 0.02  # m/s: what is slower, sleeps
METHODS = {
    "direct": Method(),
    "iterative": Method(solver="iterative"),
    "one iteration": Method(solver="iterative", iterations=1),
    "thirty iterations": Method(solver="iterative", iterations=30),
    "fifty iterations": Method(solver="iterative", iterations=50),
    "two hundred iterations": Method(solver="iterative", iterations=200),
    "three hundred iterations": Method(solver="iterative", iterations=300),
    "twenty iterations": Method(solver="iterative", iterations=20),
    "all iterations": Method(solver="iterative", iterations=20_000, residual_tolerance=1e-9),
    "asleep": Method(sleep_speed=SLOW),
    "asleep, iterative": Method(solver="iterative", sleep_speed=SLOW),
    "successive": Method(impacts="successive"),
    "successive, iterative": Method(solver="iterative", impacts="successive"),
    "corrected": Method(corrections=1),
    "corrected twice": Method(corrections=2),
    "half": Method(half_step_velocities=True),
    "half, corrected": Method(half_step_velocities=True, corrections=1),
    "strings": Method(string_stiffness=True),
    "strings, corrected": Method(string_stiffness=True, corrections=1),
    "order4": Method(composition="order4"),
    "order6": Method(composition="order6"),
    "order8": Method(composition="order8"),
}
BOTH, SUCCESSIVE = ("direct", "iterative"), ("successive", "successive, iterative")
STEPS = (1 / 60, 1 / 240, 1e-3)
ORDERS = ("order4", "order6", "order8")
WATCHED = {
    "energy": Trace(quantity=Energy()),
    "kinetic": Trace(quantity=KineticEnergy()),
    "momentum": Trace(quantity=Momentum()),
    "spin": Trace(quantity=AngularMomentum(about=(3.0, -1.0, 2.0))),
    "depth": Maximum(quantity=Penetration()),
}


@dataclass(frozen=True)
class Run:
    """A scene, the step, and what was seen."""

    scene: Scene
    h: float
    seen: Result

    def scale(self) -> float:
        """The most energy there was, J."""
        return float(max(abs(self.seen["energy"][0]), self.seen["kinetic"].max()))


Law = Callable[[Run], None]


def momentum(within: float) -> Law:
    """It stays to so many N s."""

    def law(run: Run) -> None:
        assert np.abs(run.seen["momentum"] - run.seen["momentum"][0]).max() <= within

    return law


def spin(within: float) -> Law:
    """Angular momentum about a point beside the scene stays to so many kg m²/s."""

    def law(run: Run) -> None:
        assert np.abs(run.seen["spin"] - run.seen["spin"][0]).max() <= within

    return law


def falls(within: float = 1e-9) -> Law:
    """No step raises the energy by more than this share of it."""

    def law(run: Run) -> None:
        assert np.diff(run.seen["energy"]).max() <= within * run.scale()

    return law


def never_above(within: float = 1e-12) -> Law:
    """It is never more than at the start but for this share."""

    def law(run: Run) -> None:
        assert run.seen["energy"].max() <= run.seen["energy"][0] + within * run.scale()

    return law


def flies(kicks: float, within: float = 1e-9, least: float = -np.inf) -> Law:
    """Read on the parabolas that bodies go along, with v + g h/2, the energy rises by no more than `kicks` of the energy of
    half a kick, m (g h)²/8; no step takes more than the share `least` of it."""

    def law(run: Run) -> None:
        energy = run.seen["energy"] + 0.5 * run.h * run.seen["momentum"] @ np.array(run.scene.gravity)
        most = kicks * mass_of(run.scene) * (corpus.GRAVITY * run.h) ** 2 / 8.0 + within * run.scale()
        assert (energy - np.minimum.accumulate(energy)).max() <= most
        assert np.diff(energy).min() >= least * run.scale()

    return law


def mass_of(scene: Scene) -> float:
    """Of all that moves, kg."""
    return sum(getattr(body, "mass", None) or 0.0 for body in scene.bodies)


def is_kicked(within: float) -> Law:
    """Each step takes m (g h)²/2 of the energy with v, as in free flight, to so many J."""

    def law(run: Run) -> None:
        taken = 0.5 * mass_of(run.scene) * (corpus.GRAVITY * run.h) ** 2
        assert np.abs(np.diff(run.seen["energy"]) + taken).max() <= within

    return law


def keeps(within: float) -> Law:
    """The energy stays to this share of it."""

    def law(run: Run) -> None:
        assert np.abs(run.seen["energy"] - run.seen["energy"][0]).max() <= within * run.scale()

    return law


def as_settled(speed: float) -> Law:
    """A row that is `speed` off, of speeds u and more, gives or takes 2 speed/u of the energy of what it holds."""

    def law(run: Run) -> None:
        kinetic = run.seen["kinetic"].max()
        assert (
            run.seen["energy"].max() - run.seen["energy"][0]
            <= 2.0 * speed / np.sqrt(2.0 * kinetic / mass_of(run.scene)) * kinetic
        )

    return law


def rests(run: Run) -> None:
    assert run.seen["kinetic"][-1] < 1e-15


def arrives(body: str, place: tuple[float, ...], within: float) -> Law:
    """In the end it is there, m."""

    def law(run: Run) -> None:
        assert np.abs(run.seen.final_state[body][:3] - np.array(place)).max() <= within

    return law


def overlap(within: float) -> Law:
    """No two bodies are deeper in each other, m."""

    def law(run: Run) -> None:
        assert run.seen["depth"] <= within

    return law


def pushes(within: float) -> Law:
    """Contacts push, or do nothing, and rub within friction's cone, to so many N."""

    def law(run: Run) -> None:
        points = run.seen["points"].reshape(-1, 10)
        points = points[~np.isnan(points[:, 0])]
        load = np.sum(points[:, 3:6] * points[:, 6:9], axis=1)
        rubs = np.linalg.norm(points[:, 6:9] - load[:, None] * points[:, 3:6], axis=1)
        assert load.min(initial=0.0) >= -within
        assert (rubs - points[:, 9] * load).max(initial=0.0) <= within

    return law


def stops(within: float) -> Law:
    """No coordinate is farther beyond its limits, m or rad."""

    def law(run: Run) -> None:
        for row in run.scene.constraints:
            if limit := getattr(row, "limit", None):
                at = run.seen[f"at {row.name}"]
                assert limit.lower - within <= at.min() and at.max() <= limit.upper + within, row.name

    return law


def returns(within: float) -> Law:
    """In the end every coordinate is within its limits, m or rad."""

    def law(run: Run) -> None:
        for row in run.scene.constraints:
            if limit := getattr(row, "limit", None):
                assert limit.lower - within < run.seen[f"at {row.name}"][-1] < limit.upper + within, row.name

    return law


def goes(body: str, speed: tuple[float, ...], within: float) -> Law:
    """In the end its velocity is that, m/s."""

    def law(run: Run) -> None:
        assert np.abs(run.seen.final_state[body][7:10] - np.array(speed)).max() <= within

    return law


def slower(speed: float) -> Law:
    """Nothing is ever faster, m/s, by the energy of what moves with that speed."""

    def law(run: Run) -> None:
        lightest = min(body.mass for body in run.scene.bodies if body.mass)
        assert run.seen["kinetic"].max() <= 0.5 * lightest * speed**2

    return law


def impacts(least: int, most: int) -> Law:
    """So many are answered."""

    def law(run: Run) -> None:
        assert least <= run.seen.counters["impacts"] <= most

    return law


def between_ends(run: Run) -> None:
    """Of a slider a step takes no more than its way to and fro."""
    (guide,) = run.scene.constraints
    way = guide.limit.upper - guide.limit.lower  # type: ignore[union-attr]
    assert abs(run.seen.final_state["slider"][7]) < 2.0 * way / run.h


def whole_steps(run: Run) -> None:
    assert run.seen.counters["halved_steps"] == 0


def still(run: Run) -> None:
    assert run.seen["kinetic"].max() <= 1e-18


def holds(within: float) -> Law:
    """Joints and rows are violated by no more, m or rad."""

    def law(run: Run) -> None:
        for row in run.scene.constraints:
            assert np.abs(run.seen[row.name]).max() <= within, row.name

    return law


@dataclass(frozen=True)
class Row:
    """A scene in all its variants by some methods at some steps, and the laws that hold there."""

    name: str
    scene: Callable[..., Scene]
    given: tuple[tuple[Any, ...], ...]
    methods: tuple[str, ...]
    steps: tuple[float, ...]  # s
    seconds: float
    laws: tuple[Law, ...]
    status: tuple[str, ...] = ("completed",)
    watched: dict[str, Any] = field(default_factory=dict)


def each(*values: Any) -> tuple[tuple[Any, ...], ...]:
    return tuple((value,) for value in values)


ALONE: tuple[tuple[Any, ...], ...] = ((),)
SETTLED = ("completed", "unsettled")
BEYOND = ((0.2, 1.0), (-1.0, -0.2))  # stops, rad or m
TABLE = (
    # what floats
    Row("a rack", corpus.rack, each(0.7, 1.0), BOTH, (1 / 240,), 2.0, (momentum(1e-10), spin(1e-10), falls(1e-6))),
    # Plastic: what turned in a little is put apart without an impulse, which costs angular momentum.
    Row("a plastic rack", corpus.rack, each(0.0), BOTH, (1 / 240,), 2.0, (momentum(1e-10), spin(0.02), falls(1e-6))),
    # Newton's law alone raises the energy of some; what tumbles keeps it to the order of the rotation step.
    Row("a collision", corpus.collision, each(*range(12)), BOTH, (1 / 240,), 1.0, (never_above(), falls(2e-3))),
    Row("eight in a row", corpus.unequal_row, each(3, 21, 39), ("successive", "successive, iterative"), (H,), 8 * H,
        (momentum(1e-8), falls()), SETTLED),
    Row("a row in one step", corpus.near_row, each(5, 6, 8, 24), ("direct",), (H,), 4 * H, (momentum(3e-11), overlap(1e-9))),
    Row("a row by iterations", corpus.near_row, each(5, 6, 8, 24), ("iterative",), (H,), 4 * H, (momentum(3e-11),)),
    Row("a slide in a slot", corpus.slide_in_a_slot, ALONE, BOTH, (H,), 200 * H, (momentum(1e-11), keeps(1e-9), stops(1e-9))),
    Row("impacts without end", corpus.endless, each(*range(8)), ("successive", "successive, iterative"), (H,), 8 * H,
        (falls(1e-12),), status=("completed", "unsettled")),
    Row("between near ends", corpus.between_ends, each(1e-4, 0.02), BOTH, (H, 1 / 240, 1e-3), 40 * H, (falls(1e-12), stops(1e-11))),
    Row("every joint", corpus.all_joints, ALONE, ("direct",), (0.01,), 5.0, (momentum(1e-10), spin(1e-9), never_above())),
    Row("strings", corpus.strings, each("pair", "chain", "ring", "star"), ("strings", "strings, corrected"), (H, 0.5), 20.0,
        (momentum(1e-11), spin(1e-11))),
    Row("links", corpus.links, each(1.0), ("strings",), (H, 0.5), 40.0, (momentum(1e-12), spin(1e-11))),
    Row("links between heavy ends", corpus.links, each(1e6, 1e9, 1e12), ("strings",), (0.1,), 40.0, (spin(1e-11),)),
    Row("a square", corpus.square, ALONE, ORDERS, (0.02,), 10.0, (momentum(1e-11), spin(1e-10), holds(1e-13), keeps(1e-9),
        arrives("a", (np.cos(20.0), np.sin(20.0), 5.0), 1e-5))),
    Row("a cross", corpus.crossed, ALONE, ORDERS, (0.02,), 40.0, (spin(1e-11), keeps(1e-6))),
    Row("a cross by steps", corpus.crossed, ALONE, ("half", "half, corrected"), (0.02,), 40.0, (spin(5e-4),)),
    Row("locked boxes", corpus.locked, each(True, False), ("corrected twice",), (1 / 240,), 2.0, (spin(1e-8),)),
    *(
        Row("spinning boxes", blows.spinning_row, each(*range(k, 6, 3)), SUCCESSIVE, (h,), 0.1,
            (momentum(1e-12), spin(1e-12), impacts(3, 10**6))) for k, h in enumerate(STEPS)
    ),
    Row("a rider on a slider", blows.rider, each(0.0, 1.0), BOTH, STEPS, 0.5, (falls(), stops(1e-9))),
    Row("a hammer on a slider", blows.hammer, tuple((way, psi) for way in (1e-5, 1e-3) for psi in (0.0, 0.7)),
        ("direct", "three hundred iterations"), STEPS, 0.1, (falls(1e-12), stops(1e-11), overlap(1e-9), between_ends),
        status=("completed", "unsettled")),
    Row("a ring of locks", blows.ring, each(0.0, 1e-12, 1e-8), ("direct",), (1 / 240,), 5.0,
        (momentum(1e-12), spin(1e-11), keeps(1e-4), holds(5e-5))),
    Row("a pair on a hinge", partial(joint_trees.floating, "ball", "hinge", gravity=(0.0, 0.0, 0.0)), ALONE, ("order8",), (0.05,),
        10.0, (momentum(1e-11), spin(1e-11), holds(1e-13), whole_steps)),
    # Where they touch, along a wall, off the floor and before their time: no blow takes or gives energy.
    *(
        Row(f"{scene.__name__.replace('_', ' ')}, {shares} of a step", scene, each(*shares), methods, (H,), steps * H,
            (flies(0.0, within, -within),))
        for scene, shares, methods, steps, within in (
            (blows.touching, (0.1, 0.5, 0.9), (*BOTH, *SUCCESSIVE), 3, 1e-14), (blows.along_a_wall, (0.1, 0.5, 0.9), (*BOTH, *SUCCESSIVE), 3, 1e-13),
            (blows.off_the_floor, (0.1, 0.5, 0.9), SUCCESSIVE, 1, 1e-13), (blows.earlier, (0.9,), SUCCESSIVE, 1, 1e-12),
        )
    ),
    Row("locked balls below a roof", blows.locked_below_a_roof, each(0.1, 0.5, 0.9), (*BOTH, *SUCCESSIVE), (H,), 3 * H, (is_kicked(1e-9),)),
    *(
        Row("thrown at a wall", partial(blows.at_a_wall, h), tuple((k, way) for k in range(first, 12, 3) for way in (1.0, -1.0)),
            SUCCESSIVE, (h,), 6 * h, (flies(0.0, 4e-12, -4e-12), overlap(1e-9), impacts(1, 99)))
        for first, h in enumerate(STEPS)
    ),
    Row("springs between particles", blows.sprung_particles, ALONE, ("direct",), (0.01,), 5.0, (momentum(1e-12), spin(1e-12))),
    # what falls, leans and lies
    Row("up a slope and back", blows.on_a_slope, tuple((slope, share) for slope in (-0.3, 0.3, 1.0) for share in (0.2, 0.9)),
        (*BOTH, *SUCCESSIVE), (H,), 4 * H, (falls(),)),
    Row("a support lost", blows.losing_its_support, each(0.2, 0.9), (*BOTH, *SUCCESSIVE), (H,), H, (falls(),)),
    Row("a slope that steepens", blows.onto_a_steeper_slope, each(0.2, 0.9), (*BOTH, *SUCCESSIVE), (H,), H, (falls(),)),
    # Paths that curve within a step may overlap by a five-hundredth of the larger one's radius.
    Row("boxes that hardly rebound", blows.hardly, each(0, 1, 8), BOTH, (H,), 2.0,
        (falls(), overlap(1e-3 * float(np.linalg.norm(blows.HARDLY))))),
    Row("a box on a box that the floor stops", blows.borne, each(0.0, 0.1, 0.9), BOTH, (H,), 10 * H, (overlap(1e-8), slower(1e-6))),
    Row("an end hit down", blows.end_hit_down, tuple((bar, floor) for bar in (Capsule(0.05, 1.0), Box((0.1, 0.3, 1.0)))
        for floor in (Plane(), Box((4.0, 4.0, 1.0)))), BOTH, (H,), 0.1, (overlap(2e-3 * 0.6),)),
    Row("thrown up slowly", blows.thrown_up, ALONE, BOTH, (H,), 3 * H, (falls(4e-13), goes("ball", (0.0, 0.0, 0.0), 1e-12))),
    # Of a stack of a hundred that sweeps lift apart no overlap is more than what the allowed .1 m/s close in a step, nor of boxes.
    Row("a stack lifted apart", corpus.stack, each(100), ("two hundred iterations",), (H,), 2.0, (falls(1e-12), overlap(0.1 * H))),
    Row("a pile of boxes", partial(blows.pile_of, Box((0.5, 0.5, 0.5))), each(300), ("twenty iterations",), (H,), 4.0, (overlap(0.1 * H),)),
    Row("a pile", partial(blows.pile_of, Sphere(0.25)), each(40), ("all iterations",), (H,), 2.0, (overlap(1e-8),)),
    Row("a heap", corpus.heap, each(64), ("iterative",), (H,), 2.0, (never_above(), overlap(0.05))),
    Row("a thousand", corpus.block, each(Sphere(0.5), Box((1, 1, 1))), ("thirty iterations",), (H,), 45 * H,
        (never_above(), overlap(0.02)), SETTLED),
    # Lifting out of an overlap what swung in within a step won 2e-3 of the energy.
    Row("a tumbler", corpus.tumbler, each(*range(4)), BOTH, (H,), 1.5, (falls(), overlap(1e-3))),
    # The load is not carried at once, and what is missing was won back with more.
    Row("a stack of few iterations", corpus.stack, each(20), ("fifty iterations",), (H,), 1.0, (falls(1e-12),), SETTLED),
    Row("rubber", corpus.rubber, each(*range(8)), BOTH, (1 / 240,), 1.0, (flies(1.0),), status=("completed", "unsettled")),
    Row("a grained floor", corpus.grained, each(5), ("direct", "two hundred iterations"), (H,), 3.0, (falls(), overlap(1e-3))),
    Row("a spun box", corpus.spun, ALONE, BOTH, (H,), 2.0, (falls(1e-12), rests, pushes(1e-6)),
        watched={"points": Trace(quantity=ContactPoints(8), first=1)}),
    # Impulses of 1e9 N s that push and pull passed for an answer.
    Row("on a mesh's edges", corpus.tents, each(*range(24)), ("direct",), (H,), 6 * H, (falls(), pushes(1e-3)),
        watched={"points": Trace(quantity=ContactPoints(40), first=1)}),
    Row("a long cone", corpus.long_cone, ALONE, BOTH, (H,), 1.0, (never_above(), overlap(0.02))),
    Row("boxes that fall asleep", dropped_boxes, ALONE, ("asleep", "asleep, iterative"), (H,), 4.0, (falls(),)),
    # All of it in successive impacts; where several at once stop a ball, what they take stays away.
    Row("a gas", corpus.gas, tuple((seed, across) for seed in range(4) for across in range(3)), BOTH, (H, 1 / 240), 2.0,
        (flies(1.0),)),
    Row("a gas, impact by impact", corpus.gas, tuple((seed, across) for seed in range(4) for across in range(3)),
        ("successive", "successive, iterative"), (H, 1 / 240), 2.0, (flies(0.0, least=-1e-9),)),
    Row("heavy on light links", corpus.weak_chain,
        tuple((masses, depth) for masses in ((0.1, 0.1, 10.0, 10.0), (10.0, 0.1, 0.1, 10.0), (0.1, 0.1, 10.0)) for depth in (None, 0.3)),
        ("iterative",), (1e-3,), 0.6, (as_settled(0.1),)),
    # what swings and turns
    Row("rods", corpus.rods, each(2), ("order6", "order8"), (H,), 10.0, (keeps(1e-4), holds(1e-12))),
    Row("joints that hold less", corpus.freer, each(PointOnLine, Cylindrical, Planar), ("direct", "corrected"), (0.01,), 2.0,
        (keeps(1e-4), holds(1e-6))),
    Row("the same, composed", corpus.freer, each(PointOnLine, Cylindrical, Planar), ORDERS, (0.01,), 2.0,
        (keeps(1e-6), holds(1e-10))),
    Row("two four-bars", partial(four_bars.scene, 2, 0.02), ALONE, ("order4",), (0.02,), 40.0, (holds(1e-12),)),
    Row("a slider crank in its plane", plane_trees.slider_crank, ALONE, ("order8",), (0.02,), 40.0, (holds(1e-12),)),
    # At 1e-6 s a joint's default compliance gives way more easily than a body: parting must not use that.
    *(
        Row(f"overlapping at rest, {kind.__name__}", partial(corpus.overlapping, kind, speed=0.0), each(0, 1, 3, 4),
            ("direct",), (1e-6,), 40e-6, (holds(1e-8),)) for kind in (Distance, Ball, Hinge, Prismatic)
    ),
    # A joint's finite turn, answered by (4/h) Ups of its violation, made 1096 J of 12 J in three steps of 1e-6 s.
    *(
        Row(f"overlapping, {kind.__name__ if kind else 'free'}", partial(corpus.overlapping, kind), each(0, 1, 3, 4), BOTH,
            (h,), 12 * h, (momentum(1e-11), spin(1e-11), never_above()))
        for kind in (None, Distance, Ball, Hinge, Prismatic, Lock) for h in (1e-6, 1e-4, H)
    ),
    # .2 rad beyond a stop at h = 1e-6 s was answered with 9e4 rad/s.
    *(
        Row(f"beyond a stop{told}", corpus.beyond, tuple((kind, *ends, speed) for kind in (Hinge, Prismatic) for ends in BEYOND),
            BOTH, (h,), 40 * h, (momentum(1e-11), spin(1e-11), returns(1e-6), law))
        for told, speed, law in (("", 1.0, never_above(1e-9)), (", at rest", 0.0, still)) for h in (1e-6, 1e-4, H)
    ),
    # An impact is no sign that compliance explains an overlap: 1 J became 25 kJ.
    *(
        Row("a soft pair", corpus.soft_pair, tuple((c, depth) for c in (1e-8, 1e-6, 1e-4) for depth in (0.02, 0.3)), BOTH,
            (h,), 40 * h, (momentum(1e-11), never_above(1e-9)))
        for h in (1e-6, 1e-5, 1e-4, 1e-3, H)
    ),
)  # fmt: skip


@pytest.mark.parametrize(
    ("row", "method"),
    [
        pytest.param(row, method, id=f"{row.name}, {method}, {row.steps[0]:g} s")
        for row in TABLE
        for method in row.methods
    ],
)
def test_laws_hold(row: Row, method: str) -> None:
    for given in row.given:
        scene = row.scene(*given)
        watched = WATCHED | row.watched
        for joint in scene.constraints:
            watched |= {joint.name: MaximumAbsolute(quantity=Violation(joint.name))}
            if getattr(joint, "limit", None):
                watched |= {f"at {joint.name}": Trace(quantity=JointCoordinate(joint.name))}
        for h in row.steps:
            seen = simulate(scene, time_step=h, duration=row.seconds, method=METHODS[method], observe=watched)
            assert seen.status in row.status, (given, h, seen.failure)
            for law in row.laws:
                law(Run(scene, h, seen))
