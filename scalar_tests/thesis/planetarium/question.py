"""Does an orbit stay an orbit, over years and over millions of steps?"""

from __future__ import annotations

from ... import case
from .figures import FIGURES
from .measure import FASTEST, OBSERVE, fastest, largest_step
from .metrics import LADDERS, MEASUREMENTS
from .scene import TIME_STEP, scene

TEST = case.ScalarTest(
    title="Planetarium",
    question="Is the integrator stable over many rounds of an orbit?",
    why="Errors that add up show only after a long time: an orbit that gains energy flies off, one that loses it "
    "falls in. A method that keeps structure does neither for millions of steps.",
    model="A planet of 1 kg moves under the attraction k²/r² of a sun that stays at the origin. It is a particle "
    "and nothing constrains it.",
    parameters=(
        ("time step", "1/60 s; figure up to 5 s"),
        ("mass", "1 kg"),
        ("k", "2π/365 per second"),
        ("start", "x = (1, 0, 0) m, v = (−ξ k, k, 0) m/s, ξ = 0.017"),
        ("duration", "1200 s; long run 1.404e6 steps, 6.5 h"),
    ),
    theory=(
        "ẍ = −k² x/r³, E = ½ v² − k²/r, L = x × v",
        "r(θ) = 1/(1 + ξ sin θ), period 2π a^(3/2)/k = 365.1583 s with a = 1/(1 − ξ²)",
        "The step is symplectic Euler: L is kept exactly, E swings by 2 h k ξ and does not drift.",
        "With velocities at mid-step the swing and the error of position are second order in h.",
    ),
    reference="Kepler's equation for the position, the conic for the radius, conservation for E and L.",
    conclusion="Green: the orbit is stable and as accurate as the method allows. Red: the force, the order of the "
    "update or the reading of the energy is wrong.",
    source="thesis, section 3.2.7 and section 4.2",
    seven=True,
    misprints=(
        "Eq 3.18 has ½v² + k²/r. It must be a minus: with the plus even the exact orbit swings by 2.266 %, "
        "and this step's by 2.286 %, which is what Figs 3.33 and 3.35 and the limit of 2.37 % show. Both readings are gated here.",
        "The period is 365.16 s, not 363 s.",
        "The axis labels of Figs 3.34 and 3.35 are swapped.",
    ),
    measurements=MEASUREMENTS,
    example=lambda: case.Example(scene=scene(), time_step=TIME_STEP, observe=OBSERVE),
    figures=FIGURES,
    ladders=LADDERS,
    stability=(
        case.StabilityStudy(
            name="largest-time-step",
            title="Largest time step that keeps the orbit",
            configuration="plain",
            definition="the distance to the sun stays between ½ and 2 m for ten rounds, and the energy within 10 %",
            study=largest_step,
            unit="s",
            expected=(15.8, 19.0),
            expected_source="the start, half a step off, adds h k/2 to the eccentricity ξ, so the energy swings by 2 h k (ξ + h k/2): 10 % at h = 17.4 s; the next order is (h k)² = 9 % of it",
        ),
        case.StabilityStudy(
            name="fastest",
            title="Fastest planet, over a circle's speed, that turns back within ten years",
            configuration="plain",
            definition="it starts across its radius, and after ten rounds of the circle it has been farther; h = 1 s",
            study=fastest,
            unit="1",
            expected=(0.999 * FASTEST, 1.0002 * FASTEST),
            expected_source="Kepler: half a round of a = 1/(2 − s²) takes ½ a^(3/2) years, ten at s = 1.365; (h k)² = 3e-4 moves a "
            "start, the search ends 5e-4 short",
        ),
    ),
)
