"""Do wires over pulleys share their loads, and does a rope that snaps taut give the blow that mechanics says?"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable

from .. import case
from ..bracket import break_point
from ..closed_form import error
from ..configurations import configured
from ..sweep import line, told

GRAVITY = 9.81  # m/s²
HEAVY, LIGHT = 3.0, 2.0  # kg
DRUM, RADIUS = 0.08, 0.2  # kg m², m
TIME_STEP = 1.0 / 60.0  # s
DURATION = 2.0  # s
STRANDS = (2, 3, 4, 5, 6, 7, 8)
STONE, PULLER, FAST, SLACK = 5.0, 2.0, 3.0, 0.4  # kg, kg, m/s, m: one tows the other on a slack rope
IDEAL = (HEAVY - LIGHT) * GRAVITY / (HEAVY + LIGHT)  # m/s²
TURNING = (HEAVY - LIGHT) * GRAVITY / (HEAVY + LIGHT + DRUM / RADIUS**2)


BLOCK, STRAND, SLING = 1.0, 4.0, 1.0  # kg, m, m: a block in two strands, and the load under it
ASIDE, SWAYS, SEARCHED = 1e-7, 200, 2e-3  # m and steps, of the study of its sway, and its resolution
RATIOS = 1e12  # as far as the ratio of two weights is searched
HELD = 1e-9  # to what their pull must be right


def atwood(heavy: float = HEAVY, light: float = LIGHT) -> engine.Scene:
    """Two weights on a wire over two eyes without friction."""
    ends = {"heavy": (-RADIUS, 0.0, -1.0), "light": (RADIUS, 0.0, -1.0)}
    return engine.Scene(
        bodies=(
            engine.Particle(name="heavy", mass=heavy, position=ends["heavy"]),
            engine.Particle(name="light", mass=light, position=ends["light"]),
        ),
        constraints=(
            engine.Wire(
                name="wire",
                through=(
                    ("heavy", ends["heavy"]),
                    (engine.WORLD, (-RADIUS, 0.0, 9.0)),
                    (engine.WORLD, (RADIUS, 0.0, 9.0)),
                    ("light", ends["light"]),
                ),
                compliance=0.0,
            ),
        ),
        gravity=(0.0, 0.0, -GRAVITY),
    )


def drum() -> engine.Scene:
    """The same over a drum on which the wire does not slip: two racks on one pinion."""
    bodies = [
        engine.RigidBody(name=name, mass=mass, inertia=(1.0, 1.0, 1.0), position=(x, 0.0, -1.0))
        for name, mass, x in (("heavy", HEAVY, -RADIUS), ("light", LIGHT, RADIUS))
    ]
    bodies.append(
        engine.RigidBody(name="drum", mass=4.0, inertia=(DRUM, DRUM, DRUM), position=(0.0, 0.0, 0.0))
    )
    rails = [
        engine.Prismatic(
            name=f"{name} rail", between=(engine.WORLD, name), axis=(0.0, 0.0, 1.0), compliance=0.0
        )
        for name in ("heavy", "light")
    ]
    axle = engine.Hinge(name="axle", between=(engine.WORLD, "drum"), axis=(0.0, 1.0, 0.0), compliance=0.0)
    # A turn about y lifts what hangs at −x: z = r φ there, −r φ at +x.
    wound = [
        engine.Relation(
            name=f"{name} wire", terms=((f"{name} rail", 1.0), ("axle", side * RADIUS)), compliance=0.0
        )
        for name, side in (("heavy", -1.0), ("light", 1.0))
    ]
    return engine.Scene(
        bodies=tuple(bodies), constraints=(*rails, axle, *wound), gravity=(0.0, 0.0, -GRAVITY)
    )


def tackle(load: float, strands: int = 4) -> engine.Scene:
    """A block of `load` [kg] on so many strands, one weight of 1 kg at the end of the wire: with an even number its other
    end is in the world, with an odd one at the block."""
    through: list[tuple[str, tuple[float, float, float]]] = []
    if strands % 2 == 1:
        through += [("block", (0.0, 0.0, 0.0))]
    for k in range(strands // 2):
        through += [(engine.WORLD, (0.0, 0.0, 3.0 + k)), ("block", (0.0, 0.0, 0.0))]
    through += [(engine.WORLD, (0.0, 0.0, 9.0)), (engine.WORLD, (4.0, 0.0, 9.0)), ("weight", (4.0, 0.0, 0.0))]
    return engine.Scene(
        bodies=(
            engine.Particle(name="block", mass=load, position=(0.0, 0.0, 0.0)),
            engine.Particle(name="weight", mass=1.0, position=(4.0, 0.0, 0.0)),
        ),
        constraints=(engine.Wire(name="wire", through=tuple(through), compliance=0.0),),
        gravity=(0.0, 0.0, -GRAVITY),
    )


def crane(load: float) -> engine.Scene:
    """A block in two strands of a wire, balanced by a weight at its end, with a load [kg] on a sling; the block is nudged."""
    block = (ASIDE, 0.0, 0.0)
    top, side = (0.0, 0.0, STRAND), (STRAND, 0.0, STRAND)
    strands = (
        (engine.WORLD, top),
        ("block", block),
        (engine.WORLD, top),
        (engine.WORLD, side),
        ("weight", (STRAND, 0.0, 0.0)),
    )
    return engine.Scene(
        bodies=(
            engine.Particle(name="block", mass=BLOCK, position=block),
            engine.Particle(name="load", mass=load, position=(0.0, 0.0, -SLING)),
            engine.Particle(name="weight", mass=0.5 * (BLOCK + load), position=(STRAND, 0.0, 0.0)),
        ),
        constraints=(
            engine.Wire(name="wire", through=strands, compliance=0.0),
            engine.Wire(
                name="sling", through=(("block", block), ("load", (0.0, 0.0, -SLING))), compliance=0.0
            ),
        ),
        gravity=(0.0, 0.0, -GRAVITY),
    )


def tow(restitution: float = 0.0) -> engine.Scene:
    """A stone at rest, and a puller that runs away from it on a rope with slack."""
    ends = {"stone": (0.0, 0.0, 0.0), "puller": (1.0, 0.0, 0.0)}
    return engine.Scene(
        bodies=(
            engine.Particle(name="stone", mass=STONE, position=ends["stone"]),
            engine.Particle(name="puller", mass=PULLER, position=ends["puller"], velocity=(FAST, 0.0, 0.0)),
        ),
        constraints=(
            engine.Wire(
                name="rope",
                through=(("stone", ends["stone"]), ("puller", ends["puller"])),
                length=1.0 + SLACK,
                restitution=restitution,
                compliance=0.0,
            ),
        ),
    )


def fall(simulate: case.Simulate) -> dict[str, float]:
    """Speeds after two seconds, the wire's pull, and the tackle."""
    speed: dict[str, Observable] = {"v": engine.Final(quantity=engine.Velocity("heavy"))}
    pull: dict[str, Observable] = {"pull": engine.Final(quantity=engine.ConstraintForce("wire"))}
    wire = simulate(atwood(), time_step=TIME_STEP, duration=1.0, observe=speed | pull)
    wound = simulate(drum(), time_step=TIME_STEP, duration=DURATION, observe=speed)
    still: dict[str, Observable] = {"v": engine.MaximumAbsolute(quantity=engine.Velocity())}
    worst = {"tackle_motion": 0.0, "tackle_pull": 0.0, "tackle_error": 0.0}
    for n in STRANDS:
        held = simulate(tackle(float(n), n), time_step=TIME_STEP, duration=1.0, observe=still | pull)
        lifted = simulate(
            tackle(2.0 * n, n),
            time_step=TIME_STEP,
            duration=0.5,
            observe={"v": engine.Final(quantity=engine.Velocity("block"))},
        )
        sinks = (2.0 * n - n) * GRAVITY / (2.0 * n + n**2)
        for name, value in (
            ("tackle_motion", float(held["v"].max())),
            ("tackle_pull", abs(float(held["pull"]) / GRAVITY - 1.0)),
            ("tackle_error", abs(-float(lifted["v"][2]) / (0.5 * sinks) - 1.0)),
        ):
            worst[name] = max(worst[name], value)
    return worst | {
        "wire_error": -float(wire["v"][2]) / IDEAL - 1.0,
        "pull_error": float(wire["pull"]) * (HEAVY + LIGHT) / (2.0 * HEAVY * LIGHT * GRAVITY) - 1.0,
        "drum_error": -float(wound["v"][2]) / (TURNING * DURATION) - 1.0,
    }


def snap(simulate: case.Simulate) -> dict[str, float]:
    """What the rope leaves of speed and energy, plastic and with restitution ½, and how it gets there."""
    observe = {
        "v": engine.Trace(quantity=engine.Velocity()),
        "p": engine.Trace(quantity=engine.Momentum()),
        "E": engine.Trace(quantity=engine.Energy()),
        "long": engine.MaximumAbsolute(quantity=engine.Violation("rope")),
    }
    reduced = STONE * PULLER / (STONE + PULLER)
    worst = {"speed_error": 0.0, "momentum_error": 0.0, "loss_error": 0.0, "gain": 0.0}
    for restitution in (0.0, 0.5):
        result = simulate(tow(restitution), time_step=TIME_STEP, duration=0.5, observe=observe)
        v, energy = result["v"][:, :, 0], result["E"]
        parting = float(v[-1, 1] - v[-1, 0])
        lost = 0.5 * reduced * FAST**2 * (1.0 - restitution**2)
        worst["speed_error"] = max(worst["speed_error"], abs(parting + restitution * FAST))
        worst["momentum_error"] = max(
            worst["momentum_error"], float(np.abs(result["p"][:, 0] - PULLER * FAST).max())
        )
        worst["loss_error"] = max(worst["loss_error"], abs(float(energy[0] - energy[-1]) / lost - 1.0))
        worst["gain"] = max(worst["gain"], float(np.diff(energy).max()))
    return worst


def heaviest_load() -> float:
    """The load [kg] with which the block sways by half a turn a step, Ω = 2/h: its strands pull it back with (m + M) g/s aside,
    its sling with M g/l, and Ω² is an eigenvalue of both bodies' sway."""
    square, strand, sling = (2.0 / TIME_STEP) ** 2, GRAVITY / STRAND, GRAVITY / SLING
    return BLOCK * (square - strand) * (square - sling) / (square * (strand + sling) - strand * sling)


def heaviest(simulate: case.Simulate) -> case.BreakPoint:
    """The heaviest load under a light block that hangs still."""

    def hangs(load: float) -> bool:
        observe = {"x": engine.MaximumAbsolute(quantity=engine.Position("block"), from_start=True)}
        result = simulate(crane(load), time_step=TIME_STEP, steps=SWAYS, observe=observe)
        return result.completed and float(result["x"][0]) < 100.0 * ASIDE

    return break_point(hangs, 0.1 * heaviest_load(), 3.0 * heaviest_load(), resolution=SEARCHED)


def most_uneven(simulate: case.Simulate) -> case.BreakPoint:
    """The largest ratio of two weights whose wire pulls as it must, half a second long."""
    observe: dict[str, Observable] = {
        "v": engine.Final(quantity=engine.Velocity("heavy")),
        "pull": engine.Final(quantity=engine.ConstraintForce("wire")),
    }

    def pulls(ratio: float) -> bool:
        result = simulate(atwood(ratio, 1.0), time_step=TIME_STEP, steps=30, observe=observe)
        if not result.completed:
            return False
        pull = 2.0 * ratio * GRAVITY / (ratio + 1.0)
        speed = (ratio - 1.0) * GRAVITY / (ratio + 1.0) * 30.0 * TIME_STEP
        off = abs(float(result["pull"]) / pull - 1.0), abs(-float(result["v"][2]) / speed - 1.0)
        return max(off) < HELD

    return break_point(pulls, 10.0, RATIOS, walk=12)


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Place of the drum's heavy weight after a second against ½ a t² [m]."""
    from_start = {"z": engine.Trace(quantity=engine.Velocity("heavy"))}
    result = simulate(drum(), time_step=time_step, duration=1.0, method=method, observe=from_start)
    return -time_step * math.fsum(result["z"][1:, 2]) - 0.5 * TURNING


def draw(simulate: case.Simulate) -> case.Drawing:
    """Speeds of stone and puller."""
    curves, ends = [], []
    for restitution in (0.0, 0.5):
        observe = {"v": engine.Trace(quantity=engine.Velocity())}
        result = simulate(tow(restitution), time_step=TIME_STEP, duration=0.5, observe=observe)
        for k, name in enumerate(("stone", "puller")):
            ends.append(float(result["v"][-1, k, 0]))
            curves.append(
                line(f"{name}, e = {restitution:g}", result.sample_times["v"], result["v"][:, k, 0])
            )
    together: Any = PULLER * FAST / (STONE + PULLER)
    curves.append(line("m v/(m + M)", (0.0, 0.5), (together, together), "reference"))
    return case.Drawing(
        curves=tuple(curves),
        x_label="time [s]",
        y_label="speed [m/s]",
        note=f"After a plastic blow they go at {told(ends[0], 3)} m/s and {told(ends[1], 3)} m/s, at {told(together, 3)} in closed "
        "form.",
    )


STEADY = "a steady force is exact in the velocities of the discrete step; rounding remains"

TEST = case.ScalarTest(
    title="Wires and ropes",
    question="Do wires pull as mechanics says, over pulleys or as they snap taut?",
    why="Cranes, lifts and winches hang on wires that only pull. A wire that pushes, loses load at a pulley or throws "
    "energy in when it snaps taut drives machines that do not exist.",
    model="Atwood's machine over eyes without friction, and over a drum on which the wire does not slip; tackles of two "
    "to eight strands; a puller that runs off with a slack rope to a stone at rest, plastic and with restitution ½.",
    parameters=(
        ("time step", "1/60 s"),
        ("Atwood", "3 kg and 2 kg; drum of 0.08 kg m² and 0.2 m"),
        ("tackle", "n = 2 … 8 strands, 1 kg against n and 2 n kg"),
        ("tow", "5 kg and 2 kg, 3 m/s, 0.4 m of slack"),
        ("crane", "a block of 1 kg in two strands of 4 m, a load on a sling of 1 m"),
        ("gravity", "9.81 m/s²; none for the tow"),
    ),
    theory=(
        "Atwood: a = (m₁ − m₂) g/(m₁ + m₂ + I/r²); pull 2 m₁ m₂ g/(m₁ + m₂) with I = 0.",
        "Tackle of n strands: M = n m balances; else a = (M − n m) g/(M + n² m) of the block.",
        "Snap: the parting speed u becomes −e u, momentum stays, ½ µ u² (1 − e²) is lost, µ = m M/(m + M).",
        "The rope is one row with λ ≤ 0: an open gap may close and no more, then the blow acts.",
        "Wires are rigid along their length, at any ratio of weights. Across it a light block under a heavy load is a swing: "
        "ω² is nearly (M g/m) (1/s + 1/l) with strands of s and a sling of l, and no step carries h ω > 2.",
    ),
    reference="Mechanics in closed form.",
    conclusion="Green: wires pull alike on both sides of every eye and ropes let go. Red: a wire pushes, or a blow "
    "is no blow.",
    source="ours; wires are asked for in the thesis, section 5.4",
    measurements=(
        case.Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            metrics=(
                error("wire_error", "relative error of the speed after 1 s over eyes", "1", 1e-11, STEADY),
                error("pull_error", "relative error of the wire's pull", "1", 1e-11, STEADY, "companion"),
                error(
                    "drum_error", "relative error of the speed after 2 s over the drum", "1", 1e-11, STEADY
                ),
                error(
                    "tackle_motion",
                    "largest speed of a balanced tackle in 1 s, n = 2 … 8",
                    "m/s",
                    1e-12,
                    STEADY,
                    "companion",
                ),
                error("tackle_pull", "largest relative error of its pull", "1", 1e-11, STEADY, "companion"),
                error(
                    "tackle_error",
                    "largest relative error of the block's speed, out of balance, n = 2 … 8",
                    "1",
                    1e-11,
                    STEADY,
                    "companion",
                ),
            ),
            measure=fall,
            note="Atwood's machine and a tackle",
        ),
        case.Measurement(
            configuration="snap",
            time_step=TIME_STEP,
            metrics=(
                error(
                    "speed_error",
                    "parting speed after the snap, plus e times that before",
                    "m/s",
                    1e-9,
                    "the blow is a row of its own: exact",
                ),
                error(
                    "momentum_error",
                    "largest change of momentum",
                    "N s",
                    1e-12,
                    "equal and opposite",
                    "companion",
                ),
                error(
                    "loss_error",
                    "relative error of the energy lost",
                    "1",
                    1e-9,
                    "½ µ u² (1 − e²)",
                    "companion",
                ),
                error(
                    "gain",
                    "largest gain of energy in a step",
                    "J",
                    1e-12,
                    "no step of a rope gives energy",
                    "companion",
                ),
            ),
            measure=snap,
            note="a slack rope, e = 0 and ½",
        ),
    ),
    example=lambda: case.Example(scene=atwood(), time_step=TIME_STEP, duration=1.0),
    figures=(case.Figure(name="snap", title="A rope snaps taut", draw=draw),),
    stability=(
        case.StabilityStudy(
            name="heaviest-load",
            title="Heaviest load under a block of 1 kg that hangs still at 1/60 s",
            configuration="plain",
            definition="nudged by 1e-7 m the block, in two strands of 4 m with the load on a sling of 1 m, never goes a "
            "hundred times as far in 200 steps",
            study=heaviest,
            unit="kg",
            expected=((1.0 - 1.1 * SEARCHED) * heaviest_load(), heaviest_load()),
            expected_source="h ω = 2 of the faster sway of block and load; the search ends 0.2 % short of it at most",
        ),
        case.StabilityStudy(
            name="mass-ratio",
            title="Largest ratio of two weights whose wire pulls as it must",
            configuration="plain",
            definition="after 30 steps pull and speed are right to 1e-9",
            study=most_uneven,
            unit="1",
            expected=(RATIOS, RATIOS),
            expected_source="a wire is one row: 1/m₁ + 1/m₂ is a sum in which nothing cancels, so only rounding is lost at any "
            "ratio; the search ends at 1e12",
        ),
    ),
    ladders=(
        case.Ladder(
            name="fall",
            description="sum of the heavy weight's velocities in 1 s over the drum against ½ a t²",
            unit="m",
            time_steps=tuple(1.0 / n for n in (30, 60, 120, 240, 480)),
            configurations=configured({"plain": 1.0, "half-step": None}, (1 / 480, 1 / 120)),
            error=ladder_error,
            target_error=1e-2,
            target_seconds=0.01,
        ),
    ),
)
