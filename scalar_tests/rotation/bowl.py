"""Does a ball in a bowl roll back and forth with the period of mechanics, over the facets that a mesh makes of it?"""

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
from ..sweep import line, told

GRAVITY = 9.81  # m/s²
BOWL, BALL, MASS = 1.0, 0.1, 1.0  # m, m, kg: radii of bowl and ball
REACH, FACETS = 0.15, 31  # rad: half of the bowl's arc; how many facets it has
START = 0.1  # rad
FRICTION = 1.0
TIME_STEP = 1.0 / 1920.0  # s
DURATION = 2.0  # s
PACE = math.sqrt(5.0 * GRAVITY / (7.0 * (BOWL - BALL)))  # rad/s, of small swings
FALL = 5.0 / 7.0 * GRAVITY  # m/s² per radian of slope, of a ball that rolls


def facet(count: int) -> tuple[float, float]:
    """The angle of a facet [rad], and where on the arc the ball starts: on the middle of one, level on its slope."""
    width = 2.0 * REACH / count
    return width, (round((START + REACH) / width - 0.5) + 0.5) * width - REACH


@functools.cache
def scene(count: int = FACETS, friction: float = FRICTION, push: float = 0.0) -> engine.Scene:
    """A trough whose cross-section is an arc of chords, and a ball on one of them, at rest or rolling up it by `push` [m/s]."""
    width, angle = facet(count)
    arc = [
        (BOWL * math.sin(k * width - REACH), BOWL * (1.0 - math.cos(k * width - REACH)))
        for k in range(count + 1)
    ]
    corners = tuple((x, y, z) for y in (-1.0, 1.0) for x, z in arc)
    back = count + 1
    faces = tuple(
        face for k in range(count) for face in ((k, k + 1, back + k + 1), (k, back + k + 1, back + k))
    )
    rough = engine.Material(friction=friction)
    path = BOWL * math.cos(0.5 * width) - BALL  # m, from the bowl's axis to the way of the ball's centre
    bowl = engine.RigidBody(
        name="bowl",
        motion="static",
        shape=engine.TriangleMesh(corners, faces),
        position=(0.0, 0.0, 0.0),
        material=rough,
    )
    ball = engine.RigidBody(
        name="ball",
        mass=MASS,
        shape=engine.Sphere(BALL),
        position=(path * math.sin(angle), 0.0, BOWL - path * math.cos(angle)),
        velocity=(push * math.cos(angle), 0.0, push * math.sin(angle)),
        angular_velocity=(0.0, push / BALL, 0.0),
        material=rough,
    )
    return engine.Scene(bodies=(bowl, ball), gravity=(0.0, 0.0, -GRAVITY))


LEAST = (
    2.0 / 7.0 * math.tan(facet(FACETS)[1])
)  # µ of the first facet: 2/7 of the slope's pull spin the ball up


def rolls(simulate: case.Simulate, friction: float) -> bool:
    """Whether the ball rolls down half of its first facet without slip."""
    observe: dict[str, Observable] = {
        "v": engine.Final(quantity=engine.Velocity("ball")),
        "w": engine.Final(quantity=engine.AngularVelocity("ball")),
    }
    result = simulate(scene(friction=friction), time_step=TIME_STEP, steps=100, observe=observe)
    if not result.completed:
        return False
    slip = np.linalg.norm(result["v"]) - BALL * np.linalg.norm(result["w"])
    return bool(abs(float(slip)) < 1e-6)


def slippery(simulate: case.Simulate) -> case.BreakPoint:
    """The least friction on which the ball rolls."""
    return break_point(functools.partial(rolls, simulate), 4.0 * LEAST, 0.3 * LEAST, resolution=1e-3)


def hardest_push() -> float:
    """The speed [m/s] of the start that ends on the bowl's rim: back from there, facet by facet, 2 · 5/7 g sin α of its way
    more of v², and at each corner what that takes. The last facet goes on to the rim itself."""
    width, start = facet(FACETS)
    half, keeps = (BOWL * math.cos(0.5 * width) - BALL) * math.tan(0.5 * width), (math.cos(width) + 0.4) / 1.4
    angle, way, square = REACH - 0.5 * width, half + BOWL * math.sin(0.5 * width), 0.0
    while angle > start + 0.5 * width:
        square = (square + 2.0 * FALL * math.sin(angle) * way) / keeps**2
        angle, way = angle - width, 2.0 * half
    return math.sqrt(square + 2.0 * FALL * math.sin(angle) * half)


PUSH, PUSH_STEP = hardest_push(), 1.0 / 480.0  # m/s, s
# Each corner up there is met a step early or late, and a rise in steps is short by up to a step's fall.
CORNERED = FALL * (REACH - START) * PUSH_STEP  # m/s


def hardest(simulate: case.Simulate) -> case.BreakPoint:
    """The hardest push that leaves the ball in the bowl."""
    width, _ = facet(FACETS)
    rim = BOWL * math.sin(REACH) - BALL * math.sin(REACH - 0.5 * width)

    def stays(push: float) -> bool:
        observe = {"x": engine.Maximum(quantity=engine.Position("ball"))}
        result = simulate(scene(push=push), time_step=PUSH_STEP, duration=0.4, observe=observe)
        return result.completed and float(result["x"][0]) < rim

    return break_point(stays, 0.5 * PUSH, 1.7 * PUSH, resolution=2e-3, walk=4)


def rolled(times: np.ndarray, count: int = FACETS) -> np.ndarray:
    """Where the ball is [m] along x: from corner to corner in closed form.

    On a facet it rolls with 5/7 g sin α. At a corner it meets the next one: its angular momentum about the point where
    it does stays, m v r cos Δ + I v/r = (m r + I/r) v', so v' = v (cos Δ + 2/5)/(7/5).
    """
    width, angle = facet(count)
    path = BOWL * math.cos(0.5 * width) - BALL
    half = path * math.tan(0.5 * width)
    keeps = (math.cos(width) + 0.4) / 1.4
    place = speed = time = 0.0  # along the facet from its middle
    found: list[float] = []
    while len(found) < len(times):
        pull = -FALL * math.sin(angle)
        left, side = _to_corner(place, speed, pull, half)
        while len(found) < len(times) and times[len(found)] <= time + left:
            t = times[len(found)] - time
            s = place + speed * t + 0.5 * pull * t * t
            found.append(path * math.sin(angle) + s * math.cos(angle))
        time += left
        speed = (speed + pull * left) * keeps
        place, angle = -side * half, angle + side * width
    return np.array(found)


def _to_corner(place: float, speed: float, pull: float, half: float) -> tuple[float, float]:
    """When [s] the ball leaves its facet, and on which side; at once and anew if it turns round just there."""
    best, side = math.inf, 1.0
    for end in (-1.0, 1.0):
        gap = place - end * half
        if abs(pull) * half < 1e-12 * GRAVITY * half:
            times = [-gap / speed] if speed else []
        else:
            under = speed * speed - 2.0 * pull * gap
            root = math.sqrt(max(under, 0.0))
            times = [(-speed - root) / pull, (-speed + root) / pull] if under >= 0.0 else []
        for t in times:
            if 1e-12 < t < best and (speed + pull * t) * end > 0.0:
                best, side = t, end
    return best, side


def half_period(times: np.ndarray, x: np.ndarray) -> float:
    """Time [s] between the first two passages through the middle; NaN if it does not come back."""
    passed = [k for k in range(1, len(x)) if x[k - 1] * x[k] < 0.0][:2]
    if len(passed) < 2:
        return math.nan
    first, second = (times[k - 1] + (times[k] - times[k - 1]) * x[k - 1] / (x[k - 1] - x[k]) for k in passed)
    return float(second - first)


def measure(simulate: case.Simulate) -> dict[str, float]:
    """A swing to the other side and back."""
    observe: dict[str, Observable] = {
        "x": engine.Trace(quantity=engine.Position("ball")),
        "v": engine.Trace(quantity=engine.Velocity("ball")),
        "w": engine.Trace(quantity=engine.AngularVelocity("ball")),
    }
    result = simulate(scene(), time_step=TIME_STEP, duration=DURATION, observe=observe)
    times, x = result.sample_times["x"], result["x"][:, 0]
    exact = rolled(times)
    found = half_period(times, x)
    slip = np.linalg.norm(result["v"], axis=1) - BALL * np.linalg.norm(result["w"], axis=1)
    return {
        "period_error": found / half_period(times, exact) - 1.0,
        "smooth_error": found * PACE / math.pi - 1.0,
        "place_error": float(np.abs(x - exact).max()) / float(exact[0]),
        "slip": float(np.abs(slip).max()),
    }


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest distance [m] to where it should be in two seconds."""
    observe = {"x": engine.Trace(quantity=engine.Position("ball"))}
    result = simulate(scene(), time_step=time_step, duration=DURATION, method=method, observe=observe)
    return float(np.abs(result["x"][:, 0] - rolled(result.sample_times["x"])).max())


def draw(simulate: case.Simulate) -> case.Drawing:
    """Place of the ball, over five and over thirty-one facets."""
    curves, lasts = [], []
    for count in (5, FACETS):
        observe = {"x": engine.Trace(quantity=engine.Position("ball"), every=32)}
        result = simulate(scene(count), time_step=TIME_STEP, duration=2.0 * DURATION, observe=observe)
        times = result.sample_times["x"]
        curves.append(line(f"{count} facets", times, 1000.0 * result["x"][:, 0], "points"))
        lasts.append(1000.0 * float(np.abs(result["x"][len(times) // 2 :, 0]).max()))
        curves.append(
            line(
                f"{count} facets, corner by corner",
                times,
                1000.0 * rolled(np.asarray(times), count),
                "reference",
            )
        )
    return case.Drawing(
        curves=tuple(curves),
        x_label="time [s]",
        y_label="place [mm]",
        note=f"The highest of the second half: {told(lasts[0], 3)} mm over five facets, {told(lasts[1], 3)} mm over {FACETS}.",
    )


# A corner that is met a step early or late leaves FALL × Δ × h of speed. At the worst all corners of a swing, START/Δ up
# and as many down, err to one side.
LATE = 2.0 * FALL * START * TIME_STEP  # m/s
SWING = LATE / (2.0 * START * (BOWL - BALL) * PACE * 2.0 / math.pi)
PLACE = (
    LATE * 2.0 * DURATION * PACE / math.pi * 0.5 * DURATION + 0.5 * TIME_STEP * PACE * START * BOWL
) / START
CORNERS = "a corner that is met a step early or late leaves 5/7 g Δ h of speed, Δ its angle; the bound has all of them on one side"

TEST = case.ScalarTest(
    title="Ball in a bowl",
    question="Does a ball in a bowl roll back and forth with the period of mechanics?",
    why="Rolling in a hollow joins contact, friction and inertia, and the hollow is a mesh: at each of its inner edges the "
    "ball meets the next facet, loses a little and must neither jump nor stick.",
    model="A ball starts at rest in a trough whose cross-section is an arc of 31 chords, and rolls over fourteen edges to the "
    "other side and back.",
    parameters=(
        ("time step", "1/1920 s: a facet is crossed in sixty or more"),
        ("bowl", "radius 1 m, facets of 0.0097 rad"),
        ("ball", "radius 0.1 m"),
        ("start", "at rest, 0.097 rad from the middle"),
        ("friction", "µ = 1; 0.03 is needed"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "Round: 7/5 m s'' = −m g s/(R − r), so T = 2π √(7 (R − r)/(5 g)).",
        "On a facet: s'' = 5/7 g times the sine of its slope.",
        "At a corner of Δ: angular momentum about the new point of contact stays, v' = v (cos Δ + 2/5)/(7/5).",
    ),
    reference="The motion corner by corner in closed form; small swings in a round bowl.",
    conclusion="Green: a mesh's inner edges are met as mechanics says. Red: the ball slips, jumps at edges or sticks there.",
    source="ours; the period is a classic of textbooks",
    measurements=(
        ask(
            measure,
            (
                error("period_error", "relative error of half a period", "1", SWING, CORNERS),
                error(
                    "smooth_error",
                    "relative error of half a period against the round bowl's",
                    "1",
                    SWING + 1.2e-3,
                    "the same, and 1.2e-3 that 31 facets take: the reference over those of the round bowl",
                    "companion",
                ),
                error(
                    "place_error",
                    "largest error of its place over the swing's half width",
                    "1",
                    PLACE,
                    CORNERS,
                    "companion",
                ),
                error(
                    "slip",
                    "largest difference of the centre's speed and r w",
                    "m/s",
                    START * (BOWL - BALL) * PACE * (2.0 * REACH / FACETS) ** 2,
                    "it rolls on facets; where it meets the next one the two differ by v (1 − cos Δ), twice at most, for a step",
                    "companion",
                ),
            ),
            "31 facets",
            TIME_STEP,
        ),
    ),
    example=lambda: case.Example(scene=scene(), time_step=TIME_STEP, duration=4.0),
    figures=(case.Figure(name="swing", title="A ball in a bowl", draw=draw),),
    stability=(
        case.StabilityStudy(
            name="least-friction",
            title="Least friction on which the ball rolls down its first facet",
            configuration="plain",
            definition="after 100 steps the centre goes as fast as it rolls",
            study=slippery,
            unit="1",
            better="smaller",
            expected=(0.999 * LEAST, 1.002 * LEAST),
            expected_source="2/7 of the pull along the slope spins the ball up: µ = 2/7 tan α = 0.0277, to the resolution of the "
            "search",
        ),
        case.StabilityStudy(
            name="hardest-push",
            title="Hardest push that leaves the ball in the bowl",
            configuration="plain",
            definition="pushed up from where it starts it does not come beyond the rim in 0.4 s, in steps of 1/480 s",
            study=hardest,
            unit="m/s",
            expected=(PUSH - CORNERED - 0.002 * PUSH, PUSH + CORNERED + FALL * REACH * PUSH_STEP),
            expected_source="7/10 v² is the rise to the rim and what corners take: 0.2889 m/s; corners are met up to a step early or late, "
            "a rise in steps is short by up to a step's fall, and the search has 0.2 %",
        ),
    ),
    ladders=(
        case.Ladder(
            name="place",
            description="largest error of the place in two seconds",
            unit="m",
            time_steps=tuple(1.0 / n for n in (120, 240, 480, 960, 1920)),
            configurations=configured({"plain": 1.0, "half-step": 1.0}, (1 / 1920, 1 / 240)),
            error=ladder_error,
            target_error=1e-2,
            target_seconds=0.05,
        ),
    ),
)
