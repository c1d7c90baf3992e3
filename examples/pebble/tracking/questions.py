"""A question of our own: how high does a stone come that is thrown straight up?"""

from spook_tracker.engine import Maximum, Particle, Position, Scene
from spook_tracker.scalar_tests.case import Example, Measurement, Metric, ScalarTest

SPEED = 9.81  # m/s
TIME_STEP = 0.01  # s
HEIGHT = SPEED / 2.0  # m: v²/(2 g)
STEP_ERROR = SPEED * TIME_STEP / 2.0  # m: the symplectic step stays below by ½ v h


def scene():
    stone = Particle(name="stone", position=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, SPEED), mass=1.0)
    return Scene(bodies=(stone,), gravity=(0.0, 0.0, -9.81))


def measure(simulate):
    observe = {"top": Maximum(quantity=Position("stone"))}
    top = simulate(scene(), time_step=TIME_STEP, duration=2.0, observe=observe)["top"]
    return {"height_error": float(top[2]) - HEIGHT}


THROW = ScalarTest(
    title="Thrown stone",
    question="How high does a stone come that is thrown straight up?",
    why="the smallest question with a well-known answer",
    model="one particle, gravity, no ground",
    parameters=(("speed", "9.81 m/s"), ("time step", "0.01 s")),
    theory=("v²/(2 g)",),
    reference="closed form",
    conclusion="Red: gravity or the order of the two half steps changed.",
    source="school",
    measurements=(
        Measurement(
            configuration="default",
            time_step=TIME_STEP,
            metrics=(
                Metric(
                    name="height_error",
                    description="height reached minus v²/(2 g)",
                    unit="m",
                    role="gate",
                    limit=1.001 * STEP_ERROR,
                    limit_source="½ v h",
                    limit_kind="physical",
                ),
            ),
            measure=measure,
        ),
    ),
    example=lambda: Example(scene=scene(), time_step=TIME_STEP, duration=2.0),
)

CATALOGUE = {"throw": THROW}
