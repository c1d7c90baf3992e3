"""Do a chain of capsules and a ragdoll that fall on the floor obey the balances of momentum and energy?"""

from __future__ import annotations

import functools
import itertools
import math
from dataclasses import replace

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable

from .. import case, overlap
from ..bracket import break_count, break_point
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import line, told
from .rope import ragdoll

GRAVITY = 9.81  # m/s²
LINKS, LENGTH, RADIUS, MASS = 5, 0.12, 0.02, 0.1  # m, m, kg of a link
FEW = 3  # links of the ladder: rough ground that holds a straight chain twice over takes long to solve
DROP, PUSH = 0.3, (0.5, 0.3, 0.0)  # m, m/s
FLOOR, DOLL_PUSH = -1.2, (1.0, 0.7, -1.0)  # m, m/s: of the ragdoll
FRICTION = 0.5
TIME_STEP = 1.0 / 60.0  # s
DURATION = 0.75  # s
ROUGH = engine.Material(friction=FRICTION)
COUNTS = (5, 20, 80, 320)  # links that are let fall flat
LOW, ALONG, LANDED = 0.05, 3.0, 0.5  # m, m/s, s: from where, how fast ahead, and when it slides on the floor
DRAWN, NUDGE, SLIDES = 10.0, 1e-7, 40  # m/s, m and steps of a chain that is drawn
SEARCHED = 4e-3  # the search's resolution
# s: a nudge grows a hundredfold in so many steps, 0.1 % after the links' swing sideways has h ω = 2; by the step of the test
LONGEST = 0.0607347


def floor(height: float) -> engine.RigidBody:
    """Rough and level."""
    return engine.RigidBody(
        name="floor", motion="static", shape=engine.Plane(), position=(0.0, 0.0, height), material=ROUGH
    )


@functools.cache
def chain(count: int = LINKS) -> engine.Scene:
    """Capsules on ball joints in a zigzag over the floor, pushed sideways."""
    links, joints, x, z = [], [], 0.0, DROP
    for k in range(count):
        lean = 0.5 * math.sin(1.3 * k) + 0.2
        along, up = LENGTH * math.cos(lean), LENGTH * math.sin(lean)
        turn = 0.5 * (0.5 * math.pi - lean)
        links.append(
            engine.RigidBody(
                name=f"link {k}",
                mass=MASS,
                shape=engine.Capsule(RADIUS, LENGTH - 2.0 * RADIUS),
                position=(x + 0.5 * along, 0.0, z + 0.5 * up),
                orientation=(math.cos(turn), 0.0, math.sin(turn), 0.0),
                velocity=PUSH,
                material=ROUGH,
            )
        )
        if k > 0:
            ends = (f"link {k - 1}", f"link {k}")
            joints.append(engine.Ball(name=f"joint {k}", between=ends, at=(x, 0.0, z), compliance=0.0))
        x, z = x + along, z + up
    return engine.Scene(
        bodies=(floor(0.0), *links),
        constraints=tuple(joints),
        gravity=(0.0, 0.0, -GRAVITY),
        no_contact=tuple((f"link {k}", f"link {k + 1}") for k in range(count - 1)),
    )


def flat(
    turns: tuple[float, ...], height: float, speed: float
) -> tuple[list[engine.RigidBody], list[engine.Ball]]:
    """Links in a row along −x behind the origin, each turned about the vertical [rad]; the first joint has nothing before it."""
    links, joints, x, y = [], [], 0.0, 0.0
    for k, turn in enumerate(turns):
        along, aside = LENGTH * math.cos(turn), LENGTH * math.sin(turn)
        c, s = math.sqrt(0.5) * math.cos(0.5 * turn), math.sqrt(0.5) * math.sin(0.5 * turn)
        links.append(
            engine.RigidBody(
                name=f"link {k}",
                mass=MASS,
                shape=engine.Capsule(RADIUS, LENGTH - 2.0 * RADIUS),
                position=(x - 0.5 * along, y - 0.5 * aside, height + RADIUS),
                orientation=(c, -s, c, s),
                velocity=(speed, 0.0, 0.0),
                material=ROUGH,
            )
        )
        ends = (f"link {k - 1}" if k else "head", f"link {k}")
        joints.append(
            engine.Ball(name=f"joint {k}", between=ends, at=(x, y, height + RADIUS), compliance=0.0)
        )
        x, y = x - along, y - aside
    return links, joints


@functools.cache
def row(count: int) -> engine.Scene:
    """A straight chain a little above the floor, going ahead along itself."""
    links, joints = flat((0.0,) * count, LOW, ALONG)
    return engine.Scene(
        bodies=(floor(0.0), *links),
        constraints=tuple(joints[1:]),
        gravity=(0.0, 0.0, -GRAVITY),
        no_contact=tuple((f"link {k}", f"link {k + 1}") for k in range(count - 1)),
    )


@functools.cache
def drawn() -> engine.Scene:
    """A chain on the floor behind a head that draws it on steadily; its joints lie to the left and right of the line."""
    aside = [0.0] + [NUDGE * (-1.0) ** k for k in range(LINKS)]
    turns = tuple(math.asin((one - other) / LENGTH) for one, other in itertools.pairwise(aside))
    links, joints = flat(turns, 0.0, DRAWN)
    head = engine.RigidBody(
        name="head", motion="kinematic", position=(0.0, 0.0, RADIUS), velocity=(DRAWN, 0.0, 0.0)
    )
    names = [head.name] + [link.name for link in links]
    return engine.Scene(
        bodies=(floor(0.0), head, *links),
        constraints=tuple(joints),
        gravity=(0.0, 0.0, -GRAVITY),
        no_contact=tuple(itertools.pairwise(names)),
    )


@functools.cache
def doll() -> engine.Scene:
    """The ragdoll of the rope's question, tumbling onto the floor; its parts do not touch each other."""
    thrown = ragdoll()
    still = [body for body in thrown.bodies if isinstance(body, engine.RigidBody)]
    mean = np.mean([body.velocity for body in still], axis=0)
    parts = []
    for body in still:
        x, y, z = (float(v) for v in np.array(body.velocity) - mean + np.array(DOLL_PUSH))
        parts.append(replace(body, material=ROUGH, velocity=(x, y, z)))
    names = [body.name for body in parts]
    return replace(
        thrown,
        bodies=(floor(FLOOR), *parts),
        contacts=True,
        no_contact=tuple(itertools.combinations(names, 2)),
    )


def measure(
    simulate: case.Simulate, scene: engine.Scene, time_step: float, method: engine.Method = engine.PLAIN
) -> dict[str, float]:
    """Momentum against all that acts, and the energy of every step."""
    moving = [
        body for body in scene.bodies if isinstance(body, engine.RigidBody) and body.motion == "dynamic"
    ]
    observe: dict[str, Observable] = {
        "p": engine.Trace(quantity=engine.Momentum()),
        "E": engine.Trace(quantity=engine.Energy()),
        "deep": engine.MaximumAbsolute(quantity=engine.Penetration()),
    }
    observe |= {body.name: engine.Trace(quantity=engine.ContactForce(body.name, "floor")) for body in moving}
    result = simulate(scene, time_step=time_step, duration=DURATION, method=method, observe=observe)
    weight = np.array(scene.gravity) * math.fsum(body.mass or 0.0 for body in moving)
    pushed = sum(result[body.name][1:] for body in moving)
    off = np.diff(result["p"], axis=0) - time_step * (pushed + weight)
    gain = np.diff(result["E"])
    return {
        "momentum_error": float(np.abs(off).max() / np.abs(result["p"]).max()),
        "gain": max(0.0, float(gain.max())),
        "pushed": float(np.abs(pushed[:, 2]).max()) / float(np.abs(weight[2])),
        "sunk": float(result["deep"]),
    }


def longest(simulate: case.Simulate) -> case.BreakPoint:
    """The longest step in which a chain is drawn over the floor straight."""
    observe = {"x": engine.MaximumAbsolute(quantity=engine.Position())}

    def straight(time_step: float) -> bool:
        result = simulate(drawn(), time_step=time_step, steps=SLIDES, observe=observe)
        return result.completed and float(result["x"][2:, 1].max()) < 100.0 * NUDGE

    return break_point(straight, 0.7 * LONGEST, 1.4 * LONGEST, resolution=SEARCHED, walk=2)


def most_links(simulate: case.Simulate) -> case.BreakPoint:
    """The largest number of links that land and slide as one."""
    observe: dict[str, Observable] = {
        "v": engine.Final(quantity=engine.Velocity()),
        "E": engine.Trace(quantity=engine.Energy()),
    }

    def together(count: int) -> bool:
        result = simulate(row(count), time_step=TIME_STEP, duration=LANDED, observe=observe)
        if not result.completed:
            return False
        off = np.abs(result["v"][1:] - (ALONG - FRICTION * GRAVITY * LANDED, 0.0, 0.0))
        return float(off.max()) < 1e-9 and float(np.diff(result["E"]).max()) < 1e-9

    return break_count(together, COUNTS)


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Momentum that came from nowhere, of a chain of three, over the largest."""
    return measure(simulate, chain(FEW), time_step, method)["momentum_error"]


def draw(simulate: case.Simulate) -> case.Drawing:
    """Energy of both, over that at the start."""
    curves, gains = [], []
    for name, scene in (("chain", chain()), ("ragdoll", doll())):
        observe = {"E": engine.Trace(quantity=engine.Energy())}
        result = simulate(scene, time_step=TIME_STEP, duration=DURATION, observe=observe)
        lost = (result["E"] - result["E"][0]) / abs(float(result["E"][0]))
        gains.append(float(np.diff(result["E"]).max()))
        curves.append(line(name, result.sample_times["E"], lost))
    return case.Drawing(
        curves=tuple(curves),
        x_label="time [s]",
        y_label="energy less that of the start, over it",
        note=f"No step gains energy: the largest change upwards is {told(max(gains))} J.",
    )


def swung(height: float, length: float) -> float:
    """How deep an end of a part of that length may come in within a step [m]: it turns by φ = h v/length at the speed v of a
    fall from there, and its end leaves the tangent by (length/2) φ²/2."""
    return 2.0 * GRAVITY * height * TIME_STEP**2 / (4.0 * length)


def _asked(configuration: str, scene: engine.Scene, note: str, deep: float) -> case.Measurement:
    return ask(
        functools.partial(measure, scene=scene, time_step=TIME_STEP),
        (
            error(
                "momentum_error",
                "largest momentum of a step that neither the weight nor the floor gave, over the largest momentum",
                "1",
                1e-12,
                "Newton: joints pass momentum on; rounding of a few hundred sums",
            ),
            error(
                "gain",
                "largest gain of energy in a step",
                "J",
                1e-9,
                "nothing drives it: plastic contact and friction take, joints hold; and an explicit weight takes ½ m (g h)² a step",
            ),
            error(
                "sunk",
                "deepest penetration",
                "m",
                deep,
                "a gap may close within a step, no more; an end that turns leaves its tangent by (length/2)(h v/length)²/2",
                "companion",
            ),
        ),
        note,
        TIME_STEP,
        configuration,
    )


TEST = case.ScalarTest(
    title="Falling chain",
    question="Do a chain of capsules and a ragdoll that fall on the floor obey the balances of momentum and energy?",
    why="Chains and ragdolls are where contacts and joints act on the same bodies at once: a blow runs through all of them. "
    "Momentum from nowhere or energy gained in a step is what makes them jitter and explode.",
    model="Five capsules on ball joints fall in a zigzag onto a rough floor, pushed sideways. A ragdoll of eleven parts tumbles "
    "onto it. No rebound.",
    parameters=(
        ("time step", "1/60 s"),
        ("chain", "5 capsules of 0.12 m, radius 0.02 m, 0.1 kg, from 0.3 m"),
        ("ragdoll", "71 kg, from 1.2 m"),
        ("friction coefficient", "0.5"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "Δp = h (Σ F_floor + Σ m g): the joints' forces cancel.",
        "E₊ − E = z·G v₊ − ½ |v₊ − v|²_M in a step: contacts and friction make the first part no larger than zero.",
        "A pull T along the links makes them swing across it, and no step carries h ω > 2, about T h²/(m l) = 1/3. Friction alone "
        "pulls so at five links that are drawn over the floor in steps of 1/16 s; as they fall, blows pull at them, too.",
        "A straight chain that falls flat lands as one: every link has its own floor, and slides with v − µ g t.",
    ),
    reference="Newton's law, and that nothing drives it.",
    conclusion="Green: contacts and joints are solved together. Red: momentum leaks, or a step gains energy.",
    source="ours; chains and capsules are asked for in the thesis, section 1.2",
    measurements=(
        _asked("plain", chain(), "a chain of five capsules", swung(DROP + LINKS * LENGTH, LENGTH)),
        _asked("ragdoll", doll(), "a ragdoll of eleven parts", swung(-FLOOR, 0.4)),
    ),
    example=lambda: case.Example(scene=doll(), time_step=TIME_STEP, duration=DURATION),
    figures=(case.Figure(name="energy", title="Energy over time", draw=draw),),
    stability=(
        case.StabilityStudy(
            name="longest-step",
            title="Longest time step in which a chain of five is drawn over the floor straight",
            configuration="plain",
            definition="drawn at 10 m/s, its joints 1e-7 m to the left and right of the line, no link is a hundred times as far "
            "from it within 40 steps",
            study=longest,
            unit="s",
            expected=((1.0 - 1.1 * SEARCHED) * LONGEST, 1.0002 * LONGEST),
            expected_source="h ω = 2 of the fastest swing sideways under the friction of all that is behind, run step by step in its "
            "linear form; friction across, µ m g/v a speed, takes little of it. The search ends 0.4 % short of it at most",
        ),
        case.StabilityStudy(
            name="most-links",
            title="Largest number of links that land flat and slide as one",
            configuration="plain",
            definition="0.5 s after a fall from 5 cm with 3 m/s ahead every link is as fast as v − µ g t to 1e-9 m/s, and no step "
            "gained 1e-9 J",
            study=most_links,
            unit="1",
            expected=(float(COUNTS[-1]), float(COUNTS[-1])),
            expected_source="the floor's blow takes µ times as much of the way ahead as it gives upwards, of each link alike: v − µ g t, "
            "however many and whenever they land, and joints carry nothing. The search ends there",
        ),
    ),
    ladders=(
        case.Ladder(
            name="momentum",
            description="momentum of a chain of three that came from nowhere: none is right",
            unit="1",
            time_steps=tuple(1.0 / n for n in (30, 45, 60)),
            configurations=configured({"direct": None, "iterative": None}),  # rounding
            error=ladder_error,
            target_error=1e-9,
            target_seconds=0.1,
        ),
        overlap.ladder(doll, DURATION, "ragdoll overlap", "the ragdoll and the floor"),
        overlap.ladder(chain, DURATION, "chain overlap", "the chain and the floor"),
    ),
)
