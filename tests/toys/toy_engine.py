"""A stand-in for an engine: single particles falling, by the symplectic step, in plain Python.

What it was built from and how well it works are set by environment variables, so that a test has as many
versions, good and bad, as it needs: TOY_VERSION, TOY_HASH, TOY_PARENT, TOY_ERROR (added to every position),
TOY_DIRTY (with local changes), TOY_LACKS (the only time step [s] that is not supported), TOY_COST (times the work), TOY_FAULT (diverge, nan, raise, die, hang, hog: takes TOY_HOG bytes). TOY_FAULT_TIMED is the fault of runs of
which nothing is kept, as they are timed; TOY_FAULT_STEP the only time step [s] that has it.
"""

from __future__ import annotations

import hashlib
import os
import struct
import time
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from spook_tracker.engine.method import PLAIN, Method
from spook_tracker.engine.protocol import NotSupported
from spook_tracker.engine.result import Result
from spook_tracker.engine.scene import Scene


class _BuildInfo:
    def __getattr__(self, name: str) -> Any:
        git_hash = os.environ.get("TOY_HASH", "a" * 40)
        return {
            "name": "toy",
            "version": os.environ.get("TOY_VERSION", "1.0.0"),
            "git_hash": git_hash,
            "dirty": bool(os.environ.get("TOY_DIRTY")),
            "commit_time": os.environ.get("TOY_TIME", "2026-01-01T00:00:00+00:00"),
            "parents": tuple(os.environ.get("TOY_PARENT", "").split()),
            "compiler": "none",
            "flags": "",
        }[name]


build_info = _BuildInfo()


def simulate(
    scene: Scene,
    *,
    time_step: float,
    duration: float | None = None,
    steps: int | None = None,
    method: Method = PLAIN,
    observe: Mapping[str, Any] | None = None,
    time_limit: float | None = None,
    time_stages: bool = False,
) -> Result:
    begun = time.perf_counter()
    if float(os.environ.get("TOY_LACKS", "nan")) == time_step:
        raise NotSupported("it does not support falling")
    fault = os.environ.get("TOY_FAULT", "")
    if not observe and float(os.environ.get("TOY_FAULT_STEP", time_step)) == time_step:
        fault = os.environ.get("TOY_FAULT_TIMED", fault)
    if fault == "raise":
        raise ValueError("the toy refuses")
    if fault == "die":
        os._exit(9)
    if fault == "hog":
        bytearray(int(os.environ.get("TOY_HOG", 64 << 30)))
    while fault == "hang":  # in Python, where no time limit of an engine reaches
        time.sleep(
            0.01
        )  # as one that turns round and round (tests/toys/toy_stuck.py), at no cost of the processor
    count = steps if steps is not None else round((duration or 0.0) / time_step)
    body, (_, _, g) = scene.bodies[0], scene.gravity
    z, w = body.position[2], body.velocity[2]
    half = 0.5 * time_step * g if method.half_step_velocities else 0.0
    w += half
    for _ in range(count * int(os.environ.get("TOY_COST", "1"))):
        w += time_step * g / int(os.environ.get("TOY_COST", "1"))
    w = body.velocity[2] + half
    for k in range(count):
        w += time_step * g if not (method.half_step_velocities and k == 0) else 0.0
        z += time_step * w
    z += float(os.environ.get("TOY_ERROR", "0"))
    if fault == "nan":
        z = float("nan")
    status = "diverged" if fault == "diverge" else "completed"
    bits = struct.pack("<dd", z, w)
    return Result(
        status=status,
        failure="body 'ball' left the finite numbers at step 7" if fault == "diverge" else "",
        failed_body=None,
        failed_step=None,
        time_step=time_step,
        steps=count,
        seconds=time.perf_counter() - begun,
        observables={name: np.array(z) for name in observe or {}},
        sample_times={},
        final_state={},
        counters={"steps": count},
        state_hash=hashlib.sha256(bits).hexdigest()[:16],
        stages=("apply_gravity", "integrate_positions"),
        stage_seconds={"apply_gravity": 1e-6} if time_stages else {},
    )


def explain(scene: Scene, *, time_step: float, method: Method = PLAIN, observe: Any = None) -> Any:
    return (
        SimpleNamespace(stage="apply_gravity", kept=True, reason="the scene has gravity"),
        SimpleNamespace(stage="collision", kept=False, reason="no body has a shape"),
    )
