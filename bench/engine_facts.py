"""Eight facts about kinds of engines, as questions put to every engine in every setting: FACTS, a catalogue.

    tracker run --engine mujoco --catalogue bench.engine_facts:FACTS

`bench/engines.py` puts them with all the others, and its page has a table of the answers. None is a gate: each shows what
comes of a choice that an engine's makers made.

    tracker run --engine newton --catalogue bench.engine_facts:ARM

asks one more, of those that have stops in joints: an arm of light links.

    tracker run --engine mjx --catalogue bench.engine_facts:TWINS

asks what makes itself MuJoCo again, in XLA or Warp, how far it is from MuJoCo where it says that it computes the same.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from functools import partial

import numpy as np

import spook_tracker.scalar_tests.thesis.pendulum.scene as pendulum
from spook_tracker.engine import (
    PLAIN,
    Ball,
    Energy,
    Final,
    Hinge,
    Limit,
    MaximumAbsolute,
    Particle,
    Position,
    Result,
    RigidBody,
    Scene,
    Trace,
)
from spook_tracker.engine.find import find
from spook_tracker.engine.protocol import NotSupported
from spook_tracker.scalar_tests.case import Example, Measurement, Metric, ScalarTest, Simulate
from spook_tracker.scalar_tests.ropes.chain import LENGTH, MASS, hanging_chain, level_chain
from spook_tracker.scalar_tests.stacks.resting_stack import EDGE
from spook_tracker.scalar_tests.stacks.resting_stack import scene as stack
from spook_tracker.scalar_tests.thesis.beam.scene import COUNT as BOXES
from spook_tracker.scalar_tests.thesis.beam.scene import scene as beam
from spook_tracker.scalar_tests.thesis.door.scene import forces, least_norm_forces
from spook_tracker.scalar_tests.thesis.inclined_plane.scene import scene as slope

TIME_STEP = 1.0 / 60.0  # s
LINKS, SWING = 26, 22.0  # s, as long as the thesis lets its chain swing
HINGES = 10
FALL_STEPS = 30  # half a second
STANDING, LANDED, STAND = 0.3, 1.0, 10.0  # slope, below the friction coefficient of 0.5; s
FLIGHT, FLIGHT_STEPS = 10.0, 1000  # m, in one second
ORDER_LASTS = 1.0  # s
RATIOS = tuple(10.0**k for k in range(7))
HUNG_LINKS, LEAN, CARRIED_LASTS, GIVES_WAY = 10, 0.01, 2.0, 0.01  # rad, s, of a link's or a box's length
ARM_LINKS, LINK, LINK_MASS, STOP, ARM_FALL = 6, 0.1, 0.1, 0.5, 2.0  # m, kg, rad either way, s
ROUNDED = 1e-3  # J, of the 1.8 J that it lacks when it hangs straight down
TWIN_STEP, TWIN_LASTS, EQUAL, SLIDING = 1.0 / 240.0, 1.0, 1e-9, 0.7  # s, s, m, slope
ARM_AXES = (
    (0.0, 0.0, 1.0),
    (0.0, 1.0, 0.0),
    (0.0, 1.0, 0.0),
    (1.0, 0.0, 0.0),
    (0.0, 1.0, 0.0),
    (1.0, 0.0, 0.0),
)


def energy_gain(simulate: Simulate, time_step: float) -> dict[str, float]:
    """Largest gain of energy of a chain that falls from the level, of what the fall to hanging sets free [%]."""
    built = level_chain(LINKS, time_step)
    seen = {"energy": Trace(quantity=Energy(), every=max(1, round(TIME_STEP / time_step)), from_start=True)}
    energy = simulate(built, time_step=time_step, duration=SWING, observe=seen)["energy"]
    fallen = sum(
        b.mass * float(np.linalg.norm(built.gravity)) * float(np.linalg.norm(b.position))
        for b in built.bodies
        if isinstance(b, Particle)
    )
    return {"energy_gain": 100.0 * float(np.max(energy)) / fallen}


def unevenness(simulate: Simulate) -> dict[str, float]:
    """How far the hinges' forces across are from those of least norm, of the largest of those."""
    held, right = (
        forces(simulate, steps=200, count=HINGES, damping=2.0 * TIME_STEP)[-1],
        least_norm_forces(HINGES),
    )
    return {"unevenness": float(np.abs(held[:, 0] - right[:, 0]).max() / np.abs(right[:, 0]).max())}


def sag(simulate: Simulate) -> dict[str, float]:
    """How far the lowest box is below its place after half a second [m]; in free fall it is 1.2 m."""
    seen = {"place": Final(quantity=Position(), from_start=True)}
    moved = simulate(beam(time_step=TIME_STEP), time_step=TIME_STEP, steps=FALL_STEPS, observe=seen)["place"]
    return {"sag": float(-moved[:BOXES, 2].min())}


def creep(simulate: Simulate) -> dict[str, float]:
    """How far a box slides in ten seconds on a slope that its friction holds [m], once it has had a second to come to
    rest: an engine whose contacts begin a step late lets it fall g sin(slope) h², .8 mm, before it holds it."""
    first, way = round(LANDED / TIME_STEP), round(STAND / TIME_STEP)
    seen = {"place": Trace(quantity=Position("box"), first=first, every=way)}
    begin, end = simulate(slope(STANDING), time_step=TIME_STEP, steps=first + way, observe=seen)["place"]
    return {"creep": float(np.hypot(end[0] - begin[0], end[1] - begin[1]))}


def lost_digits(simulate: Simulate) -> dict[str, float]:
    """Error of a uniform motion, of its way: no method has one, rounding alone decides."""
    built = Scene(bodies=(_flying(),), gravity=(0.0, 0.0, 0.0))
    seen = {"place": Final(quantity=Position("ball"))}
    end: Result = simulate(built, time_step=1.0 / FLIGHT_STEPS, steps=FLIGHT_STEPS, observe=seen)
    return {"lost_digits": abs(float(end["place"][0]) / FLIGHT - 1.0)}


def order(simulate: Simulate) -> dict[str, float]:
    """How fast a pendulum's error falls with its step, from 1/60 to 1/240 s: log₄ of the ratio of the errors [1].

    Where the coarser error is rounding already, this is no order; it is what came out.
    """
    errors = []
    for time_step in (TIME_STEP, TIME_STEP / 4.0):
        times, found = pendulum.traced_angle(simulate, time_step, ORDER_LASTS, PLAIN)
        errors.append(float(np.abs(found - pendulum.angle(times)).max()))
    return {"order": math.log(errors[0] / errors[1], 4.0)}


def hung(simulate: Simulate) -> dict[str, float]:
    """The greatest load, of a power of ten times a link's mass, that a chain of ten links carries (0: not even its own)."""
    seen = {"places": Trace(quantity=Position())}

    def carried(ratio: float) -> bool:
        built = hanging_chain(HUNG_LINKS, TIME_STEP, load=ratio * MASS, compliance=0.0, tilt=LEAN)
        result = simulate(built, time_step=TIME_STEP, duration=CARRIED_LASTS, observe=seen)
        if result.status not in ("completed", "unsettled"):
            return False
        places = np.insert(result["places"], 0, 0.0, axis=1)
        stretched = np.linalg.norm(np.diff(places, axis=1), axis=2) - LENGTH
        return bool(np.abs(stretched).max() <= GIVES_WAY * LENGTH)

    return {"hung": _greatest(carried)}


def stacked(simulate: Simulate) -> dict[str, float]:
    """The greatest mass, of a power of ten times that of a box, of a box that it carries (0: not even its equal)."""
    seen = {"moved": MaximumAbsolute(quantity=Position(), from_start=True)}

    def carried(ratio: float) -> bool:
        result = simulate(
            stack(2, (MASS, ratio * MASS)), time_step=TIME_STEP, duration=CARRIED_LASTS, observe=seen
        )
        return result.status in ("completed", "unsettled") and bool(result["moved"].max() <= GIVES_WAY * EDGE)

    return {"stacked": _greatest(carried)}


def _greatest(carried: Callable[[float], bool]) -> float:
    held = 0.0
    for ratio in RATIOS:
        if not carried(ratio):
            break
        held = ratio
    return held


def _flying() -> RigidBody:
    return RigidBody(
        name="ball", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.0), velocity=(FLIGHT, 0.0, 0.0)
    )


def arm() -> Scene:
    """An arm the size of those of hobbyists, stretched out level: slender links, a stop either way in each joint."""
    inertia = LINK_MASS * LINK**2 / 12.0
    links = tuple(
        RigidBody(
            name=f"{k}",
            mass=LINK_MASS,
            inertia=(0.02 * inertia, inertia, inertia),
            position=((k + 0.5) * LINK, 0.0, 0.0),
        )
        for k in range(ARM_LINKS)
    )
    joints = tuple(
        Hinge(
            name=f"joint {k}",
            between=(f"{k - 1}" if k else "world", f"{k}"),
            at=(k * LINK, 0.0, 0.0),
            axis=ARM_AXES[k],
            limit=Limit(lower=-STOP, upper=STOP),
        )
        for k in range(ARM_LINKS)
    )
    return Scene(bodies=links, constraints=joints, gravity=(0.0, 0.0, -9.81))


def arm_gain(simulate: Simulate, time_step: float) -> dict[str, float]:
    """Largest gain of energy of that arm, let go [J]: stops give none, so that it never rises; hanging it lacks 1.8 J."""
    seen = {"energy": Trace(quantity=Energy(), from_start=True)}
    energy = simulate(arm(), time_step=time_step, duration=ARM_FALL, observe=seen)["energy"]
    return {"energy_gain": float(np.max(energy))}


def apart(simulate: Simulate, built: Scene) -> dict[str, float]:
    """How far any body is after a second from where MuJoCo has it, in whichever of MuJoCo's settings is nearest [m]."""
    seen = {"place": Final(quantity=Position())}
    how = {"time_step": TWIN_STEP, "duration": TWIN_LASTS, "observe": seen}
    there, mujoco, theirs = simulate(built, **how)["place"], find("mujoco"), []
    for one in mujoco.configurations:
        with contextlib.suppress(NotSupported):
            theirs.append(mujoco.simulate(built, configuration=one.name, **how)["place"])
    return {"apart": min(float(np.abs(there - place).max()) for place in theirs)}


def whirling(joint: type[Hinge] | type[Ball] = Hinge, friction: float = 0.0, closed: bool = False) -> Scene:
    """Two bodies that spin, the second on the first and that on the world; `closed`: the far end held as well."""
    spin = 0.0 if closed else 3.0
    bodies = tuple(
        RigidBody(
            name=f"{k}",
            mass=1.0,
            inertia=(0.02, 0.05, 0.04),
            position=(k + 0.5, 0.0, 0.0),
            velocity=(0.0, spin * (k + 0.5), 0.0),
            angular_velocity=(0.0, 0.0, spin),
        )
        for k in range(2)
    )
    axes = ((0.0, 0.0, 1.0), (0.0, 0.6, 0.8))
    joints: list[Hinge | Ball] = [
        joint(
            name=f"joint {k}",
            between=(f"{k - 1}" if k else "world", f"{k}"),
            at=(float(k), 0.0, 0.0),
            **({"axis": axes[k], "friction": friction} if joint is Hinge else {}),
        )
        for k in range(2)
    ]
    if closed:
        joints.append(Ball(name="far end", between=("world", "1"), at=(1.6, 0.3, 0.0)))
    return Scene(bodies=bodies, constraints=tuple(joints), gravity=(1.0, 2.0, -9.81))


def _fact(
    title: str,
    name: str,
    unit: str,
    tells: str,
    measure: object,
    example: object,
    steps: tuple[float, ...] = (TIME_STEP,),
    limit: float | None = None,
    source: str = "stops give no energy; rounding remains",
) -> ScalarTest:
    metric = Metric(
        name=name,
        description=tells,
        unit=unit,
        role="reported" if limit is None else "gate",
        limit=limit,
        limit_source=source,
        limit_kind="physical",
    )
    return ScalarTest(
        title=title,
        question=f"{title}?",
        why="It shows what comes of a choice that the makers of an engine made.",
        model=tells,
        parameters=(("time step", ", ".join(f"1/{round(1.0 / h)} s" for h in steps)),),
        theory=(),
        reference="0",
        conclusion="Shown, not judged.",
        source="known of kinds of engines",
        measurements=tuple(
            Measurement(
                configuration="plain",
                time_step=h,
                metrics=(metric,),
                measure=partial(measure, time_step=h) if len(steps) > 1 else measure,  # type: ignore[arg-type]
                note="",
            )
            for h in steps
        ),
        example=example,  # type: ignore[arg-type]
    )


FACTS = {
    "fact_chain": _fact(
        f"Does a chain of {LINKS} links gain energy",
        "energy_gain",
        "%",
        f"largest gain of energy of a chain of {LINKS} links that falls from the level, {SWING:g} s",
        energy_gain,
        lambda: Example(scene=level_chain(LINKS, TIME_STEP), time_step=TIME_STEP),
        (TIME_STEP, 1.0 / 240.0),
    ),
    "fact_door": _fact(
        f"Do {HINGES} hinges share a door's weight evenly",
        "unevenness",
        "1",
        "how far forces across are from those of least norm, of the largest",
        unevenness,
        lambda: Example(scene=slope(STANDING), time_step=TIME_STEP),
    ),
    "fact_beam": _fact(
        f"Does a beam of {BOXES} boxes hold",
        "sag",
        "m",
        "how far the lowest box is below its place after half a second; in free fall 1.2 m",
        sag,
        lambda: Example(scene=beam(time_step=TIME_STEP), time_step=TIME_STEP),
    ),
    "fact_creep": _fact(
        "Does a box creep where friction holds it",
        "creep",
        "m",
        "how far a box slides in 10 s, from the second on, at a slope of 0.3 with a friction coefficient of 0.5",
        creep,
        lambda: Example(scene=slope(STANDING), time_step=TIME_STEP),
    ),
    "fact_digits": _fact(
        "How many digits does an engine reckon with",
        "lost_digits",
        "1",
        "error of a uniform motion after 1000 steps, of its way: rounding alone",
        lost_digits,
        lambda: Example(scene=Scene(bodies=(_flying(),)), time_step=1.0 / FLIGHT_STEPS),
        (1.0 / FLIGHT_STEPS,),
    ),
    "fact_order": _fact(
        "Of what order is a swing",
        "order",
        "1",
        "log₄ of the largest error of a pendulum's angle within a second at 1/60 s over that at 1/240 s",
        order,
        lambda: Example(scene=pendulum.scene(TIME_STEP), time_step=TIME_STEP),
    ),
    "fact_hung": _fact(
        f"How heavy a load does a chain of {HUNG_LINKS} links carry",
        "hung",
        "1",
        f"greatest power of ten (up to 10⁶) of a load over a link's mass with no link off by 1 % for {CARRIED_LASTS:g} s",
        hung,
        lambda: Example(scene=hanging_chain(HUNG_LINKS, TIME_STEP), time_step=TIME_STEP),
    ),
    "fact_stacked": _fact(
        "How heavy a box does a box carry",
        "stacked",
        "1",
        f"greatest power of ten (up to 10⁶) of masses with neither moved by 1 % of its edge for {CARRIED_LASTS:g} s",
        stacked,
        lambda: Example(scene=stack(2), time_step=TIME_STEP),
    ),
}

ARM = {
    "fact_arm": _fact(
        f"Do stops hold an arm of {ARM_LINKS} light links",
        "energy_gain",
        "J",
        f"largest gain of energy of an arm of {ARM_LINKS} links of {LINK_MASS:g} kg with stops, let go level, {ARM_FALL:g} s",
        arm_gain,
        lambda: Example(scene=arm(), time_step=TIME_STEP),
        (TIME_STEP, 1.0 / 240.0),
        limit=ROUNDED,
    ),
}

TWINS = {
    f"fact_twin_{name}": _fact(
        f"Does {what} move as in MuJoCo",
        "apart",
        "m",
        f"how far any body of {what} is after {TWIN_LASTS:g} s from where MuJoCo has it, in the nearest of its settings",
        partial(apart, built=built),
        lambda built=built: Example(scene=built, time_step=TWIN_STEP),  # type: ignore[misc]
        (TWIN_STEP,),
        limit=EQUAL,
        source="the same equations in double precision, summed in another order",
    )
    for name, what, built in (
        ("hinges", "a chain of two hinges askew", whirling()),
        ("balls", "a chain of two ball joints", whirling(Ball)),
        ("friction", "a chain of two hinges with dry friction", whirling(friction=0.5)),
        ("loop", "a chain of two ball joints whose far end is held", whirling(Ball, closed=True)),
        ("contacts", "a box that slides down a slope", slope(SLIDING)),
    )
}
