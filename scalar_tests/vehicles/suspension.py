"""Does a vehicle on its springs bounce and pitch at the frequencies of mechanics?"""

from __future__ import annotations

import functools
import math

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable

from .. import case
from ..bracket import break_point
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import apart, line, told
from ..swing import phase

GRAVITY = 9.81  # m/s²
MASS, PITCHING = 1000.0, 1500.0  # kg, kg m² about y
FRONT, REAR, TRACK = 1.2, 1.5, 1.5  # m: axles before and behind the centre; between left and right
FRONT_SPRING = 25_000.0  # N/m, each of two
REAR_SPRING = FRONT_SPRING * FRONT / REAR  # then bouncing does not pitch
LENGTH = 0.6  # m, of the springs under load
BOUNCE = math.sqrt(2.0 * (FRONT_SPRING + REAR_SPRING) / MASS)  # rad/s
PITCH = math.sqrt(2.0 * (FRONT_SPRING * FRONT**2 + REAR_SPRING * REAR**2) / PITCHING)
ROLLING = 400.0  # kg m², about the direction it drives in
ROLL = math.sqrt(
    2.0 * (FRONT_SPRING + REAR_SPRING) * (0.5 * TRACK) ** 2 / ROLLING
)  # the fastest of the three
HEAVE, TILT = 0.01, 1e-3  # m, rad: how far it is let go from rest
NUDGE = 1e-7  # m, rad: of the study
TIME_STEP = 1.0 / 60.0  # s
DURATION = 2.0  # s
CORNERS = {
    "front left": (FRONT, 1.0, FRONT_SPRING),
    "front right": (FRONT, -1.0, FRONT_SPRING),
    "rear left": (-REAR, 1.0, REAR_SPRING),
    "rear right": (-REAR, -1.0, REAR_SPRING),
}


def scene(heave: float = 0.0, tilt: float = 0.0, lean: float = 0.0, weight: float = 1.0) -> engine.Scene:
    """A chassis on four upright springs at the height of its centre, let go `heave` [m] too high and turned by `tilt` about
    its axles' direction or by `lean` along it; of so many times its mass."""
    chassis = engine.RigidBody(
        name="chassis",
        mass=weight * MASS,
        inertia=(weight * ROLLING, weight * PITCHING, weight * 1700.0),
        shape=engine.Box((3.6, 1.2, 0.5)),
        position=(0.0, 0.0, LENGTH + heave),
        orientation=_turned(tilt, lean),
    )
    springs = []
    for name, (x, side, stiffness) in CORNERS.items():
        carried = 0.5 * weight * MASS * GRAVITY * (REAR if x > 0.0 else FRONT) / (FRONT + REAR)  # N
        springs.append(
            engine.Spring(
                name=name,
                between=((x, 0.5 * side * TRACK, 0.0), "chassis"),
                anchors=((0.0, 0.0, 0.0), (x, 0.5 * side * TRACK, 0.0)),
                stiffness=stiffness,
                rest_length=LENGTH + carried / stiffness,
            )
        )
    return engine.Scene(
        bodies=(chassis,), forces=tuple(springs), gravity=(0.0, 0.0, -GRAVITY), contacts=False
    )


def _turned(tilt: float, lean: float) -> tuple[float, float, float, float]:
    angle = math.hypot(tilt, lean)
    share = math.sin(0.5 * angle) / angle if angle > 0.0 else 0.0
    return (math.cos(0.5 * angle), share * lean, share * tilt, 0.0)


def bounded(simulate: case.Simulate, time_step: float, weight: float = 1.0) -> bool:
    """Whether a nudge in bounce, pitch and roll stays small for 30 steps; struts that carry a load fall over sideways, but
    not so soon."""
    observe: dict[str, Observable] = {
        "x": engine.Trace(quantity=engine.Position("chassis")),
        "q": engine.Trace(quantity=engine.Orientation("chassis")),
    }
    result = simulate(scene(NUDGE, NUDGE, NUDGE, weight), time_step=time_step, steps=30, observe=observe)
    if not result.completed:
        return False
    swings = (result["x"][:, 2] - LENGTH, 2.0 * result["q"][:, 1], 2.0 * result["q"][:, 2])
    return max(float(np.abs(one).max()) for one in swings) < 100.0 * NUDGE


def longest(simulate: case.Simulate) -> case.BreakPoint:
    """The longest step that carries the springs."""
    fastest = 2.0 / ROLL
    return break_point(functools.partial(bounded, simulate), 0.4 * fastest, 2.0 * fastest, resolution=0.002)


LIGHTEST = (0.5 * TIME_STEP * ROLL) ** 2  # of its mass: h ω = 2 of the roll


def lightest(simulate: case.Simulate) -> case.BreakPoint:
    """The least part of its mass with which the chassis rests on its springs."""
    return break_point(
        functools.partial(bounded, simulate, TIME_STEP), 1.0, 0.25 * LIGHTEST, resolution=2e-3, walk=6
    )


def swings(
    simulate: case.Simulate, time_step: float, method: engine.Method = engine.PLAIN
) -> dict[str, float]:
    """Frequencies [rad/s] of bounce and pitch."""
    observe: dict[str, Observable] = {
        "x": engine.Trace(quantity=engine.Position("chassis")),
        "q": engine.Trace(quantity=engine.Orientation("chassis")),
    }
    up = simulate(scene(heave=HEAVE), time_step=time_step, duration=DURATION, method=method, observe=observe)
    turn = simulate(scene(tilt=TILT), time_step=time_step, duration=DURATION, method=method, observe=observe)
    return {
        "bounce": phase(up["x"][:, 2] - LENGTH) / time_step,
        "pitch": phase(2.0 * turn["q"][:, 2]) / time_step,
    }


def discrete(frequency: float, time_step: float) -> float:
    """What the symplectic step makes of a spring's frequency [rad/s]: cos(φ) = 1 − (h ω)²/2."""
    return math.acos(1.0 - 0.5 * (time_step * frequency) ** 2) / time_step


def measure(simulate: case.Simulate) -> dict[str, float]:
    """Frequencies, and whether what is let go at rest stays there."""
    found = swings(simulate, TIME_STEP)
    observe: dict[str, Observable] = {
        "x": engine.MaximumAbsolute(quantity=engine.Position("chassis"), from_start=True),
        "q": engine.Final(quantity=engine.Orientation("chassis")),
    }
    rest = simulate(scene(), time_step=TIME_STEP, duration=DURATION, observe=observe)
    both = simulate(scene(heave=HEAVE), time_step=TIME_STEP, duration=DURATION, observe=observe)
    return {
        "bounce_error": found["bounce"] / discrete(BOUNCE, TIME_STEP) - 1.0,
        "pitch_error": found["pitch"] / discrete(PITCH, TIME_STEP) - 1.0,
        "continuous_error": found["bounce"] / BOUNCE - 1.0,
        "sunk": float(np.abs(rest["x"]).max()),
        "coupled": float(np.abs(both["q"][1:]).max()),
    }


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Relative error of the bounce against √(Σk/m)."""
    return swings(simulate, time_step, method)["bounce"] / BOUNCE - 1.0


def draw(simulate: case.Simulate) -> case.Drawing:
    """Height and nose of the chassis, let go from rest."""
    observe: dict[str, Observable] = {
        "x": engine.Trace(quantity=engine.Position("chassis")),
        "q": engine.Trace(quantity=engine.Orientation("chassis")),
    }
    result = simulate(scene(HEAVE, 5.0 * TILT), time_step=TIME_STEP, duration=DURATION, observe=observe)
    time = result.sample_times["x"]
    smooth = np.linspace(0.0, DURATION, 201)
    return case.Drawing(
        curves=(
            line("bounce [cm]", time, 100.0 * (result["x"][:, 2] - LENGTH), "points"),
            line("√(Σk/m)", smooth, 100.0 * HEAVE * np.cos(BOUNCE * smooth), "reference"),
            line("pitch [mrad]", time, 2000.0 * result["q"][:, 2] / 5.0, "points"),
            line("√(Σk x²/I)", smooth, np.cos(PITCH * smooth), "reference"),
        ),
        x_label="time [s]",
        y_label="cm, and fifths of mrad",
        note=f"At most {apart(result['x'][:, 2] - LENGTH, HEAVE * np.cos(BOUNCE * time))} m from a bounce at "
        f"{told(BOUNCE / (2.0 * math.pi), 3)} Hz.",
    )


SLOW = (TIME_STEP * BOUNCE) ** 2 / 24.0
TEST = case.ScalarTest(
    title="Suspension",
    question="Does a vehicle on its springs bounce and pitch at the frequencies of mechanics?",
    why="Ride comfort is these two frequencies. They come out wrong when springs pull at a body's centre instead of at its "
    "corners, or when their turning moment is lost.",
    model="A rigid chassis on four upright springs that hold it at its corners, at the height of its centre, lifted or turned "
    "a little and let go.",
    parameters=(
        ("time step", "1/60 s"),
        ("chassis", "1000 kg, 1500 kg m² about its axles' direction"),
        ("axles", "1.2 m before and 1.5 m behind the centre"),
        ("springs", "25 kN/m in front, 20 kN/m behind, each of two"),
        ("let go", "1 cm too high, or turned by 1 mrad"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "With k_f a = k_r b it bounces without pitching: ω² = Σk/m, and pitches at ω² = Σk x²/I.",
        "Loaded springs at the height of the centre add nothing to first order: their ends move along them.",
        "No step carries h ω > 2, and roll is the fastest: ω² = Σk y²/I.",
        "Springs as plain forces: cos(φ) = 1 − (h ω)²/2 a step, so ω is too high by (h ω)²/24.",
    ),
    reference="Closed forms, continuous and of the discrete method.",
    conclusion="Green: springs hold bodies where they are tied to them. Red: their moments are lost or their forces are.",
    source="ours; vehicles are asked for in the thesis, section 5.4",
    measurements=(
        ask(
            measure,
            (
                error(
                    "bounce_error",
                    "relative error of the bounce against the discrete method's",
                    "1",
                    1e-9,
                    "upright springs are linear in the height: rounding remains",
                ),
                error(
                    "pitch_error",
                    "relative error of the pitch against the discrete method's",
                    "1",
                    0.3 * TILT**2,
                    "a spring's end goes along a circle: 0.285 tilt² slower, by an integration of the plane",
                ),
                error(
                    "continuous_error",
                    "relative error of the bounce against √(Σk/m)",
                    "1",
                    1.01 * SLOW,
                    f"(h ω)²/24 = {told(SLOW)}, and (h ω)⁴/600 more",
                    "companion",
                ),
                error("sunk", "how far it moves when let go at rest", "m", 1e-11, role="companion"),
                error(
                    "coupled",
                    "largest part of its turn after it was lifted",
                    "1",
                    1e-11,
                    "k_f a = k_r b",
                    "companion",
                ),
            ),
            "bounce and pitch",
            TIME_STEP,
        ),
    ),
    example=lambda: case.Example(scene=scene(0.1, 0.05), time_step=TIME_STEP, duration=DURATION),
    figures=(case.Figure(name="swings", title="Bounce and pitch", draw=draw),),
    stability=(
        case.StabilityStudy(
            name="longest-step",
            title="Longest time step that carries the springs",
            configuration="plain",
            definition="nudged by 1e-7 m and rad in bounce, pitch and roll none of them grows a hundredfold in 30 steps",
            study=longest,
            unit="s",
            expected=(0.995 * 2.0 / ROLL, 1.005 * 2.0 / ROLL),
            expected_source="springs are plain forces: h ω = 2 of the fastest swing, the roll at √(Σk y²/I); 0.5 % more grow "
            "four hundredfold in 30 steps",
        ),
        case.StabilityStudy(
            name="lightest",
            title="Least part of its mass with which the chassis rests on its springs at 1/60 s",
            configuration="plain",
            definition="let go 1e-7 m and rad in bounce, pitch and roll none of them grows a hundredfold in 30 steps",
            study=lightest,
            unit="1",
            better="smaller",
            expected=(0.99 * LIGHTEST, 1.01 * LIGHTEST),
            expected_source="h ω = 2 of the roll, ω² as 1 over the mass; 1 % less grows four hundredfold in 30 steps",
        ),
    ),
    ladders=(
        case.Ladder(
            name="bounce",
            description="relative error of the bounce's frequency against √(Σk/m)",
            unit="1",
            time_steps=tuple(1.0 / n for n in (15, 30, 60, 120, 240)),
            configurations=configured({"plain": 2.0, "order4": 4.0}),
            error=ladder_error,
            target_error=1e-3,
            target_seconds=0.01,
        ),
    ),
)
