"""Engines written in JavaScript: found in a node_modules folder, run by Node, one process a simulation.

The process gets a task as JSON and answers with a line of JSON and the states as float64, so nothing is rounded.
Starting Node is set-up and not timed. What does not answer in time is ended; what dies is a crash.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from spook_tracker.engine.recording import Recording
from spook_tracker.engine.result import Array

GRACE = 20.0  # s beyond its time limit in which a process must start and answer
HEAP = 2048  # MB that JavaScript may take
FOLDER = "TRACKER_NODE_MODULES"  # names a node_modules folder elsewhere


class NodeError(RuntimeError):
    """The process died without an answer."""


def package(name: str) -> Path:
    """The folder of an npm package: in $TRACKER_NODE_MODULES, here, or above. Raises ImportError if missing."""
    if shutil.which("node") is None:
        raise ImportError("Node is not installed")
    here = Path.cwd()
    folders = [folder / "node_modules" for folder in (here, *here.parents)]
    if os.environ.get(FOLDER):
        folders.insert(0, Path(os.environ[FOLDER]))
    for folder in folders:
        if (folder / name / "package.json").is_file():
            return folder / name
    raise ImportError(f"no npm package {name} in a folder node_modules here or above, nor in ${FOLDER}")


def facts(folder: Path) -> dict[str, Any]:
    """The package's own description."""
    found: dict[str, Any] = json.loads((folder / "package.json").read_text(encoding="utf-8"))
    return found


def entry(folder: Path) -> str:
    """Address of the package's module, for `import`."""
    described = facts(folder)
    address = (folder / str(described.get("module", described.get("main", "index.js")))).resolve().as_uri()
    return str(address)


def run(script: Path, task: dict[str, Any], time_limit: float | None) -> Recording:
    """One simulation by `script`; a process that hangs is ended and timed out. Raises NodeError if it died."""
    command = ["node", f"--max-old-space-size={HEAP}", str(script)]
    try:
        done = subprocess.run(
            command,
            input=json.dumps(task).encode(),
            capture_output=True,
            timeout=None if time_limit is None else time_limit + GRACE,
            preexec_fn=_without_address_limit if sys.platform == "linux" else None,
        )
    except subprocess.TimeoutExpired:
        return _nothing(task, f"no answer within {time_limit:g} s, so its process was ended")
    if done.returncode:
        words = [line.strip() for line in done.stderr.decode(errors="replace").splitlines() if line.strip()]
        said = next((line for line in words if re.match(r"\w*Error: |FATAL", line)), "it said nothing")
        raise NodeError(f"the process of {script.stem} ended with {done.returncode}: {said[:200]}")
    head, _, states = done.stdout.partition(b"\n")
    return _recording(task, json.loads(head), np.frombuffer(states, dtype="<f8"))


def _without_address_limit() -> None:
    """Node reserves addresses it never uses; what it may really take is said with HEAP."""
    import resource

    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (hard, hard))


def _recording(task: dict[str, Any], head: dict[str, Any], states: Array) -> Recording:
    """`forces_of` says how many numbers follow the bodies' for which constraint; `depth` that one more is the deepest."""
    forces = task.get("forces_of", {})
    widths = [13 * len(task["bodies"]), *forces.values(), int(task.get("depth", False))]
    rows = states.reshape(head["kept"], sum(widths))
    states, *forced, depth = np.split(rows, np.cumsum(widths)[:-1], axis=1)
    whole = states.reshape(head["kept"], -1, 13)
    samples = range(task["steps"] + 1) if task["every_step"] else (0, task["steps"])
    return Recording(
        samples=np.array(samples[: head["kept"]], dtype=np.int64),
        positions=whole[:, :, :3],
        orientations=whole[:, :, 3:7],
        velocities=whole[:, :, 7:10],
        angular_velocities=whole[:, :, 10:],
        steps=head["steps"],
        seconds=head["seconds"],
        setup_seconds=head["setup_seconds"],
        constraint_forces={
            name: rows[:, 0] if forces[name] == 1 else rows for name, rows in zip(forces, forced, strict=True)
        },
        penetration=depth[:, 0] if depth.size else None,
        status=head["status"],
        failure=head["failure"],
    )


def _nothing(task: dict[str, Any], failure: str) -> Recording:
    bodies = [[*b["position"], *b["orientation"], *b["velocity"], *b["spin"]] for b in task["bodies"]]
    more = sum(task.get("forces_of", {}).values()) + int(task.get("depth", False))
    start = np.array([*chain.from_iterable(bodies), *[0.0] * more])
    head = {
        "kept": 1,
        "steps": 0,
        "status": "timed_out",
        "failure": failure,
        "seconds": 0.0,
        "setup_seconds": 0.0,
    }
    return _recording(task, head, start)
