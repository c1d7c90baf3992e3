"""Each part of a run document as a row, and back. The two directions stand side by side."""

from __future__ import annotations

import hashlib
import math
import zlib
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from functools import lru_cache
from typing import TYPE_CHECKING, Any, TypeVar

import msgspec

from spook_tracker.tracker.document import run_document as document
from spook_tracker.tracker.document.errors import DatabaseError, DocumentError
from spook_tracker.tracker.document.json_form import Number, boxed, decode, encode

from .identity import identity

if TYPE_CHECKING:
    from spook_tracker.tracker.document.json_form import Writable

Row = dict[str, Any]
SPECIALS = ("nan", "inf", "-inf", "-0.0")  # float64 values that not every database keeps
Part = TypeVar("Part")


def json_of(part: Writable) -> str:
    """Compact JSON; floats in the shortest form that reads back to the same bits."""
    return encode(part).decode()


class Compressed:
    """Bodies compressed already, by hash: figures of an engine that did not change are the same every night."""

    def __init__(self, most: int) -> None:
        self.most, self.size = most, 0  # bytes that are kept, the oldest go first
        self.bodies: dict[bytes, bytes] = {}

    def of(self, content: bytes) -> bytes:
        """The content compressed."""
        name = hashlib.sha256(content).digest()
        if (known := self.bodies.get(name)) is not None:
            return known
        body = zlib.compress(content, 6)
        if len(body) <= self.most:
            self.bodies[name] = body
            self.size += len(body)
            while self.size > self.most:
                self.size -= len(self.bodies.pop(next(iter(self.bodies))))
        return body


_compressed = Compressed(32 * 1024 * 1024)


def packed(part: Writable) -> bytes:
    """Compressed JSON, for the bulky parts that no query reads."""
    return _compressed.of(encode(part))


def unpacked(body: bytes, kind: type[Part]) -> Part:
    return _unpacked(body, kind)  # type: ignore[no-any-return, arg-type]


@lru_cache(maxsize=256)  # a map that stands still is the same bytes night after night
def _unpacked(body: bytes, kind: type[Part]) -> Part:
    try:
        return decode(zlib.decompress(body), kind)
    except (zlib.error, msgspec.DecodeError) as error:
        raise DatabaseError(
            f"a stored figure or map is damaged ({error}); restore the database from a copy"
        ) from None


def moment(text: str) -> datetime:
    """The moment an ISO 8601 text names; without a zone it is UTC."""
    try:
        found = datetime.fromisoformat(text)
        return found.replace(tzinfo=UTC) if found.tzinfo is None else found.astimezone(UTC)
    except (ValueError, OverflowError):
        raise DocumentError(f"{text[:60]!r} is not a time; write it as 2026-11-21T03:17:00+00:00") from None


def stored_moment(value: datetime | str) -> datetime:
    """A moment as it was stored; SQLite keeps text, and all is UTC."""
    found = datetime.fromisoformat(value) if isinstance(value, str) else value
    return found.replace(tzinfo=UTC) if found.tzinfo is None else found.astimezone(UTC)


def split(number: float) -> tuple[float | None, str | None]:
    """A float64 as (value, special): as JSON carries it, and the sign of zero, which databases lose, in words."""
    if not math.isfinite(number):
        return None, str(boxed(number))
    if number == 0.0 and math.copysign(1.0, number) < 0:
        return 0.0, "-0.0"
    return float(number), None


def joined(value: float | None, special: str | None) -> Number:
    if special is not None:
        return Number(special)
    assert value is not None  # the table's own check
    return Number(value)


def engine_row(engine: document.EngineVersion) -> Row:
    columns = msgspec.structs.asdict(engine)
    told = {name: value for name, value in columns.items() if value or name not in ("subject", "author")}
    return {"id": identity("engine", json_of(told)), **columns, "parents": json_of(engine.parents)}


def engine_of(row: Mapping[str, Any]) -> document.EngineVersion:
    columns = {name: row[name] for name in document.EngineVersion.__struct_fields__}
    columns |= {"dirty": bool(row["dirty"])}
    return document.EngineVersion(**columns | {"parents": decode(row["parents"], tuple[str, ...])})


def machine_row(machine: document.Machine) -> Row:
    return {"id": identity("machine", json_of(machine)), **msgspec.structs.asdict(machine)}


def machine_of(row: Mapping[str, Any]) -> document.Machine:
    return document.Machine(**{name: row[name] for name in document.Machine.__struct_fields__})


def cards_row(cards: tuple[document.TestCard, ...]) -> Row:
    body = json_of(cards)
    return {"id": identity("cards", body), "body": body}


def cards_of(body: str) -> tuple[document.TestCard, ...]:
    return decode(body, tuple[document.TestCard, ...])


def limits(definition: document.SeriesDefinition) -> tuple[float | None, float | None]:
    """The limit as the interval of values that keep it; None: open on that side."""
    limit = definition.limit
    if limit is None:
        return None, None
    if isinstance(limit, tuple):
        return limit[0] + 0.0, limit[1] + 0.0  # + 0.0: no negative zero in a plain column
    if definition.better == "larger":
        return limit + 0.0, None
    if definition.better == "smaller":
        return None, limit + 0.0
    return -abs(limit) + 0.0, abs(limit)


def definition_row(definition: document.SeriesDefinition) -> Row:
    """The row of a definition, not to be changed: definitions are the same night after night."""
    return _definition_row(json_of(definition))


@lru_cache(maxsize=20_000)
def _definition_row(body: str) -> Row:
    definition = definition_of(body)
    low, high = limits(definition)
    same = (
        "test",
        "configuration",
        "metric",
        "unit",
        "role",
        "better",
        "kind",
        "limit_kind",
        "set_point_kind",
        "test_version",
    )
    return {
        "id": identity("definition", body),
        "series_id": identity("series", definition.key),
        **{name: getattr(definition, name) for name in same},
        "time_step": None if definition.time_step is None else definition.time_step + 0.0,
        "limit_low": low,
        "limit_high": high,
        "body": body,
    }


def definition_of(body: str) -> document.SeriesDefinition:
    return decode(body, document.SeriesDefinition)


def content_of(run: document.RunDocument, rows: Sequence[Row] = ()) -> str:
    """A hash of all values of a run, with what stands behind them and their definitions, whose rows may be known."""
    definitions = [row["id"] for row in rows or map(definition_row, run.series)]
    return hashlib.sha256(encode((definitions, run.samples))).hexdigest()[:16]


def asked_text(asked: document.Asked | None) -> str:
    return "" if asked is None else json_of(asked)


@lru_cache(maxsize=64)  # most nights are asked for the same
def asked_of(text: str) -> document.Asked | None:
    return decode(text, document.Asked) if text else None


def workers_text(workers: tuple[document.Worker, ...]) -> str:
    return json_of(workers) if workers else ""


def workers_of(text: str) -> tuple[document.Worker, ...]:
    return decode(text, tuple[document.Worker, ...]) if text else ()


def sample_row(sample: document.Sample) -> Row:
    value, special = split(sample.value)
    return {
        "value": value,
        "special": special,
        "outcome": sample.outcome,
        "passed": sample.passed,
        "set_point_held": sample.set_point_held,
    }


def evidence_row(sample: document.Sample) -> Row | None:
    if not (sample.failure or sample.state_hash or sample.counters):
        return None
    counters = json_of(sample.counters)
    return {"failure": sample.failure, "state_hash": sample.state_hash, "counters": counters}


def timing_row(timing: document.Timing) -> Row:
    return {
        "seconds": json_of(timing.seconds),
        "runs_per_repeat": timing.runs_per_repeat,
        "instructions": timing.instructions,
        "stage_seconds": json_of(timing.stage_seconds),
        "cpu_seconds": json_of(timing.cpu_seconds) if timing.cpu_seconds else "",
        "calibration": json_of(timing.calibration) if timing.calibration else "",
        "again": json_of(timing.again) if timing.again else "",
    }


_SECONDS = msgspec.json.Decoder(tuple[float, ...])
_BY_STAGE = msgspec.json.Decoder(dict[str, float])
_COUNTERS = msgspec.json.Decoder(dict[str, int])


def timing_of(
    seconds: str,
    runs_per_repeat: int,
    instructions: int | None,
    stages: str,
    cpu: str,
    calibration: str,
    again: str,
) -> document.Timing:
    return document.Timing(
        seconds=_SECONDS.decode(seconds),
        runs_per_repeat=runs_per_repeat,
        instructions=instructions,
        stage_seconds=_BY_STAGE.decode(stages),
        cpu_seconds=_SECONDS.decode(cpu) if cpu else (),
        calibration=_SECONDS.decode(calibration) if calibration else (),
        again=decode(again, document.Again) if again else None,
    )


@lru_cache(maxsize=20_000)
def counters_of(text: str) -> dict[str, int]:
    return _COUNTERS.decode(text)
