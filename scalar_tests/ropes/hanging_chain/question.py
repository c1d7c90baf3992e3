"""Does a heavy load on a light chain swing as it should, however heavy it is?"""

from __future__ import annotations

from ... import case
from .measure import draw
from .metrics import LADDERS, MEASUREMENTS
from .scene import HEAVY, OBSERVE, STRING, TIME_STEP, scene
from .stability import STUDIES

TEST = case.ScalarTest(
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
    measurements=MEASUREMENTS,
    example=lambda: case.Example(scene=scene(HEAVY), time_step=TIME_STEP, method=STRING, observe=OBSERVE),
    figures=(case.Figure(name="path", title="The load at a million to one", draw=draw),),
    stability=STUDIES,
    ladders=LADDERS,
)
