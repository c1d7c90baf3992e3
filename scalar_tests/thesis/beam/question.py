"""Do lock joints hold a beam of boxes on two piles?

A lock that gives way by rounding alone lets a rigid beam lie where it was put. The measure is the deepest sag
over the last 50 of 1000 steps, over the beam's length. What a solver hides in its locks (a floor in the matrix, an
iteration stopped early) shows here first: the deflection grows with the fourth power of the length.
"""

from __future__ import annotations

from ... import case
from .measure import draw_against_count, draw_against_time, draw_against_time_step, draw_along_the_beam
from .metrics import LADDERS, MEASUREMENTS
from .scene import TIME_STEP, scene
from .stability import STUDIES

TEST = case.ScalarTest(
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
        "printed in section 4.2 and the value of Figure 3.5 at 80 boxes. One compliance hidden in every lock, 2.3e-15 m/N, sags by "
        "that limit at 80 boxes, and 2.5e-15 by the 8e-8 % of Figure 3.5 at 200; Figure 3.4 would need 2.3e-14: its scale is the "
        "likely misprint.",
    ),
    measurements=MEASUREMENTS,
    example=lambda: case.Example(scene=scene(), time_step=TIME_STEP),
    figures=(
        case.Figure(
            name="deviation-against-time-step",
            title="Largest height deviation against the time step",
            draw=draw_against_time_step,
            thesis="Fig 3.2",
        ),
        case.Figure(
            name="deviation-against-time",
            title="Height deviation against time at h = 9.8e-5 s",
            draw=draw_against_time,
            thesis="Fig 3.3",
        ),
        case.Figure(
            name="deviation-along-the-beam",
            title="Height deviation along the beam",
            draw=draw_along_the_beam,
            thesis="Fig 3.4",
        ),
        case.Figure(
            name="deviation-against-length",
            title="Largest height deviation against the number of boxes",
            draw=draw_against_count,
            thesis="Fig 3.5",
        ),
    ),
    seven=True,
    ladders=LADDERS,
    stability=STUDIES,
)
