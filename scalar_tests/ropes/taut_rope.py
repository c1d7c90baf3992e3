"""How tight may a rope of links be that carries waves at √(T/ρ)?"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from spook_tracker import engine

from .. import case
from ..bracket import break_count, break_point
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import line, sweep, told
from ..swing import phase

LENGTH, MASS = 10.0, 5.0  # m, kg
PULL, PIECES = 50.0, 20  # N, links
SWAY = 1e-4  # m, of its modes
MODES = (1, 2, 3)
TIME_STEP = 1.0 / 60.0  # s
DURATION = 1.0  # s


@functools.cache
def taut(mode: int, count: int = PIECES, pull: float = PULL, sway: float = SWAY) -> engine.Scene:
    """Links of the same rope in a row, bent into a mode and at rest, drawn by `pull` at a slide of a link's mass."""
    length, mass = LENGTH / count, MASS / count
    bent = [sway * math.sin(mode * math.pi * k / count) for k in range(count + 1)]
    rods, joints, x = [], [], 0.0
    for k in range(count):
        along = math.sqrt(length**2 - (bent[k + 1] - bent[k]) ** 2)
        turn = 0.5 * (0.5 * math.pi - math.atan2(bent[k + 1] - bent[k], along))
        rods.append(
            engine.RigidBody(
                name=f"link {k}",
                mass=mass,
                shape=engine.Capsule(0.02, length - 0.04),
                inertia=(mass * length**2 / 12.0, mass * length**2 / 12.0, 1e-5),
                position=(x + 0.5 * along, 0.0, 0.5 * (bent[k] + bent[k + 1])),
                orientation=(math.cos(turn), 0.0, math.sin(turn), 0.0),
            )
        )
        before = engine.WORLD if k == 0 else f"link {k - 1}"
        joints.append(
            engine.Ball(
                name=f"joint {k}", between=(before, f"link {k}"), at=(x, 0.0, bent[k]), compliance=0.0
            )
        )
        x += along
    end = engine.RigidBody(name="slide", mass=mass, inertia=(mass,) * 3, position=(x, 0.0, bent[count]))
    last = engine.Ball(
        name="end", between=(f"link {count - 1}", "slide"), at=(x, 0.0, bent[count]), compliance=0.0
    )
    guide = engine.Prismatic(
        name="guide", between=(engine.WORLD, "slide"), axis=(1.0, 0.0, 0.0), compliance=0.0
    )
    return engine.Scene(
        bodies=(*rods, end),
        constraints=(*joints, last, guide),
        forces=(engine.Load(name="pull", body="slide", force=(pull, 0.0, 0.0)),),
        contacts=False,
    )


def rate(mode: int, count: int = PIECES, pull: float = PULL) -> float:
    """ω of a mode of taut links [rad/s]: T/l (2 − 2 cos θ) against m/3 (2 + cos θ), θ = π mode/links."""
    turn = math.cos(math.pi * mode / count)
    return math.sqrt(6.0 * pull * count**2 / (MASS * LENGTH) * (1.0 - turn) / (2.0 + turn))


def discrete(frequency: float, time_step: float) -> float:
    """What the step makes of it [rad/s]: cos φ = 1 − (h ω)²/2."""
    return math.acos(1.0 - 0.5 * (time_step * frequency) ** 2) / time_step


def swing(
    simulate: case.Simulate, mode: int, time_step: float, method: engine.Method = engine.PLAIN
) -> float:
    """Frequency of a mode [rad/s] over a second."""
    observe = {"x": engine.Trace(quantity=engine.Position())}
    result = simulate(taut(mode), time_step=time_step, duration=DURATION, method=method, observe=observe)
    shape = np.sin(mode * math.pi * (np.arange(PIECES) + 0.5) / PIECES)
    x: Any = result["x"][:, :PIECES, 2] @ shape
    return phase(x) / time_step


def wave(simulate: case.Simulate) -> dict[str, float]:
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


def wave_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Relative error of the third mode's frequency."""
    return swing(simulate, 3, time_step, method) / rate(3) - 1.0


def tightest() -> float:
    """The pull [N] at which the fastest swing of ten links turns by half a turn a step: h ω = 2."""
    return (2.0 / (TIME_STEP * rate(9, 10, 1.0))) ** 2


def strongest(simulate: case.Simulate) -> case.BreakPoint:
    """The largest pull under which ten links stay straight."""
    return break_point(
        lambda pull: straight(simulate, 10, pull), 0.4 * tightest(), 2.0 * tightest(), resolution=0.005
    )


def straight(simulate: case.Simulate, count: int, pull: float) -> bool:
    """Whether so many links, bent into their shortest waves, stay within a tenth of a millimetre for 200 steps."""
    observe = {"x": engine.MaximumAbsolute(quantity=engine.Position(), from_start=True)}
    asked = taut(count - 1, count, pull, 1e-7)
    result = simulate(asked, time_step=TIME_STEP, steps=200, observe=observe)
    return result.completed and float(result["x"].max()) < 1e-4


def most() -> int:
    """The largest number of links whose fastest swing under 50 N turns by less than half a turn a step."""
    count = 2
    while TIME_STEP * rate(count, count + 1) < 2.0:
        count += 1
    return count


def finest(simulate: case.Simulate) -> case.BreakPoint:
    """The largest number of links that stay straight under 50 N."""
    return break_count(lambda count: straight(simulate, count, PULL), (10, 20, 40))


def draw(simulate: case.Simulate) -> case.Drawing:
    """Frequencies of the modes, of links and step, and of a smooth rope."""
    modes = tuple(range(1, 11))
    found = sweep(modes, lambda mode: swing(simulate, round(mode), TIME_STEP))
    speed = math.sqrt(PULL * LENGTH / MASS)
    return case.Drawing(
        curves=(
            line("simulation", modes, found, "points"),
            line("links and step", modes, (discrete(rate(m), TIME_STEP) for m in modes), "reference"),
            line("smooth rope", modes, (m * math.pi / LENGTH * speed for m in modes), "limit"),
        ),
        x_label="mode",
        y_label="frequency [rad/s]",
        note=f"Mode {modes[-1]} swings at {told(found[-1], 4)} rad/s, in links and step at "
        f"{told(discrete(rate(modes[-1]), TIME_STEP), 4)} rad/s, in a smooth rope at "
        f"{told(modes[-1] * math.pi / LENGTH * speed, 4)} rad/s.",
    )


FASTER = ((math.pi / PIECES) ** 2 + (TIME_STEP * rate(1)) ** 2) / 24.0

TEST = case.ScalarTest(
    title="Taut rope",
    question="How tight may a rope of links be that carries waves at √(T/ρ)?",
    why="Cranes, cables and tendons are ropes under tension. Their waves show whether rows pass on a pull across a link as well "
    "as along it; and the pull is what makes light links run away.",
    model="Twenty rods on ball joints in a row, held at one end and drawn at a slide at the other, are bent by 0.1 mm into one of "
    "the first three modes and let go. No gravity.",
    parameters=(
        ("rope", "10 m, 5 kg, 20 links, drawn by 50 N: waves of 10 m/s"),
        ("time step", "1/60 s"),
    ),
    theory=(
        "Links in the mode θ = π k/N swing with ω² = 6 T/(m l) (1 − cos(θ))/(2 + cos(θ)), which is √(T/ρ) k π/L and "
        "θ²/24 more; the step makes cos φ = 1 − (h ω)²/2 of it.",
        "No step carries h ω > 2: for the shortest waves, ω² = 12 T/(m l), that is T h²/(m l) = 1/3.",
    ),
    reference="Dispersion relation of links and step (closed form).",
    conclusion="Green: waves run as fast as they must. Red: the pull is not passed on, or joints give way.",
    source="ours; J. le Rond d'Alembert, 1747, for the smooth string",
    measurements=(
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
            "three modes",
            TIME_STEP,
        ),
    ),
    example=lambda: case.Example(scene=taut(1, sway=0.5), time_step=TIME_STEP, duration=4.0),
    figures=(case.Figure(name="modes", title="Frequencies of a taut rope", draw=draw),),
    ladders=(
        case.Ladder(
            name="wave",
            description="relative error of the third mode's frequency of the taut rope against that of links",
            unit="1",
            time_steps=tuple(1.0 / n for n in (60, 120, 240, 480)),
            configurations=configured({"direct": 2.0, "half-step": 2.0}),
            error=wave_error,
            target_error=1e-3,
            target_seconds=0.02,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="tightest",
            title="Largest pull under which a rope of ten links stays straight at 1/60 s",
            configuration="plain",
            definition="bent by 1e-7 m into its shortest waves it moves by less than 1e-4 m in 200 steps",
            study=strongest,
            unit="N",
            expected=(0.99 * tightest(), 1.005 * tightest()),
            expected_source="h ω = 2 of the shortest waves of ten links, to the resolution of the search",
        ),
        case.StabilityStudy(
            name="finest",
            title="Most links of a rope under 50 N that stay straight at 1/60 s",
            configuration="plain",
            definition="bent by 1e-7 m into its shortest waves it moves by less than 1e-4 m in 200 steps",
            study=finest,
            unit="1",
            expected=(float(most()), float(most())),
            expected_source="h ω = 2 of the shortest waves: 1.957 with 34 links, 2.015 with 35",
        ),
    ),
)
