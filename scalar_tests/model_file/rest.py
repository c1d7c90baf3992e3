"""Where everything comes to rest, when, how still it then is, how deep it overlaps and what carries its weight."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from spook_tracker.engine.result import Result

from .. import case
from .facts import BEYOND, LONGEST_REST, PUSH, PUSHED, Asked, pushed, settles, spread, turns, watched

CALM = 0.5  # s of calm that make a rest; creep is measured over it
READ = {
    "settled": 0.04,
    "creep": 1e-6,
}  # what else a reading cannot tell: two looks at the clock, s; of the size a second
AXES = "xyz"


def metrics(asked: Asked, stands_free: bool) -> tuple[case.Metric, ...]:
    """The rest pose of each watched body, and of the whole when it settled, its creep, its overlap and its load."""

    def one(name: str, description: str, unit: str, better: Any = "inside") -> case.Metric:
        return case.Metric(name=name, description=description, unit=unit, role="reported", better=better)

    found = []
    for label in (body.label for body in asked.model.watched):
        found += [one(f"{label}.rest_{axis}", f"{axis} of {label} at rest", "m") for axis in AXES]
        found.append(one(f"{label}.rest_turn", f"how far {label} has turned from its start, at rest", "rad"))
    found += [
        one("settled", f"when nothing moves faster than 1e-3 of the size a second for {CALM:g} s", "s"),
        one("creep", "how fast the watched body that creeps most still moves at rest", "m/s"),
        one("overlap", "the deepest overlap of two shapes at rest", "m"),
    ]
    if stands_free:
        found.append(one("load", "what contacts with the world carry at rest, over the weight", "1"))
    return tuple(found)


def measure(asked: Asked, simulate: case.Simulate) -> Mapping[str, float]:
    """Run until it rests; again with pushes of the last bits, and with half the time step. Of what does not rest nothing more
    is asked: where it is after so long is no rest, and its motion is compared elsewhere."""
    run = watched(asked, simulate)
    values, size = _rest(asked, run), float(run["size"])
    columns = {body.label: k for k, body in enumerate(asked.model.watched)}
    if not settles(run):
        moves = f"still moves at {float(run['fastest']):.2g} m/s after {run.steps * run.time_step:g} s"
        return {
            name: case.Estimate(value, rounding=math.inf, scale=size, unsettled=moves)
            for name, value in values.items()
        }
    # from the other end than those who ask for its motion, perhaps in another process at the same time
    try:
        halved = _rest(asked, watched(asked, simulate, refined=2))
        others = [_rest(asked, pushed(asked, simulate, run, seed)) for seed in range(PUSHED, 0, -1)]
    except case.OutOfTime:
        return values
    creep = np.asarray(run["creep"])
    found: dict[str, float] = {}
    for name, value in values.items():
        column = columns.get(name.rpartition(".")[0])
        unit = 1.0 if column is None or name.endswith("turn") else size
        crept = 0.0 if column is None else CALM * float(creep[column]) * (1.0 if unit == size else 2.0 / size)
        rounded = BEYOND * max(spread(value, [other.get(name, math.nan) for other in others]), PUSH * unit)
        found[name] = case.Estimate(
            value,
            rounding=max(rounded, crept, READ.get(name, 0.0) * (size if name == "creep" else 1.0)),
            step_error=abs(halved[name] - value) if name in halved else None,
            scale=unit,
        )
    return found


def _rest(asked: Asked, run: Result) -> dict[str, float]:
    """What is read of one run; of one that broke off nothing."""
    if not run.completed:
        return {}
    final = [run.final_state[body.label] for body in asked.model.watched]
    start = np.asarray(run["orientation"])[0]
    found: dict[str, float] = {}
    for body, state, before in zip(asked.model.watched, final, start, strict=True):
        found |= {f"{body.label}.rest_{axis}": float(state[k]) for k, axis in enumerate(AXES)}
        found[f"{body.label}.rest_turn"] = float(turns(np.asarray(state[3:7]), before))
    settled = float(run["settled"])
    return found | {
        "settled": settled if math.isfinite(settled) else LONGEST_REST,
        "creep": float(np.max(run["creep"])),
        "overlap": float(run["overlap"]),
        "load": float(run["load"]),
    }
