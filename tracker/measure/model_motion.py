"""How a model file moves, recorded for the replay as the engine that loaded it shows it."""

from __future__ import annotations

import numpy as np

from spook_tracker.engine.model_file import SHOWN_AS
from spook_tracker.engine.result import Result
from spook_tracker.scalar_tests.case import Seen, Simulate
from spook_tracker.tracker.document.run_document import Channel, DrawnSolid, Trajectory

from .trajectory import MOST_BYTES, Array, channel


def model_trajectory(name: str, seen: Seen, simulate: Simulate) -> Trajectory | None:
    """A run of it; None where there is nothing to see."""
    run = seen.run(simulate)
    places, turns = (np.asarray(run.partial[key], dtype=float) for key in ("body_place", "body_turn"))
    solids, step = _solids(run), seen.step
    if len(places) < 2 or not solids:
        return None
    channels = _channels(places, turns)
    while sum(len(one.data) for one in channels) > MOST_BYTES and len(places) > 8:
        places, turns, step = places[::2], turns[::2], 2.0 * step
        channels = _channels(places, turns)
    return Trajectory(
        test=name,
        name="example",
        time_step=run.time_step,
        step=step,
        count=len(places),
        bodies=places.shape[1],
        solids=tuple(solids),
        body_of_solid=tuple(int(body) for body in run.partial["shape_body"]),
        gravity=seen.gravity,
        failure=run.failure,
        channels=channels,
    )


def _channels(places: Array, turns: Array) -> tuple[Channel, ...]:
    count = len(places)
    return (
        channel("position", "m", places.reshape(count, -1)),
        channel("orientation", "1", turns.reshape(count, -1)),
    )


def _solids(run: Result) -> list[DrawnSolid]:
    found = []
    for kind, size, fixed, place, turn in zip(
        *(run.partial[f"shape_{key}"] for key in ("kind", "size", "fixed", "place", "turn")), strict=True
    ):
        numbers = [float(x) for x in size if np.isfinite(x)]
        found.append(
            DrawnSolid(
                kind=SHOWN_AS[int(kind)],  # type: ignore[arg-type]
                position=tuple(place.tolist()),
                orientation=tuple(turn.tolist()),
                size=tuple(round(x, 5) for x in numbers),
                fixed=bool(fixed),
            )
        )
    return found
