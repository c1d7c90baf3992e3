"""Do lock joints hold a beam of boxes on two piles?

A lock that gives way by rounding alone lets a rigid beam lie where it was put. The measure is the deepest sag
over the last 50 of 1000 steps, over the beam's length. What a solver hides in its locks (a floor in the matrix, an
iteration stopped early) shows here first: the deflection grows with the fourth power of the length.
"""

from __future__ import annotations

import numpy as np

from spook_tracker.engine import PLAIN, MaximumAbsolute, Method, Position, Result, Trace
from spook_tracker.scalar_tests.beam.scene import (
    COUNT,
    SAG,
    SAG_COMPLIANCE,
    SIZE,
    STEPS,
    TIME_STEP,
    deviation,
    heights,
    sag_of_compliant_beam,
    scene,
)
from spook_tracker.scalar_tests.beam.stability import STUDIES
from spook_tracker.scalar_tests.case import (
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
)

LADDER_COUNT = 20


def _measure_gate(simulate: Simulate) -> dict[str, float]:
    return {"height_deviation": deviation(simulate)}


def _measure_long(simulate: Simulate) -> dict[str, float]:
    return {"height_deviation": deviation(simulate, count=2000)}


def _measure_sag(simulate: Simulate) -> dict[str, float]:
    each = heights(simulate, compliance=SAG_COMPLIANCE)
    return {"sag": float(-each.min()), "sag_error": float(-each.min()) / sag_of_compliant_beam() - 1.0}


def _measure_support(support: str) -> object:
    def measure(simulate: Simulate) -> dict[str, float]:
        return {"height_deviation": deviation(simulate, support=support)}

    return measure


def _draw_against_time_step(simulate: Simulate) -> Drawing:
    steps = tuple(float(h) for h in np.geomspace(1e-4, 1e-1, 13))
    values = tuple(deviation(simulate, time_step=h) for h in steps)
    return Drawing(
        curves=(Curve(name="80 boxes", x=steps, y=values),),
        x_label="time step [s]",
        y_label="largest height deviation over length [%]",
        x_scale="log",
        note=(
            "The thesis reads down to −2e-7 % near h = 1e-4 s, where its beam never stopped ringing; here the "
            "damping follows the time step and only rounding is left."
        ),
    )


def _draw_against_time(simulate: Simulate) -> Drawing:
    step = 9.8e-5
    result = simulate(
        scene(time_step=step),
        time_step=step,
        steps=STEPS,
        observe={"height": Trace(quantity=Position(), every=5, from_start=True)},
    )
    drops = result["height"][:, :COUNT, 2]
    lowest = 100.0 * drops.min(axis=1) / (COUNT * SIZE[0])
    times = tuple(float(t) for t in result.sample_times["height"])
    return Drawing(
        curves=(Curve(name="80 boxes, h = 9.8e-5 s", x=times, y=tuple(map(float, lowest)), style="line"),),
        x_label="time [s]",
        y_label="lowest height deviation over length [%]",
        note="The thesis' beam rings at this time step (about −1e-6 %).",
    )


def _draw_along_the_beam(simulate: Simulate) -> Drawing:
    rigid = heights(simulate)
    soft = heights(simulate, compliance=2.2e-15)
    boxes = tuple(float(i + 1) for i in range(COUNT))
    return Drawing(
        curves=(
            Curve(name="compliance 0", x=boxes, y=tuple(map(float, 1e6 * rigid))),
            Curve(name="compliance 2.2e-15", x=boxes, y=tuple(map(float, 1e6 * soft)), style="line"),
        ),
        x_label="box",
        y_label="height deviation [µm]",
        note=(
            "The printed limit is what a hidden compliance of 2.2e-15 in every lock row would give. "
            "The thesis' figure reads −5e-9 m at the middle, ten times its own limit."
        ),
    )


def _draw_against_count(simulate: Simulate) -> Drawing:
    counts = (10, 20, 40, 60, 80, 100, 150, 200)
    values = tuple(deviation(simulate, count=count) for count in counts)
    return Drawing(
        curves=(Curve(name="compliance 0", x=tuple(map(float, counts)), y=values),),
        x_label="boxes",
        y_label="largest height deviation over length [%]",
        x_scale="log",
        note="In the thesis the deviation grows from about 100 boxes on, down to −8e-8 %.",
    )


WOULD_CATCH = "thesis, section 4.2; it would catch a hidden compliance of 2.3e-15 in the locks"


def _deviation_metric(role: str, limit: float | None, source: str, set_point: float) -> Metric:
    return Metric(
        name="height_deviation",
        description="largest height deviation of a box over the beam's length, last 50 of 1000 steps",
        unit="%",
        role=role,  # type: ignore[arg-type]
        limit=limit,
        limit_source=source,
        set_point=(-set_point, set_point),
        set_point_source="rigid locks leave rounding only: a few units in the last place of the height",
        reference=0.0,
        tolerance=1e-13,
    )


def ladder_error(simulate: Simulate, time_step: float, method: Method) -> float:
    """Largest height deviation of LADDER_COUNT boxes over 2 s, of their length [%]."""
    built = scene(LADDER_COUNT, time_step=time_step)
    observe = {"place": MaximumAbsolute(quantity=Position(), from_start=True)}
    result = simulate(built, time_step=time_step, duration=2.0, method=method, observe=observe)
    return 100.0 * float(result["place"][:LADDER_COUNT, 2].max()) / (LADDER_COUNT * SIZE[0])


def ladder_run(simulate: Simulate, time_step: float, method: Method) -> Result:
    """The same beam with nothing observed."""
    built = scene(LADDER_COUNT, time_step=time_step)
    return simulate(built, time_step=time_step, duration=2.0, method=method)


TEST = ScalarTest(
    title="Beam on two piles",
    question="Do lock joints hold a beam of 80 boxes on two piles?",
    why=(
        "Long chains of rigid joints are where iterative solvers and hidden softness show: most engines let this "
        "beam fall through between its piles at a time step of 1/60 s."
    ),
    model=(
        "80 boxes in a row, each locked to the next, lie on two fixed piles under the centres of the end boxes, "
        "one frictionless unilateral contact each. All start at rest. Variants rest on an edge of each pile or on "
        "four corners, where contact forces are no longer unique."
    ),
    parameters=(
        ("boxes", "80, each 0.125 × 0.1 × 0.1 m, 2.5 kg"),
        ("gravity", "9.81 m/s²"),
        ("locks", "compliance 0, damping 2 h"),
        ("time step", "1/60 s, 1000 steps"),
    ),
    theory=(
        "With compliance 0 the discrete method keeps every lock closed: z = z₀ up to rounding.",
        "With compliance c a lock gives way by c M in angle and c V in height, M and V being moment and shear.",
        "sag = c Σ (M m + V v) over the locks, m and v for a unit load at the middle (unit-load theorem).",
        "c = 1e-12 sags 2.134e-7 m at 80 boxes.",
    ),
    reference="0; with compliance, the unit-load theorem over the locks (closed form).",
    conclusion=(
        "Green: the locks carry the beam with nothing hidden in the matrix. Red: some compliance, iteration error "
        "or loss of digits lets it sag."
    ),
    source="thesis, sections 3.2.1 and 4.2",
    misprints=(
        "Figure 3.4 reads 5e-9 m for the deepest box, which over 10 m is 5e-8 %: ten times the limit of 4.9e-9 % "
        "printed in section 4.2 and the value of Figure 3.5 at 80 boxes.",
    ),
    measurements=(
        Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            parameters={"N": COUNT},
            metrics=(_deviation_metric("gate", 4.9e-9, WOULD_CATCH, 1e-12),),
            measure=_measure_gate,
            note="Plain SPOOK, direct solver; one contact under the centre of each end box.",
        ),
        Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            parameters={"N": 2000},
            metrics=(_deviation_metric("companion", 1e-12, "set point: rounding only", 1e-12),),
            measure=_measure_long,
            note="A beam of 250 m, 25 times the thesis' length.",
        ),
        Measurement(
            configuration="compliant",
            time_step=TIME_STEP,
            parameters={"N": COUNT},
            metrics=(
                Metric(
                    name="sag",
                    description="deepest sag with compliance 1e-12 in every lock row",
                    unit="m",
                    role="reported",
                    reference=SAG,
                ),
                Metric(
                    name="sag_error",
                    description="sag over the closed form, minus one: the beam must bend exactly as much as asked",
                    unit="1",
                    role="companion",
                    limit=1e-3,
                    limit_source="unit-load theorem, 0.1 %",
                    reference=0.0,
                    tolerance=1e-8,
                ),
            ),
            measure=_measure_sag,
            note="Compliance 1e-12: proves that the gate is not green because nothing can bend.",
        ),
        *(
            Measurement(
                configuration=support,
                time_step=TIME_STEP,
                parameters={"N": COUNT},
                metrics=(_deviation_metric("companion", 4.9e-9, "thesis, section 4.2", 1e-12),),
                measure=_measure_support(support),  # type: ignore[arg-type]
                note=note,
            )
            for support, note in (
                ("edge", "Each pile touches along an edge: two contacts, one more than needed."),
                ("corners", "Each pile carries four corners: contact forces are not unique."),
            )
        ),
    ),
    example=lambda: Example(scene=scene(), time_step=TIME_STEP),
    figures=(
        Figure(
            name="deviation-against-time-step",
            title="Largest height deviation against the time step",
            draw=_draw_against_time_step,
            thesis="Fig 3.2",
        ),
        Figure(
            name="deviation-against-time",
            title="Height deviation against time at h = 9.8e-5 s",
            draw=_draw_against_time,
            thesis="Fig 3.3",
        ),
        Figure(
            name="deviation-along-the-beam",
            title="Height deviation along the beam",
            draw=_draw_along_the_beam,
            thesis="Fig 3.4",
        ),
        Figure(
            name="deviation-against-length",
            title="Largest height deviation against the number of boxes",
            draw=_draw_against_count,
            thesis="Fig 3.5",
        ),
    ),
    seven=True,
    ladders=(
        Ladder(
            name="height",
            description="largest height deviation of 20 boxes over 2 s, of their length",
            unit="%",
            time_steps=tuple(1.0 / n for n in (15, 30, 60)),
            configurations=(
                Configuration(name="direct", method=PLAIN, expected_order=None),
                Configuration(
                    name="direct, no refinement", method=Method(refinements=0), expected_order=None
                ),
                Configuration(
                    name="iterative, 50 sweeps", method=Method(solver="iterative"), expected_order=None
                ),
                Configuration(
                    name="iterative, 200 sweeps",
                    method=Method(solver="iterative", iterations=200),
                    expected_order=None,
                ),
            ),
            error=ladder_error,
            run=ladder_run,
            target_error=None,
            target_seconds=None,
        ),
    ),
    stability=STUDIES,
)
