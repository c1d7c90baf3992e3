"""Instructions of a test's example by valgrind's callgrind, where the processor shows no counter.

A process under valgrind takes some steps of the example; what is counted are the instructions inside the engine's
shared objects, so that neither Python nor NumPy is among them. It
takes a minute where the example takes a millisecond: for short pieces, beside processor time and not instead of it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from spook_tracker.tracker.document.errors import TrackerError

LIMIT = 1800.0  # s
CHILD = """
import sys
from pathlib import Path
from spook_tracker.tracker.measure.questions import Questions

engine, catalogue, test, steps, told, *path = sys.argv[1:]
sys.path[:0] = path
source = Questions(engine=engine, catalogue=catalogue)
simulate, example = source.simulate(), source.tests()[test].example()
simulate(example.scene, time_step=example.time_step, steps=int(steps), method=example.method)
mapped = {line.split(None, 5)[5] for line in Path("/proc/self/maps").read_text().splitlines() if ".so" in line}
Path(told).write_text("\\n".join(sorted(mapped)))
"""
BESIDE = ("numpy", "scipy", "msgspec")  # packages that are in the process whichever engine is asked


@dataclass(frozen=True, kw_only=True)
class Counted:
    """Instructions of some steps, the scene's compilation included."""

    instructions: int
    objects: tuple[str, ...]  # file names of those that were counted


def count_instructions(
    engine: str, catalogue: str, test: str, steps: int, folder: Path | None = None
) -> Counted:
    """Count them; `folder` is where modules of a team's own are found. TrackerError where valgrind is not there or fails."""
    valgrind = shutil.which("valgrind")
    if valgrind is None:
        raise TrackerError(
            "counting by callgrind needs valgrind; install it, or count where the processor can"
        )
    with tempfile.TemporaryDirectory() as scratch:
        costs, told = Path(scratch) / "costs", Path(scratch) / "objects"
        child = [sys.executable, "-c", CHILD, engine, catalogue, test, str(steps), str(told)]
        child += [] if folder is None else [str(folder)]
        command = [valgrind, "--tool=callgrind", f"--callgrind-out-file={costs}", *child]
        try:
            done = subprocess.run(
                command, capture_output=True, text=True, errors="replace", timeout=LIMIT, check=False,
                env={**os.environ, "PYTHONHASHSEED": "0"},
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            raise TrackerError(
                f"{test} took longer than {LIMIT:g} s under valgrind; ask fewer steps"
            ) from None
        if not told.is_file() or not costs.is_file():
            last = [line for line in done.stderr.splitlines() if line.strip() and not line.startswith("==")][
                -1:
            ]
            raise TrackerError(f"{test} cannot be counted: {last[0] if last else 'valgrind said nothing'}")
        objects = filter(_of_engine, told.read_text(encoding="utf-8").split("\n"))
        by_object = self_costs(costs.read_text(encoding="utf-8", errors="replace"))
    found = {name: by_object[name] for name in objects if by_object.get(name)}
    if not found:
        raise TrackerError(
            f"{test} ran in no shared object of the engine {engine!r}: there is nothing to count"
        )
    return Counted(instructions=sum(found.values()), objects=tuple(sorted(Path(name).name for name in found)))


def _of_engine(name: str) -> bool:
    """Whether a shared object is neither the system's, nor Python's, nor of a package that is there anyhow."""
    parts = Path(name).parts
    installed = "site-packages" in parts or "dist-packages" in parts
    if not installed and name.startswith(("/usr/", "/lib", f"{sys.base_prefix}/lib/")):
        return False
    return not {part.partition(".")[0] for part in parts} & set(BESIDE)


def self_costs(text: str) -> dict[str, int]:
    """Instructions by shared object, of a callgrind profile; what was spent in calls counts where it was spent."""
    names: dict[str, str] = {}
    costs: dict[str, int] = {}
    place, inclusive = "", False
    for line in text.splitlines():
        kind, _, rest = line.partition("=")
        if kind in (
            "ob",
            "cob",
        ):  # a name stands where its number comes first, be it of the one that is called
            number, _, name = rest.partition(" ")
            name = names.setdefault(number, name or number)
            place = name if kind == "ob" else place
        elif line.startswith("calls="):
            inclusive = True  # the next line is what the call cost altogether
        elif line[:1].isdigit() or line[:1] in ("+", "-", "*"):
            if not inclusive:
                _, _, cost = line.partition(" ")
                costs[place] = costs.get(place, 0) + int(cost or 0)
            inclusive = False
    return costs
