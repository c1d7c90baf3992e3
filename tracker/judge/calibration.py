"""Run times as the engine's own: processor time over what the calibration kernel took beside it.

A preempted slice is not ours, so processor time is judged where it was taken. When the machine is slower the
kernel is slower with it, and their ratio stays. A night on which the kernel itself was unsteady is not judged.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from statistics import median

from spook_tracker.tracker.document.run_document import Point, Timing

UNQUIET = 0.25  # relative: how far the kernel's middle time may lie above its least


def ladder_timing(timings: Iterable[Timing]) -> Timing:
    """One timing for a ladder: geometric means over its rungs of the least seconds, processor time and kernel.

    `calibration` of it is the least and the middle time of the kernel; empty where a rung lacks either.
    """
    rungs = list(timings)
    whole = all(t.cpu_seconds and t.calibration for t in rungs)
    return Timing(
        seconds=(geometric_mean(min(t.seconds) for t in rungs),),
        runs_per_repeat=1,
        cpu_seconds=(geometric_mean(min(t.cpu_seconds) for t in rungs),) if whole else (),
        calibration=(
            geometric_mean(min(t.calibration) for t in rungs),
            geometric_mean(median(t.calibration) for t in rungs),
        )
        if whole
        else (),
    )


def engines_own(nights: Sequence[Point]) -> list[float]:
    """The values to be judged, in seconds of the machine as it usually is; as they are without a kernel."""
    kernels = [found for night in nights if (found := _kernel(night)) is not None]
    usual = median(kernels) if kernels else 1.0
    values = []
    for night in nights:
        kernel, timing = _kernel(night), night.sample.timing
        if kernel is None or timing is None:
            values.append(night.value)
        else:
            values.append(timing.cpu_seconds[0] * usual / kernel)
    return values


def unquiet(night: Point) -> str:
    """Why a night's times are not judged; empty if they are."""
    timing = night.sample.timing
    if timing is None or len(timing.calibration) < 2:
        return ""
    least, middle = timing.calibration[:2]
    if middle <= (1.0 + UNQUIET) * least:
        return ""
    percent = 100.0 * (middle / least - 1.0)
    return f"not judged: the machine was not quiet, its calibration kernel took {percent:.0f} % more than at best"


def _kernel(night: Point) -> float | None:
    timing = night.sample.timing
    if timing is None or not timing.calibration or not timing.cpu_seconds:
        return None
    return timing.calibration[0]


def geometric_mean(values: Iterable[float]) -> float:
    """The mean of logarithms, as a value; the smallest double stands for nothing at all."""
    logs = [math.log(max(value, 5e-324)) for value in values]
    return math.exp(sum(logs) / len(logs))
