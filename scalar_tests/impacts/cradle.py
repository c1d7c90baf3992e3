"""Does a blow pass through a row of touching balls as the order of impacts says?"""

from __future__ import annotations

import functools

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.bodies import Material

from .. import case
from ..bracket import break_point
from ..closed_form import ask, error
from ..sweep import line

TIME_STEP = 1.0 / 60.0  # s
RADIUS = 0.1  # m
SPEED = 1.0  # m/s
WAY = 0.1037  # m, to the first blow
DURATION = 0.5  # s
COUNT = 5
CLOSED = 1e-9 * RADIUS  # m: gaps up to a billionth of the larger radius count as closed
SUCCESSIVE = engine.Method(impacts="successive")


def scene(
    moving: int, restitution: float = 1.0, gap: float = 0.0, masses: tuple[float, ...] = ()
) -> engine.Scene:
    """Balls of 1 kg, or of `masses` [kg], in a row with `gap` [m] between; the first `moving` come at SPEED."""
    steel = Material(restitution=restitution)
    balls = tuple(
        engine.RigidBody(
            name=f"ball {k + 1}",
            mass=masses[k] if masses else 1.0,
            shape=engine.Sphere(RADIUS),
            position=(k * (2.0 * RADIUS + gap) - (WAY if k < moving else 0.0), 0.0, 0.0),
            velocity=(SPEED if k < moving else 0.0, 0.0, 0.0),
            material=steel,
        )
        for k in range(len(masses) or COUNT)
    )
    return engine.Scene(bodies=balls)


def passed_on(moving: int, restitution: float, masses: tuple[float, ...] = (1.0,) * COUNT) -> np.ndarray:
    """Speeds [m/s] after blows of one pair after the other, from left to right, until nothing approaches."""
    speed = np.array([SPEED if k < moving else 0.0 for k in range(len(masses))])
    while (np.diff(speed) < -1e-14).any():
        for k in range(len(masses) - 1):
            closing = speed[k] - speed[k + 1]
            if closing > 1e-14:
                impulse = (1.0 + restitution) * closing / (1.0 / masses[k] + 1.0 / masses[k + 1])
                speed[k] -= impulse / masses[k]
                speed[k + 1] += impulse / masses[k + 1]
    return speed


def all_at_once(moving: int) -> np.ndarray:
    """Speeds [m/s] if the touching ones meet in a single elastic blow: v₊ = v₋ + 2 (common − v₋) within each group.

    The only pair that closes is that of the last coming and the first resting ball; the others may part.
    """
    come, rest = moving, COUNT - moving
    impulse = 2.0 * SPEED / (1.0 / come + 1.0 / rest)
    return np.array([SPEED - impulse / come] * come + [impulse / rest] * rest)


def speeds(simulate: case.Simulate, built: engine.Scene, method: engine.Method) -> np.ndarray:
    """Speeds along the row after the blow [m/s]."""
    observe = {"v": engine.Final(quantity=engine.Velocity())}
    result = simulate(built, time_step=TIME_STEP, duration=DURATION, method=method, observe=observe)
    return np.asarray(result["v"][:, 0])


def _measure_successive(simulate: case.Simulate) -> dict[str, float]:
    rows = {
        "one_ball_error": (scene(1), passed_on(1, 1.0)),
        "two_balls_error": (scene(2), passed_on(2, 1.0)),
        "lossy_error": (scene(2, restitution=0.9), passed_on(2, 0.9)),
        "unequal_error": (scene(1, masses=(1.0, 2.0, 4.0)), passed_on(1, 1.0, (1.0, 2.0, 4.0))),
    }
    return {
        name: float(np.abs(speeds(simulate, built, SUCCESSIVE) - right).max())
        for name, (built, right) in rows.items()
    }


def _measure_simultaneous(simulate: case.Simulate) -> dict[str, float]:
    apart = scene(1, gap=2.0 * TIME_STEP * SPEED)
    return {
        "touching_error": float(np.abs(speeds(simulate, scene(1), engine.Method()) - all_at_once(1)).max()),
        "apart_error": float(np.abs(speeds(simulate, apart, engine.Method()) - passed_on(1, 1.0)).max()),
    }


def most_unequal(simulate: case.Simulate) -> case.BreakPoint:
    """Largest ratio of masses of neighbours among three balls."""

    def passes(ratio: float) -> bool:
        masses = (1.0, ratio, ratio**2)
        found = speeds(simulate, scene(1, masses=masses), SUCCESSIVE)
        return float(np.abs(found - passed_on(1, 1.0, masses)).max()) < 1e-9

    return break_point(passes, 1.5, 1e6, resolution=0.1, walk=7)


def tells_gaps(simulate: case.Simulate, gap: float) -> bool:
    """Whether balls `gap` [m] apart pass a blow on one after the other, though touching ones meet at once."""
    found = speeds(simulate, scene(1, gap=gap), engine.Method())
    return float(np.abs(found - passed_on(1, 1.0)).max()) < 1e-9


def narrowest(simulate: case.Simulate) -> case.BreakPoint:
    """The narrowest gap [m] that is told from none."""
    return break_point(functools.partial(tells_gaps, simulate), 1e-3, 1e-14, resolution=1e-2, walk=12)


def _draw(simulate: case.Simulate) -> case.Drawing:
    curves = []
    for name, method in (("successive", SUCCESSIVE), ("simultaneous", engine.Method())):
        observe = {"v": engine.Trace(quantity=engine.Velocity(f"ball {COUNT}"))}
        result = simulate(scene(1), time_step=TIME_STEP, duration=DURATION, method=method, observe=observe)
        curves.append(line(name, result.sample_times["v"], result["v"][:, 0]))
    return case.Drawing(curves=tuple(curves), x_label="time [s]", y_label="speed of the last ball [m/s]")


TEST = case.ScalarTest(
    title="Newton's cradle",
    question="Does a blow pass through a row of touching balls as the order of impacts says?",
    why="Newton's law does not say what happens when bodies touch already: a single blow for all and one after the "
    "other give different rows, and an engine should give the one it was asked for.",
    model="One ball or two meet a row of resting balls that touch, without gravity.",
    parameters=(
        ("balls", "5 of 1 kg, or 1, 2 and 4 kg; radius 0.1 m, 1 m/s"),
        ("restitution", "1 and 0.9"),
        ("gap", "0; twice the way of a step for the simultaneous row"),
        ("time step", "1/60 s"),
    ),
    theory=(
        "Successive: blows of two balls, one pair after the other, until nothing approaches: as many leave as came.",
        "Simultaneous: one blow for all that touch; one ball on four gives −0.6 and 0.4 for each of the four.",
        "With gaps between them the balls meet in pairs, whatever the order.",
    ),
    reference="Impulse balances of two bodies, and of two groups (closed form).",
    conclusion="Green: each order of impacts is what it is called. Red: blows stop half-way, or energy is lost.",
    source="ours; E. Mariotte, Traité de la percussion, 1673",
    lacks={"ladder": "exact at every step"},
    measurements=(
        ask(
            _measure_successive,
            (
                error("one_ball_error", "largest error of a speed, one ball comes", "m/s", 1e-12),
                error("two_balls_error", "largest error of a speed, two balls come", "m/s", 1e-12),
                error("lossy_error", "largest error of a speed, two balls come, e = 0.9", "m/s", 1e-12),
                error("unequal_error", "largest error of a speed, 1, 2 and 4 kg", "m/s", 1e-12),
            ),
            "Impacts one after the other.",
            TIME_STEP,
            configuration="successive",
        ),
        ask(
            _measure_simultaneous,
            (
                error("touching_error", "largest error of a speed, a single blow for all", "m/s", 1e-12),
                error("apart_error", "largest error of a speed, balls with gaps", "m/s", 1e-12),
            ),
            "Impacts at once.",
            TIME_STEP,
        ),
    ),
    example=lambda: case.Example(scene=scene(2), time_step=TIME_STEP, method=SUCCESSIVE, duration=1.0),
    figures=(case.Figure(name="last-ball", title="Speed of the last ball", draw=_draw),),
    stability=(
        case.StabilityStudy(
            name="most-unequal",
            title="Largest ratio of masses of neighbours in a row of three",
            configuration="successive",
            definition="speeds after the blow right to 1e-9 m/s",
            study=most_unequal,
            unit="1",
            expected=(1e6, 1e6),
            expected_source="a blow of two bodies is one row: rounding does not grow with the ratio; the search ends at 1e6",
        ),
        case.StabilityStudy(
            name="narrowest",
            title="Narrowest gap between balls that is told from none",
            configuration="simultaneous",
            definition="speeds of one blow after the other, right to 1e-9 m/s",
            study=narrowest,
            unit="m",
            better="smaller",
            expected=(CLOSED, 1.02 * CLOSED),
            expected_source="the method's own: gaps up to 1e-9 of a radius count as closed, and closed ones meet at once; to the "
            "resolution of the search",
        ),
    ),
)
