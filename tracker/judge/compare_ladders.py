"""Two versions on one ladder: which is slower, and which is better at equal error and at equal time."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping

import msgspec

from spook_tracker.tracker.document.json_form import Number
from spook_tracker.tracker.document.middle import median
from spook_tracker.tracker.document.order import least_cost
from spook_tracker.tracker.document.run_document import Sample, SeriesDefinition, Timing

from .calibration import geometric_mean, that_counts, unquiet_kernel
from .comparison_document import Change, Frontier
from .timing_statistics import compare_times
from .vocabulary import Word

Samples = Mapping[str, tuple[SeriesDefinition, Sample]]
Rung = tuple[SeriesDefinition, Sample, Sample]
PROBES = 9  # errors, and times, at which two ladders are compared


def run_times(before: Samples, after: Samples, by_history: Collection[str] = ()) -> list[Change]:
    """One change per ladder configuration: run times over its rungs, by statistics that do not cry wolf.

    `by_history`: times of which the history tells the noise, and so are judged by that.
    """
    changes = []
    single = (rungs for key, rungs in _single(before, after) if key not in by_history)
    for rungs in [*_ladders(before, after).values(), *single]:
        definition = rungs[0][0]
        timed = [(old.timing, new.timing) for _, old, new in rungs]
        both: list[tuple[Timing, Timing]] = [(old, new) for old, new in timed if old and new]
        both = [(_counted(old), _counted(new)) for old, new in both]
        found = compare_times(
            [old for old, _ in both],
            [new for _, new in both],
            definition.time_tolerance if definition.kind == "ladder" else definition.relative_tolerance,
        )
        if found is None or (definition.kind == "time" and not found.repeated):
            continue  # a time without repeats is told by itself
        word: Word = "regressed" if found.slower else "improved" if found.faster else "same"
        percent = 100.0 * (found.ratio - 1.0)
        sentence = f"{percent:+.0f} % run time" + f" over {found.rungs} rungs" * (definition.kind == "ladder")
        if loud := _unquiet(both):
            word, sentence = "same", f"{sentence}; {loud}"
        elif not found.repeated:
            sentence += ", timed less than three times on a side: to be measured again"
        elif word == "same":
            sentence += f", inside the noise of these sessions (±{100.0 * found.floor:.0f} %)"
        changes.append(
            Change(
                series=f"{definition.test}/{definition.configuration}/{definition.metric}:run-time",
                test=definition.test,
                metric=f"{definition.metric}:run-time",
                configuration=definition.configuration,
                role="reported",
                kind="run_time",
                unit="s",
                word=word,
                red=word == "regressed",
                stands="watch" if word == "regressed" else "followed",
                name="slower at equal error" if word == "regressed" else "",
                sentence=sentence,
                before=Number(first := geometric_mean(_least(old) for old, _ in both)),
                after=Number(first * found.ratio),
                before_outcome="value",
                after_outcome="value",
                limit=None,
                decades=math.log10(found.ratio),
            )
        )
    return changes


def _counted(timing: Timing) -> Timing:
    """The timing with the repeats that count."""
    taken = that_counts(timing)
    return msgspec.structs.replace(
        timing, seconds=taken.seconds, cpu_seconds=taken.cpu_seconds, calibration=taken.calibration
    )


def _least(timing: Timing) -> float:
    """Seconds of the processor where they were taken, else of the clock."""
    return min(timing.cpu_seconds if timing.cpu_seconds and timing.calibration else timing.seconds)


def _unquiet(both: list[tuple[Timing, Timing]]) -> str:
    """Why the times of a side are not judged; empty if they are."""
    return unquiet_kernel([old for old, _ in both]) or unquiet_kernel([new for _, new in both])


def _ladders(before: Samples, after: Samples) -> dict[tuple[str, str, str], list[Rung]]:
    """Rungs that both sides measured under one definition, by test, ladder and configuration."""
    groups: dict[tuple[str, str, str], list[Rung]] = defaultdict(list)
    for key, (definition, new) in after.items():
        if definition.kind != "ladder" or key not in before:
            continue
        earlier, old = before[key]
        if earlier.test_version == definition.test_version:
            groups[(definition.test, definition.metric, definition.configuration)].append(
                (definition, old, new)
            )
    for rungs in groups.values():
        rungs.sort(key=lambda rung: -(rung[0].time_step or 0.0))
    return groups


def _single(before: Samples, after: Samples) -> Iterator[tuple[str, list[Rung]]]:
    """Series outside ladders that carry repeats of their own, by key."""
    for key, (definition, new) in after.items():
        if definition.kind == "ladder" or new.timing is None or key not in before:
            continue
        earlier, old = before[key]
        if earlier.test_version == definition.test_version:
            yield key, [(definition, old, new)]


def frontiers(before: Samples, after: Samples, same_machine: bool) -> Iterator[Frontier]:
    """Both versions on each ladder, as ratios later to earlier; None where they share no error or time."""
    for (test, ladder, configuration), rungs in sorted(_ladders(before, after).items()):
        old = [(_seconds(s), _steps(s), abs(s.value)) for _, s, _ in rungs]
        new = [(_seconds(s), _steps(s), abs(s.value)) for _, _, s in rungs]
        seconds = [[point[0] for point in side] for side in (old, new)]
        steps = [[point[1] for point in side] for side in (old, new)]
        errors = [[point[2] for point in side] for side in (old, new)]
        timed = same_machine and any(math.isfinite(s) for s in seconds[0])
        yield Frontier(
            test=test,
            ladder=ladder.removeprefix("ladder:"),
            configuration=configuration,
            time_at_equal_error=_ratio(seconds, errors) if timed else None,
            error_at_equal_time=_ratio(errors, seconds) if timed else None,
            work_at_equal_error=_ratio(steps, errors),
        )


def _seconds(sample: Sample) -> float:
    return min(sample.timing.seconds) if sample.timing else math.nan


def _steps(sample: Sample) -> float:
    return float(sample.counters.get("steps", 0)) or math.nan


def _ratio(cost: list[list[float]], quality: list[list[float]]) -> float | None:
    """Median over common values of `quality` of what the later side costs relative to the earlier."""
    finite = [[value for value in side if math.isfinite(value) and value > 0.0] for side in quality]
    if not all(finite):
        return None
    low, high = max(min(side) for side in finite), min(max(side) for side in finite)
    if not 0.0 < low <= high:
        return None
    earlier, later = (least_cost(c, q) for c, q in zip(cost, quality, strict=True))
    ratios = []
    for i in range(PROBES):
        target = low * (high / low) ** (i / (PROBES - 1)) * (1.0 + 1e-12)
        first, second = earlier(target), later(target)
        if 0.0 < first < math.inf and 0.0 < second < math.inf:
            ratios.append(second / first)
    return median(ratios) if ratios else None
