"""Do billiard balls move after a hit as impulse and friction say?"""

from __future__ import annotations

import math

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.bodies import Material

from .. import case
from ..bracket import break_point
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import apart, line

TIME_STEP = 1.0 / 60.0  # s
RADIUS = 0.03  # m
MASS = 0.17  # kg
GRAVITY = 9.81  # m/s²
CLOTH = 0.2  # coefficient of friction
RESTITUTION = 0.95
SPEED = 1.0  # m/s of the cue ball at the hit
DURATION = 1.5  # s, long after all sliding has ended
BALLS = 0.9  # restitution of the hit in the air
HELD = 1e-6  # of the speed, the error of a shot that still counts as right
SHOTS = {"follow": (1.0, 0.0), "stun": (0.0, 0.0), "draw": (-1.0, 0.0), "half_ball": (1.0, 0.5)}


def table(roll: float, offset: float) -> engine.Scene:
    """Cue ball touching a smooth object ball at SPEED along x, turning `roll` times as fast as it would roll; the
    line of centres is off by asin(offset)."""
    cloth = Material(friction=CLOTH)
    leather = Material(friction=CLOTH, restitution=RESTITUTION)
    along = math.sqrt(1.0 - offset**2)
    bed = engine.RigidBody(
        name="bed", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=cloth
    )
    cue = engine.RigidBody(
        name="cue",
        mass=MASS,
        shape=engine.Sphere(RADIUS),
        position=(0.0, 0.0, RADIUS),
        velocity=(SPEED, 0.0, 0.0),
        angular_velocity=(0.0, roll * SPEED / RADIUS, 0.0),
        material=leather,
    )
    other = engine.RigidBody(
        name="object",
        mass=MASS,
        shape=engine.Sphere(RADIUS),
        position=(2.0 * RADIUS * along, 2.0 * RADIUS * offset, RADIUS),
        material=Material(restitution=RESTITUTION),
    )
    return engine.Scene(bodies=(bed, cue, other), gravity=(0.0, 0.0, -GRAVITY))


def expected_shot(roll: float, offset: float) -> tuple[np.ndarray, np.ndarray]:
    """Velocities of cue and object ball once both roll or slide steadily [m/s].

    Sliding keeps v + 2/5 r ω about the point on the cloth: it ends at 5/7 of the speed after the hit and 2/7 of
    what the spin would roll at.
    """
    normal = np.array((math.sqrt(1.0 - offset**2), offset, 0.0))
    before = np.array((SPEED, 0.0, 0.0))
    given = 0.5 * (1.0 + RESTITUTION) * (before @ normal) * normal
    return 5.0 / 7.0 * (before - given) + 2.0 / 7.0 * roll * before, given


def shot_errors(
    simulate: case.Simulate, roll: float, offset: float, time_step: float = TIME_STEP
) -> tuple[float, float, float]:
    """Errors of cue ball and object ball [m/s], and of the cue ball's spin times its radius [m/s]."""
    observe = {
        "v": engine.Final(quantity=engine.Velocity()),
        "w": engine.Final(quantity=engine.AngularVelocity("cue")),
    }
    result = simulate(table(roll, offset), time_step=time_step, duration=DURATION, observe=observe)
    cue, other = expected_shot(roll, offset)
    rolls = RADIUS * result["w"] - np.array((-cue[1], cue[0], 0.0))
    return (
        float(np.linalg.norm(result["v"][1] - cue)),
        float(np.linalg.norm(result["v"][2] - other)),
        float(np.linalg.norm(rolls)),
    )


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """How far it is from where it should have come back to [m]: v0 t + a t²/2 while it slides, then v1 t."""
    observe = {"x": engine.Final(quantity=engine.Position("cue"))}
    result = simulate(
        table(-1.0, 0.0), time_step=time_step, duration=DURATION, method=method, observe=observe
    )
    first, last = SPEED - 0.5 * (1.0 + RESTITUTION) * SPEED, float(expected_shot(-1.0, 0.0)[0][0])
    sliding = abs(last - first) / (CLOTH * GRAVITY)
    return abs(float(result["x"][0]) - 0.5 * (first + last) * sliding - last * (DURATION - sliding))


def catching_spin() -> float:
    """Spin [rad/s] with which the cue ball has caught up with the object ball when the shot ends.

    It leaves the hit with v0, gains a = μ g up to 5/7 v0 + 2/7 r ω and rolls; steps add half of one of what it gained
    to its way. The object ball slides on with what it was given. The first of the two speeds that go as far in time.
    """
    given, pull = 0.5 * (1.0 + RESTITUTION) * SPEED, CLOTH * GRAVITY
    left = SPEED - given
    time = DURATION + left / pull + 0.5 * TIME_STEP
    ahead = given * DURATION + 0.5 * left**2 / pull + 0.5 * TIME_STEP * left
    rolls = pull * (time - math.sqrt(time**2 - 2.0 * ahead / pull))
    return (3.5 * rolls - 2.5 * left) / RADIUS


def _measure_shots(simulate: case.Simulate) -> dict[str, float]:
    values: dict[str, float] = {}
    others, rolls = [], []
    for name, (roll, offset) in SHOTS.items():
        values[f"{name}_error"], other, spin = shot_errors(simulate, roll, offset)
        others.append(other)
        rolls.append(spin)
    return values | {"object_error": max(others), "rolling_error": max(rolls)}


ARRIVING = ((3.0, 0.0, 0.0), (4.0, 8.0, -12.0), (0.0, 5.0, 2.0))  # m/s; rad/s of both
RADII = (0.05, 0.08)  # m
LINE = (math.sqrt(0.8), 0.4, 0.2)  # of centres at the hit


def in_the_air(friction: float, heavier: float = 3.0, faster: float = 1.0) -> engine.Scene:
    """Two unequal balls that turn, on their way to a hit off their centres, without gravity; the second is `heavier`
    than the first, which comes at `faster` times 3 m/s."""
    rough = Material(friction=friction, restitution=BALLS)
    m1, m2 = 1.0, heavier
    r1, r2 = RADII
    speed, w1, w2 = ARRIVING
    v = (faster * speed[0], 0.0, 0.0)
    going = engine.RigidBody(
        name="going",
        mass=m1,
        shape=engine.Sphere(r1),
        position=(-0.1037 * v[0], 0.0, 0.0),
        velocity=v,
        angular_velocity=w1,
        material=rough,
    )
    other = engine.RigidBody(
        name="other",
        mass=m2,
        shape=engine.Sphere(r2),
        position=tuple((r1 + r2) * n for n in LINE),  # type: ignore[arg-type]
        angular_velocity=w2,
        material=rough,
    )
    return engine.Scene(bodies=(going, other))


def expected_hit(friction: float, heavier: float = 3.0, faster: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """(2, 3) velocities [m/s] and spins [rad/s] after the hit; spheres answer a tangential impulse with 7/2 of 1/m."""
    m1, m2 = 1.0, heavier
    r1, r2 = RADII
    v, w1, w2 = (np.array(part) for part in ARRIVING)
    v = faster * v
    n = np.array(LINE)
    meeting = v + np.cross(w1, r1 * n) + np.cross(w2, r2 * n)
    closing = meeting @ n
    slip = meeting - closing * n
    light = 1.0 / m1 + 1.0 / m2
    normal = (1.0 + BALLS) * closing / light
    tangential = min(friction * normal, float(np.linalg.norm(slip)) / (3.5 * light))
    impulse = -normal * n - tangential * slip / np.linalg.norm(slip)
    turned = 2.5 * np.cross(n, impulse)
    return (
        np.array((v + impulse / m1, -impulse / m2)),
        np.array((w1 + turned / (m1 * r1), w2 + turned / (m2 * r2))),
    )


def _measure_hits(simulate: case.Simulate) -> dict[str, float]:
    values = {}
    for name, friction in (("sliding", 0.1), ("gripping", 1.0)):
        values[f"{name}_hit_error"], values[f"{name}_spin_error"] = hit_errors(simulate, friction)
    return values


def hit_errors(
    simulate: case.Simulate, friction: float, heavier: float = 3.0, faster: float = 1.0
) -> tuple[float, float]:
    """Largest errors of a velocity [m/s] and of a spin [rad/s] after the hit in the air."""
    observe = {
        "v": engine.Final(quantity=engine.Velocity()),
        "w": engine.Final(quantity=engine.AngularVelocity()),
    }
    built = in_the_air(friction, heavier, faster)
    result = simulate(built, time_step=TIME_STEP, duration=0.2, observe=observe)
    speeds, spins = expected_hit(friction, heavier, faster)
    return float(np.abs(result["v"] - speeds).max()), float(np.abs(result["w"] - spins).max())


def _hits(simulate: case.Simulate, friction: float, heavier: float = 3.0, faster: float = 1.0) -> bool:
    try:
        speed, spin = hit_errors(simulate, friction, heavier, faster)
    except engine.SimulationFailed:
        return False
    return speed <= HELD * faster * ARRIVING[0][0] and spin * RADII[0] <= HELD * faster * ARRIVING[0][0]


def heaviest_hit(simulate: case.Simulate) -> case.BreakPoint:
    """Largest mass ratio of two balls that hit each other rightly."""
    return break_point(lambda ratio: _hits(simulate, 0.1, heavier=ratio), 1.0, 1e12, resolution=0.1, walk=13)


def fastest_hit(simulate: case.Simulate) -> case.BreakPoint:
    """Highest speed [m/s] at which two smooth balls hit each other rightly; rough ones would be spun up too fast."""
    speed = ARRIVING[0][0]
    return break_point(lambda v: _hits(simulate, 0.0, faster=v / speed), 1.0, 1e6, resolution=0.1, walk=7)


def fastest_spin(simulate: case.Simulate) -> case.BreakPoint:
    """Largest spin [rad/s] of a cue ball that follows rightly."""

    def holds(spin: float) -> bool:
        try:
            return max(shot_errors(simulate, spin * RADIUS / SPEED, 0.0)) <= HELD * SPEED
        except engine.SimulationFailed:
            return False

    return break_point(holds, 1.0, 1e4, resolution=0.01, walk=9)


def _draw(simulate: case.Simulate) -> case.Drawing:
    rolls = tuple(0.25 * k for k in range(-6, 7))
    after = tuple(
        float(
            simulate(
                table(roll, 0.0),
                time_step=TIME_STEP,
                duration=DURATION,
                observe={"v": engine.Final(quantity=engine.Velocity("cue"))},
            )["v"][0]
        )
        for roll in rolls
    )
    return case.Drawing(
        curves=(
            line("cue ball, rolling again", rolls, after, "points"),
            line(
                "5/7 v₊ + 2/7 r ω",
                rolls,
                (float(expected_shot(roll, 0.0)[0][0]) for roll in rolls),
                "reference",
            ),
        ),
        x_label="spin at the hit, over that of rolling",
        y_label="speed [m/s]",
        note=f"At most {apart(after, (expected_shot(roll, 0.0)[0][0] for roll in rolls))} m/s from the closed form.",
    )


TEST = case.ScalarTest(
    title="Billiards",
    question="Do billiard balls move after a hit as impulse and friction say?",
    why="Follow and draw live on spin that a hit must leave alone and friction must turn into speed; an engine that "
    "rubs at a blow in the wrong direction, or twice, misses every pocket.",
    model="A cue ball hits a smooth object ball full or half, rolling, sliding or turning backwards, and rolls again; "
    "two unequal balls that turn meet in the air off their centres.",
    parameters=(
        ("balls on the table", "radius 0.03 m, 0.17 kg, e = 0.95, 1 m/s at the hit"),
        ("cloth", "μ = 0.2"),
        ("balls in the air", "1 kg and 3 kg, radius 0.05 m and 0.08 m, e = 0.9, μ = 0.1 and 1, 3 m/s"),
        ("gravity", "9.81 m/s² on the table"),
        ("time step", "1/60 s"),
    ),
    theory=(
        "Smooth hit of equal balls: the object ball takes (1 + e)/2 of the normal part, spins stay.",
        "Sliding keeps v + 2/5 r ω: rolling begins at 5/7 v₊ + 2/7 r ω₀ (follow 2/7, draw −2/7 for e = 1).",
        "Rough hit: normal impulse (1 + e) u/(1/m₁ + 1/m₂); tangential μ of it, or slip/(7/2 (1/m₁ + 1/m₂)) if less.",
    ),
    reference="Impulse balances of spheres (closed form).",
    conclusion="Green: spin and speed are exchanged by Coulomb's law only. Red: friction acts in the wrong "
    "direction or a hit takes spin away.",
    source="ours; G. G. Coriolis, Théorie mathématique des effets du jeu de billard, 1835",
    measurements=(
        ask(
            _measure_shots,
            (
                error("follow_error", "error of a rolling cue ball after a full hit", "m/s", 1e-9),
                error("stun_error", "error of a cue ball without spin after a full hit", "m/s", 1e-9),
                error("draw_error", "error of a cue ball with back spin after a full hit", "m/s", 1e-9),
                error("half_ball_error", "error of a rolling cue ball after a half-ball hit", "m/s", 1e-9),
                error(
                    "object_error",
                    "largest error of the object ball, four shots",
                    "m/s",
                    1e-9,
                    role="companion",
                ),
                error(
                    "rolling_error",
                    "largest difference of r ω and v at the end, four shots",
                    "m/s",
                    1e-9,
                    role="companion",
                ),
            ),
            "Four shots on the table.",
            TIME_STEP,
        ),
        ask(
            _measure_hits,
            (
                error("sliding_hit_error", "largest error of a velocity after the hit, μ = 0.1", "m/s", 1e-9),
                error("gripping_hit_error", "largest error of a velocity after the hit, μ = 1", "m/s", 1e-9),
                error(
                    "sliding_spin_error",
                    "largest error of a spin after the hit, μ = 0.1",
                    "rad/s",
                    1e-7,
                    role="companion",
                ),
                error(
                    "gripping_spin_error",
                    "largest error of a spin after the hit, μ = 1",
                    "rad/s",
                    1e-7,
                    role="companion",
                ),
            ),
            "A hit in the air, in three dimensions.",
            TIME_STEP,
        ),
    ),
    example=lambda: case.Example(scene=table(1.0, 0.5), time_step=TIME_STEP, duration=2.0),
    figures=(case.Figure(name="follow-and-draw", title="Speed after a full hit against spin", draw=_draw),),
    ladders=(
        case.Ladder(
            name="draw",
            description="place of a cue ball with back spin 1.5 s after a full hit, against the closed form",
            unit="m",
            time_steps=tuple(1.0 / n for n in (30, 60, 120, 480, 1920)),
            configurations=configured({"direct": 1.0, "iterative": 1.0}),
            error=ladder_error,
            target_error=1e-3,
            target_seconds=0.003,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="heaviest-hit",
            title="Largest mass ratio of two balls that hit each other",
            configuration="plain",
            definition="velocities and spins after the hit right to 1e-6 of the speed",
            study=heaviest_hit,
            unit="1",
            expected=(1e12, 1e12),
            expected_source="one impulse, one row: rounding does not grow with the ratio; the search ends at 1e12",
        ),
        case.StabilityStudy(
            name="fastest-hit",
            title="Fastest smooth ball that hits another at h = 1/60 s",
            configuration="plain",
            definition="velocities and spins after the hit right to 1e-6 of the speed",
            study=fastest_hit,
            unit="m/s",
            expected=(1e6, 1e6),
            expected_source="the time of the hit decides, whatever the way in a step; the search ends at 1e6 m/s",
        ),
        case.StabilityStudy(
            name="fastest-spin",
            title="Fastest spin of a ball that follows at h = 1/60 s",
            configuration="plain",
            definition="cue ball, object ball and rolling right to 1e-6 m/s; a refused step is none",
            study=fastest_spin,
            unit="rad/s",
            expected=(0.99 * catching_spin(), catching_spin()),
            expected_source="turns are exact at any rate; a faster one has caught up with the object ball by the end",
        ),
    ),
)
