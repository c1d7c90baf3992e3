"""What force holds a scissor lift of n stages, and how fast does it lift?"""

from __future__ import annotations

import math

from spook_tracker import engine
from spook_tracker.engine.joints import Constraint
from spook_tracker.engine.result import SimulationFailed

from .. import case
from ..bracket import break_count, break_point
from ..closed_form import error
from ..sweep import line, told

GRAVITY = 9.81  # m/s²
BAR = 2.0  # m, length of an arm
ARM = 5.0  # kg each
LOAD = 1000.0  # kg
STAGES = tuple(range(1, 21))
TALL = (10, 30, 60)  # stages of the search for the tallest
ANGLE = math.radians(30.0)  # of the arms from the horizontal
ANGLES = tuple(math.radians(a) for a in (5.0, 15.0, 30.0, 45.0, 60.0, 80.0))
RATIOS = (1.0, 1e2, 1e4, 1e6)  # of the load to an arm
SPEED = 0.1  # m/s, of the lower pin that slides
TIME_STEP = 1.0 / 60.0  # s
FLOOR = 1e-12  # of pivots, over the diagonal: the method's
ACROSS = (0.0, 1.0, 0.0)


def scene(
    stages: int, angle: float = ANGLE, load: float = LOAD, arm: float = ARM, driven: bool = False
) -> engine.Scene:
    """Pairs of arms that cross, one on the other, in the plane of x and z; the lower left pin is fixed, the lower right
    one slides on the ground, and above them a platform hangs on one pin and slides on the other. The lowest pins are held
    apart by a rigid actuator, or the right one is driven inwards.

    Every part keeps to its plane by a Planar joint and every pin is a PointOnLine along its axis, so no row says what
    others say.
    """
    width, height = BAR * math.cos(angle), BAR * math.sin(angle)
    moment = arm * BAR**2 / 12.0
    bodies: list[engine.RigidBody] = []
    rows: list[Constraint] = []

    def part(name: str, mass: float, x: float, z: float, inertia: float, guided: bool = False) -> None:
        bodies.append(
            engine.RigidBody(name=name, mass=mass, inertia=(inertia, inertia, inertia), position=(x, 0.0, z))
        )
        if not guided:  # by a rail
            rows.append(
                engine.Planar(name=f"{name} plane", between=(engine.WORLD, name), axis=ACROSS, compliance=0.0)
            )

    def pin(first: str, second: str, x: float, z: float) -> None:
        name = f"{first} to {second}"
        rows.append(
            engine.PointOnLine(
                name=name, between=(first, second), at=(x, 0.0, z), axis=ACROSS, compliance=0.0
            )
        )

    for k in range(stages):
        for way in ("up", "down"):
            part(f"{way} {k}", arm, 0.5 * width, (k + 0.5) * height, moment)
        pin(f"up {k}", f"down {k}", 0.5 * width, (k + 0.5) * height)
        if k > 0:  # each arm goes on where the other kind of the stage below ends
            pin(f"down {k - 1}", f"up {k}", 0.0, k * height)
            pin(f"up {k - 1}", f"down {k}", width, k * height)
    top = stages * height
    part("platform", load, 0.5 * width, top, load * width**2 / 12.0)
    pin(f"down {stages - 1}", "platform", 0.0, top)
    part("slide", 1.0, width, top, 1.0, guided=True)  # between the platform and the right pin
    rows.append(
        engine.Prismatic(
            name="rail",
            between=("platform", "slide"),
            at=(width, 0.0, top),
            axis=(1.0, 0.0, 0.0),
            compliance=0.0,
        )
    )
    pin(f"up {stages - 1}", "slide", width, top)
    pin(engine.WORLD, "up 0", 0.0, 0.0)
    part("foot", 1.0, width, 0.0, 1.0, guided=True)
    motor = engine.Motor(speed=-SPEED) if driven else None
    rows.append(
        engine.Prismatic(
            name="ground", between=(engine.WORLD, "foot"), axis=(1.0, 0.0, 0.0), motor=motor, compliance=0.0
        )
    )
    pin("foot", "down 0", width, 0.0)
    if not driven:
        rows.append(
            engine.Distance(
                name="actuator",
                between=((0.0, 0.0, 0.0), "foot"),
                compliance=0.0,
            )
        )
    return engine.Scene(bodies=tuple(bodies), constraints=tuple(rows), gravity=(0.0, 0.0, -GRAVITY))


def holding_force(stages: int, angle: float, load: float, arm: float) -> float:
    """n (W + ½ W_arms) cot θ [N]: the work of the actuator is that of the weights, W dH + ½ W_arms dH = −F dw. The
    platform's slide, 1 kg at the top, is lifted with the load."""
    lifted = (load + 1.0) * GRAVITY + 0.5 * 2 * stages * arm * GRAVITY
    return stages * lifted / math.tan(angle)


def force(
    simulate: case.Simulate, stages: int, angle: float = ANGLE, load: float = LOAD, arm: float = ARM
) -> float:
    """Tension of the actuator after ten steps at rest over the closed form, minus one."""
    observe = {"pull": engine.Final(quantity=engine.ConstraintForce("actuator"))}
    result = simulate(scene(stages, angle, load, arm), time_step=TIME_STEP, steps=10, observe=observe)
    return float(result["pull"]) / holding_force(stages, angle, load, arm) - 1.0


def hold(simulate: case.Simulate) -> dict[str, float]:
    """Over stages, angles and loads."""
    rest = {"x": engine.MaximumAbsolute(quantity=engine.Position("platform"), from_start=True)}
    still = simulate(scene(20), time_step=TIME_STEP, steps=60, observe=rest)
    return {
        "force_error": max(abs(force(simulate, n)) for n in STAGES),
        "angle_error": max(abs(force(simulate, 3, angle=angle)) for angle in ANGLES),
        "ratio_error": max(abs(force(simulate, 3, load=ratio * ARM)) for ratio in RATIOS),
        "tall_error": max(abs(force(simulate, 20, load=ratio * ARM)) for ratio in RATIOS),
        "sag": float(still["x"].max()),
    }


def lift(simulate: case.Simulate) -> dict[str, float]:
    """Speed of the platform in the first step of the driven lift over n cot θ times that of the pin, minus one."""

    def off(stages: int, angle: float) -> float:
        observe = {"v": engine.Final(quantity=engine.Velocity("platform"))}
        asked = scene(stages, angle, driven=True)
        v = simulate(asked, time_step=TIME_STEP, steps=1, observe=observe)["v"]
        return abs(float(v[2]) / (SPEED * stages / math.tan(angle)) - 1.0)

    return {
        "rate_error": max(off(stages, ANGLE) for stages in STAGES),
        "rate_angle_error": max(off(stages, angle) for stages in (1, 3, 20) for angle in ANGLES),
    }


def loaded(ratio: float) -> float:
    """Relative error of a force under a load so many times an arm: an arm's end gives way by up to 4/m, a load by 1/M, so
    the floor of pivots is 4 M/m of what counts, and the one refinement squares that."""
    return (4.0 * FLOOR * ratio) ** 2


def heaviest(simulate: case.Simulate) -> case.BreakPoint:
    """The heaviest load over an arm that twenty stages hold to a millionth."""

    def holds(ratio: float) -> bool:
        try:
            return abs(force(simulate, 20, load=ratio * ARM)) < 1e-6
        except SimulationFailed:
            return False

    return break_point(holds, 1e6, 1e11, resolution=0.05)


def tallest(simulate: case.Simulate) -> case.BreakPoint:
    """The most stages that hold the load to 1e-9."""
    return break_count(lambda stages: abs(force(simulate, stages)) < 1e-9, TALL)


def height_after(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Height of three stages driven for a second, less n √(l² − (w − u t)²) [m]."""
    observe = {"z": engine.Final(quantity=engine.Position("platform"))}
    result = simulate(
        scene(3, driven=True), time_step=time_step, duration=1.0, method=method, observe=observe
    )
    return float(result["z"][2]) - 3.0 * math.sqrt(BAR**2 - (BAR * math.cos(ANGLE) - SPEED) ** 2)


def draw(simulate: case.Simulate) -> case.Drawing:
    """Force of the actuator against the angle."""
    degrees = [5.0, 10.0, 15.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0]
    curves = []
    worst = 0.0
    for stages in (1, 5, 20):
        right = [holding_force(stages, math.radians(a), LOAD, ARM) for a in degrees]
        errors = [force(simulate, stages, angle=math.radians(a)) for a in degrees]
        worst = max(worst, *(abs(error) for error in errors))
        found = [f * (1.0 + error) for f, error in zip(right, errors, strict=True)]
        curves.append(line(f"n = {stages}", degrees, found))
        curves.append(line(f"n (W + ½ W_arms) cot θ, n = {stages}", degrees, right, "reference"))
    return case.Drawing(
        curves=tuple(curves),
        x_label="angle of the arms from the horizontal [°]",
        y_label="force of the actuator [N]",
        y_scale="log",
        note=f"The largest relative difference is {told(worst, 2)}.",
    )


ROUNDING = (
    "statics are exact in one step; forces grow like n² along the arms, 400 roundings of 2e-16 are 1e-13"
)

TEST = case.ScalarTest(
    title="Scissor lift",
    question="Do force and speed of a scissor lift follow from its geometry?",
    why="Forces add up along the arms: twenty stages multiply the load by twenty over the tangent of a small angle, "
    "through forty bars of a thousandth of its mass. Loops of light bars under heavy loads are where solvers fail.",
    model="One to twenty pairs of crossed arms of 2 m and 5 kg, a platform with a load of 1 t (5 kg to 5000 t) on top, a "
    "rigid actuator between the lowest pins. Once more with the foot driven inwards at 0.1 m/s.",
    parameters=(
        ("time step", "1/60 s, 10 steps"),
        ("arms", "2 m, 5 kg"),
        ("stages", "1 to 20"),
        ("angle", "30°; 5 to 80°"),
        ("load", "1000 kg; 1 to 1e6 times an arm"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "Virtual work: H = n l sin θ, w = l cos θ, W dH + ½ W_arms dH + F dw = 0.",
        "F = n W cot θ + (n/2) W_arms cot θ; the platform's slide of 1 kg counts with W.",
        "Lift rate: dH/dt = −n cot θ dw/dt.",
    ),
    reference="Virtual work and kinematics in closed form.",
    conclusion="Green: forces through loops of many light bars are right. Red: they get lost in the chain, or a loop is "
    "held by a compliance that it was not given.",
    source="ours; the lift is asked for in the thesis, section 5.4",
    measurements=(
        case.Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            metrics=(
                error("force_error", "largest relative error of the force, n = 1 … 20", "1", 1e-12, ROUNDING),
                error("angle_error", "the same at 5 to 80°, three stages", "1", 1e-12, ROUNDING, "companion"),
                error(
                    "ratio_error",
                    "the same for loads of 1 to 1e6 arms, three stages",
                    "1",
                    1e-12,
                    ROUNDING,
                    "companion",
                ),
                error(
                    "tall_error",
                    "the same on twenty stages",
                    "1",
                    loaded(RATIOS[-1]),
                    "the floor of pivots, 1e-12, over m/4M, squared by the refinement",
                ),
                case.Metric(
                    name="sag",
                    description="largest movement of the platform on 20 stages in 60 steps",
                    unit="m",
                    role="companion",
                    limit=1e-12,
                    limit_source="rigid rows: nothing but rounding, times the leverage n cot θ = 35",
                    reference=0.0,
                    tolerance=1e-13,
                ),
            ),
            measure=hold,
            note="held at rest",
        ),
        case.Measurement(
            configuration="driven",
            time_step=TIME_STEP,
            metrics=(
                error(
                    "rate_error",
                    "largest relative error of the first step's lift rate, n = 1 … 20",
                    "1",
                    1e-12,
                    "a velocity row is exact in one step; rounding times the leverage",
                ),
                error(
                    "rate_angle_error",
                    "the same at 5 to 80°, one, three and twenty stages",
                    "1",
                    1e-12,
                    "the same",
                    "companion",
                ),
            ),
            measure=lift,
            note="the foot driven at 0.1 m/s",
        ),
    ),
    example=lambda: case.Example(scene=scene(5, driven=True), time_step=TIME_STEP, duration=4.0),
    stability=(
        case.StabilityStudy(
            name="heaviest",
            title="Heaviest load, over an arm, that twenty stages hold to a millionth",
            configuration="plain",
            definition="after ten steps the force of the actuator is right to 1e-6",
            study=heaviest,
            unit="1",
            expected=(0.25e-3 / FLOOR, 0.25 / FLOOR),
            expected_source="the floor of pivots, 1e-12, over m/4M is 1e-3 there, 1e-6 by the refinement, and not before; it is 1, "
            "so that nothing is left of the load, a thousand times further. Rigid arms have no swing that could run away",
        ),
        case.StabilityStudy(
            name="tallest",
            title="Most stages that hold a load of 200 arms",
            configuration="plain",
            definition="after ten steps the force of the actuator is right to 1e-9",
            study=tallest,
            unit="1",
            expected=(TALL[-1], TALL[-1]),
            expected_source="rounding grows like n², 3600 of 2e-16 are 8e-13, and nothing else does; the search ends at 60",
        ),
    ),
    figures=(case.Figure(name="force", title="Force of the actuator", draw=draw),),
    ladders=(
        case.Ladder(
            name="height",
            description="height of three driven stages after 1 s against n √(l² − w²)",
            unit="m",
            time_steps=tuple(1.0 / n for n in (30, 60, 120, 240, 480)),
            configurations=(
                case.Configuration(
                    name="plain", method=engine.PLAIN, expected_order=2.0, order_range=(1 / 480, 1 / 120)
                ),
                case.Configuration(
                    name="curved",
                    method=engine.Method(corrections=1),
                    expected_order=3.0,
                    order_range=(1 / 480, 1 / 120),
                ),
            ),
            error=height_after,
            target_error=1e-5,
            target_seconds=0.05,
        ),
    ),
)
