"""The numbers asked of the loaded chain: units, limits, set points and where they come from, configuration by configuration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from spook_tracker import engine

from ... import case
from .measure import STRING_HALF_STEP, ladder_error, plain, string, string_unneeded
from .scene import BELOW_BREAK, HEAVY, LIGHT, STRING, TIME_STEP

LINEAR_MAP = "the powers of the map of small motion, with h² T/(4 l) and its damping on the masses: "

ORACLE = "the method's own discrete solution, tests/oracles/particles.py: "


def _near(value: float) -> tuple[float, float]:
    """A part in a hundred thousand either way: the prototype agrees to a part in a million."""
    return (value * (1.0 - 1e-5), value * (1.0 + 1e-5))


@dataclass(frozen=True, slots=True, kw_only=True)
class Owed:
    """What theory gives a configuration: the limit, the band around the value, and where both come from."""

    limit: float
    set_point: tuple[float, float] | None = None
    source: str


def _metrics(role: Any, *, length: Owed, path: Owed, gain: Owed, lost: Owed) -> tuple[case.Metric, ...]:
    return (
        case.Metric(
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
        case.Metric(
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
        case.Metric(
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
        case.Metric(
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


MEASUREMENTS = (
    case.Measurement(
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
    case.Measurement(
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
    case.Measurement(
        configuration="string",
        time_step=TIME_STEP,
        metrics=(
            case.Metric(
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
)

LADDERS = (
    case.Ladder(
        name="load",
        description="largest distance of a load of 1000 : 1 from small motion over 5 s, of its excursion",
        unit="1",
        time_steps=tuple(1.0 / n for n in (30, 60, 120, 240, 480, 960)),
        configurations=(
            case.Configuration(
                name="plain", method=engine.PLAIN, expected_order=1.0, order_range=(1 / 960, 1 / 120)
            ),
            case.Configuration(
                name="half-step",
                method=engine.Method(half_step_velocities=True),
                expected_order=2.0,
                order_range=(1 / 960, 1 / 120),
            ),
            case.Configuration(
                name="string", method=STRING, expected_order=1.0, order_range=(1 / 960, 1 / 240)
            ),
            case.Configuration(name="string, half-step", method=STRING_HALF_STEP, expected_order=None),
        ),
        error=ladder_error,
        target_error=0.01,
        target_seconds=0.1,
    ),
)
