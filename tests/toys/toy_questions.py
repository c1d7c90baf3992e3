"""Two questions for the toy engine: one with a gate and a ladder, one that only follows a value."""

from __future__ import annotations

from spook_tracker.engine.bodies import Particle
from spook_tracker.engine.method import PLAIN, Method
from spook_tracker.engine.observe import Final, Position
from spook_tracker.engine.scene import Scene
from spook_tracker.scalar_tests.case import (
    BreakPoint,
    Configuration,
    Curve,
    Drawing,
    Example,
    Figure,
    Ladder,
    Measurement,
    Metric,
    ScalarTest,
    Simulate,
    StabilityMap,
    StabilityStudy,
)

GRAVITY = 10.0  # m/s²
DURATION = 1.0  # s
EXACT = -0.5 * GRAVITY * DURATION**2  # m


def scene() -> Scene:
    """A ball at rest above nothing."""
    return Scene(
        bodies=(Particle(name="ball", position=(0.0, 0.0, 0.0), mass=1.0),), gravity=(0, 0, -GRAVITY)
    )


def error(simulate: Simulate, time_step: float, method: Method) -> float:
    result = simulate(
        scene(),
        time_step=time_step,
        duration=DURATION,
        method=method,
        observe={"end": Final(quantity=Position("ball"))},
    )
    return float(result["end"]) - EXACT


def run(simulate: Simulate, time_step: float, method: Method):
    return simulate(scene(), time_step=time_step, duration=DURATION, method=method)


POSITION_ERROR = Metric(
    name="position_error",
    description="how far the ball is from where it should be",
    unit="m",
    role="gate",
    limit=0.1,
    limit_source="½ g t h",
    set_point=(-0.051, -0.049),
)
VELOCITY = Metric(
    name="height", description="where the ball ends", unit="m", role="reported", better="inside"
)


def plain(simulate: Simulate) -> dict[str, float]:
    found = error(simulate, 0.01, PLAIN)
    return {"position_error": found, "height": found + EXACT}


COMMON = {
    "why": "because",
    "model": "a ball",
    "parameters": (("mass", "1 kg"),),
    "theory": ("x = ½ g t²",),
    "reference": "closed form",
    "conclusion": "fine",
    "source": "ours",
    "example": lambda: Example(scene=scene(), time_step=0.01),
}
FALL = ScalarTest(
    title="Falling",
    question="Where is the ball?",
    measurements=(
        Measurement(configuration="plain", time_step=0.01, metrics=(POSITION_ERROR, VELOCITY), measure=plain),
    ),
    figures=(
        Figure(
            name="error-against-step",
            title="Error",
            draw=lambda simulate: Drawing(
                curves=(
                    Curve(
                        name="plain", x=(0.1, 0.01), y=tuple(error(simulate, h, PLAIN) for h in (0.1, 0.01))
                    ),
                ),
                x_label="h [s]",
                y_label="error [m]",
            ),
        ),
    ),
    ladders=(
        Ladder(
            name="end-error",
            description="position error at the end",
            unit="m",
            time_steps=(0.1, 0.05, 0.025, 0.0125),
            configurations=(
                Configuration(name="plain", method=PLAIN, expected_order=1.0),
                Configuration(
                    name="half-step", method=Method(half_step_velocities=True), expected_order=None
                ),
            ),
            error=error,
            run=run,
            target_error=0.1,
            target_seconds=1.0,
        ),
    ),
    stability=(
        StabilityStudy(
            name="largest-step",
            title="largest stable time step",
            configuration="plain",
            definition="finite",
            study=lambda simulate: BreakPoint(
                value=2.0 + error(simulate, 0.1, PLAIN), resolution=0.01, evaluations=8
            ),
            unit="s",
        ),
        StabilityStudy(
            name="map",
            title="a map",
            configuration="plain",
            definition="finite",
            study=lambda simulate: StabilityMap(
                x=(1.0, 2.0), y=(1.0,), cells=(("settled", "bounded"),), x_label="x", y_label="y"
            ),
        ),
    ),
    **COMMON,
)
STAND = ScalarTest(
    title="Standing",
    question="Does nothing move?",
    measurements=(
        Measurement(
            configuration="plain",
            time_step=0.1,
            metrics=(Metric(name="sag", description="sag", unit="m", role="companion", limit=20.0),),
            measure=lambda simulate: {"sag": error(simulate, 0.1, PLAIN) + 1.0},
        ),
    ),
    **COMMON,
)
CATALOGUE = {"fall": FALL, "stand": STAND}
