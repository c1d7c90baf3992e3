"""Does a cable of rigid links hang as the statics of its catenary says?"""

from __future__ import annotations

import functools
import math

from spook_tracker import engine

from .. import case
from ..bracket import break_count, unbroken
from ..closed_form import ask, error
from ..configurations import configured
from ..heavier import heavier
from ..sweep import line, told

GRAVITY = 9.81  # m/s²
SPAN, LENGTH, MASS = 8.0, 10.0, 5.0  # m, m, kg, of the whole cable
TIME_STEP = 1.0 / 60.0  # s
DURATION = 1.0  # s
# Links, and a step that carries them: a pull along a link acts across it where the step starts, an explicit spring whose
# fastest swing must turn by less than half a turn a step, h ω < 2.
ASKED = ((10, TIME_STEP), (25, TIME_STEP), (50, TIME_STEP / 4.0))


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
def scene(count: int) -> engine.Scene:
    """Thin rods on ball joints, at rest where statics puts them."""
    length, places = LENGTH / count, nodes(count)
    rods, joints = [], []
    for k, angle in enumerate(angles(count, horizontal(count))):
        (x, z), (u, w) = places[k], places[k + 1]
        turn = 0.5 * (0.5 * math.pi - angle)  # the rod lies along its z axis
        rods.append(
            engine.RigidBody(
                name=f"link {k}",
                mass=MASS / count,
                shape=engine.Capsule(0.02, length - 0.04),
                inertia=(MASS / count * length**2 / 12.0, MASS / count * length**2 / 12.0, 1e-5),
                position=(0.5 * (x + u), 0.0, 0.5 * (z + w)),
                orientation=(math.cos(turn), 0.0, math.sin(turn), 0.0),
            )
        )
    names = [engine.WORLD, *(rod.name for rod in rods), engine.WORLD]
    for k, (x, z) in enumerate(places):
        between = (names[k], names[k + 1]) if k < count else (engine.WORLD, names[k])
        joints.append(engine.Ball(name=f"joint {k}", between=between, at=(x, 0.0, z), compliance=0.0))
    return engine.Scene(
        bodies=tuple(rods), constraints=tuple(joints), gravity=(0.0, 0.0, -GRAVITY), contacts=False
    )


def smoothing(count: int) -> float:
    """By how much links pull less than a smooth cable, over its pull: the midpoint rule reaches further with
    cos φ = 1/√(1 + (s/a)²), by l²/24 of its change of slope from end to end, and H gives way by what that takes."""
    a, half = catenary() * LENGTH / (MASS * GRAVITY), 0.5 * LENGTH
    bent = 1.0 + (half / a) ** 2
    further = (LENGTH / count) ** 2 / 12.0 * half / a**2 * bent**-1.5
    # span = 2 a asinh(L/2a): d span/d ln a
    return float(further / (2.0 * a * (math.asinh(half / a) - half / a / math.sqrt(bent))))


def finest(simulate: case.Simulate) -> case.BreakPoint:
    """The largest number of links whose cable hangs still at 1/60 s."""
    observe = {"x": engine.MaximumAbsolute(quantity=engine.Position(), from_start=True)}

    def still(count: int) -> bool:
        result = simulate(scene(count), time_step=TIME_STEP, steps=300, observe=observe)
        return result.completed and float(result["x"].max()) < 1e-6

    return break_count(still, (10, 20, 40, 80))


def hangs(simulate: case.Simulate, whole: float) -> bool:
    """Whether ten links of that mass [kg] hang still for a second and pull in proportion to it."""
    observe = {
        "x": engine.MaximumAbsolute(quantity=engine.Position(), from_start=True),
        "force": engine.Final(quantity=engine.ConstraintForce("joint 0")),
    }
    result = simulate(
        heavier(scene(10), whole / MASS), time_step=TIME_STEP, duration=DURATION, observe=observe
    )
    pull = -float(result["force"][0]) * MASS / whole
    return result.completed and float(result["x"].max()) < 1e-9 and abs(pull / horizontal(10) - 1.0) < 1e-9


def measure(simulate: case.Simulate, count: int, time_step: float) -> dict[str, float]:
    """A second at rest."""
    middle = f"link {count // 2}"
    observe = {
        "x": engine.MaximumAbsolute(quantity=engine.Position(middle), from_start=True),
        "force": engine.Final(quantity=engine.ConstraintForce("joint 0")),
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


def pull_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Relative error of the horizontal force of the cable of ten links after a second."""
    observe = {"force": engine.Final(quantity=engine.ConstraintForce("joint 0"))}
    result = simulate(scene(10), time_step=time_step, duration=DURATION, method=method, observe=observe)
    return -float(result["force"][0]) / horizontal(10) - 1.0


def draw(simulate: case.Simulate) -> case.Drawing:
    """Where the links lie after a second, and the catenary."""
    count = 10
    observe = {str(k): engine.Final(quantity=engine.Position(f"link {k}")) for k in range(count)}
    result = simulate(scene(count), time_step=TIME_STEP, duration=DURATION, observe=observe)
    places = [result[str(k)] for k in range(count)]
    a = catenary() * LENGTH / (MASS * GRAVITY)
    x = [SPAN * (k / 60.0 - 0.5) for k in range(61)]
    top = math.cosh(0.5 * SPAN / a)
    off = max(abs(float(p[2]) - a * (math.cosh(float(p[0]) / a) - top)) for p in places)
    return case.Drawing(
        curves=(
            line("middles of the links", (p[0] for p in places), (p[2] for p in places), "points"),
            line("catenary", x, (a * (math.cosh(u / a) - top) for u in x), "reference"),
        ),
        x_label="x [m]",
        y_label="z [m]",
        note=f"At most {told(off)} m below or above the catenary: ten links are no smooth cable.",
    )


def _asked(count: int, time_step: float) -> case.Measurement:
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
    return case.Measurement(
        configuration=asked.configuration,
        time_step=time_step,
        parameters={"N": float(count)},
        metrics=asked.metrics,
        measure=asked.measure,
        note=asked.note,
    )


TEST = case.ScalarTest(
    title="Hanging cable",
    question="Does a cable of rigid links hang as the statics of its catenary says?",
    why="A cable's pull comes from its shape alone: joints that give way, or forces that leak along the chain, change it.",
    model="Thin uniform rods on ball joints hang between two points of the same height, at rest where statics puts them.",
    parameters=(
        ("span", "8 m"),
        ("cable", "10 m, 5 kg, in 10, 25 and 50 links"),
        ("gravity", "9.81 m/s²"),
        (
            "time step",
            "1/60 s; 1/240 s with 50 links, for more than 49 swing by over half a turn in 1/60 s: h ω > 2",
        ),
    ),
    theory=(
        "Moments about the middle of link k: tan φ_k = V_k/H, V_k the weight between it and the lowest point.",
        "H follows from the span: Σ l cos φ_k = 8 m. The ends carry half of the weight each.",
        "With ever shorter links it becomes the catenary of length L and span s, as 1/N²: L = 2 a sinh(s/2a), H = a w.",
        "No step carries h ω > 2; the shortest waves of links under tension have ω² = 12 T/(m l).",
    ),
    reference="Statics of the links (closed form but for H, found by halving).",
    conclusion="Green: joints carry the cable's weight and pull. Red: they give way or forces are wrong.",
    source="ours; the catenary is J. Bernoulli's problem of 1690",
    measurements=(*(_asked(*asked) for asked in ASKED),),
    example=lambda: case.Example(scene=scene(10), time_step=TIME_STEP, duration=2.0),
    figures=(case.Figure(name="shape", title="A hanging cable", draw=draw),),
    ladders=(
        case.Ladder(
            name="pull",
            description="relative error of the horizontal force at an end after a second, ten links",
            unit="1",
            time_steps=tuple(1.0 / n for n in (30, 60, 120)),
            configurations=configured({"direct": None, "half-step": None}),  # exact
            error=pull_error,
            target_error=1e-9,
            target_seconds=0.01,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="finest",
            title="Most links whose cable hangs still at 1/60 s",
            configuration="plain",
            definition="at rest where statics puts it nothing moves by 1e-6 m in 300 steps",
            study=finest,
            unit="1",
            expected=(49.0, 49.0),
            expected_source="h ω = 2 of the hanging links' fastest swing in their plane",
        ),
        unbroken(
            hangs,
            MASS,
            1e12,
            name="heaviest",
            title="Heaviest cable of ten links that hangs still",
            definition="in a second nothing moves by 1e-9 m, and the pull is its weight's share to 1e-9",
            source="mass scales out of rigid joints",
            unit="kg",
        ),
    ),
)
