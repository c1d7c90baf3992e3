"""A run in a dozen lines, from any language: what was measured, and everything else has a default.

    {"engine": "ours", "version": "1.4.0", "results": [
        {"test": "fall", "metric": "error", "value": 0.0016, "unit": "m", "time_step": 0.01, "limit": 0.002}]}

It becomes a whole run document. Its content is its identity: the same file twice is one run.
"""

from __future__ import annotations

import hashlib
import math
from datetime import UTC, datetime
from typing import Literal, NoReturn

import msgspec

from spook_tracker.scalar_tests.case import Metric
from spook_tracker.tracker.document.errors import DocumentError
from spook_tracker.tracker.document.json_form import Number, decode
from spook_tracker.tracker.document.run_document import (
    EngineVersion,
    Machine,
    Name,
    OutcomeClass,
    RunDocument,
    Sample,
    SeriesDefinition,
    Struct,
    Text,
    Timing,
)

from .question import Outcome, Witness, judged_sample, series_key

Better = Literal["smaller_magnitude", "larger", "smaller", "inside"]


class ShortResult(Struct, frozen=True, kw_only=True):
    """One value. With a limit it gates; without one it is followed."""

    test: Name
    metric: Name
    value: Number | None = None  # none: `outcome` says why
    unit: Text = "1"
    time_step: float | None = None  # s
    configuration: Name = "default"
    parameters: dict[str, float] = msgspec.field(default_factory=dict)
    better: Better = "smaller_magnitude"
    limit: float | tuple[float, float] | None = None
    outcome: OutcomeClass = "value"
    explaining: bool = False  # says why a run time of its test changed, and is never red
    noisy: bool = False  # judged by statistics, as run times are, and not exactly
    seconds: tuple[
        float, ...
    ] = ()  # run time of each repeat; the value is noisy, and the shortest if not given
    runs_per_repeat: int = 1
    failure: Text = ""
    description: Text = ""
    definition: Text = ""  # what was asked, in any words: values are compared only where it is the same


class ShortRun(Struct, frozen=True, kw_only=True):
    """Everything of one version."""

    engine: Name
    version: Name
    results: tuple[ShortResult, ...]
    commit: Text = ""  # full hash
    parents: tuple[str, ...] = ()
    commit_time: Text = ""  # ISO 8601 UTC
    started: Text = ""  # ISO 8601 UTC; else the commit's time, else now
    machine: Name = "unknown"
    processor: Text = ""  # as a reader sees it; else the machine's name
    cores: int = 1
    operating_system: Text = ""
    dirty: bool = False  # built with changes that are in no commit


class _Peek(msgspec.Struct):
    results: msgspec.Raw | msgspec.UnsetType = msgspec.UNSET
    schema_version: msgspec.Raw | msgspec.UnsetType = msgspec.UNSET


def is_short(content: bytes) -> bool:
    """Whether this is meant to be a run in short form: it has results and no schema version."""
    seen = _peek(content)
    return seen.results is not msgspec.UNSET and seen.schema_version is msgspec.UNSET


def is_whole(content: bytes) -> bool:
    """Whether this is meant to be a run document of ours; a look that costs a twentieth of reading it."""
    return _peek(content).schema_version is not msgspec.UNSET


def _peek(content: bytes) -> _Peek:
    try:
        return msgspec.json.decode(content, type=_Peek)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return _Peek()


def whole(content: bytes, origin: str) -> RunDocument:
    """The run document it stands for. DocumentError names the file and the place in it."""
    try:
        short = decode(content, ShortRun)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise DocumentError(f"{origin} is not a valid run in short form: {error!s:.300}") from None
    return document_of(short, hashlib.sha256(content).hexdigest()[:32], origin)


def document_of(short: ShortRun, identity: str, origin: str) -> RunDocument:
    """The same from what was read. DocumentError names the place that makes no sense."""
    started = short.started or short.commit_time or datetime.now(UTC).isoformat(timespec="microseconds")
    pairs = [_pair(result, origin) for result in short.results]
    return RunDocument(
        schema_version=1,
        id=identity,
        idempotency_key=identity,
        started=started,
        finished=started,
        trigger="import",
        tracker_version="",
        ci_address="",
        engine=EngineVersion(
            name=short.engine,
            version=short.version,
            git_hash=short.commit,
            dirty=short.dirty,
            commit_time=short.commit_time,
            parents=short.parents,
        ),
        machine=Machine(
            fingerprint=short.machine,
            processor=short.processor or short.machine,
            cores=short.cores,
            operating_system=short.operating_system,
            float_environment="",
        ),
        tests=(),
        series=tuple(series for series, _ in pairs),
        samples=tuple(sample for _, sample in pairs),
    )


def _pair(result: ShortResult, origin: str) -> tuple[SeriesDefinition, Sample]:
    key = series_key(result.test, result.configuration, result.metric, result.time_step, result.parameters)
    if any(not (math.isfinite(s) and s >= 0.0) for s in result.seconds):
        raise DocumentError(f"{origin}: {key}: seconds must be numbers that are not negative")
    if result.seconds:
        told = Number(min(result.seconds)) if result.value is None else result.value
        result = msgspec.structs.replace(result, value=told, unit="s", better="smaller", noisy=True)
    if result.value is None and result.outcome in ("value", "unsettled", "out_of_limit"):
        raise DocumentError(f"{origin}: {key} has no value; its outcome must say why")
    if isinstance(result.limit, tuple) != (result.better == "inside") and result.limit is not None:
        raise DocumentError(f'{origin}: {key}: a limit of two numbers and better "inside" belong together')
    if result.explaining and result.limit is not None:
        raise DocumentError(f"{origin}: {key}: what only explains has no limit")
    metric = Metric(
        name=result.metric,
        description=result.description,
        unit=result.unit,
        role="explaining" if result.explaining else "reported" if result.limit is None else "gate",
        better=result.better,
        limit=result.limit,
    )
    facts: tuple[object, ...] = (key, result.unit, result.better, result.limit)
    facts += (result.definition,) if result.definition else ()
    series = SeriesDefinition(
        key=key,
        test=result.test,
        title=result.test.replace("_", " ").capitalize(),
        configuration=result.configuration,
        metric=result.metric,
        description=result.description,
        unit=result.unit,
        role=metric.role,
        better=result.better,
        kind="time" if result.noisy else "scalar",
        time_step=result.time_step,
        parameters=result.parameters,
        limit=result.limit,
        limit_source="" if result.limit is None else "as imported",
        set_point=None,
        set_point_source="",
        reference=None,
        tolerance=metric.tolerance,
        relative_tolerance=metric.relative_tolerance,
        test_version=hashlib.sha256(repr(facts).encode()).hexdigest()[:12],
    )
    value = None if result.value is None else float(result.value)
    outcome = "value" if result.outcome == "out_of_limit" else result.outcome
    sample = judged_sample(key, metric, Outcome(value, outcome, result.failure), Witness(_nothing))
    if result.seconds:
        sample = msgspec.structs.replace(
            sample, timing=Timing(seconds=result.seconds, runs_per_repeat=result.runs_per_repeat)
        )
    return series, sample


def _nothing(*arguments: object, **options: object) -> NoReturn:
    raise AssertionError("what is imported is not simulated")
