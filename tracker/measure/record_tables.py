"""Records as runs: JSON lines, CSV, or a JSON list of flat objects, one mapping for all of them.

A column has a meaning: it tells about the run (commit, started, ...), names what was measured (test, metric,
parameter), or holds values in a unit. What is given no meaning has the usual one of its name; a column of
numbers in no known unit is kept as what may explain a change, since its unit does not say which way is better.

    {"commit": "1af2…", "timestamp": "2026-03-30T08:50:26+00:00", "steps_per_second": 4.1e6, "ncon_mean": 22.3}

Without a column for the test, the file's name is the test: a file a benchmark, a line a commit.
"""

from __future__ import annotations

import csv
import io
import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from msgspec.structs import replace

from spook_tracker.tracker.document.errors import DocumentError
from spook_tracker.tracker.document.run_document import RunDocument

from .other_tools import NOTHING, Beside, documents_of, repeated, sampled
from .short_form import ShortResult, ShortRun
from .units import Unit, unit_of

if TYPE_CHECKING:
    from spook_tracker.tracker.document.json_form import Json

Remarks: TypeAlias = frozenset[tuple[str, str]]  # columns without a meaning, and what they hold
RUN = ("commit", "version", "started", "branch", "engine", "machine")
NAMES = ("test", "metric", "value", "unit", "configuration", "parameter")
LEFT_OUT = "-"
FAILED = (
    "n/a",
    "na",
    "none",
    "null",
    "-",
    "--",
    "fail",
    "failed",
    "error",
    "timeout",
    "crash",
    "crashed",
    "oom",
)
USUAL = {
    **{name: name for name in (*RUN, *NAMES) if name != "parameter"},
    **dict.fromkeys(("sha", "commit_hash", "commit_id", "git_hash", "revision"), "commit"),
    **dict.fromkeys(("timestamp", "date", "datetime", "commit_time"), "started"),
    **dict.fromkeys(("benchmark", "name"), "test"),
}
NAMED_UNIT = re.compile(
    r"(?:^|[_.])(?:(\w+?)_per_(seconds?|secs?|s|ms|us|ns|min)|(s|secs?|seconds|ms|us|ns|bytes|[kmg]i?b))$"
)
FORMS = (".jsonl", ".ndjson", ".csv", ".tsv")
MILLISECONDS = 1e11  # a moment above it is no number of seconds since 1970: those would be in the year 5138


@dataclass(frozen=True, slots=True)
class Meaning:
    """What a column holds: something of RUN or NAMES, nothing that counts, or values."""

    role: str = ""  # empty: values
    unit: Unit = field(default_factory=lambda: Unit("1"))
    explains: bool = False


@dataclass(frozen=True, slots=True)
class Tables:
    """What files of records give: the runs, and the columns that hold numbers in no known unit."""

    runs: tuple[RunDocument, ...]
    unknown: tuple[str, ...]
    absent: tuple[str, ...]  # columns that were given a meaning and are in no record


def is_table(file: Path, content: bytes) -> bool:
    """Whether it is meant to be records: by its name, or a JSON list."""
    return file.suffix.lower() in FORMS or content.lstrip()[:1] == b"["


def meanings(told: Iterable[str]) -> tuple[tuple[str, Meaning], ...]:
    """`PATTERN=MEANING` each; DocumentError for one that is not that. The first that fits a column counts."""
    found = []
    for text in told:
        pattern, equals, meant = (part.strip() for part in text.rpartition("="))
        if not (pattern and equals and meant):
            raise DocumentError(f"{text!r} gives no column a meaning; write NAME=MEANING, as in run_time=s")
        found.append((pattern, _meaning(meant)))
    return tuple(found)


def _meaning(meant: str) -> Meaning:
    if meant in (*RUN, *NAMES, LEFT_OUT):
        return Meaning(meant)
    name, _, better = (part.strip() for part in meant.partition(","))
    unit = unit_of(name)
    if better == "explains":
        return Meaning("", unit, explains=True)
    if better not in ("", "larger", "smaller"):
        raise DocumentError(f"{meant!r}: after the unit comes larger, smaller or explains, not {better!r}")
    return Meaning("", replace(unit, better=better) if better else unit)


def of_tables(
    files: Mapping[Path, bytes], told: Sequence[tuple[str, Meaning]] = (), beside: Beside = NOTHING
) -> Tables:
    """The runs in these files together: what several say of one commit is one run. DocumentError."""
    unknown: dict[str, None] = {}
    columns: set[str] = set()
    runs: dict[tuple[str, ...], list[_Growing]] = {}
    for file, content in files.items():
        records = sorted(_records(file, content), key=lambda one: _started(one[1], told))
        for place, record in records:
            columns |= record.keys()
            about, results, remarks = _read(file, place, record, told, unknown)
            key = tuple(about.get(name, "") for name in RUN if name != "started")
            same = runs.setdefault(key, [])
            run = next((one for one in same if one.takes(about, results)), None)
            if run is None:
                same.append(run := _Growing(about))
            run.add(results, remarks, f"{file}:{place}")
    short = [one.whole() for same in runs.values() for one in same]
    origin = str(next(iter(files), ""))
    documents = documents_of(short, beside, origin)
    absent = (pattern for pattern, _ in told if not any(fnmatchcase(name, pattern) for name in columns))
    return Tables(documents, tuple(unknown), tuple(absent))


@dataclass(slots=True)
class _Growing:
    """A run that gets its values from several records."""

    about: dict[str, str]
    results: dict[tuple[str, str, str], ShortResult] = field(default_factory=dict)
    repeats: dict[tuple[str, str, str], list[ShortResult]] = field(default_factory=dict)
    remarks: dict[tuple[str, str, str], Remarks] = field(default_factory=dict)

    def takes(self, about: Mapping[str, str], results: Sequence[ShortResult]) -> bool:
        """Whether more values belong to it: those of one moment do, and of one commit those it does not have."""
        return self.about.get("started") == about.get("started") or not any(
            _key(one) in self.results for one in results
        )

    def add(self, results: Sequence[ShortResult], remarks: Remarks, place: str) -> None:
        """Records that differ in nothing but their values are repeats: of times the least counts, else their median."""
        for one in results:
            key = _key(one)
            if self.remarks.setdefault(key, remarks) != remarks:
                apart = sorted({name for name, _ in self.remarks[key] ^ remarks})
                raise DocumentError(
                    f"{place}: a second value of {one.test}/{one.metric} in one run, with another {', '.join(apart)}; "
                    f"say --column {apart[0]}=parameter if that tells two benchmarks apart, and --column {apart[0]}=- "
                    "if they are repeats of one"
                )
            self.repeats.setdefault(key, []).append(one)
            self.results[key] = repeated(self.repeats[key])

    def whole(self) -> tuple[ShortRun, str]:
        commit = self.about.get("commit", "")
        run = ShortRun(
            engine=self.about.get("engine") or "unknown",
            version=self.about.get("version") or commit[:10],
            commit=commit,
            started=self.about.get("started", ""),
            machine=self.about.get("machine") or "machine not said: may mix several",
            results=tuple(self.results.values()),
        )
        return run, self.about.get("branch", "")


def _key(one: ShortResult) -> tuple[str, str, str]:
    return one.test, one.configuration, one.metric


def _records(file: Path, content: bytes) -> Iterator[tuple[int, dict[str, Json]]]:
    """Its records and the line of each."""
    try:
        text = content.decode("utf-8-sig")
        if file.suffix.lower() in (".csv", ".tsv"):
            rows = csv.DictReader(io.StringIO(text), delimiter="\t" if file.suffix.lower() == ".tsv" else ",")
            twice = [name for name, count in Counter(rows.fieldnames or ()).items() if count > 1]
            if twice:
                raise ValueError(f"two columns are called {twice[0]!r}")
            for row in rows:
                if None in row or None in row.values():
                    raise ValueError(f"line {rows.line_num} has not as many cells as there are columns")
                yield rows.line_num, {name: cell for name, cell in row.items() if cell != ""}
            return
        lines = enumerate(text.splitlines(), 1)
        given = enumerate(json.loads(text), 1) if text.lstrip()[:1] == "[" else _json_lines(lines)
        for place, one in given:
            if not isinstance(one, dict):
                raise ValueError(f"record {place} is no JSON object")
            yield place, dict(_flat(one))
    except (ValueError, RecursionError, csv.Error) as error:  # of JSON and of UTF-8, too
        raise DocumentError(f"{file} cannot be read as records: {error!s:.200}") from None


def _json_lines(lines: Iterable[tuple[int, str]]) -> Iterator[tuple[int, Json]]:
    for place, line in lines:
        if line.strip():
            try:
                yield place, json.loads(line)
            except ValueError as error:
                raise ValueError(f"line {place}: {error}") from None


def _flat(one: Mapping[str, Json], before: str = "") -> Iterator[tuple[str, Json]]:
    for name, value in one.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{before}{name}.")
        else:
            yield before + name, value


def _started(record: Mapping[str, Json], told: Sequence[tuple[str, Meaning]]) -> str:
    for name, value in record.items():
        if _meant(name, told).role == "started":
            return _moment(value)
    return ""


def _read(
    file: Path,
    place: int,
    record: Mapping[str, Json],
    told: Sequence[tuple[str, Meaning]],
    unknown: dict[str, None],
) -> tuple[dict[str, str], list[ShortResult], Remarks]:
    """What a record says about its run, its values, and what else."""
    about: dict[str, str] = {}
    named: dict[str, str] = {}
    parameters: list[str] = []
    values: list[tuple[str, Json, Meaning]] = []
    remarks: list[tuple[str, str]] = []
    for name, value in record.items():
        meaning = _meant(name, told)
        if meaning.role == "value":
            values.append((name, value, meaning))
        elif meaning.role == "started":
            about["started"] = _moment(value)
        elif meaning.role == "parameter":
            parameters.append(f"{name}={value}")
        elif meaning.role in RUN:
            about[meaning.role] = str(value)
        elif meaning.role in NAMES:
            named[meaning.role] = str(value)
        elif meaning.role != LEFT_OUT and (_is_value(value) or meaning.unit.name != "1"):
            values.append((name, value, meaning))
        if not meaning.role and (meaning.unit.name == "1" or not _is_value(value)) and not meaning.explains:
            remarks.append((name, str(value)))
    if not about.get("commit") and not about.get("version"):
        if "jmhVersion" in record:
            raise DocumentError(
                f"{file} is JMH's, which tells no commit; bring it as github-action-benchmark's data.js, or its values "
                "as JSON lines or CSV with a column for the commit"
            )
        raise DocumentError(
            f"{file}:{place}: no column tells the commit or the version; say which does (--column NAME=commit)"
        )
    long = any(meaning.role == "value" for _, _, meaning in values)
    if long:
        values = [one for one in values if one[2].role == "value"]
    test = named.get("test") or file.stem
    test += f"({', '.join(parameters)})" if parameters else ""
    results = []
    for name, value, meaning in values:
        if long and "unit" in named:
            meaning = Meaning("", unit_of(named["unit"]))
        metric = named.get("metric", "") if long else name
        if meaning.unit.name == "1" and not meaning.explains:
            unknown[metric or test] = None
            meaning = Meaning("", meaning.unit, explains=True)
        try:
            if isinstance(value, list | dict):
                raise TypeError("no number")
            failed = isinstance(value, str) and value.strip().lower() in FAILED
            one = sampled(test, None if failed else value, meaning.unit)
            if failed:
                one = replace(one, failure=f"the file says {value}")
        except (TypeError, ValueError):
            raise DocumentError(
                f"{file}:{place}: {name} is {value!r:.60} and no number; correct it, or leave the column out with "
                f"--column {name}=-"
            ) from None
        results.append(
            replace(
                one,
                metric=metric or one.metric,
                configuration=named.get("configuration", "default"),
                explaining=meaning.explains,
            )
        )
    return about, results, frozenset(remarks)


def _meant(name: str, told: Sequence[tuple[str, Meaning]]) -> Meaning:
    for pattern, meaning in told:
        if fnmatchcase(name, pattern):
            return meaning
    if (usual := USUAL.get(name.lower())) is not None:
        return Meaning(usual)
    if (said := NAMED_UNIT.search(name.lower())) is None:
        return Meaning()
    counted, below, unit = said.groups()
    return Meaning("", unit_of(f"{counted}/{below}" if counted else unit))


def _is_value(value: Json) -> bool:
    """Numbers, and null for what failed; other texts are remarks."""
    if isinstance(value, str):
        try:
            float(value)
        except ValueError:
            return False
        return True
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))


def _moment(value: Json) -> str:
    """ISO 8601 as it is; seconds or milliseconds since 1970 as that."""
    try:
        if not isinstance(value, str | int | float):
            return str(value)
        seconds = float(value)
    except ValueError:
        return str(value)
    try:
        return datetime.fromtimestamp(seconds / 1e3 if seconds > MILLISECONDS else seconds, UTC).isoformat()
    except (ValueError, OverflowError, OSError):
        raise DocumentError(f"{value} is no valid time") from None
