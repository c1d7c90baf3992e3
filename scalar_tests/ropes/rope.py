"""Does a rope of a thousand links keep its momenta, pull as it must, and cost no more a link than a short one?"""

from __future__ import annotations

import functools
import math

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable

from .. import case
from ..bracket import break_point, unbroken
from ..closed_form import ask, error
from ..heavier import heavier
from ..sweep import line, told

LENGTH, MASS, THICK = 10.0, 5.0, 0.004  # m, kg, m: of the whole rope, however many links it has
LONG, SHORT = 1000, 125  # links
TIME_STEP = 1.0 / 60.0  # s
DURATION = 0.5  # s
# Spun so slowly that T h²/(m l) = (w h N)²/8 stays below 0.15: from 1/3 on rigid links under tension run away, h ω > 2.
SPIN = 0.06  # rad/s
GRAVITY = 9.81  # m/s²
THROWN, TUMBLE = (2.0, 0.5, 4.0), (1.0, 3.0, 0.5)  # m/s, rad/s: the ragdoll
FLIGHT = 0.5  # s


def middle_pull() -> float:
    """Tension [N] in the middle of a rope that turns about it as a whole: Σ m w² x over one half."""
    return 0.5 * MASS * SPIN**2 * 0.25 * LENGTH


@functools.cache
def rope(count: int, spin: float = SPIN, nudge: float = 0.0) -> engine.Scene:
    """Thin rods on ball joints in a straight line along x, which turns about its middle; nothing else acts. `nudge` [rad/s]
    tilts every other rod up and down."""
    length, mass = LENGTH / count, MASS / count
    across = mass * length**2 / 12.0
    links = []
    for k in range(count):
        x = (k + 0.5) * length - 0.5 * LENGTH
        links.append(
            engine.RigidBody(
                name=f"link {k}",
                mass=mass,
                shape=engine.Capsule(0.5 * THICK, length - THICK),
                inertia=(across, across, 0.5 * mass * THICK**2),
                position=(x, 0.0, 0.0),
                orientation=(math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0),
                velocity=(0.0, spin * x, 0.0),
                angular_velocity=(0.0, nudge if k % 2 == 0 else -nudge, spin),
            )
        )
    joints = [
        engine.Ball(
            name=f"joint {k}",
            between=(f"link {k - 1}", f"link {k}"),
            at=(k * length - 0.5 * LENGTH, 0.0, 0.0),
            compliance=0.0,
        )
        for k in range(1, count)
    ]
    return engine.Scene(bodies=tuple(links), constraints=tuple(joints), contacts=False)


BODIES: dict[str, tuple[engine.Shape, float, tuple[float, float, float]]] = {  # kg, m
    "pelvis": (engine.Box((0.2, 0.3, 0.2)), 12.0, (0.0, 0.0, 0.0)),
    "chest": (engine.Box((0.2, 0.35, 0.4)), 25.0, (0.0, 0.0, 0.35)),
    "head": (engine.Sphere(0.12), 5.0, (0.0, 0.0, 0.72)),
    **{
        f"{side} {part}": (shape, mass, (0.0, sign * y, z))
        for side, sign in (("left", 1.0), ("right", -1.0))
        for part, shape, mass, y, z in (
            ("arm", engine.Capsule(0.05, 0.25), 2.5, 0.25, 0.35),
            ("forearm", engine.Capsule(0.04, 0.22), 1.5, 0.25, 0.03),
            ("thigh", engine.Capsule(0.08, 0.32), 9.0, 0.1, -0.3),
            ("shin", engine.Capsule(0.05, 0.35), 4.0, 0.1, -0.75),
        )
    },
}
BALLS = {
    "waist": ("pelvis", "chest", (0.0, 0.0, 0.12)),
    "neck": ("chest", "head", (0.0, 0.0, 0.58)),
    **{
        f"{side} {name}": (first, f"{side} {second}", (0.0, sign * y, z))
        for side, sign in (("left", 1.0), ("right", -1.0))
        for name, first, second, y, z in (
            ("shoulder", "chest", "arm", 0.25, 0.52),
            ("hip", "pelvis", "thigh", 0.1, -0.1),
        )
    },
}
HINGES = {
    f"{side} {name}": (f"{side} {first}", f"{side} {second}", (0.0, sign * y, z))
    for side, sign in (("left", 1.0), ("right", -1.0))
    for name, first, second, y, z in (
        ("elbow", "arm", "forearm", 0.25, 0.18),
        ("knee", "thigh", "shin", 0.1, -0.52),
    )
}
DOLL = math.fsum(mass for _, mass, _ in BODIES.values())  # kg


def ragdoll() -> engine.Scene:
    """A body of eleven parts, thrown and tumbling as a whole."""
    parts = []
    for name, (shape, mass, place) in BODIES.items():
        turned = np.cross(TUMBLE, place) + THROWN
        parts.append(
            engine.RigidBody(
                name=name,
                mass=mass,
                shape=shape,
                position=place,
                velocity=(float(turned[0]), float(turned[1]), float(turned[2])),
                angular_velocity=TUMBLE,
            )
        )
    balls = [
        engine.Ball(name=name, between=(first, second), at=at, compliance=0.0)
        for name, (first, second, at) in BALLS.items()
    ]
    hinges = [
        engine.Hinge(name=name, between=(first, second), at=at, axis=(0.0, 1.0, 0.0), compliance=0.0)
        for name, (first, second, at) in HINGES.items()
    ]
    return engine.Scene(
        bodies=tuple(parts),
        constraints=(*balls, *hinges),
        gravity=(0.0, 0.0, -GRAVITY),
        contacts=False,
    )


def spin(simulate: case.Simulate) -> dict[str, float]:
    """Half a second of the long rope."""
    observe: dict[str, Observable] = {
        "p": engine.MaximumAbsolute(quantity=engine.Momentum()),
        "L": engine.Trace(quantity=engine.AngularMomentum()),
        "E": engine.Trace(quantity=engine.Energy()),
        "pull": engine.Final(quantity=engine.ConstraintForce(f"joint {LONG // 2}")),
    }
    long = simulate(rope(LONG), time_step=TIME_STEP, duration=DURATION, observe=observe)
    turning, energy = long["L"][:, 2], long["E"]
    whole = MASS * LENGTH**2 / 12.0 * SPIN
    return {
        "pull_error": float(np.linalg.norm(long["pull"][:3])) / middle_pull() - 1.0,
        "momentum_error": float(long["p"].max()) / (0.25 * MASS * SPIN * LENGTH),
        "turning_error": float(np.abs(turning / turning[0] - 1.0).max()),
        "energy_error": float(np.abs(energy / (0.5 * whole * SPIN) - 1.0).max()),
    }


FEW = 40  # links of the study
# At which h ω = 2 of its fastest swing across, by the eigenvalues of its links in the test.
FASTEST = 2.50376  # rad/s


def straight(simulate: case.Simulate, spin: float) -> bool:
    """Whether a rope of few links that is nudged stays in its plane for 200 steps."""
    observe = {"x": engine.MaximumAbsolute(quantity=engine.Position())}
    result = simulate(rope(FEW, spin, 1e-8), time_step=TIME_STEP, steps=200, observe=observe)
    return result.completed and float(result["x"].max(axis=0)[2]) < 1e-6


def fastest(simulate: case.Simulate) -> case.BreakPoint:
    """The fastest spin of a rope of few links."""
    return break_point(functools.partial(straight, simulate), 0.4 * FASTEST, 2.0 * FASTEST, resolution=0.005)


def pulls(simulate: case.Simulate, whole: float) -> bool:
    """Whether forty links of that mass [kg] pull in their middle as Σ m ω² x asks, after thirty steps."""
    observe = {"pull": engine.Final(quantity=engine.ConstraintForce("joint 20"))}
    result = simulate(heavier(rope(40), whole / MASS), time_step=TIME_STEP, steps=30, observe=observe)
    pull = float(np.linalg.norm(result["pull"][:3])) * MASS / whole
    return result.completed and abs(pull / middle_pull() - 1.0) < 10.0 * (SPIN * TIME_STEP) ** 2


def cost(simulate: case.Simulate) -> dict[str, float]:
    """Exact work a link of the long rope over that of the short one."""
    work = []
    for count in (LONG, SHORT):
        result = simulate(rope(count), time_step=TIME_STEP, steps=3)
        work.append(result.counters.get("block_operations", math.nan) / count)
    return {"cost_error": work[0] / work[1] - 1.0}


def throw(simulate: case.Simulate) -> dict[str, float]:
    """The ragdoll in flight."""
    observe: dict[str, Observable] = {
        "p": engine.Trace(quantity=engine.Momentum()),
        "L": engine.Trace(quantity=engine.AngularMomentum()),
    }
    asked = ragdoll()
    result = simulate(asked, time_step=TIME_STEP, duration=FLIGHT, observe=observe)
    p, turning, time = result["p"], result["L"], result.sample_times["p"]
    expected = p[0] + np.outer(time, (0.0, 0.0, -DOLL * GRAVITY))
    # About the origin gravity turns it by −(Σ m x) × g: with v before x, Σ m x is p h ahead of a step.
    h = TIME_STEP
    places = np.array([sum(mass * place[k] for _, mass, place in BODIES.values()) for k in range(3)])
    sums = places + h * np.vstack((np.zeros(3), np.cumsum(p[1:], axis=0)))
    turned = turning[0] + h * np.vstack(
        (np.zeros(3), np.cumsum(np.cross(sums[:-1], (0.0, 0.0, -GRAVITY)), axis=0))
    )
    return {
        "momentum_error": float(np.abs(p - expected).max() / np.abs(p).max()),
        "turning_error": float(np.abs(turning - turned).max() / np.abs(turning).max()),
    }


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest relative error of the energy of the ragdoll in half a second."""
    observe = {"E": engine.MaximumAbsolute(quantity=engine.Energy(), from_start=True)}
    asked = ragdoll()
    result = simulate(asked, time_step=time_step, duration=FLIGHT, method=method, observe=observe)
    return float(result["E"]) / (0.5 * DOLL * float(np.dot(THROWN, THROWN)))


def draw(simulate: case.Simulate) -> case.Drawing:
    """Work a step and link against the number of links."""
    counts, works = [16, 32, 64, 125, 250, 500], []
    for count in counts:
        result = simulate(rope(count), time_step=TIME_STEP, steps=3)
        works.append(result.counters.get("block_operations", 0) / (3.0 * count))
    return case.Drawing(
        curves=(line("work per link", counts, works, "points"),),
        x_label="links",
        y_label="block operations a step and link",
        x_scale="log",
        note=f"{told(works[0], 3)} a link with {counts[0]} links, {told(works[-1], 3)} with {counts[-1]}.",
    )


# A steady circle on rows with damping τ = 2h is longer by (w h)²/2 (1 + 2τ/h)/2: every link stretches by that part, the spin
# falls by twice and the energy with it, the pull by four less one.
STRETCH = 1.25 * (SPIN * TIME_STEP) ** 2
TURNS = (
    f"rows are taken where a step starts: every link is {told(STRETCH)} of its length too long, (1 + 2θ)/4 (w h)² with θ = 2, so "
    "the spin falls by twice that, the pull by three times"
)
ROUNDING = "equal and opposite, about the same point: rounding of a thousand sums"

TEST = case.ScalarTest(
    title="Rope and ragdoll",
    question="Does a rope of a thousand links keep its momenta, pull as it must, and cost no more a link than a short one?",
    why="Cranes and tethers are long chains. A solver that fills in costs N³ and a tolerance that adds up along the chain "
    "loses its ends; a ragdoll shows the same where limbs branch.",
    model="A straight rope of thin rods on ball joints turns about its middle in empty space. A body of eleven parts on ball "
    "joints and hinges is thrown.",
    parameters=(
        ("time step", "1/60 s"),
        ("rope", "10 m, 5 kg, 1000 links; 125 for the cost; 0.06 rad/s"),
        ("ragdoll", f"{DOLL:g} kg, 3 m/s ahead and up, tumbling"),
        ("gravity", "none; 9.81 m/s² for the ragdoll"),
    ),
    theory=(
        "The rope turns as one: tension in the middle (m/2) w² (L/4).",
        "Momentum stays, or grows with m g t; about the origin gravity turns by Σ m x × g, summed with the step's places.",
        "Rows of a chain have no fill, one elimination a link: work grows with N.",
    ),
    reference="Closed forms; counts of block operations, the same on every machine.",
    conclusion="Green: chains are held in one go, link by link. Red: momenta leak, the pull is wrong, or cost grows faster.",
    source="ours; chains are asked for in the thesis, sections 1.2 and 5.4",
    measurements=(
        ask(
            spin,
            (
                error("pull_error", "relative error of the tension in the middle", "1", 3.3 * STRETCH, TURNS),
                error(
                    "momentum_error",
                    "largest momentum over that of one half",
                    "1",
                    1e-9,
                    ROUNDING,
                    "companion",
                ),
                error(
                    "turning_error",
                    "largest relative change of the angular momentum",
                    "1",
                    1e-9,
                    ROUNDING,
                    "companion",
                ),
                error(
                    "energy_error",
                    "largest relative change of the energy",
                    "1",
                    2.2 * STRETCH,
                    TURNS,
                    "companion",
                ),
            ),
            "a thousand links",
            TIME_STEP,
        ),
        ask(
            cost,
            (
                error(
                    "cost_error",
                    "work a link over that of 125 links, minus one",
                    "1",
                    1.0 / SHORT,
                    "a link costs the same; the ends have one joint less, less than a link's work in 125",
                ),
            ),
            "cost per link",
            TIME_STEP,
            "cost",
        ),
        ask(
            throw,
            (
                error("momentum_error", "relative error of the momentum", "1", 1e-12, ROUNDING),
                error(
                    "turning_error",
                    "relative error of the angular momentum",
                    "1",
                    1e-12,
                    ROUNDING,
                    "companion",
                ),
            ),
            "ragdoll",
            TIME_STEP,
            "ragdoll",
        ),
    ),
    example=lambda: case.Example(scene=ragdoll(), time_step=TIME_STEP, duration=1.0),
    figures=(case.Figure(name="cost", title="Work per link", draw=draw),),
    stability=(
        case.StabilityStudy(
            name="fastest",
            title="Fastest spin at which a rope of forty links stays straight",
            configuration="plain",
            definition="its links nudged by 1e-8 rad/s up and down it leaves its plane by less than 1e-6 m in 200 steps",
            study=fastest,
            unit="rad/s",
            expected=(0.99 * FASTEST, 1.005 * FASTEST),
            expected_source="h ω = 2 of the fastest swing across it, by eigenvalues: about T h²/(m l) = 1/3 in the middle",
        ),
        unbroken(
            pulls,
            MASS,
            1e12,
            name="heaviest",
            title="Heaviest rope of forty links that pulls as it should",
            definition="the pull in its middle after thirty steps is Σ m ω² x, to ten times (h ω)²",
            source="mass scales out of rigid joints",
            unit="kg",
            walk=4,
        ),
    ),
    ladders=(
        case.Ladder(
            name="energy",
            description="largest relative error of the ragdoll's energy in half a second",
            unit="1",
            time_steps=tuple(1.0 / n for n in (60, 120, 240, 480)),
            configurations=(
                case.Configuration(name="plain", method=engine.PLAIN, expected_order=1.0),
                case.Configuration(
                    name="order4",
                    method=engine.Method(composition="order4"),
                    expected_order=None,  # the largest over ever fewer samples has none
                    time_steps=(1 / 8, 1 / 12, 1 / 20, 1 / 30),
                ),
            ),
            error=ladder_error,
            target_error=1e-2,
            target_seconds=0.05,
        ),
    ),
)
