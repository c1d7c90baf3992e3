"""How far every watched body goes, drawn over time, and how fast pushes of the last bits grow."""

from __future__ import annotations

from functools import partial

import numpy as np

from .. import case
from ..sweep import line
from .facts import PUSH, UNPREDICTABLE, Asked, apart, pushed, times_of, watched


def places(asked: Asked, simulate: case.Simulate) -> case.Drawing:
    """Distance of each watched body from its start."""
    times = times_of(asked)
    there = np.asarray(watched(asked, simulate).partial["position"])
    moved = np.linalg.norm(there - there[:1], axis=-1)
    return case.Drawing(
        curves=tuple(
            line(body.label, times[: len(moved)], moved[:, k]) for k, body in enumerate(asked.model.watched)
        ),
        x_label="time [s]",
        y_label="distance from its start [m]",
    )


def growth(asked: Asked, simulate: case.Simulate) -> case.Drawing:
    """Distance between a run and the same with pushes of the last bits, of the body that is furthest off."""
    times, run = times_of(asked), watched(asked, simulate)
    size = float(run.partial["size"])
    found = [(seed, apart(run, pushed(asked, simulate, run, seed), size)) for seed in (1, 2)]
    shown = [
        line(f"seed {seed}", times[: len(grown)], np.where(grown > 0.0, grown, np.nan))
        for seed, grown in found
    ]
    limit = line("predictable up to here", times, np.full(len(times), UNPREDICTABLE * size), "limit")
    return case.Drawing(
        curves=(*shown, limit),
        x_label="time [s]",
        y_label="distance between the runs [m]",
        y_scale="log",
        note=f"Pushes of {PUSH:g} of the size in every step. Where they have grown to a hundredth of it nothing about "
        "places can be predicted.",
    )


def figures(asked: Asked) -> tuple[case.Figure, ...]:
    """Both."""
    return (
        case.Figure(name="places", title="Where the watched bodies go", draw=partial(places, asked)),
        case.Figure(
            name="growth", title="How fast pushes of the last bits grow", draw=partial(growth, asked)
        ),
    )
