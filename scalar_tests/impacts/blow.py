"""Does an impact change velocities by Coulomb's and Newton's laws alone?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.bodies import Material

from .. import case
from ..bracket import break_point
from ..sweep import line

TIME_STEP = 1.0 / 60.0  # s
RADIUS = 0.1  # m
MASS = 1.0  # kg
RESTITUTION = 0.8
FALL, SLIDE = 2.0, 3.0  # m/s, towards the floor and along it
GRAVITY = 9.81  # m/s², of the slide over a seam
PASSING = 3.0  # m/s, each of two balls
GAP = 0.01  # m, between them as they pass
SMALL = 0.05  # m, radius of balls that pass or meet
SEAM_SPEED = 5.0  # m/s


def thrown(friction: float) -> engine.Scene:
    """A ball without spin on its way to a rough floor, without gravity."""
    rough = Material(friction=friction, restitution=RESTITUTION)
    floor = engine.RigidBody(
        name="floor", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=rough
    )
    ball = engine.RigidBody(
        name="ball",
        mass=MASS,
        shape=engine.Sphere(RADIUS),
        position=(0.0, 0.0, RADIUS + 0.05),
        velocity=(SLIDE, 0.0, -FALL),
        material=rough,
    )
    return engine.Scene(bodies=(floor, ball))


def expected_slide(friction: float) -> float:
    """Speed along the floor after the blow [m/s]: it slides throughout, or it grips."""
    return max(SLIDE - friction * (1.0 + RESTITUTION) * FALL, 5.0 / 7.0 * SLIDE)


def bounce_errors(
    simulate: case.Simulate, friction: float, time_step: float = TIME_STEP
) -> tuple[float, float, float]:
    """Errors of the speed along the floor and of the rebound [m/s], and of the spin [rad/s]."""
    observe = {
        "v": engine.Final(quantity=engine.Velocity("ball")),
        "w": engine.Final(quantity=engine.AngularVelocity("ball")),
    }
    result = simulate(thrown(friction), time_step=time_step, duration=0.1, observe=observe)
    along = expected_slide(friction)
    return (
        float(result["v"][0]) - along,
        float(result["v"][2]) - RESTITUTION * FALL,
        float(result["w"][1]) - 2.5 * (SLIDE - along) / RADIUS,
    )


def _measure_bounces(simulate: case.Simulate) -> dict[str, float]:
    values: dict[str, float] = {}
    for name, friction in (("sliding", 0.2), ("gripping", 5.0)):
        along, rebound, spin = bounce_errors(simulate, friction)
        values |= {f"{name}_speed_error": along, f"{name}_rebound_error": rebound, f"{name}_spin_error": spin}
    return values


def balls(offset: float, speed: float, material: Material) -> engine.Scene:
    """Two balls on their way past each other, or to a hit off the centre."""
    going = engine.RigidBody(
        name="going",
        mass=MASS,
        shape=engine.Sphere(SMALL),
        position=(-0.5, 0.0, 0.0),
        velocity=(PASSING, 0.0, 0.0),
        material=material,
    )
    other = engine.RigidBody(
        name="other",
        mass=MASS,
        shape=engine.Sphere(SMALL),
        position=(0.5, 0.0, offset),
        velocity=(-speed, 0.0, 0.0),
        material=material,
    )
    return engine.Scene(bodies=(going, other))


def _measure_near_miss(simulate: case.Simulate) -> dict[str, float]:
    scene = balls(2.0 * SMALL + GAP, PASSING, Material(restitution=0.5))
    result = simulate(
        scene, time_step=TIME_STEP, duration=0.5, observe={"v": engine.Final(quantity=engine.Velocity())}
    )
    before = np.array(((PASSING, 0.0, 0.0), (-PASSING, 0.0, 0.0)))
    return {"miss_change": float(np.abs(result["v"] - before).max())}


def _measure_hit(simulate: case.Simulate) -> dict[str, float]:
    """Elastic and smooth, half a radius off the centre: the second ball leaves along the line of centres."""
    scene = balls(SMALL, 0.0, Material(restitution=1.0))
    result = simulate(
        scene, time_step=TIME_STEP, duration=0.6, observe={"v": engine.Final(quantity=engine.Velocity())}
    )
    normal = np.array((math.sqrt(0.75), 0.0, 0.5))
    given = PASSING * normal[0] * normal
    return {"hit_error": float(np.linalg.norm(result["v"][1] - given))}


def seam(shape: engine.Shape, height: float) -> engine.Scene:
    """A body sliding on two boxes whose tops lie in one plane."""
    tiles = [
        engine.RigidBody(
            name=f"tile{k}", motion="static", shape=engine.Box((2.0, 2.0, 1.0)), position=(2.0 * k, 0.0, -0.5)
        )
        for k in range(2)
    ]
    slider = engine.RigidBody(
        name="slider", mass=MASS, shape=shape, position=(0.013, 0.0, height), velocity=(SEAM_SPEED, 0.0, 0.0)
    )
    return engine.Scene(bodies=(*tiles, slider), gravity=(0.0, 0.0, -GRAVITY))


def _measure_seam(simulate: case.Simulate) -> dict[str, float]:
    values = {}
    for name, shape in (("ball", engine.Sphere(SMALL)), ("box", engine.Box((2 * SMALL,) * 3))):
        result = simulate(
            seam(shape, SMALL),
            time_step=TIME_STEP,
            duration=0.4,
            observe={"v": engine.Trace(quantity=engine.Velocity("slider"))},
        )
        values[f"seam_{name}_change"] = float(np.abs(result["v"] - (SEAM_SPEED, 0.0, 0.0)).max())
    return values


def fastest(simulate: case.Simulate) -> case.BreakPoint:
    """How many times as fast the ball may be thrown at the floor."""

    def bounces(times: float) -> bool:
        floor, ball = thrown(0.2).bodies
        velocity = (times * SLIDE, 0.0, -times * FALL)
        built = replace(thrown(0.2), bodies=(floor, replace(ball, velocity=velocity)))
        result = simulate(
            built,
            time_step=TIME_STEP,
            duration=0.1,
            observe={"v": engine.Final(quantity=engine.Velocity("ball"))},
        )
        right = np.array((expected_slide(0.2), 0.0, RESTITUTION * FALL))
        return float(np.abs(result["v"] / times - right).max()) < 1e-9

    return break_point(bounces, 1.0, 1e6, resolution=0.1, walk=7)


GRIP = SLIDE / (3.5 * (1.0 + RESTITUTION) * FALL)  # .238: friction that takes 2/7 of the slide


def smoothest(simulate: case.Simulate) -> case.BreakPoint:
    """The least friction with which the ball leaves the floor rolling."""

    def rolls(friction: float) -> bool:
        off, _, spin_off = bounce_errors(simulate, friction)
        right = expected_slide(friction)
        turning = 2.5 * (SLIDE - right) + RADIUS * spin_off  # r ω, m/s
        return abs(right + off - turning) < 1e-9

    return break_point(rolls, 2.0, 0.02, resolution=1e-3, walk=6)


def _draw_friction(simulate: case.Simulate) -> case.Drawing:
    coefficients = tuple(0.05 * k for k in range(1, 13))
    after = tuple(bounce_errors(simulate, mu)[0] + expected_slide(mu) for mu in coefficients)
    return case.Drawing(
        curves=(
            line("speed along the floor after the blow", coefficients, after, "both"),
            case.Curve(
                name="v − μ (1 + e) u, or 5/7 v",
                x=coefficients,
                y=tuple(map(expected_slide, coefficients)),
                style="reference",
            ),
        ),
        x_label="coefficient of friction μ",
        y_label="speed [m/s]",
    )


def _exact(
    name: str, description: str, unit: str, limit: float, source: str, role: str = "gate"
) -> case.Metric:
    return case.Metric(
        name=name,
        description=description,
        unit=unit,
        role=role,  # type: ignore[arg-type]
        limit=limit,
        limit_source=source,
        reference=0.0,
        tolerance=0.1 * limit,
    )


def _ask(measure: object, metrics: tuple[case.Metric, ...], note: str) -> case.Measurement:
    return case.Measurement(
        configuration="plain",
        time_step=TIME_STEP,
        metrics=metrics,
        measure=measure,  # type: ignore[arg-type]
        note=note,
    )


LAW = "closed form of one impulse; rounding and the solver's tolerance remain"

TEST = case.ScalarTest(
    title="Blows",
    question="Does an impact change velocities by Coulomb's and Newton's laws alone?",
    why="Engines drop the friction of a rebound, and let bodies collide that only pass each other.",
    model="A thrown ball bounces on a rough floor; two balls meet off their centres, or pass with a gap of 1 cm; "
    "a ball and a box slide without friction over the seam of two boxes.",
    parameters=(
        ("thrown ball", "radius 0.1 m, 1 kg, 2 m/s down, 3 m/s along the floor, e = 0.8, μ = 0.2 and 5"),
        ("balls that meet or pass", "radius 0.05 m, 3 m/s"),
        ("slide", "5 m/s, gravity 9.81 m/s²"),
        ("time step", "1/60 s"),
    ),
    theory=(
        "Normal impulse J = m (1 + e) u; friction μ J, or what stops the slip if that is less.",
        "Sliding: Δv = μ (1 + e) u. Gripping: v₊ = 5/7 v. Spin: ω = 5/2 Δv/r.",
        "Elastic, smooth, equal masses: the normal part of the velocity changes over to the second ball.",
        "Without touch there is no impulse: velocities keep every bit.",
    ),
    reference="Impulse balances of single impacts (closed form).",
    conclusion="Green: a blow is Coulomb's and Newton's. Red: friction is lost or invented, or bodies hit what "
    "they do not touch.",
    source="of our own",
    lacks={"ladder": "exact at every step"},
    measurements=(
        _ask(
            _measure_bounces,
            (
                _exact(
                    "sliding_speed_error", "error of the speed along the floor, μ = 0.2", "m/s", 1e-9, LAW
                ),
                _exact("gripping_speed_error", "error of the speed along the floor, μ = 5", "m/s", 1e-9, LAW),
                _exact("sliding_spin_error", "error of the spin, μ = 0.2", "rad/s", 1e-7, LAW, "companion"),
                _exact("gripping_spin_error", "error of the spin, μ = 5", "rad/s", 1e-7, LAW, "companion"),
                _exact(
                    "sliding_rebound_error", "error of the rebound, μ = 0.2", "m/s", 1e-9, LAW, "companion"
                ),
                _exact(
                    "gripping_rebound_error", "error of the rebound, μ = 5", "m/s", 1e-9, LAW, "companion"
                ),
            ),
            "A ball thrown at a slant.",
        ),
        _ask(
            _measure_near_miss,
            (
                case.Metric(
                    name="miss_change",
                    description="largest change of a velocity of two balls that pass without touching",
                    unit="m/s",
                    role="gate",
                    limit=0.0,
                    limit_source="no touch, no impulse: not a bit may change",
                    reference=0.0,
                ),
            ),
            "Two balls pass with a gap of 1 cm.",
        ),
        _ask(
            _measure_hit,
            (
                _exact(
                    "hit_error",
                    "error of the velocity of the ball that is hit off its centre",
                    "m/s",
                    1e-7,
                    LAW,
                ),
            ),
            "The normal is that of the meeting, not of the step before it.",
        ),
        _ask(
            _measure_seam,
            (
                _exact(
                    "seam_ball_change", "largest change of a ball's velocity at a seam", "m/s", 1e-12, LAW
                ),
                _exact("seam_box_change", "largest change of a box's velocity at a seam", "m/s", 1e-12, LAW),
            ),
            "Edges inside a plane are no obstacles.",
        ),
    ),
    example=lambda: case.Example(scene=thrown(0.2), time_step=TIME_STEP),
    figures=(
        case.Figure(name="friction", title="Speed after the blow against friction", draw=_draw_friction),
    ),
    stability=(
        case.StabilityStudy(
            name="fastest",
            title="How many times as fast a ball may be thrown at h = 1/60 s",
            configuration="plain",
            definition="velocities after the blow right to 1e-9 of the throw",
            study=fastest,
            unit="1",
            expected=(1e6, 1e6),
            expected_source="the time of the blow decides, whatever the way in a step; the search ends at 1e6",
        ),
        case.StabilityStudy(
            name="smoothest",
            title="Least friction with which a ball leaves the floor rolling",
            configuration="plain",
            definition="speed along the floor and r ω alike after the blow, to 1e-9 m/s",
            study=smoothest,
            unit="1",
            better="smaller",
            expected=(GRIP, 1.001 * GRIP),
            expected_source="a blow takes at most µ (1 + e) u of the slide, and rolling needs 2/7 of it; to the resolution of the "
            "search",
        ),
    ),
)
