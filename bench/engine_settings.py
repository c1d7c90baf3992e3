"""What the page of engines says of how each is asked: what its makers would object to, and how a better setting is sent.

`tracker engines` says what the settings are and what each rests on; an adapter's `configurations` hold both.
"""

from __future__ import annotations

from collections.abc import Mapping

OBJECTIONS: Mapping[str, str] = {
    "box3d": "a substep is its way to accuracy, and a ladder of whole steps with a fixed number of them is not how it is tuned; springs beside centres are pushed once a step and not in each substep, as its own give by a frequency; it is made for heaps in games, in single precision and in parallel",
    "cannon": "it is made for the web, where a frame has 16 ms: 500 sweeps, and stiffnesses of 1e15, are far from its own",
    "dart": "springs and fields are pushed from Python before each step, which its C++ does not need, and so are the speeds of its servos; its own hinge as a constraint is not asked (two points hold it)",
    "drake": "it is made for controllers whose error is held, not for a held step: its error-controlled integrators are not asked, and the ladder's steps are long for SAP",
    "exudyn": "implicit steps pay where a system is stiff or large, and most scenes here are neither; its contacts are not asked for",
    "jolt": "it is asked through WebAssembly on one thread, where its C++ has all cores; 100 iterations are beyond any game",
    "mjx": "it is made for thousands of worlds on an accelerator: one world on one core is its worst case",
    "motrixsim": "it is made for many worlds at once on all cores, and is asked one on one; its single precision is a choice for learning",
    "mujoco": "soft contacts and regularised friction are a choice, for inverse dynamics and control; asked as if they were hard, it is stiffer than its makers advise for speed; a motor is its row of dry friction told a speed to hold, from Python in every stage, which its manual does not know",
    "mujoco_warp": "as of mjx: it is made for a GPU, and is compiled for a CPU here",
    "newton": "it is made for many worlds on a GPU: in single precision, one world on one core, none of its six solvers is in its place",
    "p2": "it is made for games in a plane, by a small number of sweeps",
    "pybullet": "500 sweeps are ten times what it asks for, and loads are pushed from Python before each step; its own step is 1/240 s; where bodies bounce it sees contacts later and mends depths more slowly than it does unasked",
    "rapier": "it is asked through WebAssembly on one thread; its 100 iterations are steps within a step, whose rounding turns free bodies too fast where steps are small: 4 of 25 sweeps each keep them, but open chains wider and fall further off, so they are not asked",
    "rapier3d": "as of rapier, by its bindings for Python, which push fields before each step and are asked for belts within it; its friction for each point of contact (coulomb) is there to show what forces of friction are, and costs more",
    "sapien": "PhysX is made for a GPU and for many bodies; its articulations are not asked",
    "simbody": "it is made for the motion of people and machines with a dozen joints, by integrators that hold the error, and OpenSim around it costs time; heaps at a step that is given are not its trade",
}

SETTINGS = (
    "## How each engine is asked, and what its makers would object to",
    "",
    "`tracker engines` tells every setting of every engine here, and what it rests on: its manual, its own examples, or what one",
    "gets without asking. What could be said against them:",
    "",
    "| engine | what its makers would object to |",
    "|---|---|",
    *(f"| {name} | {words} |" for name, words in OBJECTIONS.items()),
    "",
    "A better setting is a `Configuration` of a few lines in `engine/peers/ENGINE.py`, with where it is advised as its reason",
    "(`docs/engine-protocol.md`); `python bench/engines.py ENGINE` asks that engine alone again, and the page is made anew with it.",
    "",
)
