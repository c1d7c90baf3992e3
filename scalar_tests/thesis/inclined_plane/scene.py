"""The box on an inclined plane shared by the friction tests: the plane stays level, gravity is tilted."""

from __future__ import annotations

import math
from dataclasses import replace

from spook_tracker import engine
from spook_tracker.engine.result import Result

from ... import case

EDGE = 1.0  # m
MASS = 1.0  # kg
GRAVITY = 10.0  # m/s²
FRICTION = 0.5
TIME_STEP = 1.0 / 60.0  # s
SLIP_SPEED = 1e-3  # m/s, the thesis' limit for "in motion"
CONE = engine.Method()
BOX = engine.Method(friction="box")
SCALED_BOX = engine.Method(friction="scaled_box")
MODELS = {"cone": CONE, "box": BOX, "scaled box": SCALED_BOX}


def scene(
    slope: float, direction: float = 0.0, friction: float = FRICTION, mass: float = MASS
) -> engine.Scene:
    """A box at rest on a level plane under gravity tilted by atan(slope) towards `direction` [rad]."""
    tilt = math.atan(slope)
    rough = engine.Material(friction=friction)
    plane = engine.RigidBody(
        name="plane", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=rough
    )
    box = engine.RigidBody(
        name="box",
        mass=mass,
        shape=engine.Box((EDGE, EDGE, EDGE)),
        position=(0.0, 0.0, 0.5 * EDGE),
        material=rough,
    )
    pull = (
        -GRAVITY * math.sin(tilt) * math.cos(direction),
        -GRAVITY * math.sin(tilt) * math.sin(direction),
        -GRAVITY * math.cos(tilt),
    )
    return engine.Scene(bodies=(plane, box), gravity=pull)


def slide(
    simulate: case.Simulate,
    slope: float,
    direction: float = 0.0,
    *,
    steps: int = 60,
    method: engine.Method = CONE,
    friction: float = FRICTION,
    mass: float = MASS,
) -> Result:
    """Run the box; observes the contact `force` [N] on the box and the final `velocity` [m/s]."""
    return simulate(
        scene(slope, direction, friction, mass),
        time_step=TIME_STEP,
        steps=steps,
        method=method,
        observe={
            "force": engine.Trace(quantity=engine.ContactForce("box"), first=steps // 2),
            "velocity": engine.Final(quantity=engine.Velocity("box")),
        },
    )


def unloaded(
    simulate: case.Simulate,
    slope: float,
    direction: float,
    share: float,
    method: engine.Method,
    steps: int = 10,
) -> Result:
    """The box while `share` of its weight presses it on as well, which goes as the last step begins; observes as `slide`."""
    before = (steps - 1.5) * TIME_STEP
    weight = MASS * GRAVITY * math.cos(math.atan(slope))
    press = engine.Load(
        name="press",
        body="box",
        force=(0.0, 0.0, -share * weight),
        factor=engine.Table(times=(0.0, before, before + 0.1 * TIME_STEP), values=(1.0, 1.0, 0.0)),
    )
    return simulate(
        replace(scene(slope, direction), forces=(press,)),
        time_step=TIME_STEP,
        steps=steps,
        method=method,
        observe={"force": engine.Trace(quantity=engine.ContactForce("box"), first=steps)},
    )


def force_ratio(result: Result) -> float:
    """|Ft|/|Fn| at the last step."""
    x, y, z = result["force"][-1]
    return math.hypot(x, y) / abs(float(z))


def force_direction_error(result: Result, direction: float) -> float:
    """Angle [degrees] between the friction force and the upward slope direction, at the last step."""
    x, y, _ = result["force"][-1]
    angle = math.atan2(y, x) - direction
    return math.degrees(abs(math.remainder(angle, 2.0 * math.pi)))


def slips(
    simulate: case.Simulate, slope: float, friction: float, seconds: float = 4.0, method: engine.Method = CONE
) -> bool:
    """Whether the box exceeds SLIP_SPEED within `seconds` of standing on the slope."""
    steps = round(seconds / TIME_STEP)
    velocity = slide(simulate, slope, steps=steps, friction=friction, method=method)["velocity"]
    return math.hypot(velocity[0], velocity[1]) > SLIP_SPEED


def slip_slope(simulate: case.Simulate, friction: float, resolution: float = 1e-4) -> float:
    """The tangent of the slope at which the box starts to slide, by bisection to `resolution`."""
    low, high = 0.0, 2.0 * friction + 0.1
    while high - low > resolution:
        middle = 0.5 * (low + high)
        if slips(simulate, middle, friction):
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)
