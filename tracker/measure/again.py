"""A run time that seems slower is taken once more at once, before it is reported.

The whole ladders of a test are timed again, alone on the machine and by the rules of every timing; what was taken
first stays beside it. tracker/judge/calibration.py says which of the two counts.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import msgspec

from spook_tracker.scalar_tests.case import ScalarTest
from spook_tracker.tracker.document.run_document import Again, RunDocument, Sample, SeriesDefinition

from .ladder import ErrorPoint, ErrorPoints
from .questions import Questions
from .run import Errors, Progress, Request, Watch, select, timings


def timed_again(
    source: Questions, request: Request, document: RunDocument, names: Iterable[str], watch: Watch
) -> RunDocument:
    """The document with the ladders of these tests timed once more; only rungs that were timed before."""
    tests = select(source.tests(), sorted(set(names)))
    source.simulate()
    watch(Progress(0, len(tests), "", False))
    series, _ = timings(source, request, tests, _errors(tests, document), watch)
    more = {definition.key: sample.timing for definition, sample in series if sample.timing is not None}
    samples = []
    for sample in document.samples:
        if sample.timing is not None and (taken := more.get(sample.series)) is not None:
            again = Again(seconds=taken.seconds, cpu_seconds=taken.cpu_seconds, calibration=taken.calibration)
            sample = msgspec.structs.replace(
                sample, timing=msgspec.structs.replace(sample.timing, again=again)
            )
        samples.append(sample)
    return msgspec.structs.replace(document, samples=tuple(samples))


def _errors(tests: Mapping[str, ScalarTest], document: RunDocument) -> Errors:
    """The rungs of these tests' ladders as the document has them."""
    samples = {sample.series: sample for sample in document.samples}
    found: dict[tuple[str, str, str], dict[float, tuple[SeriesDefinition, Sample]]] = {}
    for definition in document.series:
        if definition.kind == "ladder" and definition.time_step is not None and definition.key in samples:
            rungs = found.setdefault((definition.test, definition.metric, definition.configuration), {})
            rungs[definition.time_step] = definition, samples[definition.key]
    errors = {}
    for name, test in tests.items():
        for i, ladder in enumerate(test.ladders):
            for j, configuration in enumerate(ladder.configurations):
                rungs = found.get((name, f"ladder:{ladder.name}", configuration.name), {})
                errors[name, i, j] = ErrorPoints(
                    tuple(_point(h, rungs) for h in ladder.steps_of(configuration))
                )
    return errors


def _point(h: float, rungs: Mapping[float, tuple[SeriesDefinition, Sample]]) -> ErrorPoint:
    if h not in rungs:
        return ErrorPoint(h, float("nan"), "missing", "not measured", {}, "")
    _, sample = rungs[h]
    took = min(sample.timing.seconds) if sample.timing and sample.timing.seconds else 0.0
    return ErrorPoint(
        h, sample.value, sample.outcome, sample.failure, sample.counters, sample.state_hash, took
    )
