"""What explains a run time and does not decide: counts of iterations, retired instructions, beside the time itself.

One more iteration that makes a step faster is no regression, and one less that makes it slower no comfort: the time
gates, the count says why. Which is which a test declares (`Metric(role="explaining")`, `ScalarTest.counter_roles`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace as replaced
from typing import TYPE_CHECKING

import msgspec

from spook_tracker.tracker.document.run_document import Sample, SeriesDefinition

from .calibration import geometric_mean
from .comparison_document import Change
from .repeats import Nights

if TYPE_CHECKING:
    from .judged import Judged
    from .tonight import Finding

EXPLAINING = "explaining"
TIMES = ("time", "run_time")
Samples = Mapping[str, tuple[SeriesDefinition, Sample]]


def calm(change: Change) -> Change:
    """A change of what explains is told, and never red."""
    if change.role != EXPLAINING or not change.red:
        return change
    return msgspec.structs.replace(
        change,
        word="changed",
        red=False,
        stands="followed",
        name="",
        sentence=f"{change.sentence}, does not decide",
    )


def calm_nights(definition: SeriesDefinition, nights: Sequence[Judged]) -> Sequence[Judged]:
    """The same of a history."""
    if definition.role != EXPLAINING:
        return nights
    return nights.changed(_calm_night) if isinstance(nights, Nights) else list(map(_calm_night, nights))


def _calm_night(night: Judged) -> Judged:
    if night.red or night.verdict.red:
        sentence = f"{night.verdict.sentence}, does not decide"
        verdict = msgspec.structs.replace(night.verdict, word="changed", name="", sentence=sentence)
        return msgspec.structs.replace(night, state="green", verdict=verdict)
    return msgspec.structs.replace(night, state="green") if night.state == "recovered" else night


def beside_run_times(changes: Sequence[Change], before: Samples, after: Samples) -> list[Change]:
    """Changes in which every run time says what of its test and configuration explains it."""
    why: dict[tuple[str, str], list[str]] = {}
    for change in changes:
        old, new = change.before, change.after
        if change.role == EXPLAINING and old is not None and new is not None and old != new:
            words = f"{_name(change.metric)} {old:.6g} → {new:.6g}"
            why.setdefault((change.test, change.configuration), []).append(words)
    counted = _instructions(before, after)
    told = []
    for change in changes:
        if change.kind in TIMES and change.role != EXPLAINING:
            rungs = counted.get(
                (change.test, change.configuration, change.metric.removesuffix(":run-time")), []
            )
            if parts := [*rungs, *sorted(why.get((change.test, change.configuration), ()))]:
                change = msgspec.structs.replace(change, sentence=f"{change.sentence}; {', '.join(parts)}")
        told.append(change)
    return told


Place = tuple[str, str, str]  # test, configuration and metric of a ladder


def _instructions(before: Samples, after: Samples) -> Mapping[Place, list[str]]:
    """Retired instructions of every ladder's rungs, after against before, where both counted them."""
    ratios: dict[Place, list[float]] = {}
    for key, (definition, sample) in after.items():
        new = sample.timing
        old = before[key][1].timing if new and new.instructions and key in before else None
        if new and old and new.instructions and old.instructions:
            place = definition.test, definition.configuration, definition.metric
            ratios.setdefault(place, []).append(new.instructions / old.instructions)
    means = {place: geometric_mean(of_rungs) for place, of_rungs in ratios.items()}
    return {
        place: [f"instructions {100.0 * (mean - 1.0):+.1f} %"]
        for place, mean in means.items()
        if math.isfinite(mean)
    }


def beside_findings(findings: Sequence[Finding]) -> list[Finding]:
    """Findings of a night in which every run time says what of its test and configuration changed and explains it."""
    why: dict[tuple[str, str], list[str]] = {}
    for finding in findings:
        definition, judged = finding.definition, finding.judged
        if definition is None or judged is None or definition.role != EXPLAINING or judged.against is None:
            continue
        old, new = judged.against.sample.value, judged.night.sample.value
        if old != new and math.isfinite(new):
            words = f"{_name(definition.metric)} {old:.6g} → {new:.6g}"
            why.setdefault((definition.test, definition.configuration), []).append(words)
    told = []
    for finding in findings:
        definition = finding.definition
        timed = definition is not None and definition.kind == "time" and definition.role != EXPLAINING
        parts = why.get((definition.test, definition.configuration)) if timed and definition else None
        if parts:
            sentence = f"{finding.verdict.sentence}; {', '.join(sorted(parts))}"
            finding = replaced(finding, verdict=msgspec.structs.replace(finding.verdict, sentence=sentence))
        told.append(finding)
    return told


def _name(metric: str) -> str:
    """Of a counter without its family."""
    return metric.rpartition(":")[2].replace("_", " ")
