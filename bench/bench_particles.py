"""Our particle kernels against loops written by hand for one scene each, interleaved in one run.

Both sides must end in the same state. Then the cost per link against their number, and what each option of
the method costs.
"""

from __future__ import annotations

import ctypes
import math
import shutil
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

from bench.costs import asked, bench, cost, exact, in_units
from spook_tracker.engine import CentralGravity, Distance, Method, Particle, Scene, compile

STEP = 1 / 60  # s
REPEATS = 60  # short slices: the least of many is undisturbed even on a busy machine
DOWN = (0.0, 0.0, -9.81)
CORRECTIONS = {"one correction": 2.5, "two corrections": 3.3}  # times plain: a pass down and one up for each

METHODS = {
    "plain": Method(),
    "half-step velocities": Method(half_step_velocities=True),
    "one correction": Method(corrections=1),
    "two corrections": Method(corrections=2),
    "composition of order 4": Method(composition="order4"),
    "composition of order 8": Method(composition="order8"),
    "general solver forced in": Method(force_stages=("solve_block",)),
    "string stiffness": Method(string_stiffness=True),
    "iterative, 50 iterations": Method(solver="iterative", iterations=50, residual_tolerance=0.0),
}


def chain(links: int) -> Scene:
    """A horizontal line of unit links, the first end fixed."""
    bodies = [Particle(name=f"{i}", mass=1.0, position=(i + 1.0, 0.0, 0.0)) for i in range(links)]
    rows = [
        Distance(
            name=f"row {i}",
            between=(f"{i - 1}" if i else (0.0, 0.0, 0.0), f"{i}"),
            rest_length=1.0,
            compliance=1e-13,
            damping=STEP,
        )
        for i in range(links)
    ]
    return Scene(bodies=bodies, constraints=rows, gravity=DOWN)


def planetarium() -> Scene:
    """The thesis' planet on its slightly eccentric orbit."""
    k, xi = 2 * math.pi / 365, 0.017
    planet = Particle(name="planet", mass=1.0, position=(1.0, 0.0, 0.0), velocity=(-xi * k, k, 0.0))
    return Scene(bodies=(planet,), forces=(CentralGravity(name="sun", strength=k * k),))


def build_loops(folder: Path, name: str = "loops.cpp") -> ctypes.CDLL:
    """Compile a file of this folder the way the engine is compiled."""
    compiler = next((c for c in ("c++", "g++", "clang++") if shutil.which(c)), None)
    if compiler is None:
        sys.exit("bench: there is no C++ compiler on the path")
    library = folder / f"{name}.so"
    source = Path(__file__).with_name(name)
    subprocess.run(
        [
            compiler,
            "-std=c++20",
            "-O3",
            "-ffp-contract=off",
            "-shared",
            "-fPIC",
            str(source),
            "-o",
            str(library),
        ],
        check=True,
    )
    return ctypes.CDLL(str(library))


def falling() -> Scene:
    return Scene(bodies=(Particle(name="0", mass=1.0, position=(0, 0, 0)),), gravity=DOWN)


def against_a_hand_loop(scene: Scene, name: str, steps: int, links: int = 0) -> dict[str, float]:
    """Both sides' cost of a step, and how far apart they end [m]: of chains, which are chaotic, in the first second."""
    with tempfile.TemporaryDirectory() as folder:
        function = getattr(build_loops(Path(folder)), name)
        function.restype = ctypes.c_double
        arguments = [ctypes.c_long(links)] if links else []
        program = compile(scene, time_step=STEP)
        ours, hand = math.inf, math.inf
        for _ in range(REPEATS):
            begin = time.perf_counter()
            function(*arguments, ctypes.c_long(steps))
            hand = min(hand, (time.perf_counter() - begin) / steps)
            ours = min(ours, program.run(steps).seconds / steps)
        compared = 60 if links else steps
        state = next(reversed(program.run(compared).final_state.values()))
        end = function(*arguments, ctypes.c_long(compared))
    apart = abs(state[2 if name == "falling" else 0] - end) / max(1.0, abs(end))
    return {"times_by_hand": ours / hand, "step": in_units(ours, "operation"), "apart": apart}


def against_the_number_of_links(links: int) -> dict[str, float]:
    program = compile(chain(links), time_step=1e-3)
    steps = max(16, 100_000 // links)
    seconds = min(program.run(steps).seconds for _ in range(20)) / steps
    return {"link": in_units(seconds / links, "operation")}


def against_methods() -> dict[str, float]:
    """What each option costs on the 26 links, plain being 1."""
    costs = {}
    for name, method in METHODS.items():
        program = compile(chain(26), time_step=1e-3, method=method)
        steps = 500 if method.solver == "direct" else 50
        costs[name] = min(program.run(steps).seconds for _ in range(100)) / steps
    return {name: each / costs["plain"] for name, each in costs.items()}


BY_HAND = cost("times_by_hand", "a step, by the loop written for this scene", 1.5, "what being general costs")
# Where the compiler folds the whole loop by hand into a formula, a step is told in operations.
FALLING = cost("step", "a step of one falling particle", 6.4, "three sums, three products", unit="operation")
APART = exact("apart", "how far from the loop's end we end, of the way", 1e-9, "rounding", unit="1")
TESTS = {
    "particles": bench(
        "Particles",
        "What does a step of particles cost, beside loops written by hand?",
        asked(
            "falling",
            partial(against_a_hand_loop, falling(), "falling", 2_000_000),
            FALLING,
            APART,
            time_step=STEP,
        ),
        *(
            asked(title, partial(against_a_hand_loop, scene, *how), BY_HAND, APART, time_step=STEP)
            for title, scene, *how in (
                ("planetarium", planetarium(), "planetarium", 30_000),
                ("pendulum", chain(1), "pendulum", 20_000),
                ("chain of 26", chain(26), "chain", 2_000, 26),
            )
        ),
        asked(
            "options of chain of 26",
            against_methods,
            *(cost(name, "a step, by a plain one", CORRECTIONS.get(name)) for name in METHODS),
            time_step=1e-3,
        ),
        *(
            asked(
                f"chain of {links}",
                partial(against_the_number_of_links, links),
                cost("link", "a step, a link", unit="operation"),
                time_step=1e-3,
            )
            for links in (10, 100, 1_000, 10_000, 100_000)
        ),
        beside="a loop in C++ that knows the scene, compiled alike",
    )
}
