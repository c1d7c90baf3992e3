"""Is a real steel beam, clamped at one end and loaded at the other, simulated rightly?

Nothing is tuned: each lock gets the compliance of the piece of beam it stands for, dx/(EI) in rotation and
dx³/(12 EI) in shear, half a piece at the wall. Then the nodes lie exactly on the Euler-Bernoulli curve.
"""

from __future__ import annotations

from ... import case
from .figures import draw_against_count, draw_difference, draw_shape
from .metrics import LADDERS, MEASUREMENTS
from .scene import TIME_STEP, scene
from .stability import STUDIES

TEST = case.ScalarTest(
    title="Cantilever",
    question="Is a real steel beam, clamped at one end and loaded at the other, simulated rightly?",
    why="An engineer wants material constants to go in and the right deflection to come out, with nothing tuned.",
    model=(
        "A HEA 120 beam of 12 m in pieces, each locked to the next and the first to the wall. Every lock has the "
        "compliance of the piece it stands for. A load of 10 kg hangs at the tip; the beam settles."
    ),
    parameters=(
        ("beam", "12 m, 60 elements of 0.2 × 0.120 × 0.114 m, 19.9 kg/m"),
        ("modulus, second moment", "E = 210e9 Pa, I = 2.305e-6 m⁴"),
        ("load", "10 kg × 9.81 m/s² = 98.1 N at the tip"),
        ("locks", "rotation dx/(EI), shear dx³/(12EI), axial 0"),
        ("damping", "0.5 s"),
        ("time step", "1/60 s"),
    ),
    theory=(
        "h(x) = P x² (3l − x)/(6EI), tip P l³/(3EI) = 0.11673505 m.",
        "A piece of beam of length d bends by M d/(EI) about its middle and shears by V d³/(12EI): with these two "
        "compliances a chain of rigid pieces passes through the exact nodes.",
        "At rest g = −ε F for any time step and damping, so the answer is static.",
        "Large deflections shorten the lever: the elastica EI θ'' = −P cos θ ends (4/35)(P l²/(EI))² = 9.73e-5 short.",
    ),
    reference="Euler-Bernoulli (closed form) for small loads; the elastica by collocation for the printed load.",
    conclusion="Green: compliance means what it says. Red: joints are softer, stiffer or wrongly placed.",
    source="thesis, section 3.2.8",
    misprints=(
        "60 elements of 0.125 m are 7.5 m, not 12 m; 2.985 kg is 0.15 m of 19.9 kg/m. Here 60 elements of 0.2 m.",
        "I = 2.305e-6 m⁴ is the weak axis of the profile, while the drawn box stands on its strong one.",
        "The printed compliance 1e-8 is far too stiff (0.0029 m at the tip); the figure must have used another.",
        "A speed under 1e-4 m/s is met at every turning point; here all speeds must stay under it for a second.",
        "Equation 3.20 leaves out the beam's own weight, which alone would bend it by 1.0454 m.",
    ),
    measurements=MEASUREMENTS,
    example=lambda: case.Example(scene=scene(), time_step=TIME_STEP),
    figures=(
        case.Figure(name="shape", title="The bent beam", draw=draw_shape, thesis="Fig 3.37, upper"),
        case.Figure(
            name="difference",
            title="Simulation minus formula",
            draw=draw_difference,
            thesis="Fig 3.37, lower",
        ),
        case.Figure(name="error-against-count", title="Node error against elements", draw=draw_against_count),
    ),
    ladders=LADDERS,
    stability=STUDIES,
)
