"""Files of other benchmark tools as runs: their values are followed and judged as noisy, like our own run times.

pytest-benchmark (--benchmark-json), asv (results/MACHINE/*.json), Google Benchmark (--benchmark_out) and
github-action-benchmark (data.js, a whole history in one file). What a file does not say stays unknown.
A machine is known by its processor, never by its host's name: that is new in every job of a hosted runner, and
not ours to publish.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Literal, TypedDict

import msgspec

from spook_tracker.tracker.document.errors import DocumentError
from spook_tracker.tracker.document.json_form import Number
from spook_tracker.tracker.document.middle import median
from spook_tracker.tracker.document.run_document import RunDocument, SeriesDefinition

from .short_form import ShortResult, ShortRun, document_of
from .units import Unit, unit_of

if TYPE_CHECKING:
    from spook_tracker.tracker.document.json_form import Json

DATA_JS = b"window.BENCHMARK_DATA"
DIRECTIONS: dict[str, Literal["smaller", "larger"]] = {
    "customBiggerIsBetter": "larger",
    "customSmallerIsBetter": "smaller",
}
MOST_REPEATS = 101  # kept of one benchmark in one run; pytest-benchmark times tens of thousands
LONGEST_NAME = 200  # characters, of run documents
MIXED = "not said: may mix processors"


@dataclass(frozen=True, slots=True)
class Beside:
    """What the file itself does not say: from the files beside it, or from the caller of the import."""

    engine: str = ""  # in place of the file's
    machine: str = ""  # in place of the file's
    branch: str = ""  # the one whose runs are wanted
    commits: Mapping[str, bool] = field(default_factory=dict)  # those git knows here: whether they lie on it
    project: str = ""  # asv.conf.json's
    benchmarks: Mapping[str, Any] = field(default_factory=dict)  # asv's benchmarks.json


NOTHING = Beside()


def of_other_tools(content: bytes, origin: str, beside: Beside = NOTHING) -> tuple[RunDocument, ...] | None:
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
        told = _branch_of(said)
        return documents_of(((run, told) for run in read(said, beside)), beside, origin)
    except DocumentError:
        raise
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


def documents_of(
    runs: Iterable[tuple[ShortRun, str]], beside: Beside, origin: str
) -> tuple[RunDocument, ...]:
    """Runs, and the branch that the file says of each, as whole documents; those of other branches are left out."""
    wanted = (_named(run, beside) for run, told in runs if _is_wanted(run, told, beside, origin))
    return tuple(document_of(run, _identity(run), origin) for run in wanted)


def _is_wanted(run: ShortRun, told: str, beside: Beside, origin: str) -> bool:
    if not beside.branch:
        return True
    if told:
        return told == beside.branch
    if (lies := beside.commits.get(run.commit)) is None:
        raise DocumentError(
            f"{origin} does not say on which branch {run.version} was measured, and no repository here knows it"
        )
    return lies


def _branch_of(said: Mapping[str, Any]) -> str:
    """pytest-benchmark's, which puts "(detached head)" where it does not know; the others do not say."""
    commit = said.get("commit_info")
    told = str(commit.get("branch") or "") if isinstance(commit, dict) else ""
    return "" if told.startswith("(") else told


def _reader(said: Mapping[str, Any]) -> Callable[[Mapping[str, Any], Beside], Iterator[ShortRun]] | None:
    if "commit_hash" in said and ("result_columns" in said or "env_name" in said):
        return _asv
    if "entries" in said and "repoUrl" in said:
        return _github_action
    if isinstance(said.get("benchmarks"), list):
        if "machine_info" in said and "commit_info" in said:
            return _pytest
        if isinstance(context := said.get("context"), dict) and "num_cpus" in context:
            return _google
    return None


class Failure(TypedDict, total=False):
    """What became of a result without a value."""

    outcome: Literal["crashed", "not_finite"]
    failure: str


def _named(run: ShortRun, beside: Beside) -> ShortRun:
    machine = _fitting(beside.machine or run.machine, LONGEST_NAME)
    return msgspec.structs.replace(
        run,
        engine=_fitting(beside.engine or run.engine, LONGEST_NAME),
        version=_fitting(run.version, LONGEST_NAME),
        machine=machine,
        processor=machine if beside.machine else run.processor,
        results=tuple(_fitted(one) for one in _told_once(run.results)),
    )


def _fitted(one: ShortResult) -> ShortResult:
    """With names that a series may have together; the whole name is its description where it was cut."""
    long = len(one.test) + len(one.configuration) + len(one.metric) + 2 > LONGEST_NAME
    if not long and one.test and one.configuration and one.metric:
        return one
    return msgspec.structs.replace(
        one,
        test=_fitting(one.test, LONGEST_NAME // 2 if long else LONGEST_NAME),
        metric=_fitting(one.metric, LONGEST_NAME // 5 if long else LONGEST_NAME),
        configuration=_fitting(one.configuration, LONGEST_NAME // 4 if long else LONGEST_NAME),
        description=one.test if long else one.description,
    )


def _fitting(name: str, longest: int) -> str:
    """Parametrised benchmarks have names of a thousand characters: what is cut off is told apart by a hash of all."""
    if len(name) <= longest:
        return name or "unnamed"
    return f"{name[: longest - 10]}… {hashlib.sha256(name.encode()).hexdigest()[:8]}"


def _pytest(said: Mapping[str, Any], _: Beside) -> Iterator[ShortRun]:
    commit, machine = said["commit_info"] or {}, said["machine_info"] or {}
    known = commit.get("id") if commit.get("id") != "unversioned" else ""
    results = []
    for one in said["benchmarks"]:
        stats = one["stats"]
        seconds = stats.get("data") or [stats["min"], stats["median"], stats["max"]]
        result = _timed(one["fullname"], [float(s) for s in seconds])
        results.append(msgspec.structs.replace(result, runs_per_repeat=int(stats.get("iterations") or 1)))
    cpu = machine["cpu"] if isinstance(machine.get("cpu"), dict) else {}
    lane, cores = _lane(cpu.get("brand_raw"), cpu.get("count"))
    yield ShortRun(
        engine=commit.get("project") or "unknown",
        version=(known or "unknown")[:10],
        commit=known or "",
        commit_time=commit.get("time") or "",
        started=said.get("datetime") or "",
        machine=lane,
        cores=cores,
        operating_system=_words(machine.get("system"), machine.get("release")),
        dirty=bool(commit.get("dirty")),
        results=tuple(results),
    )


def _google(said: Mapping[str, Any], _: Beside) -> Iterator[ShortRun]:
    """Repetitions of one name are its repeats; of aggregates the median counts, where they are all there is."""
    context = said["context"]
    seconds: dict[str, list[float]] = {}
    medians: dict[str, list[float]] = {}
    why: dict[str, str] = {}
    for one in said["benchmarks"]:
        run = one.get("run_type", "iteration") == "iteration" and not one.get("error_occurred")
        if run or one.get("aggregate_name") == "median":
            unit = one.get("time_unit", "ns")
            if (read := unit_of(unit)).name != "s":
                raise ValueError(f"{unit} is no unit of time")
            name = one.get("run_name") or one["name"]
            (seconds if run else medians).setdefault(name, []).append(float(one["real_time"]) * read.scale)
        elif one.get("error_occurred"):
            why[one.get("run_name") or one["name"]] = str(one.get("error_message") or "")
            seconds.setdefault(one.get("run_name") or one["name"], [])
    seconds = medians | seconds
    results = [_timed(name, repeats) for name, repeats in seconds.items()]
    results = [
        msgspec.structs.replace(one, failure=why[one.test]) if not one.seconds and why.get(one.test) else one
        for one in results
    ]
    lane, cores = _lane(None, context["num_cpus"])
    yield ShortRun(
        engine=str(context.get("executable", "unknown")).rpartition("/")[2] or "unknown",
        version=str(context.get("git_version") or context["date"]),
        started=context["date"],
        machine=lane,
        cores=cores,
        results=tuple(results),
    )


def _asv(said: Mapping[str, Any], beside: Beside) -> Iterator[ShortRun]:
    """A value for each combination of parameters, named by their values as `asv show` does.

    asv writes null for what failed and NaN for what its set-up skipped. Its benchmark's version is its definition.
    """
    if "result_columns" not in said:
        raise ValueError("of an asv before 0.5, whose `asv update` brings results to today's form")
    columns, machine = said["result_columns"], said.get("params") or {}
    results = []
    for name, row in said["results"].items():
        told = dict(zip(columns, row or (), strict=False))
        cases = asv_cases(name, told)
        values = told.get("result") or [None] * len(cases)
        unit = _asv_unit(name, beside.benchmarks.get(name) or {})
        for place, (case, value) in enumerate(zip(cases, values, strict=True)):
            result = sampled(case, value, unit)
            if result.seconds:
                result = _repeated(result, told, place, unit.scale)
            if value is not None and math.isnan(float(value)):
                result = msgspec.structs.replace(result, outcome="not_supported", failure="skipped by asv")
            results.append(
                msgspec.structs.replace(
                    result,
                    configuration=str(said.get("env_name") or "default"),
                    definition=str(told.get("version") or ""),
                )
            )
    host = str(machine.get("machine") or "")
    words = _words(machine.get("cpu"), machine.get("gpu"), between=", ")
    lane, cores = _lane(words, machine.get("num_cpu"))
    if host:  # chosen by the team, and kept: two machines of one model are two
        lane = f"{lane}, no. {hashlib.sha256(host.encode()).hexdigest()[:6]}"
    yield ShortRun(
        engine=beside.project or "asv",
        version=said["commit_hash"][:10],
        commit=said["commit_hash"],
        started=_moment(said["date"]),
        machine=lane,
        cores=cores,
        operating_system=_words(machine.get("os")),
        results=tuple(results),
    )


def asv_cases(name: str, described: Mapping[str, Any]) -> list[str]:
    """The tests of one benchmark: by the values of its parameters, as `asv show` names them."""
    cases = itertools.product(*(described.get("params") or ()))
    return [f"{name}({', '.join(map(str, case))})" if case else name for case in cases]


def asv_series(name: str, described: Mapping[str, Any], configuration: str) -> SeriesDefinition:
    """The series of a benchmark that asv lists and that has no result yet."""
    result = msgspec.structs.replace(
        sampled(name, None, _asv_unit(name, described)),
        configuration=configuration,
        definition=str(described.get("version") or ""),
    )
    run = ShortRun(engine="asv", version="none", results=(result,))
    return document_of(run, "none", "asv's list").series[0]


def _repeated(result: ShortResult, told: Mapping[str, Any], place: int, scale: float) -> ShortResult:
    """The repeats behind a time where asv kept them, else its quartiles; the value stays the one that asv shows."""
    of_case = {name: row[place] for name, row in told.items() if isinstance(row, list) and place < len(row)}
    quartiles = of_case.get("stats_q_25"), result.value, of_case.get("stats_q_75")
    kept: Sequence[Any] = of_case.get("samples") or (() if None in quartiles else quartiles)
    seconds = _thinned([float(one) * (1.0 if one is result.value else scale) for one in kept])
    if not seconds or not all(math.isfinite(s) and s >= 0.0 for s in seconds):
        return result
    often = of_case.get("stats_number")
    return msgspec.structs.replace(result, seconds=seconds, runs_per_repeat=int(often or 1))


def _asv_unit(name: str, described: Mapping[str, Any]) -> Unit:
    """asv's own type and unit where its list of benchmarks is at hand; else what its prefix means to asv."""
    if described.get("unit"):
        return unit_of(str(described["unit"]))
    function = name.rpartition(".")[2].lower()
    if function.startswith(("time_", "timeraw_")):
        return unit_of("s")
    return unit_of("bytes" if function.startswith(("mem_", "peakmem_")) else "1")


def _github_action(said: Mapping[str, Any], _: Beside) -> Iterator[ShortRun]:
    """A suite is an engine where it is alone; several are configurations of what the repository holds."""
    several = len(said["entries"]) > 1
    project = str(said["repoUrl"]).rstrip("/").rpartition("/")[2]
    for suite, entries in said["entries"].items():
        for entry in entries:
            commit = entry["commit"]
            better = DIRECTIONS.get(str(entry.get("tool", "")))
            yield ShortRun(
                engine=project if several and project else suite,
                version=commit["id"][:10],
                commit=commit["id"],
                commit_time=commit.get("timestamp") or "",
                started=_moment(entry["date"]),
                processor=MIXED,
                results=tuple(
                    msgspec.structs.replace(bench, configuration=suite) if several else bench
                    for bench in (_bench(one, better) for one in entry["benches"])
                ),
            )


def _told_once(results: Sequence[ShortResult]) -> tuple[ShortResult, ...]:
    """Times under one name in one run are its repeats; other values there are numbered, so that none is lost."""
    found: dict[tuple[str, str, str], ShortResult] = {}
    for one in results:
        name, number = one.test, 1
        while (before := found.get((one.test, one.configuration, one.metric))) is not None:
            if one.seconds and before.seconds:
                one = repeated([before, one])
                break
            number += 1
            one = msgspec.structs.replace(one, test=f"{name} ({number})")
        found[one.test, one.configuration, one.metric] = one
    return tuple(found.values())


def repeated(those: Sequence[ShortResult]) -> ShortResult:
    """One result of several: of times the least counts, of other values their median, and of failures none beside those."""
    told = [one for one in those if one.value is not None] or [those[0]]
    if seconds := sum((one.seconds for one in told), ()):
        return msgspec.structs.replace(told[0], value=Number(min(seconds)), seconds=seconds)
    if told[0].value is None:
        return told[0]
    return msgspec.structs.replace(told[0], value=Number(median([float(one.value or 0.0) for one in told])))


def _bench(one: Mapping[str, Any], better: Literal["smaller", "larger"] | None) -> ShortResult:
    unit = unit_of(str(one.get("unit", "1")))
    if better:
        unit = msgspec.structs.replace(unit, better=better)
    try:
        return sampled(one["name"], one["value"], unit)
    except (TypeError, ValueError):  # a text, a list
        failed = sampled(one["name"], None, unit)
        return msgspec.structs.replace(failed, **_failed(one["value"]))


def sampled(test: str, value: float | str | None, unit: Unit) -> ShortResult:
    """One value in its unit; what is no value, or no time, is this result's outcome alone."""
    metric = "run_time" if unit.name == "s" and unit.better == "smaller" else "value"
    number = math.nan if value is None else float(value) * unit.scale
    if metric == "run_time":
        return _timed(test, [] if value is None else [number])
    failure: Failure = {} if math.isfinite(number) else _failed(value)
    return ShortResult(
        test=test,
        metric=metric,
        value=Number(number) if not failure else None,
        unit=unit.name,
        better=unit.better,
        noisy=True,
        **failure,
    )


def _timed(test: str, seconds: list[float]) -> ShortResult:
    """Run time of each repeat, s; none: it failed."""
    if seconds and all(math.isfinite(s) and s >= 0.0 for s in seconds):
        value, kept = Number(min(seconds)), _thinned(seconds)
        return ShortResult(test=test, metric="run_time", value=value, seconds=kept)
    failure = _failed(seconds[0] if seconds else None)
    return ShortResult(test=test, metric="run_time", unit="s", better="smaller", noisy=True, **failure)


def _thinned(seconds: Sequence[float]) -> tuple[float, ...]:
    """At most MOST_REPEATS of them: where there are more, those of evenly spaced ranks, with the least and the most."""
    if len(seconds) <= MOST_REPEATS:
        return tuple(seconds)
    ranked = sorted(seconds)
    return tuple(ranked[i * (len(ranked) - 1) // (MOST_REPEATS - 1)] for i in range(MOST_REPEATS))


def _failed(value: Json) -> Failure:
    if value is None:
        return {"outcome": "crashed", "failure": "it failed: the file gives no value"}
    said = f"{value:.6g}" if isinstance(value, float) else str(value)
    return {"outcome": "not_finite", "failure": f"the file says {said}"}


def _lane(processor: Json, cores: Json) -> tuple[str, int]:
    """The machine by what decides run times, and its cores."""
    text = str(cores or "")
    count = int(text) if text.isdecimal() and len(text) < 7 else 1
    return f"{processor or 'processor ' + MIXED}, {count} cores", count


def _words(*parts: Json, between: str = " ") -> str:
    return between.join(str(part) for part in parts if part)


def _moment(milliseconds: float | str) -> str:
    return datetime.fromtimestamp(float(milliseconds) / 1e3, UTC).isoformat()


def _identity(run: ShortRun) -> str:
    """The same results twice are one run; what runs of before said nothing of is left out where it says nothing."""
    said = msgspec.json.encode(run, enc_hook=float)
    return hashlib.sha256(said if run.dirty else said.replace(b',"dirty":false', b"")).hexdigest()[:32]
