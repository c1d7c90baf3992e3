"""Does a box float as deep as Archimedes says, bob at its rate, and stand or fall as its metacentre says?"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from spook_tracker import engine

from .. import case
from ..bracket import break_point, cell, table
from ..configurations import configured
from ..sweep import line, told

GRAVITY = 9.81  # m/s²
WATER = 1000.0  # kg/m³
LENGTH, SIDE = 4.0, 1.0  # m, of a log whose section is a square
TIME_STEP = 1.0 / 60.0  # s
DURATION = 10.0  # s
RATIO = 0.15  # density of the log over that of the water: upright is stable
PUSHED = 0.05  # m, above its draught at the start of the heave
ANGLES = (2.0, 5.0, 10.0)  # degrees, at which the surface meets only the sides
UPRIGHT = (0.2, 0.8)  # ratios at which it stands
TILTED = (0.2225, 0.5, 0.7775)  # and at which it falls
NUDGE = 1e-4  # rad
LIFTED, BOBS = (
    1e-7,
    60,
)  # m and steps, of the stability studies: so little that it can grow a hundredfold unbent
SEARCHED = 2e-3  # their resolution
DRAG = 1.0  # 1, of the log across a stream
STEPS = (1 / 60, 0.05, 0.1, 0.15, 0.2, 0.24, 0.26, 0.3)  # s
STREAMS = (0.0, 1.0, 3.0, 10.0, 30.0, 60.0, 100.0, 200.0, 300.0)  # m/s


def scene(ratio: float = RATIO, raised: float = 0.0, roll: float = 0.0) -> engine.Scene:
    """A log along x at its draught, `raised` [m] above it or rolled by `roll` [rad] about its centre line."""
    box = engine.Box((LENGTH, SIDE, SIDE))
    log = engine.RigidBody(
        name="log",
        mass=ratio * WATER * LENGTH * SIDE**2,
        shape=box,
        position=(0.0, 0.0, SIDE * (0.5 - ratio) + raised),
        orientation=(math.cos(0.5 * roll), math.sin(0.5 * roll), 0.0, 0.0),
    )
    sea = engine.Fluid(name="sea", density=WATER, level=0.0)
    return engine.Scene(bodies=(log,), forces=(sea,), gravity=(0.0, 0.0, -GRAVITY))


def heave_rate(ratio: float = RATIO) -> float:
    """ω = √(ρ g A/m) = √(g/(s H)) [rad/s]; no water moves along."""
    return math.sqrt(GRAVITY / (ratio * SIDE))


def metacentric_height(ratio: float) -> float:
    """GM = KB + BM − KG = s H/2 + B²/(12 s H) − H/2 [m]; zero at s = ½ ± √(1/12) = .2113 and .7887."""
    return 0.5 * ratio * SIDE + SIDE / (12.0 * ratio) - 0.5 * SIDE


def righting_arm(ratio: float, roll: float) -> float:
    """GZ = sin φ (GM + ½ BM tan² φ) [m], exact while only the sides meet the surface; buoyant force times it rights."""
    return math.sin(roll) * (metacentric_height(ratio) + SIDE / (24.0 * ratio) * math.tan(roll) ** 2)


def heave(simulate: case.Simulate) -> dict[str, float]:
    """Bobbing and floating against the closed forms."""
    observe = {"z": engine.Trace(quantity=engine.Position("log"))}
    result = simulate(scene(raised=PUSHED), time_step=TIME_STEP, duration=DURATION, observe=observe)
    z = result["z"][:, 2] - SIDE * (0.5 - RATIO)
    # v₊ = v − h ω² z, z₊ = z + h v₊ from rest: z_n = z_0 cos((n + ½) θ)/cos(θ/2), sin(θ/2) = h ω/2.
    half = math.asin(0.5 * TIME_STEP * heave_rate())
    discrete = PUSHED * np.cos((2.0 * np.arange(len(z)) + 1.0) * half) / math.cos(half)
    still = simulate(scene(), time_step=TIME_STEP, duration=DURATION, observe=observe)
    return {
        "period_error": period(result.sample_times["z"], z) * heave_rate() / (2.0 * math.pi) - 1.0,
        "heave_error": float(np.abs(z - discrete).max()),
        "draught_error": float(np.abs(still["z"][:, 2] - SIDE * (0.5 - RATIO)).max()),
    }


def period(times: Any, z: Any) -> float:
    """Mean time [s] between falls through zero, each found on the cosine's straight part."""
    at = [k for k in range(len(z) - 1) if z[k] > 0.0 >= z[k + 1]]
    falls = [times[k] + (times[k + 1] - times[k]) * z[k] / (z[k] - z[k + 1]) for k in (at[0], at[-1])]
    return float(falls[1] - falls[0]) / (len(at) - 1)


def roll(simulate: case.Simulate) -> dict[str, float]:
    """The righting moment in one step, and on which side of the metacentre the log stands."""
    worst = 0.0
    for ratio in (0.15, 0.5, 0.85):
        for degrees in ANGLES:
            angle = math.radians(degrees)
            observe = {"w": engine.Final(quantity=engine.AngularVelocity("log"))}
            result = simulate(scene(ratio, roll=angle), time_step=1e-4, steps=1, observe=observe)
            moved = scene(ratio, roll=angle).bodies[0]
            assert isinstance(moved, engine.RigidBody) and moved.inertia is not None
            arm = -float(result["w"][0]) / 1e-4 * moved.inertia[0] / (WATER * GRAVITY * volume(ratio, angle))
            worst = max(worst, abs(arm / lifted_arm(ratio, angle) - 1.0))
    return {"righting_error": worst, "wrong_sides": float(sum(_wrong(simulate, *case) for case in _CASES))}


_CASES = (*((ratio, True) for ratio in UPRIGHT), *((ratio, False) for ratio in TILTED))


def volume(ratio: float, roll: float) -> float:
    """Volume below the surface of the log rolled about its centre at its upright height [m³]."""
    return LENGTH * SIDE * (0.5 * SIDE - SIDE * (0.5 - ratio) / math.cos(roll))


def lifted_arm(ratio: float, roll: float) -> float:
    """GZ of the ratio whose draught along the log's own axis the rolled log has: the surface cuts its centre line at
    H (½ − s)/cos φ above the centre, so it floats as a log of that s."""
    own = 0.5 - (0.5 - ratio) / math.cos(roll)
    return righting_arm(own, roll)


def _wrong(simulate: case.Simulate, ratio: float, stands: bool) -> bool:
    """Whether a log that is nudged falls where it should stand, or stands where it should fall, within 20 s."""
    observe = {"q": engine.Trace(quantity=engine.Orientation("log"))}
    result = simulate(scene(ratio, roll=NUDGE), time_step=TIME_STEP, duration=20.0, observe=observe)
    rolled = 2.0 * float(np.abs(result["q"][:, 1]).max())
    # Standing, the nudge stays as it is but for half a step of its rate; falling, it grows by e⁸ and more.
    return rolled > 1.1 * NUDGE if stands else rolled < 100.0 * NUDGE


def bobs(simulate: case.Simulate, ratio: float, time_step: float) -> bool:
    """Whether a log that is lifted a little never goes a hundred times as far."""
    observe = {"z": engine.MaximumAbsolute(quantity=engine.Position("log"), from_start=True)}
    result = simulate(scene(ratio, raised=LIFTED), time_step=time_step, steps=BOBS, observe=observe)
    return result.completed and float(result["z"][2]) < 100.0 * LIFTED


LONGEST = 2.0 / heave_rate()  # s: h ω = 2
LIGHTEST = 0.25 * GRAVITY * TIME_STEP**2 / SIDE  # density ratio: the same at 1/60 s


def longest(simulate: case.Simulate) -> case.BreakPoint:
    """The longest step in which the log bobs."""
    return break_point(
        lambda time_step: bobs(simulate, RATIO, time_step), 0.4 * LONGEST, 2.0 * LONGEST, resolution=SEARCHED
    )


def lightest(simulate: case.Simulate) -> case.BreakPoint:
    """The lightest log that bobs at 1/60 s."""
    return break_point(
        lambda ratio: bobs(simulate, ratio, TIME_STEP), 6.0 * LIGHTEST, 0.2 * LIGHTEST, resolution=SEARCHED
    )


def moored(stream: float) -> engine.Scene:
    """The log lifted a little on a rail straight up, across a stream [m/s] with drag."""
    rail = engine.Prismatic(name="rail", between=(engine.WORLD, "log"), axis=(0.0, 0.0, 1.0), compliance=0.0)
    sea = engine.Fluid(
        name="sea", density=WATER, level=0.0, velocity=(0.0, stream, 0.0), drag_coefficient=DRAG
    )
    return replace(scene(raised=LIFTED), constraints=(rail,), forces=(sea,))


def heave_growth(time_step: float, stream: float) -> float:
    """Growth of a small heave in a step: largest |eigenvalue| of v₊ = (1 − h c) v − h ω² z, z₊ = z + h v₊."""
    damped = 1.0 - time_step * 0.5 * DRAG * stream / SIDE
    pulled = -time_step * heave_rate() ** 2
    step = np.array(((1.0 + time_step * pulled, time_step * damped), (pulled, damped)))
    return float(np.abs(np.linalg.eigvals(step)).max())


def stream_map(simulate: case.Simulate) -> case.StabilityMap:
    """(time step, stream): what a run does, beside the eigenvalue of its step."""

    def kind(time_step: float, stream: float) -> str:
        observe = {"z": engine.Trace(quantity=engine.Position("log"), from_start=True)}
        result = simulate(moored(stream), time_step=time_step, steps=BOBS, observe=observe)
        return cell(result, result.partial["z"][:, 2] / LIFTED + 1.0, bound=100.0, rest=1e-3)

    return case.StabilityMap(
        x=STEPS,
        y=STREAMS,
        cells=table(STREAMS, STEPS, kind),
        x_label="time step [s]",
        y_label="stream [m/s]",
        prediction=table(STREAMS, STEPS, heave_growth),
        note="Drag is a plain force, too: a stream that damps the heave at short steps drives it at long ones, from "
        f"(h ω)² + h C U/B = 4 on; without a stream that is {told(LONGEST, 3)} s.",
    )


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest distance from z_0 cos ω t in 2 s [m]."""
    observe = {"z": engine.Trace(quantity=engine.Position("log"))}
    result = simulate(scene(raised=PUSHED), time_step=time_step, duration=2.0, method=method, observe=observe)
    z = result["z"][:, 2] - SIDE * (0.5 - RATIO)
    return float(np.abs(z - PUSHED * np.cos(heave_rate() * result.sample_times["z"])).max())


def draw_heave(simulate: case.Simulate) -> case.Drawing:
    """Height above the draught against time."""
    observe = {"z": engine.Trace(quantity=engine.Position("log"))}
    result = simulate(scene(raised=PUSHED), time_step=TIME_STEP, duration=4.0, observe=observe)
    time, z = result.sample_times["z"], result["z"][:, 2] - SIDE * (0.5 - RATIO)
    exact = PUSHED * np.cos(heave_rate() * time)
    return case.Drawing(
        curves=(line("simulation, h = 1/60 s", time, z), line("z₀ cos ω t", time, exact, "reference")),
        x_label="time [s]",
        y_label="height above the draught [m]",
        note=f"The two are at most {told(float(np.abs(z - exact).max()), 2)} m apart.",
    )


def draw_roll(simulate: case.Simulate) -> case.Drawing:
    """How far a nudged log rolls against its density ratio."""
    ratios = [0.1, 0.15, 0.2, 0.2225, 0.3, 0.4, 0.5, 0.6, 0.7, 0.7775, 0.8, 0.85, 0.9]
    rolled = []
    for ratio in ratios:
        observe = {"q": engine.Trace(quantity=engine.Orientation("log"), every=6)}
        q = simulate(scene(ratio, roll=NUDGE), time_step=TIME_STEP, duration=20.0, observe=observe)["q"]
        rolled.append(math.degrees(2.0 * float(np.arcsin(np.minimum(1.0, np.abs(q[:, 1]).max())))))
    turned = sum(angle > 20.0 for angle in rolled)
    return case.Drawing(
        curves=(line("largest roll within 20 s", ratios, rolled),),
        x_label="density of the log over that of the water",
        y_label="largest roll [°]",
        y_scale="log",
        note=f"{turned} of {len(ratios)} logs turn by more than 20°. In theory those between .2113 and .7887 do, whose "
        "metacentre lies below their centre of mass.",
    )


TEST = case.ScalarTest(
    title="Floating box",
    question="Does a log float as deep, bob as fast and stand upright as hydrostatics says?",
    why="Boats, buoys and whatever falls into water are carried by the volume they displace; its size makes them "
    "float, its change makes them bob, and the way its centre moves makes them stand or capsize.",
    model="A log of 4 × 1 × 1 m floats in water: at rest; raised by 5 cm and let go; rolled by up to 10° for one step; "
    "nudged by 1e-4 rad at five densities. No water moves along with it (no added mass): a real log bobs and rolls "
    "more slowly than this.",
    parameters=(
        ("time step", "1/60 s"),
        ("log", "4 × 1 × 1 m, density ratio 0.15 (heave), 0.15 to 0.85 (roll)"),
        ("water", "1000 kg/m³, still, without drag"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "Draught = density ratio s times height.",
        "Heave: ω² = ρ g A/m = g/(s H). One step of the method: z_n = z₀ cos((n + ½) θ)/cos(θ/2) with sin(θ/2) = h ω/2.",
        "Roll: righting arm GZ = sin φ (GM + ½ BM tan² φ), GM = s H/2 + B²/(12 s H) − H/2, BM = B²/(12 s H).",
        "GM < 0 between s = ½ − √(1/12) = .2113 and ½ + √(1/12) = .7887: there a square log does not stand.",
        "Buoyancy and drag are plain forces: no step carries h ω > 2, which at 1/60 s is foam of g h²/(4 H) the density of water; "
        "across a stream U with drag C the heave is damped by c = C U/(2 B) and bounded while (h ω)² + 2 h c < 4.",
    ),
    reference="Hydrostatics in closed form, wall-sided formula; closed form of the discrete step.",
    conclusion="Green: the submerged volume, its centre and the forces from them are right. Red: one of them is not, "
    "or gravity and the fluid do not agree about which way is up.",
    source="ours; buoyancy is asked for in the thesis, section 5.4",
    measurements=(
        case.Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="period_error",
                    description="period of the heave over 2π √(s H/g), minus one",
                    unit="1",
                    role="gate",
                    limit=1e-3,
                    limit_source="(h ω)²/24 = 7.6e-4, by which the discrete period is too short, and the crossings' "
                    "straight lines; an added mass of 0.2 % would show",
                    reference=0.0,
                    relative_tolerance=1e-6,
                ),
                case.Metric(
                    name="heave_error",
                    description="largest distance from the discrete solution in 10 s",
                    unit="m",
                    role="companion",
                    limit=1e-11,
                    limit_source="exact in the discrete step; the rounding of 600 steps of a volume of cubic metres",
                    reference=0.0,
                    tolerance=1e-13,
                ),
                case.Metric(
                    name="draught_error",
                    description="largest departure from the draught in 10 s at rest",
                    unit="m",
                    role="companion",
                    limit=1e-12,
                    limit_source="nothing but rounding moves a log at its draught",
                    reference=0.0,
                    tolerance=1e-14,
                ),
            ),
            measure=heave,
            note="heave and rest",
        ),
        case.Measurement(
            configuration="roll",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="righting_error",
                    description="largest relative error of the righting arm at 2, 5 and 10°, three densities",
                    unit="1",
                    role="gate",
                    limit=1e-9,
                    limit_source="exact while only the sides meet the surface; rounding of a small difference of "
                    "large moments remains",
                    reference=0.0,
                    tolerance=1e-11,
                ),
                case.Metric(
                    name="wrong_sides",
                    description="densities at which a nudged log stands and should fall, or falls and should stand",
                    unit="1",
                    role="companion",
                    better="inside",
                    limit=(0.0, 0.0),
                    limit_source="the metacentre: ½ ± √(1/12), with 0.0112 to either side",
                    reference=0.0,
                ),
            ),
            measure=roll,
            note="one step rolled, and 20 s nudged",
        ),
    ),
    example=lambda: case.Example(scene=scene(0.5, roll=0.02), time_step=TIME_STEP),
    figures=(
        case.Figure(name="heave", title="Heave", draw=draw_heave),
        case.Figure(name="roll", title="Roll against density", draw=draw_roll),
    ),
    stability=(
        case.StabilityStudy(
            name="longest-step",
            title="Longest time step in which the log bobs",
            configuration="plain",
            definition="lifted by 1e-7 m it never goes a hundred times as far in 60 steps",
            study=longest,
            unit="s",
            expected=((1.0 - 1.1 * SEARCHED) * LONGEST, LONGEST),
            expected_source="h ω = 2: at rest z_n turns into (2 n + 1) z₀ there, before it into no more than z₀/√(1 − (h ω/2)²); "
            "the search ends 0.2 % short of it at most",
        ),
        case.StabilityStudy(
            name="lightest",
            title="Lightest log, over the water, that bobs at 1/60 s",
            configuration="plain",
            definition="lifted by 1e-7 m it never goes a hundred times as far in 60 steps",
            study=lightest,
            unit="1",
            better="smaller",
            expected=(LIGHTEST, (1.0 + 1.1 * SEARCHED) * LIGHTEST),
            expected_source="h ω = 2 of the heave, ω² = g/(s H): s = g h²/(4 H); the search ends 0.2 % short of it at most",
        ),
        case.StabilityStudy(
            name="stream",
            title="Heave of a log moored across a stream",
            configuration="plain",
            definition="lifted by 1e-7 m, 60 steps: settled within a thousandth of that; growing beyond a hundred times, or "
            "twice as large in the last third as in the middle",
            study=stream_map,
        ),
    ),
    ladders=(
        case.Ladder(
            name="heave",
            description="largest distance from z₀ cos ω t in 2 s",
            unit="m",
            time_steps=tuple(1.0 / n for n in (30, 60, 120, 240, 480, 960)),
            configurations=configured({"plain": 1.0, "half-step": 2.0}, (1 / 960, 1 / 240)),
            error=ladder_error,
            target_error=5e-3,
            target_seconds=0.01,
        ),
    ),
)
