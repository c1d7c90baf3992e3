"""Does a heavy load on a light chain swing as it should, however heavy it is?"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from spook_tracker.engine import PLAIN, Method, Position, Result, Trace
from spook_tracker.scalar_tests.case import (
    Configuration,
    Drawing,
    Example,
    Figure,
    Ladder,
    Measurement,
    Metric,
    ScalarTest,
    Simulate,
)
from spook_tracker.scalar_tests.chain import LENGTH
from spook_tracker.scalar_tests.hanging_chain.scene import (
    BELOW_BREAK,
    COUNT,
    HEAVY,
    LIGHT,
    OBSERVE,
    STEPS,
    STRING,
    TILT,
    TIME_STEP,
    exact_load,
    lift,
    scene,
)
from spook_tracker.scalar_tests.hanging_chain.stability import STUDIES
from spook_tracker.scalar_tests.sweep import line

LINEAR_MAP = "the powers of the map of small motion, with h² T/(4 l) and its damping on the masses: "
ORACLE = "the method's own discrete solution, tests/oracle.py: "
LADDER_RATIO, LADDER_TILT = 1000.0, 1e-4  # rad: small motion to 1e-9
STRING_HALF_STEP = Method(string_stiffness=True, half_step_velocities=True)


def _answers(simulate: Simulate, ratio: float, method: Method) -> dict[str, float]:
    result = simulate(scene(ratio), time_step=TIME_STEP, steps=STEPS, method=method, observe=OBSERVE)
    time = TIME_STEP * np.arange(STEPS + 1)
    load = result["places"][:, -1, 0]
    energy = result["energy"] / lift(ratio)
    return {
        "length_deviation": float(result["violation"].max()) / LENGTH,
        "path_error": float(np.abs(load - exact_load(ratio, time)).max()) / (COUNT * LENGTH * TILT),
        "energy_gain": float(energy.max()),
        "energy_lost": float(-energy[-STEPS // 4 :].mean()),
    }


def plain(simulate: Simulate) -> dict[str, float]:
    """Plain SPOOK below its break point."""
    return _answers(simulate, BELOW_BREAK, PLAIN)


def string(simulate: Simulate) -> dict[str, float]:
    """String stiffness, a million to one."""
    return _answers(simulate, HEAVY, STRING)


def string_unneeded(simulate: Simulate) -> dict[str, float]:
    """String stiffness where plain SPOOK would do: what it costs."""
    with_it, without = _answers(simulate, LIGHT, STRING), _answers(simulate, LIGHT, PLAIN)
    return {"energy_cost": with_it["energy_lost"] - without["energy_lost"]}


def _near(value: float) -> tuple[float, float]:
    """A part in a hundred thousand either way: the prototype agrees to a part in a million."""
    return (value * (1.0 - 1e-5), value * (1.0 + 1e-5))


def draw(simulate: Simulate) -> Drawing:
    """The load's path at a million to one."""
    result = simulate(scene(HEAVY), time_step=TIME_STEP, steps=STEPS, method=STRING, observe=OBSERVE)
    time = TIME_STEP * np.arange(STEPS + 1)
    return Drawing(
        curves=(
            line("string stiffness, 1e6 : 1", time[::4], result["places"][::4, -1, 0]),
            line("small motion", time[::4], exact_load(HEAVY, time[::4]), "reference"),
        ),
        x_label="time [s]",
        y_label="load, sideways [m]",
        note="Plain SPOOK cannot run this scene. The amplitude falls by the damping that taut links need.",
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Owed:
    """What theory gives a configuration: the limit, the band around the value, and where both come from."""

    limit: float
    set_point: tuple[float, float] | None = None
    source: str


def _metrics(role: Any, *, length: Owed, path: Owed, gain: Owed, lost: Owed) -> tuple[Metric, ...]:
    return (
        Metric(
            name="length_deviation",
            description="largest |violation| of a link in 20 s, of its length",
            unit="1",
            role=role,
            limit=length.limit,
            limit_source=length.source,
            set_point=length.set_point,
            set_point_source=length.source if length.set_point else "",
            reference=0.0,
            relative_tolerance=1e-6,
        ),
        Metric(
            name="path_error",
            description="largest distance of the load from small motion, of the start's excursion",
            unit="1",
            role="companion",
            limit=path.limit,
            limit_source=path.source,
            set_point=path.set_point,
            set_point_source=path.source if path.set_point else "",
            reference=0.0,
            relative_tolerance=1e-6,
        ),
        Metric(
            name="energy_gain",
            description="largest E − E₀, of the energy above hanging",
            unit="1",
            role="companion",
            better="smaller",
            limit=gain.limit,
            limit_source=gain.source,
            set_point=gain.set_point,
            set_point_source=gain.source if gain.set_point else "",
            reference=0.0,
            relative_tolerance=1e-6,
        ),
        Metric(
            name="energy_lost",
            description="mean loss of the last 5 s, of the energy above hanging",
            unit="1",
            role="companion",
            better="smaller",
            limit=lost.limit,
            limit_source=lost.source,
            set_point=lost.set_point,
            set_point_source=lost.source if lost.set_point else "",
            reference=0.0,
            relative_tolerance=1e-6,
        ),
    )


def ladder_error(simulate: Simulate, time_step: float, method: Method) -> float:
    """Largest distance of the load from small motion over 5 s, of the start's excursion."""
    result = simulate(
        scene(LADDER_RATIO, time_step, tilt=LADDER_TILT),
        time_step=time_step,
        duration=5.0,
        method=method,
        observe={"places": Trace(quantity=Position())},
    )
    exact = exact_load(LADDER_RATIO, result.sample_times["places"], LADDER_TILT)
    return float(np.abs(result["places"][:, -1, 0] - exact).max()) / (COUNT * LENGTH * LADDER_TILT)


def ladder_run(simulate: Simulate, time_step: float, method: Method) -> Result:
    """The same 5 s with nothing observed."""
    return simulate(
        scene(LADDER_RATIO, time_step, tilt=LADDER_TILT), time_step=time_step, duration=5.0, method=method
    )


TEST = ScalarTest(
    title="Hanging chain",
    question="Does a heavy load on a light chain swing as it should, however heavy it is?",
    why="Cranes, winches and anchors hang tons on light links. Freezing the direction of a taut link steps its "
    "sideways stiffness explicitly, and that breaks when the load is heavy.",
    model="Ten spheres of 1 kg on rigid links of 1 m hang from a fixed point; the last is heavier. All lean by "
    "0.01 rad, start at rest and swing for 20 s.",
    parameters=(
        ("time step", "1/60 s"),
        ("links", "10 of 1 m, compliance 0, damping one time step"),
        ("spheres", "1 kg; the last 300, 1e6 or 10 kg"),
        ("lean", "0.01 rad"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "Sideways, a taut link is a spring T/l. Frozen directions step it explicitly: stable while h ω < 2 for the "
        "fastest sideways mode, which for many links means T h²/(m l) < 1.",
        "String stiffness adds h² T/(4 l) to the mass across each link, and a little damping above T h²/(m l) = 0.3.",
        "Small motion: the eigenmodes of the chain with its load.",
    ),
    reference="Eigenmodes of the linear chain with load, by a dense solve.",
    conclusion="Green: mass ratio is no danger with string stiffness, and costs nothing where it is not needed. "
    "Red: tension from the last step, its sign or its damping is wrong.",
    source="ours; after the thesis, section 2.2, Mass ratio",
    measurements=(
        Measurement(
            configuration="string",
            time_step=TIME_STEP,
            metrics=_metrics(
                "gate",
                length=Owed(
                    limit=2.1e-8,
                    set_point=(2.0e-8, 2.05e-8),
                    source="curvature left out by linearised rows, ¾ h² θ̇², with the swing's θ̇ = 0.01 √(g/L): 2.04e-8",
                ),
                path=Owed(limit=0.039, set_point=(0.0386, 0.0390), source=LINEAR_MAP + "0.0388"),
                gain=Owed(
                    limit=1e-4, source="damping only takes; the lean bends small motion by its square, 1e-4"
                ),
                lost=Owed(limit=0.07, set_point=(0.0685, 0.0699), source=LINEAR_MAP + "0.0692"),
            ),
            measure=string,
            parameters={"mass ratio": HEAVY},
            note="transverse stiffness of taut links treated implicitly",
        ),
        Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            metrics=_metrics(
                "companion",
                length=Owed(limit=3.1e-8, set_point=_near(3.0257854e-8), source=ORACLE + "3.026e-8"),
                path=Owed(
                    limit=0.0084,
                    set_point=_near(8.3610699e-3),
                    source=ORACLE + "0.00836, of which half a step of phase, ½ h √(g/L), is 0.0083",
                ),
                gain=Owed(
                    limit=0.0082,
                    set_point=_near(8.1402566e-3),
                    source=ORACLE + "0.00814, of which a velocity half a step old reads ½ h √(g/L) = 0.0083",
                ),
                lost=Owed(limit=4.7e-4, set_point=_near(4.6287472e-4), source=ORACLE + "4.63e-4"),
            ),
            measure=plain,
            parameters={"mass ratio": BELOW_BREAK},
            note="the SPOOK step as it stands, below its break point",
        ),
        Measurement(
            configuration="string",
            time_step=TIME_STEP,
            metrics=(
                Metric(
                    name="energy_cost",
                    description="energy lost beyond plain SPOOK where plain SPOOK would do, of the lift",
                    unit="1",
                    role="companion",
                    limit=5e-5,
                    limit_source="both maps of small motion, with and without h² T/(4 l) on the masses: 4.8e-5",
                    reference=0.0,
                    tolerance=1e-7,
                ),
            ),
            measure=string_unneeded,
            parameters={"mass ratio": LIGHT},
            note="string stiffness where it is not needed",
        ),
    ),
    example=lambda: Example(scene=scene(HEAVY), time_step=TIME_STEP, method=STRING, observe=OBSERVE),
    figures=(Figure(name="path", title="The load at a million to one", draw=draw),),
    stability=STUDIES,
    ladders=(
        Ladder(
            name="load",
            description="largest distance of a load of 1000 : 1 from small motion over 5 s, of its excursion",
            unit="1",
            time_steps=tuple(1.0 / n for n in (30, 60, 120, 240, 480, 960)),
            configurations=(
                Configuration(name="plain", method=PLAIN, expected_order=1.0, order_range=(1 / 960, 1 / 120)),
                Configuration(
                    name="half-step",
                    method=Method(half_step_velocities=True),
                    expected_order=2.0,
                    order_range=(1 / 960, 1 / 120),
                ),
                Configuration(
                    name="string", method=STRING, expected_order=1.0, order_range=(1 / 960, 1 / 240)
                ),
                Configuration(name="string, half-step", method=STRING_HALF_STEP, expected_order=None),
            ),
            error=ladder_error,
            run=ladder_run,
            target_error=0.01,
            target_seconds=0.1,
        ),
    ),
)
