"""Our particle kernels against loops written by hand for one scene each, interleaved in one run.

Prints nanoseconds per step and their ratio; both sides must end in the same state. Then cost per step, memory and
order against the number of links, and what forcing the general solver into a chain would cost.
"""

from __future__ import annotations

import ctypes
import math
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent))

from bench.floors import here
from spook_tracker.engine import CentralGravity, Distance, Method, Particle, Scene, compile

STEP = 1 / 60  # s
REPEATS = 60  # short slices: the least of many is undisturbed even on a busy machine
DOWN = (0.0, 0.0, -9.81)
LIMITS = {
    "falling": 3.0,
    "planetarium": 1.5,
    "pendulum": 1.5,
    "chain of 26": 1.5,
}  # ns for falling, as bench/floors.py carries it to this machine; else ratio
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
    "iterative, 50 sweeps": Method(solver="iterative", iterations=50, residual_tolerance=0.0),
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


def against_hand_loops() -> bool:
    """The ratio table; whether every line keeps its limit."""
    kept = True
    with tempfile.TemporaryDirectory() as folder:
        loops = build_loops(Path(folder))
        print(f"{'scene':<14}{'ours, ns/step':>16}{'by hand':>10}{'ratio':>8}{'limit':>12}  same state")
        for name, scene, steps in (
            (
                "falling",
                Scene(bodies=(Particle(name="0", mass=1.0, position=(0, 0, 0)),), gravity=DOWN),
                2_000_000,
            ),
            ("planetarium", planetarium(), 30_000),
            ("pendulum", chain(1), 20_000),
            ("chain of 26", chain(26), 2_000),
        ):
            function = getattr(loops, name.split()[0])
            function.restype = ctypes.c_double
            arguments = [ctypes.c_long(26)] if name.startswith("chain") else []
            program = compile(scene, time_step=STEP)
            ours, hand = math.inf, math.inf
            for _ in range(REPEATS):
                begin = time.perf_counter()
                end = function(*arguments, ctypes.c_long(steps))
                hand = min(hand, (time.perf_counter() - begin) / steps * 1e9)
                result = program.run(steps)
                ours = min(ours, result.seconds / steps * 1e9)
            state = next(reversed(result.final_state.values()))
            same = abs(state[2 if name == "falling" else 0] - end) <= 1e-9 * max(1.0, abs(end))
            limit = here(LIMITS[name], "arithmetic") if name == "falling" else LIMITS[name]
            kept &= ours <= limit if name == "falling" else ours <= limit * hand
            text = f"{limit:.2f} ns" if name == "falling" else f"{limit:g} x"
            # Chaotic chains part at rounding level within 2 000 steps: compared over the first second only.
            if name.startswith("chain"):
                short = program.run(60)
                end = function(*arguments, ctypes.c_long(60))
                same = abs(next(reversed(short.final_state.values()))[0] - end) < 1e-9
            print(
                f"{name:<14}{ours:>16.2f}{hand:>10.2f}{ours / hand:>8.2f}{text:>12}  {'yes' if same else 'NO'}"
            )
            kept &= same
    return kept


def against_the_number_of_links() -> None:
    """Cost per link and step, and memory per link, from 10 to 100 000 links."""
    print(f"\n{'links':>8}{'ns/step':>14}{'ns/link':>10}{'memory, bytes/link':>20}")
    for links in (10, 100, 1_000, 10_000, 100_000):
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        program = compile(chain(links), time_step=1e-3)
        steps = max(16, 100_000 // links)
        seconds = min(program.run(steps).seconds for _ in range(20)) / steps
        grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024 / links
        print(f"{links:>8}{seconds * 1e9:>14.0f}{seconds * 1e9 / links:>10.1f}{grown:>20.0f}")


def against_methods() -> bool:
    """What each option costs on the 26 links, plain being 1; whether the corrections keep their limits."""
    kept = True
    print(f"\n{'chain of 26':<36}{'ns/step':>10}{'times plain':>14}{'limit':>8}")
    plain = 0.0
    for name, method in METHODS.items():
        program = compile(chain(26), time_step=1e-3, method=method)
        steps = 500 if method.solver == "direct" else 50
        cost = min(program.run(steps).seconds for _ in range(100)) / steps * 1e9
        plain = plain or cost
        limit = CORRECTIONS.get(name, math.inf)
        kept &= cost <= limit * plain
        text = f"{limit:>8.1f} x" if limit < math.inf else ""
        print(f"{name:<36}{cost:>10.0f}{cost / plain:>14.2f}{text}")
    return kept


if __name__ == "__main__":
    kept = against_hand_loops()
    against_the_number_of_links()
    kept &= against_methods()
    print("\nevery limit kept" if kept else "\nA LIMIT IS NOT KEPT")
    sys.exit(0 if kept else 1)
