"""Files of other benchmark tools as runs: their times are followed and judged as noisy, like our own run times.

pytest-benchmark (--benchmark-json), asv (results/MACHINE/*.json), Google Benchmark (--benchmark_out) and
github-action-benchmark (data.js, a whole history in one file). What a file does not say stays unknown.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from typing import Any

import msgspec

from spook_tracker.tracker.document.errors import DocumentError
from spook_tracker.tracker.document.json_form import Number
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.measure.short_form import ShortResult, ShortRun, document_of

DATA_JS = b"window.BENCHMARK_DATA"
UNITS = {"ns": 1e-9, "us": 1e-6, "µs": 1e-6, "ms": 1e-3, "s": 1.0, "sec": 1.0, "seconds": 1.0}  # s
RATES = ("iter/sec", "ops/sec", "op/s", "it/s", "items/s")


def of_other_tools(content: bytes, origin: str) -> tuple[RunDocument, ...] | None:
    """The runs in a file of one of these tools; None if it is none of theirs. DocumentError if it makes no sense."""
    js = content.lstrip().startswith(DATA_JS)
    try:
        said = json.loads(content.partition(b"=")[2].strip().rstrip(b";") if js else content)
    except (ValueError, RecursionError):
        return None
    read = _reader(said) if isinstance(said, dict) else None
    if read is None:
        return None
    try:
        return tuple(document_of(_unnamed(run), _identity(run), origin) for run in read(said) if run.results)
    except (
        KeyError,
        TypeError,
        ValueError,
        AttributeError,
        IndexError,
        OverflowError,
        OSError,  # a moment that no calendar has
        msgspec.ValidationError,
    ) as error:
        words = f"{type(error).__name__}: {error!s:.120}"
        raise DocumentError(
            f"{origin} looks like another tool's file but cannot be read as one ({words})"
        ) from None


def _unnamed(run: ShortRun) -> ShortRun:
    """The run of a machine without the name by which its network knows it: histories are published."""
    if run.machine == "unknown":
        return run
    return msgspec.structs.replace(
        run, machine=f"machine {hashlib.sha256(run.machine.encode()).hexdigest()[:8]}"
    )


def _reader(said: Mapping[str, Any]) -> Any:
    if "result_columns" in said and "commit_hash" in said:
        return _asv
    if "entries" in said and "repoUrl" in said:
        return _github_action
    if isinstance(said.get("benchmarks"), list):
        if "machine_info" in said and "commit_info" in said:
            return _pytest
        if isinstance(context := said.get("context"), dict) and "num_cpus" in context:
            return _google
    return None


def _pytest(said: Mapping[str, Any]) -> Iterator[ShortRun]:
    commit = said["commit_info"]
    known = commit.get("id") if commit.get("id") != "unversioned" else ""
    results = []
    for one in said["benchmarks"]:
        stats = one["stats"]
        seconds = stats.get("data") or [stats["min"], stats["median"], stats["max"]]
        results.append(_timed(one["fullname"], [float(s) for s in seconds]))
    yield ShortRun(
        engine=commit.get("project") or "unknown",
        version=(known or "unknown")[:10],
        commit=known or "",
        commit_time=commit.get("time") or "",
        started=said.get("datetime") or "",
        machine=said["machine_info"].get("node") or "unknown",
        results=tuple(results),
    )


def _google(said: Mapping[str, Any]) -> Iterator[ShortRun]:
    """Repetitions of one name are its repeats; of aggregates the median counts, where they are all there is."""
    context = said["context"]
    seconds: dict[str, list[float]] = {}
    medians: dict[str, list[float]] = {}
    for one in said["benchmarks"]:
        run = one.get("run_type", "iteration") == "iteration" and not one.get("error_occurred")
        if run or one.get("aggregate_name") == "median":
            taken = float(one["real_time"]) * UNITS[one.get("time_unit", "ns")]
            name = one.get("run_name") or one["name"]
            (seconds if run else medians).setdefault(name, []).append(taken)
    seconds = medians | seconds
    yield ShortRun(
        engine=str(context.get("executable", "unknown")).rpartition("/")[2] or "unknown",
        version=str(context.get("git_version") or context["date"]),
        started=context["date"],
        machine=context.get("host_name") or "unknown",
        results=tuple(_timed(name, repeats) for name, repeats in seconds.items()),
    )


def _asv(said: Mapping[str, Any]) -> Iterator[ShortRun]:
    """A value for each combination of parameters; what failed is null there and left out."""
    columns = said["result_columns"]
    results = []
    for name, row in said["results"].items():
        told = dict(zip(columns, row or (), strict=False))
        values = told.get("result") or []
        for place, value in enumerate(values):
            if value is not None and math.isfinite(float(value)):
                case = name if len(values) == 1 else f"{name}[{place}]"
                results.append(
                    _timed(case, [float(value)]) if "time_" in name else _followed(case, float(value))
                )
    yield ShortRun(
        engine="asv",
        version=said["commit_hash"][:10],
        commit=said["commit_hash"],
        started=datetime.fromtimestamp(float(said["date"]) / 1e3, UTC).isoformat(),
        machine=str(said.get("params", {}).get("machine") or "unknown"),
        results=tuple(results),
    )


def _github_action(said: Mapping[str, Any]) -> Iterator[ShortRun]:
    for suite, entries in said["entries"].items():
        for entry in entries:
            commit = entry["commit"]
            larger = "bigger" in str(entry.get("tool", "")).lower()
            yield ShortRun(
                engine=suite,
                version=commit["id"][:10],
                commit=commit["id"],
                commit_time=commit.get("timestamp") or "",
                started=datetime.fromtimestamp(float(entry["date"]) / 1e3, UTC).isoformat(),
                results=tuple(_bench(one, larger) for one in entry["benches"] if one["value"] is not None),
            )


def _bench(one: Mapping[str, Any], larger: bool) -> ShortResult:
    unit, value = str(one.get("unit", "1")), float(one["value"])
    scale = UNITS.get(unit.partition("/")[0].strip())
    if scale is not None and not larger:
        return _timed(one["name"], [value * scale])
    return _followed(one["name"], value, unit, larger or unit.lower() in RATES)


def _timed(test: str, seconds: list[float]) -> ShortResult:
    return ShortResult(test=test, metric="run_time", seconds=tuple(seconds))


def _followed(test: str, value: float, unit: str = "1", larger: bool = False) -> ShortResult:
    better: Any = "larger" if larger else "smaller"
    return ShortResult(test=test, metric="value", value=Number(value), unit=unit, better=better, noisy=True)


def _identity(run: ShortRun) -> str:
    """The same results twice are one run."""
    return hashlib.sha256(msgspec.json.encode(run, enc_hook=float)).hexdigest()[:32]
