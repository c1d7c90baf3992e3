"""Does a cable of rigid links hang in its catenary, pull as statics says, and carry waves at √(T/ρ)?"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from spook_tracker.engine import (
    PLAIN,
    WORLD,
    Ball,
    Capsule,
    ConstraintForce,
    Final,
    Load,
    MaximumAbsolute,
    Method,
    Position,
    Prismatic,
    Result,
    RigidBody,
    Scene,
    Trace,
)
from spook_tracker.scalar_tests.bracket import break_count, break_point
from spook_tracker.scalar_tests.case import (
    BreakPoint,
    Configuration,
    Drawing,
    Example,
    Figure,
    Ladder,
    Measurement,
    ScalarTest,
    Simulate,
    StabilityStudy,
)
from spook_tracker.scalar_tests.closed_form import ask, error
from spook_tracker.scalar_tests.sweep import line, told

GRAVITY = 9.81  # m/s²
SPAN, LENGTH, MASS = 8.0, 10.0, 5.0  # m, m, kg, of the whole cable
TIME_STEP = 1.0 / 60.0  # s
DURATION = 1.0  # s
# Links, and a step that carries them: a pull along a link acts across it where the step starts, an explicit spring whose
# fastest swing must turn by less than half a turn a step, h ω < 2.
ASKED = ((10, TIME_STEP), (25, TIME_STEP), (50, TIME_STEP / 4.0))
PULL, PIECES = 50.0, 20  # N, links of the taut rope, the same rope as the cable
SWAY = 1e-4  # m, of its modes
MODES = (1, 2, 3)


def angles(count: int, pull: float) -> list[float]:
    """Of each link from the horizontal [rad], hung with the horizontal force `pull` [N]: moments about its middle."""
    weight = MASS * GRAVITY / count
    return [math.atan((k + 0.5 - 0.5 * count) * weight / pull) for k in range(count)]


@functools.cache
def horizontal(count: int) -> float:
    """The horizontal force [N] with which the links reach over the span; by halving."""
    low, high = 1e-3, 1e4
    for _ in range(200):
        pull = 0.5 * (low + high)
        reach = LENGTH / count * math.fsum(math.cos(angle) for angle in angles(count, pull))
        low, high = (pull, high) if reach < SPAN else (low, pull)
    return 0.5 * (low + high)


def catenary() -> float:
    """The horizontal force [N] of a cable without links: 2 a sinh(span/(2 a)) = length, H = a w."""
    low, high = 0.5, 1e3
    for _ in range(200):
        a = 0.5 * (low + high)
        low, high = (a, high) if 2.0 * a * math.sinh(0.5 * SPAN / a) > LENGTH else (low, a)
    return low * MASS * GRAVITY / LENGTH


def nodes(count: int) -> list[tuple[float, float]]:
    """Joints from the left end to the right [m]."""
    x, z, found = -0.5 * SPAN, 0.0, [(-0.5 * SPAN, 0.0)]
    for angle in angles(count, horizontal(count)):
        x, z = x + LENGTH / count * math.cos(angle), z + LENGTH / count * math.sin(angle)
        found.append((x, z))
    return found


@functools.cache
def scene(count: int) -> Scene:
    """Thin rods on ball joints, at rest where statics puts them."""
    length, places = LENGTH / count, nodes(count)
    rods, joints = [], []
    for k, angle in enumerate(angles(count, horizontal(count))):
        (x, z), (u, w) = places[k], places[k + 1]
        turn = 0.5 * (0.5 * math.pi - angle)  # the rod lies along its z axis
        rods.append(
            RigidBody(
                name=f"link {k}",
                mass=MASS / count,
                shape=Capsule(0.02, length - 0.04),
                inertia=(MASS / count * length**2 / 12.0, MASS / count * length**2 / 12.0, 1e-5),
                position=(0.5 * (x + u), 0.0, 0.5 * (z + w)),
                orientation=(math.cos(turn), 0.0, math.sin(turn), 0.0),
            )
        )
    names = [WORLD, *(rod.name for rod in rods), WORLD]
    for k, (x, z) in enumerate(places):
        between = (names[k], names[k + 1]) if k < count else (WORLD, names[k])
        joints.append(Ball(name=f"joint {k}", between=between, at=(x, 0.0, z), compliance=0.0))
    return Scene(bodies=tuple(rods), constraints=tuple(joints), gravity=(0.0, 0.0, -GRAVITY), contacts=False)


def smoothing(count: int) -> float:
    """By how much links pull less than a smooth cable, over its pull: the midpoint rule reaches further with
    cos φ = 1/√(1 + (s/a)²), by l²/24 of its change of slope from end to end, and H gives way by what that takes."""
    a, half = catenary() * LENGTH / (MASS * GRAVITY), 0.5 * LENGTH
    bent = 1.0 + (half / a) ** 2
    further = (LENGTH / count) ** 2 / 12.0 * half / a**2 * bent**-1.5
    # span = 2 a asinh(L/2a): d span/d ln a
    return float(further / (2.0 * a * (math.asinh(half / a) - half / a / math.sqrt(bent))))


@functools.cache
def taut(mode: int, count: int = PIECES, pull: float = PULL, sway: float = SWAY) -> Scene:
    """Links of the same rope in a row, bent into a mode and at rest, drawn by `pull` at a slide of a link's mass."""
    length, mass = LENGTH / count, MASS / count
    bent = [sway * math.sin(mode * math.pi * k / count) for k in range(count + 1)]
    rods, joints, x = [], [], 0.0
    for k in range(count):
        along = math.sqrt(length**2 - (bent[k + 1] - bent[k]) ** 2)
        turn = 0.5 * (0.5 * math.pi - math.atan2(bent[k + 1] - bent[k], along))
        rods.append(
            RigidBody(
                name=f"link {k}",
                mass=mass,
                shape=Capsule(0.02, length - 0.04),
                inertia=(mass * length**2 / 12.0, mass * length**2 / 12.0, 1e-5),
                position=(x + 0.5 * along, 0.0, 0.5 * (bent[k] + bent[k + 1])),
                orientation=(math.cos(turn), 0.0, math.sin(turn), 0.0),
            )
        )
        before = WORLD if k == 0 else f"link {k - 1}"
        joints.append(
            Ball(name=f"joint {k}", between=(before, f"link {k}"), at=(x, 0.0, bent[k]), compliance=0.0)
        )
        x += along
    end = RigidBody(name="slide", mass=mass, inertia=(mass,) * 3, position=(x, 0.0, bent[count]))
    last = Ball(name="end", between=(f"link {count - 1}", "slide"), at=(x, 0.0, bent[count]), compliance=0.0)
    guide = Prismatic(name="guide", between=(WORLD, "slide"), axis=(1.0, 0.0, 0.0), compliance=0.0)
    return Scene(
        bodies=(*rods, end),
        constraints=(*joints, last, guide),
        forces=(Load(name="pull", body="slide", force=(pull, 0.0, 0.0)),),
        contacts=False,
    )


def rate(mode: int, count: int = PIECES, pull: float = PULL) -> float:
    """ω of a mode of taut links [rad/s]: T/l (2 − 2 cos θ) against m/3 (2 + cos θ), θ = π mode/links."""
    turn = math.cos(math.pi * mode / count)
    return math.sqrt(6.0 * pull * count**2 / (MASS * LENGTH) * (1.0 - turn) / (2.0 + turn))


def discrete(frequency: float, time_step: float) -> float:
    """What the step makes of it [rad/s]: cos φ = 1 − (h ω)²/2."""
    return math.acos(1.0 - 0.5 * (time_step * frequency) ** 2) / time_step


def swing(simulate: Simulate, mode: int, time_step: float, method: Method = PLAIN) -> float:
    """Frequency of a mode [rad/s] over a second: x₊ + x₋ = 2 x cos φ, by least squares."""
    observe = {"x": Trace(quantity=Position())}
    result = simulate(taut(mode), time_step=time_step, duration=DURATION, method=method, observe=observe)
    shape = np.sin(mode * math.pi * (np.arange(PIECES) + 0.5) / PIECES)
    x: Any = result["x"][:, :PIECES, 2] @ shape
    inner = x[1:-1]
    return math.acos(0.5 * float(inner @ (x[2:] + x[:-2])) / float(inner @ inner)) / time_step


def wave(simulate: Simulate) -> dict[str, float]:
    """The first modes of the taut rope."""
    found = {mode: swing(simulate, mode, TIME_STEP) for mode in MODES}
    return {
        "mode_error": max(abs(one / discrete(rate(mode), TIME_STEP) - 1.0) for mode, one in found.items()),
        "speed_error": found[1] * LENGTH / math.pi / math.sqrt(PULL * LENGTH / MASS) - 1.0,
    }


def pulsing() -> float:
    """Relative change of the pull by the sway of the highest mode asked for: the end comes in by A²κ²L/4 (1 + cos 2ωt),
    which pulls at the rope's mass and at the slide's."""
    slope = MODES[-1] * math.pi * SWAY / LENGTH
    return (1.0 + 1.0 / PIECES) * 0.5 * (slope * MODES[-1] * math.pi) ** 2


def wave_error(simulate: Simulate, time_step: float, method: Method) -> float:
    """Relative error of the third mode's frequency."""
    return swing(simulate, 3, time_step, method) / rate(3) - 1.0


def wave_run(simulate: Simulate, time_step: float, method: Method) -> Result:
    """The same second with nothing observed."""
    return simulate(taut(3), time_step=time_step, duration=DURATION, method=method)


def tightest() -> float:
    """The pull [N] at which the fastest swing of ten links turns by half a turn a step: h ω = 2."""
    return (2.0 / (TIME_STEP * rate(9, 10, 1.0))) ** 2


def stays(result: Result, allowed: float) -> bool:
    """Whether nothing has moved by more than `allowed` [m]."""
    return result.completed and float(result["x"].max()) < allowed


def strongest(simulate: Simulate) -> BreakPoint:
    """The largest pull under which ten links stay straight."""
    observe = {"x": MaximumAbsolute(quantity=Position(), from_start=True)}

    def straight(pull: float) -> bool:
        asked = taut(9, 10, pull, 1e-7)
        return stays(simulate(asked, time_step=TIME_STEP, steps=200, observe=observe), 1e-4)

    return break_point(straight, 0.4 * tightest(), 2.0 * tightest(), resolution=0.005)


def finest(simulate: Simulate) -> BreakPoint:
    """The largest number of links whose cable hangs still at 1/60 s."""
    observe = {"x": MaximumAbsolute(quantity=Position(), from_start=True)}

    def still(count: int) -> bool:
        return stays(simulate(scene(count), time_step=TIME_STEP, steps=300, observe=observe), 1e-6)

    return break_count(still, (10, 20, 40, 80))


def measure(simulate: Simulate, count: int, time_step: float) -> dict[str, float]:
    """A second at rest."""
    middle = f"link {count // 2}"
    observe = {
        "x": MaximumAbsolute(quantity=Position(middle), from_start=True),
        "force": Final(quantity=ConstraintForce("joint 0")),
    }
    result = simulate(scene(count), time_step=time_step, duration=DURATION, observe=observe)
    pull, weight = horizontal(count), MASS * GRAVITY
    # On the first link at the left end: to the left, and half of the weight up.
    return {
        "pull_error": -float(result["force"][0]) / pull - 1.0,
        "catenary_error": -float(result["force"][0]) / catenary() - 1.0,
        "carried_error": float(result["force"][2]) / (0.5 * weight) - 1.0,
        "moved": float(max(result["x"])),
    }


def pull_error(simulate: Simulate, time_step: float, method: Method) -> float:
    """Relative error of the horizontal force of the cable of ten links after a second."""
    observe = {"force": Final(quantity=ConstraintForce("joint 0"))}
    result = simulate(scene(10), time_step=time_step, duration=DURATION, method=method, observe=observe)
    return -float(result["force"][0]) / horizontal(10) - 1.0


def run(simulate: Simulate, time_step: float, method: Method) -> Result:
    """The same second with nothing observed."""
    return simulate(scene(10), time_step=time_step, duration=DURATION, method=method)


def draw(simulate: Simulate) -> Drawing:
    """Where the links lie after a second, and the catenary."""
    count = 10
    observe = {str(k): Final(quantity=Position(f"link {k}")) for k in range(count)}
    result = simulate(scene(count), time_step=TIME_STEP, duration=DURATION, observe=observe)
    places = [result[str(k)] for k in range(count)]
    a = catenary() * LENGTH / (MASS * GRAVITY)
    x = [SPAN * (k / 60.0 - 0.5) for k in range(61)]
    top = math.cosh(0.5 * SPAN / a)
    off = max(abs(float(p[2]) - a * (math.cosh(float(p[0]) / a) - top)) for p in places)
    return Drawing(
        curves=(
            line("middles of the links", (p[0] for p in places), (p[2] for p in places), "points"),
            line("catenary", x, (a * (math.cosh(u / a) - top) for u in x), "reference"),
        ),
        x_label="x [m]",
        y_label="z [m]",
        note=f"At most {told(off)} m below or above the catenary: ten links are no smooth cable.",
    )


def _asked(count: int, time_step: float) -> Measurement:
    asked = ask(
        functools.partial(measure, count=count, time_step=time_step),
        (
            error("pull_error", "relative error of the horizontal force at an end", "1", 1e-9),
            error(
                "catenary_error",
                "horizontal force at an end over a smooth cable's, minus one",
                "1",
                1.02 * smoothing(count),
                f"links reach further by the midpoint rule's l²/24 of the change of slope: {told(smoothing(count))} "
                "less pull, and a little of the fourth order",
            ),
            error(
                "carried_error", "relative error of the vertical force at an end", "1", 1e-9, role="companion"
            ),
            error("moved", "how far the middle of the cable moves in a second", "m", 1e-9, role="companion"),
        ),
        f"{count} links",
        time_step,
    )
    return Measurement(
        configuration=asked.configuration,
        time_step=time_step,
        parameters={"N": float(count)},
        metrics=asked.metrics,
        measure=asked.measure,
        note=asked.note,
    )


FASTER = ((math.pi / PIECES) ** 2 + (TIME_STEP * rate(1)) ** 2) / 24.0

TEST = ScalarTest(
    title="Hanging cable",
    question="Does a cable of rigid links hang in its catenary, pull as statics says, and carry waves at √(T/ρ)?",
    why="A cable's pull comes from its shape alone: joints that give way, or forces that leak along the chain, change it. "
    "Drawn tight it carries waves, whose speed is its pull over its mass.",
    model="Thin uniform rods on ball joints hang between two points of the same height, at rest where statics puts them. "
    "The same rope, drawn tight without gravity, is bent by 0.1 mm into one of its first three modes and let go.",
    parameters=(
        ("span", "8 m"),
        ("cable", "10 m, 5 kg, in 10, 25 and 50 links"),
        ("gravity", "9.81 m/s²"),
        ("taut rope", "20 links, drawn by 50 N: waves of 10 m/s"),
        (
            "time step",
            "1/60 s; 1/240 s with 50 links, for more than 49 swing by over half a turn in 1/60 s: h ω > 2",
        ),
    ),
    theory=(
        "Moments about the middle of link k: tan φ_k = V_k/H, V_k the weight between it and the lowest point.",
        "H follows from the span: Σ l cos φ_k = 8 m. The ends carry half of the weight each.",
        "With ever shorter links it becomes the catenary of length L and span s, as 1/N²: L = 2 a sinh(s/2a), H = a w.",
        "Taut links in the mode θ = π k/N swing with ω² = 6 T/(m l) (1 − cos θ)/(2 + cos θ), which is √(T/ρ) k π/L and "
        "θ²/24 more; the step makes cos φ = 1 − (h ω)²/2 of it.",
        "No step carries h ω > 2: for the shortest waves, ω² = 12 T/(m l), that is T h²/(m l) = 1/3.",
    ),
    reference="Statics of the links (closed form but for H, found by halving); dispersion relation of links and step.",
    conclusion="Green: joints carry the cable's weight and pull, and waves run as fast as they must. Red: they give way or "
    "forces are wrong.",
    source="ours; the catenary is J. Bernoulli's problem of 1690",
    measurements=(
        *(_asked(*asked) for asked in ASKED),
        ask(
            wave,
            (
                error(
                    "mode_error",
                    "largest relative error of a frequency against the discrete dispersion relation, modes 1 to 3",
                    "1",
                    pulsing(),
                    "the sway shortens the rope and so pulls at its mass: (π k)² (π k A/L)²/2 of the pull",
                ),
                error(
                    "speed_error",
                    "speed of the first mode's wave over √(T/ρ), minus one",
                    "1",
                    1.01 * FASTER,
                    f"(π/N)²/24 of the links and (h ω)²/24 of the step, {told(FASTER)} together",
                    "companion",
                ),
            ),
            "waves of a taut rope",
            TIME_STEP,
            "taut",
        ),
    ),
    example=lambda: Example(scene=scene(10), time_step=TIME_STEP, duration=2.0),
    figures=(Figure(name="shape", title="A hanging cable", draw=draw),),
    ladders=(
        Ladder(
            name="pull",
            description="relative error of the horizontal force at an end after a second, ten links",
            unit="1",
            time_steps=tuple(1.0 / n for n in (30, 60, 120)),
            configurations=(Configuration(name="direct", method=PLAIN, expected_order=None),),  # exact
            error=pull_error,
            run=run,
            target_error=1e-9,
            target_seconds=0.01,
        ),
        Ladder(
            name="wave",
            description="relative error of the third mode's frequency of the taut rope against that of links",
            unit="1",
            time_steps=tuple(1.0 / n for n in (60, 120, 240, 480)),
            configurations=(Configuration(name="direct", method=PLAIN, expected_order=2.0),),
            error=wave_error,
            run=wave_run,
            target_error=1e-3,
            target_seconds=0.02,
        ),
    ),
    stability=(
        StabilityStudy(
            name="tightest",
            title="Largest pull under which a rope of ten links stays straight at 1/60 s",
            configuration="plain",
            definition="bent by 1e-7 m into its shortest waves it moves by less than 1e-4 m in 200 steps",
            study=strongest,
            unit="N",
            expected=(0.99 * tightest(), 1.005 * tightest()),
            expected_source="h ω = 2 of the shortest waves of ten links, to the resolution of the search",
        ),
        StabilityStudy(
            name="finest",
            title="Most links whose cable hangs still at 1/60 s",
            configuration="plain",
            definition="at rest where statics puts it nothing moves by 1e-6 m in 300 steps",
            study=finest,
            unit="1",
            expected=(49.0, 49.0),
            expected_source="h ω = 2 of the hanging links' fastest swing in their plane",
        ),
    ),
)
