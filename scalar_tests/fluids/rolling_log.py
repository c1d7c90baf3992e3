"""Does a log roll at the rate its metacentre says as long as that lies above its centre?"""

from __future__ import annotations

import functools
import math

import numpy as np

from spook_tracker import engine

from .. import case
from ..bracket import break_point
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import line, sweep, told
from ..swing import phase
from .floating_box import DURATION, GRAVITY, NUDGE, SIDE, TIME_STEP, metacentric_height, scene

LIGHT, HEAVY = 0.5 - math.sqrt(1.0 / 12.0), 0.5 + math.sqrt(1.0 / 12.0)  # density ratios, GM = 0
ROLLED = (0.15, 0.2, 0.8, 0.85)  # ratios at which the roll is timed


def roll_rate(ratio: float) -> float:
    """ω = √(m g GM/I) [rad/s], I = m (B² + H²)/12 of the log about its length."""
    return math.sqrt(GRAVITY * metacentric_height(ratio) * 12.0 / (2.0 * SIDE**2))


def swing(
    simulate: case.Simulate, ratio: float, time_step: float = TIME_STEP, method: engine.Method = engine.PLAIN
) -> float:
    """Frequency [rad/s] of a small roll."""
    observe = {"q": engine.Trace(quantity=engine.Orientation("log"))}
    asked = scene(ratio, roll=NUDGE)
    result = simulate(asked, time_step=time_step, duration=DURATION, method=method, observe=observe)
    x = 2.0 * result["q"][:, 1]
    return phase(x) / time_step


def swing_limit(ratio: float) -> float:
    """A roll φ rights itself with GM + ½ BM tan²φ, and lifts the log by parts of φ²: φ² (1 + BM/GM) covers both while the
    heave is not near twice the roll."""
    return NUDGE**2 * (1.0 + SIDE / (12.0 * ratio) / metacentric_height(ratio))


def swings(simulate: case.Simulate) -> dict[str, float]:
    """Rolls outside of the densities at which it falls, against √(m g GM/I), slowed as the step does."""
    worst = 0.0
    for ratio in ROLLED:
        discrete = math.acos(1.0 - 0.5 * (TIME_STEP * roll_rate(ratio)) ** 2) / TIME_STEP
        worst = max(worst, abs(swing(simulate, ratio) / discrete - 1.0) / swing_limit(ratio))
    return {
        "roll_rate_error": worst,
        "continuous_error": swing(simulate, ROLLED[0]) / roll_rate(ROLLED[0]) - 1.0,
    }


def upright(simulate: case.Simulate, ratio: float) -> bool:
    """Whether a nudge has not grown tenfold within 20 s."""
    observe = {"q": engine.Trace(quantity=engine.Orientation("log"), every=12)}
    result = simulate(scene(ratio, roll=NUDGE), time_step=TIME_STEP, duration=20.0, observe=observe)
    return result.completed and 2.0 * float(np.abs(result["q"][:, 1]).max()) < 10.0 * NUDGE


def blurred(place: float) -> float:
    """How far beyond GM = 0 a nudge grows tenfold within 20 s, cosh(20 √(−m g GM/I)) = 10, and what the search leaves."""
    lacking = (math.acosh(10.0) / 20.0 / roll_rate(0.15)) ** 2 * metacentric_height(0.15)
    return lacking / abs(0.5 * SIDE - SIDE / (12.0 * place**2)) + 1e-3 * place


def edge(simulate: case.Simulate, easy: float, hard: float) -> case.BreakPoint:
    """The last density ratio at which it stands upright."""
    return break_point(functools.partial(upright, simulate), easy, hard, resolution=1e-3, walk=5)


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Relative error of the roll's frequency, ratio 0.15."""
    return swing(simulate, ROLLED[0], time_step, method) / roll_rate(ROLLED[0]) - 1.0


def draw(simulate: case.Simulate) -> case.Drawing:
    """Frequency of the roll against the density."""
    curves = []
    for name, ratios in (
        ("light", (0.12, 0.14, 0.16, 0.18, 0.2, 0.208)),
        ("heavy", (0.792, 0.8, 0.83, 0.86, 0.9, 0.95)),
    ):
        curves.append(line(name, ratios, sweep(ratios, lambda ratio: swing(simulate, ratio)), "points"))
        curves.append(line(f"√(m g GM/I), {name}", ratios, map(roll_rate, ratios), "reference"))
    return case.Drawing(
        curves=tuple(curves),
        x_label="density of the log over that of the water",
        y_label="frequency of the roll [rad/s]",
        note=f"The lightest log drawn rolls at {told(curves[0].y[0], 3)} rad/s, {told(roll_rate(curves[0].x[0]), 3)} rad/s by its "
        "metacentre.",
    )


TEST = case.ScalarTest(
    title="Rolling log",
    question="Does a log roll at the rate its metacentre says as long as that lies above its centre?",
    why="Ships are judged by their metacentre. It is a difference of large moments: what is lost of them shows in the roll "
    "first, and at the densities where a log falls on its side.",
    model="The square log of the floating box, nudged by 1e-4 rad: its roll is timed at four densities, and it stands or falls "
    "around two more. No water moves along with it.",
    parameters=(
        ("time step", "1/60 s"),
        ("log", "4 × 1 × 1 m, density ratios 0.15, 0.2, 0.8 and 0.85"),
        ("water", "1000 kg/m³, still, without drag"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "ω² = m g GM/I, GM = s H/2 + B²/(12 s H) − H/2; one step makes cos(θ) = 1 − (h ω)²/2 of it.",
        "GM < 0 between s = ½ − √(1/12) = .2113 and ½ + √(1/12) = .7887.",
    ),
    reference="Hydrostatics and the discrete step in closed form.",
    conclusion="Green: what lies below the surface and its moments are right. Red: one of them is not.",
    source="ours; buoyancy is asked for in the thesis, section 5.4",
    measurements=(
        ask(
            swings,
            (
                error(
                    "roll_rate_error",
                    "largest relative error of the roll's frequency against the discrete √(m g GM/I), over what its size explains",
                    "1",
                    1.0,
                    "φ² (1 + BM/GM): a roll of 1e-4 rad rights itself a little more than its metacentre says, and heaves",
                ),
                error(
                    "continuous_error",
                    "relative error of the roll's frequency against √(m g GM/I), ratio 0.15",
                    "1",
                    1.05 * (TIME_STEP * roll_rate(ROLLED[0])) ** 2 / 24.0,
                    "(h ω)²/24 of the step",
                    "companion",
                ),
            ),
            "small rolls at four densities",
            TIME_STEP,
        ),
    ),
    example=lambda: case.Example(scene=scene(0.15, roll=0.1), time_step=TIME_STEP, duration=DURATION),
    figures=(case.Figure(name="roll", title="Frequency of the roll", draw=draw),),
    stability=(
        case.StabilityStudy(
            name="light",
            title="Largest low density ratio at which a square log stands upright",
            configuration="plain",
            definition="nudged by 1e-4 rad it rolls by less than ten times that within 20 s",
            study=functools.partial(edge, easy=0.16, hard=0.3),
            unit="1",
            expected=(LIGHT - blurred(LIGHT), LIGHT + blurred(LIGHT)),
            expected_source="GM = 0 at ½ − √(1/12) = .2113; where a nudge grows tenfold in 20 s, and what the search leaves",
        ),
        case.StabilityStudy(
            name="heavy",
            title="Smallest high density ratio at which a square log stands upright",
            configuration="plain",
            definition="nudged by 1e-4 rad it rolls by less than ten times that within 20 s",
            study=functools.partial(edge, easy=0.88, hard=0.7),
            unit="1",
            better="smaller",
            expected=(HEAVY - blurred(HEAVY), HEAVY + blurred(HEAVY)),
            expected_source="GM = 0 at ½ + √(1/12) = .7887; where a nudge grows tenfold in 20 s, and what the search leaves",
        ),
    ),
    ladders=(
        case.Ladder(
            name="roll",
            description="relative error of the roll's frequency against √(m g GM/I)",
            unit="1",
            time_steps=tuple(1.0 / n for n in (15, 30, 60, 120)),
            configurations=configured({"plain": 2.0, "iterative": 2.0}),
            error=ladder_error,
            target_error=1e-4,
            target_seconds=0.01,
        ),
    ),
)
