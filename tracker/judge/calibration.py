"""Run times as the engine's own: processor time over what the calibration kernel took beside it.

Interference only ever makes a run slower: of a time that was taken once more the same night the lesser one counts.
A preempted slice is not ours, so processor time is judged where it was taken. When the machine is slower the
kernel is slower with it, and their ratio stays. A night on which the kernel itself was unsteady is not judged.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TypeAlias

from spook_tracker.tracker.document.middle import median
from spook_tracker.tracker.document.run_document import Again, Point, Timing

Taken: TypeAlias = Timing | Again
UNQUIET = 0.25  # relative: how far the kernel's middle time may lie above its least


def ladder_timing(timings: Iterable[Timing]) -> Timing:
    """One timing for a ladder: geometric means over its rungs of the least seconds, processor time and kernel.

    `calibration` of it is the least and the middle time of the kernel; empty where a rung lacks either. `again` is
    the same of the second times, where every rung has one.
    """
    rungs = list(timings)
    more = [timing.again for timing in rungs if timing.again is not None]
    seconds, cpu, kernel = _together(rungs)
    again = None
    if len(more) == len(rungs):
        again = Again(**dict(zip(("seconds", "cpu_seconds", "calibration"), _together(more), strict=True)))
    return Timing(seconds=seconds, runs_per_repeat=1, cpu_seconds=cpu, calibration=kernel, again=again)


def _together(rungs: Sequence[Taken]) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    """Seconds, processor time and kernel of all rungs, as `ladder_timing` says."""
    seconds = (geometric_mean(min(t.seconds) for t in rungs),)
    if not all(t.cpu_seconds and t.calibration for t in rungs):
        return seconds, (), ()
    least = geometric_mean(min(t.calibration) for t in rungs)
    middle = geometric_mean(median(t.calibration) for t in rungs)
    return seconds, (geometric_mean(min(t.cpu_seconds) for t in rungs),), (least, middle)


def that_counts(timing: Timing) -> Taken:
    """Of a timing and what was taken again, the one that was disturbed less."""
    return timing if timing.again is None or _own(timing) <= _own(timing.again) else timing.again


def _own(taken: Taken) -> float:
    """Kernels that a run lasts, or its seconds where there is no kernel."""
    if taken.cpu_seconds and taken.calibration:
        return min(taken.cpu_seconds) / min(taken.calibration)
    return min(taken.seconds)


def taken_again(night: Point) -> str:
    """What came of timing it once more, in words; empty if it was not."""
    timing = night.sample.timing
    if timing is None or timing.again is None:
        return ""
    percent = 100.0 * (_own(timing.again) / _own(timing) - 1.0)
    return f"; timed again at once: {percent:+.1f} %, the lesser counts"


def engines_own(nights: Sequence[Point]) -> list[float]:
    """The values to be judged, in seconds of the machine as it was when it was first calibrated.

    They are as they are without a kernel. No later night changes them, nor what was said of them.
    """
    first = next((found for night in nights if (found := _kernel(night)) is not None), 1.0)
    values = []
    for night in nights:
        kernel, timing = _kernel(night), night.sample.timing
        if kernel is None or timing is None:
            values.append(night.value)
        else:
            values.append(that_counts(timing).cpu_seconds[0] * first / kernel)
    return values


def unquiet(night: Point) -> str:
    """Why a night's times are not judged; empty if they are."""
    timing = night.sample.timing
    return "" if timing is None else _unsteady(that_counts(timing).calibration[:2])


def unquiet_kernel(timings: Sequence[Timing]) -> str:
    """The same of the rungs of one ladder; empty where one has no kernel."""
    return _unsteady(ladder_timing(timings).calibration) if timings else ""


def _unsteady(kernel: Sequence[float]) -> str:
    """Why times beside this kernel, at least and in the middle, are not judged."""
    if len(kernel) < 2:
        return ""
    least, middle = kernel
    if middle <= (1.0 + UNQUIET) * least:
        return ""
    percent = 100.0 * (middle / least - 1.0)
    return f"not judged: the machine was not quiet, its calibration kernel took {percent:.0f} % more than at best"


def _kernel(night: Point) -> float | None:
    timing = night.sample.timing
    if timing is None:
        return None
    taken = that_counts(timing)
    return taken.calibration[0] if taken.calibration and taken.cpu_seconds else None


def geometric_mean(values: Iterable[float]) -> float:
    """The mean of logarithms, as a value; the smallest double stands for nothing at all."""
    logs = [math.log(max(value, 5e-324)) for value in values]
    return math.exp(sum(logs) / len(logs))
