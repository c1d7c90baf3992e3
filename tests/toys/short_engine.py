"""An engine for drawings only: a few steps of ours, the rest of every trace held, read off a scale that may be wrong."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from spook_tracker.engine import Result, Scene, Trace, simulate
from spook_tracker.scalar_tests.case import Simulate

STEPS = 6


def read_off(wrong: bool) -> Simulate:
    """Whatever is asked for, in the shape it is asked for; if wrong, far off, and otherwise in each run."""
    runs = 0

    def engine(
        scene: Scene,
        *,
        time_step: float,
        duration: float | None = None,
        steps: int | None = None,
        observe: Any = None,
        **options: Any,
    ) -> Result:
        nonlocal runs
        runs += 1
        scale = 100.0 * (1.0 + 0.37 * (runs % 9)) if wrong else 1.0
        asked = round((duration or 0.0) / time_step) if steps is None else steps
        done = min(asked, STEPS)
        observe = observe or {}
        few = {
            name: replace(one, first=0, last=None, **({"every": 1} if isinstance(one, Trace) else {}))
            for name, one in observe.items()
        }
        result = simulate(scene, time_step=time_step, steps=done, observe=few, **options)
        seen, times = {}, {}
        for name, one in observe.items():
            value = np.asarray(result.partial[name])
            if wrong:
                uneven = np.cos(np.arange(value.size).reshape(value.shape))
                value = scale * (value * (1.0 + 0.5 * uneven) + 1e-3 * uneven)
            if isinstance(one, Trace):
                last = asked if one.last is None else one.last
                places = np.arange(one.first, last + 1, one.every)
                value, times[name] = value[np.minimum(places, len(value) - 1)], time_step * places
            seen[name] = value
        return replace(
            result,
            status="completed",
            failure="",
            observables=seen,
            sample_times=times,
            counters={name: round(scale * count) for name, count in result.counters.items()},
            final_state={name: scale * state for name, state in result.final_state.items()},
            steps=asked,
        )

    return engine
