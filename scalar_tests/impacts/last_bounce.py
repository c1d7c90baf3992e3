"""Is a ball heard to bounce for as long as its first bounces say?"""

from __future__ import annotations

import math

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.bodies import Material

from .. import case, readings
from ..bracket import break_point
from ..readings import Reading, deviation
from ..sweep import line

GRAVITY = 9.81  # m/s²
RADIUS, MASS = 0.02, 0.01  # m, kg; neither matters
FIRST = 0.63  # s, of the first bounce
KEPT = 0.80  # of the height, bounce after bounce
READ = 0.01  # one of its last digit: the source calls its heights "somewhat rough" and says no more
RESTITUTION = math.sqrt(KEPT)
END = FIRST / (1.0 - RESTITUTION)  # s
STEEP = FIRST / (2.0 * RESTITUTION * (1.0 - RESTITUTION) ** 2)  # s: dEND/dKEPT
TIME_STEP = 1e-3  # s
DURATION = 9.0  # s
HEARD = 1e-4  # m: lower bounces make no sound worth the name
BOUNCES = math.ceil(math.log(8.0 * HEARD / GRAVITY / FIRST**2) / math.log(KEPT))  # that are higher
SOURCE = "Styer & Besson, Journal of Online Mathematics and its Applications 7 (2007)"
READINGS = (
    Reading(
        at="from the first bounce to the end", value=6.42, sigma=math.hypot(STEEP * READ, 0.005 * END / FIRST)
    ),
)


def scene(restitution: float = RESTITUTION) -> engine.Scene:
    """A ball as it leaves a table for its first bounce."""
    rubber = Material(restitution=restitution)
    table = engine.RigidBody(
        name="table", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=rubber
    )
    ball = engine.RigidBody(
        name="ball",
        mass=MASS,
        shape=engine.Sphere(RADIUS),
        position=(0.0, 0.0, RADIUS),
        velocity=(0.0, 0.0, 0.5 * GRAVITY * FIRST),
        material=rubber,
    )
    return engine.Scene(bodies=(table, ball), gravity=(0.0, 0.0, -GRAVITY))


def heard() -> float:
    """When [s] the last bounce higher than HEARD comes down through it: its flights before, and the way from its top."""
    flight = FIRST * RESTITUTION ** (BOUNCES - 1)
    before = END * (1.0 - RESTITUTION ** (BOUNCES - 1))
    return before + 0.5 * flight + math.sqrt(0.25 * flight**2 - 2.0 * HEARD / GRAVITY)


def end(simulate: case.Simulate, time_step: float = TIME_STEP, method: engine.Method = engine.PLAIN) -> float:
    """When [s] the ball is last seen above HEARD."""
    observe = {"place": engine.Trace(quantity=engine.Position("ball"))}
    result = simulate(scene(), time_step=time_step, duration=DURATION, method=method, observe=observe)
    above = np.nonzero(result["place"][:, 2] - RADIUS > HEARD)[0]
    return float(result.sample_times["place"][above[-1]]) if len(above) else math.nan


def measure(simulate: case.Simulate) -> dict[str, float]:
    """The end against what was heard, and against the sum of the bounces."""
    found = end(simulate)
    return {"deviation": deviation((found,), READINGS), "theory_error": abs(found / heard() - 1.0)}


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Relative error of the time at which the ball is last above HEARD."""
    return end(simulate, time_step, method) / heard() - 1.0


def liveliest(simulate: case.Simulate) -> case.BreakPoint:
    """The largest restitution with which no bounce is higher than the first."""

    def holds(restitution: float) -> bool:
        observe = {"energy": engine.Trace(quantity=engine.Energy())}
        result = simulate(
            scene(restitution),
            time_step=TIME_STEP,
            duration=DURATION,
            method=engine.Method(half_step_velocities=True),
            observe=observe,
        )
        most = 0.125 * MASS * (GRAVITY * FIRST) ** 2
        return result.completed and float(result["energy"].max() - result["energy"][0]) < 1e-2 * most

    return break_point(holds, 0.5, 1.0, resolution=1e-3, walk=6)


LIFT = 0.01  # m, of a bounce that is one


def dullest(simulate: case.Simulate) -> case.BreakPoint:
    """The least restitution with which the ball comes up again, by LIFT."""

    def bounces(restitution: float) -> bool:
        observe = {"place": engine.Trace(quantity=engine.Position("ball"))}
        result = simulate(scene(restitution), time_step=TIME_STEP, duration=1.25 * FIRST, observe=observe)
        after = result.sample_times["place"] > FIRST + 2.0 * TIME_STEP
        return bool((result["place"][after, 2] - RADIUS).max() > LIFT)

    return break_point(bounces, 0.9, 0.01, resolution=1e-3, walk=5)


def dull(worst: float = 0.0) -> float:
    """That restitution by Newton's law: e v is √(2 g LIFT). Steps at their `worst`, 1, take g h off v and ½ e v h off the rise."""
    lost = worst * GRAVITY * TIME_STEP
    return (0.5 * lost + math.hypot(0.5 * lost, math.sqrt(2.0 * GRAVITY * LIFT))) / (
        0.5 * GRAVITY * FIRST - lost
    )


def _draw(simulate: case.Simulate) -> case.Drawing:
    observe = {"place": engine.Trace(quantity=engine.Position("ball"), every=5)}
    result = simulate(scene(), time_step=TIME_STEP, duration=7.0, observe=observe)
    gap = result["place"][:, 2] - RADIUS
    return case.Drawing(
        curves=(
            line("simulated", result.sample_times["place"], gap),
            line("heard last", (READINGS[0].value,) * 2, (0.0, float(gap.max())), "reference"),
        ),
        x_label="time from the first impact [s]",
        y_label="gap [m]",
    )


TEST = readings.measured_test(
    SOURCE,
    ": heights of a video, and 6.42 s of its sound from the first impact to the end.",
    READINGS,
    "s",
    (
        ("first bounce", "0.63 s"),
        ("height kept", "0.80 ± 0.01, restitution √0.80"),
        ("gravity", "9.81 m/s²"),
        ("time step", "1e-3 s, 9 s"),
    ),
    measure,
    readings.against_theory(
        (BOUNCES + 1.0) * TIME_STEP / heard(),
        "each bounce higher than 0.1 mm ends up to a step too early, and it is looked at once a step",
    ),
    configuration="plain",
    time_step=TIME_STEP,
    note="until it lies still",
    title="Last bounce, measured",
    question="Is a ball heard to bounce for as long as its first bounces say?",
    why="Restitution as one number is a bold claim: that a ball loses the same share at 4 m/s and at 4 cm/s.",
    model="A ball whose first bounce takes 0.63 s and that keeps 0.80 of its height each time bounces until it lies still.",
    theory=(
        "All bounces together: t₁/(1 − e); those lower than 0.1 mm, the last 0.08 s, are not counted as heard.",
        "σ is a choice: the source has 0.80 without an uncertainty; one of its last digit, 0.01, moves the end by 5 %.",
        "Left out: air, the ball's spin, and that rubber keeps more of a gentle impact: why the real ball is heard longer.",
    ),
    conclusion="Green: many impacts add up as they do in the world. Red: energy is lost or made as bounces get small.",
    example=lambda: case.Example(scene=scene(), time_step=TIME_STEP),
    figures=(
        case.Figure(name="bounces", title="Bounces, and when the real ball was heard last", draw=_draw),
    ),
    ladders=readings.ladder(
        ladder_error,
        (1e-3, 5e-4, 2.5e-4, 1.25e-4, 6.25e-5),
        1.0,
        better="four substeps",
        method=engine.Method(substeps=4),
        better_order=1.0,
        name="end",
        description="relative error of the time at which the ball is last above 0.1 mm",
        unit="1",
        target_error=1e-3,
    ),
    stability=(
        case.StabilityStudy(
            name="liveliest",
            title="Largest restitution with which no bounce is higher than the first",
            configuration="half-step",
            definition="9 s without 1 % more energy than at the start",
            study=liveliest,
            unit="1",
            expected=(1.0, 1.0),
            expected_source="an impact keeps e² ≤ 1 of its energy; the search ends at 1",
        ),
        case.StabilityStudy(
            name="dullest",
            title="Least restitution with which the ball comes up again by a centimetre",
            configuration="plain",
            definition="after its first bounce it is seen higher than that",
            study=dullest,
            unit="1",
            better="smaller",
            expected=(dull(), 1.0015 * dull(1.0)),
            expected_source="Newton: e² of 0.487 m is a centimetre at e = 0.1433; steps come down slower by up to g h and rise lower by up "
            "to ½ v h, and the search has a thousandth",
        ),
    ),
)
