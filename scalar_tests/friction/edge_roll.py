"""Does a ball leave the edge of a table where its contact force ends?"""

from __future__ import annotations

import math

from spook_tracker import engine
from spook_tracker.engine.bodies import Material

from .. import case
from ..bracket import break_point
from ..closed_form import ask, error
from ..sweep import apart, line

TIME_STEP = 2.5e-4  # s
RADIUS = 0.1  # m
MASS = 1.0  # kg
GRAVITY = 9.81  # m/s²
RUN_UP = 0.123  # m
SLOW, FAST = 0.3, 1.2  # m/s; the centre leaves in a straight line above √(g r) = 0.99
ROUGH = 50.0  # coefficient of friction: no slip until the force has all but ended
DURATION = 0.9  # s
PUSHED = 0.01  # of the level speed
KEPT, COARSE = 0.8, 1e-3  # of a rolling ball's spin in flight; s
# µ at which a ball of SLOW flies off with KEPT of that spin, less and more g COARSE/r: its equations of motion, integrated
# in tests/scalar_tests/test_contact_breaks.py
SMOOTHEST = (0.2157, 0.2532)


def scene(speed: float, rolling: bool, rough: float = ROUGH) -> engine.Scene:
    """A ball near the edge of a table, rolling on a `rough` one or sliding on a smooth one."""
    surface = Material(friction=rough if rolling else 0.0)
    table = engine.RigidBody(
        name="table",
        motion="static",
        shape=engine.Box((1.0, 1.0, 1.0)),
        position=(-0.5, 0.0, -0.5),
        material=surface,
    )
    ball = engine.RigidBody(
        name="ball",
        mass=MASS,
        shape=engine.Sphere(RADIUS),
        position=(-RUN_UP, 0.0, RADIUS),
        velocity=(speed, 0.0, 0.0),
        angular_velocity=(0.0, speed / RADIUS if rolling else 0.0, 0.0),
        material=surface,
    )
    return engine.Scene(bodies=(table, ball), gravity=(0.0, 0.0, -GRAVITY))


def departure(speed: float, rolling: bool) -> tuple[float, float]:
    """Angle [rad] from the vertical at which the edge lets go, and the speed of the centre there [m/s]."""
    part = 1.0 / (1.4 if rolling else 1.0)  # of the potential energy that goes into the centre's motion
    cosine = min(1.0, (2.0 * part + speed**2 / (GRAVITY * RADIUS)) / (1.0 + 2.0 * part))
    return math.acos(cosine), math.sqrt(speed**2 + 2.0 * part * GRAVITY * RADIUS * (1.0 - cosine))


def last_hop(speed: float, rolling: bool, time_step: float = TIME_STEP) -> float:
    """How long before the departure the discrete ball touches last [s].

    Each step goes straight on and leaves the edge by up to v²/r h of normal speed. The force N = m k t that is
    left at t before the departure brings the ball back after 2 v²/r h/(k t): as long as t itself for
    t = √(2 h v²/(r k)).
    """
    angle, leaving = departure(speed, rolling)
    inward = leaving**2 / RADIUS  # m/s²
    along = GRAVITY * math.sin(angle) * (5.0 / 7.0 if rolling else 1.0)
    rate = 2.0 * leaving * along / RADIUS + GRAVITY * math.sin(angle) * leaving / RADIUS  # m/s³
    return math.sqrt(2.0 * time_step * inward / rate)


def errors(
    simulate: case.Simulate, speed: float, rolling: bool, time_step: float = TIME_STEP
) -> tuple[float, float]:
    """Errors of the level speed [m/s] and of the spin [rad/s] in flight, which nothing changes any more."""
    observe = {
        "v": engine.Final(quantity=engine.Velocity("ball")),
        "w": engine.Final(quantity=engine.AngularVelocity("ball")),
    }
    result = simulate(scene(speed, rolling), time_step=time_step, duration=DURATION, observe=observe)
    angle, leaving = departure(speed, rolling)
    spin = leaving / RADIUS if rolling else 0.0
    return float(result["v"][0]) - leaving * math.cos(angle), float(result["w"][1]) - spin


def _measure(simulate: case.Simulate) -> dict[str, float]:
    sliding, _ = errors(simulate, SLOW, False)
    _, rolling = errors(simulate, SLOW, True)
    fast = [errors(simulate, FAST, rolling) for rolling in (False, True)]
    return {
        "sliding_error": sliding,
        "rolling_spin_error": rolling,
        "fast_speed_error": max((abs(speed) for speed, _ in fast)),
        "fast_spin_error": max((abs(spin) for _, spin in fast)),
    }


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Error of its level speed in flight [m/s]."""
    observe = {"v": engine.Final(quantity=engine.Velocity("ball"))}
    result = simulate(
        scene(SLOW, False), time_step=time_step, duration=DURATION, method=method, observe=observe
    )
    angle, leaving = departure(SLOW, False)
    return abs(float(result["v"][0]) - leaving * math.cos(angle))


def gain(speed: float) -> float:
    """What the edge adds to the level speed of a smooth ball, over that speed (closed form)."""
    angle, leaving = departure(speed, False)
    return leaving * math.cos(angle) / speed - 1.0


def fastest_pushed(simulate: case.Simulate) -> case.BreakPoint:
    """Highest speed [m/s] at which the edge pushes a smooth ball on by PUSHED of its level speed."""

    def is_pushed(speed: float) -> bool:
        observe = {"v": engine.Final(quantity=engine.Velocity("ball"))}
        result = simulate(scene(speed, False), time_step=TIME_STEP, duration=DURATION, observe=observe)
        return float(result["v"][0]) > speed * (1.0 + PUSHED)

    return break_point(is_pushed, SLOW, FAST, resolution=0.005, walk=6)


def expected_pushed() -> tuple[float, float]:
    """Where the closed form gains PUSHED [m/s]; a last hop may move the level speed by g h, and the search has a step."""
    bounds = []
    for shift in (1.0, -1.0):
        low, high = SLOW, math.sqrt(GRAVITY * RADIUS)
        for _ in range(60):
            middle = 0.5 * (low + high)
            wanted = PUSHED + shift * GRAVITY * TIME_STEP / middle
            low, high = (middle, high) if gain(middle) > wanted else (low, middle)
        bounds.append(low * (0.995 if shift > 0.0 else 1.005))
    return bounds[0], bounds[1]


def smoothest(simulate: case.Simulate) -> case.BreakPoint:
    """The least friction with which the edge spins a ball up to KEPT of what rolling does."""
    wanted = KEPT * departure(SLOW, True)[1] / RADIUS

    def spun(friction: float) -> bool:
        observe = {"w": engine.Final(quantity=engine.AngularVelocity("ball"))}
        asked = scene(SLOW, True, friction)
        result = simulate(asked, time_step=COARSE, duration=0.65, observe=observe)
        return result.completed and float(result["w"][1]) > wanted

    return break_point(spun, 0.5, 0.1, resolution=0.02, walk=4)


def _draw(simulate: case.Simulate) -> case.Drawing:
    speeds = tuple(0.1 * k for k in range(1, 13))
    step = 4.0 * TIME_STEP
    found = tuple(
        errors(simulate, speed, False, step)[0] + math.cos(angle) * leaving
        for speed in speeds
        for angle, leaving in (departure(speed, False),)
    )
    right = tuple(
        math.cos(angle) * leaving for angle, leaving in (departure(speed, False) for speed in speeds)
    )
    return case.Drawing(
        curves=(
            line("smooth edge", speeds, found, "points"),
            line("closed form", speeds, right, "reference"),
        ),
        x_label="speed on the table [m/s]",
        y_label="level speed in flight [m/s]",
        note=f"At most {apart(found, right)} m/s from the closed form.",
    )


TEST = case.ScalarTest(
    title="Over the edge",
    question="Does a ball leave the edge of a table where its contact force ends?",
    why="An edge is the place where contacts change their normal in every step; engines catch on it, or let go early.",
    model="A ball slides over the edge of a smooth table, or rolls over that of a rough one, and flies off.",
    parameters=(
        ("ball", "radius 0.1 m, 1 kg"),
        ("speeds", "0.3 m/s and 1.2 m/s"),
        ("friction coefficient", "0 and 50"),
        ("gravity", "9.81 m/s²"),
        ("time step", "2.5e-4 s"),
    ),
    theory=(
        "The edge lets go where m v²/r = m g cos θ: cos θ = (2 + v₀²/(g r))/3 sliding, (10 + 7 v₀²/(g r))/17 rolling.",
        "From v₀² = g r on it leaves at once, with speed and spin as they were.",
        "The discrete ball hops along the edge; no friction turns it after its last hop, t = √(2 h v²/(r k)) before the end.",
    ),
    reference="Energy and the end of the contact force (closed form).",
    conclusion="Green: the normal follows the edge and pushes only. Red: the edge holds, catches or throws.",
    source="ours; a classic of mechanics",
    measurements=(
        ask(
            _measure,
            (
                error(
                    "sliding_error",
                    "error of the level speed of a ball that slides off at 0.3 m/s",
                    "m/s",
                    GRAVITY * TIME_STEP,
                    "the speed normal to the edge is off by up to v²/r h ≤ g h in the last hop, and it ends there",
                ),
                error(
                    "rolling_spin_error",
                    "error of the spin of a ball that rolls off at 0.3 m/s",
                    "rad/s",
                    5.0 / 7.0 * GRAVITY / RADIUS * math.sin(departure(SLOW, True)[0]) * last_hop(SLOW, True),
                    "5/7 g sin θ/r of spin is gained per second until the last hop, √(2 h v²/(r k)) before the end",
                ),
                error(
                    "fast_speed_error",
                    "largest error of the level speed at 1.2 m/s, sliding and rolling",
                    "m/s",
                    1e-12,
                    "the edge is not touched any more: rounding of the run-up",
                ),
                error(
                    "fast_spin_error",
                    "largest error of the spin at 1.2 m/s, sliding and rolling",
                    "rad/s",
                    1e-11,
                    "the edge is not touched any more: rounding of the run-up",
                    role="companion",
                ),
            ),
            "Four balls.",
            TIME_STEP,
        ),
    ),
    example=lambda: case.Example(scene=scene(SLOW, True), time_step=4.0 * TIME_STEP, duration=DURATION),
    figures=(
        case.Figure(name="speed", title="Level speed in flight against speed on the table", draw=_draw),
    ),
    ladders=(
        case.Ladder(
            name="sliding",
            description="level speed in flight of a ball that slides off at 0.3 m/s, against the closed form",
            unit="m/s",
            time_steps=(4e-3, 1e-3, 2.5e-4, 6.25e-5),
            configurations=(
                case.Configuration(
                    name="direct", method=engine.PLAIN, expected_order=None
                ),  # where the last hop ends
                case.Configuration(
                    name="iterative", method=engine.Method(solver="iterative"), expected_order=None
                ),
            ),
            error=ladder_error,
            target_error=1e-3,
            target_seconds=0.01,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="fastest-pushed",
            title="Fastest smooth ball that the edge pushes on by a hundredth",
            configuration="plain",
            definition="it gains a hundredth of its level speed at the edge",
            study=fastest_pushed,
            unit="m/s",
            expected=expected_pushed(),
            expected_source="energy and the end of the contact force; g h of level speed for the last hop, and the half per cent of the search",
        ),
        case.StabilityStudy(
            name="smoothest",
            title="Least friction with which the edge spins a ball up to 0.8 of what rolling does",
            configuration="plain",
            definition="its spin in flight, in steps of 1e-3 s",
            study=smoothest,
            unit="1",
            better="smaller",
            expected=(SMOOTHEST[0], 1.02 * SMOOTHEST[1]),
            expected_source="it slips from 2/7 sin θ = µ N/(m g) on, and µ N turns it until it leaves: 0.2334; g h/r of spin for the last hop, "
            "and the two per cent of the search",
        ),
    ),
)
