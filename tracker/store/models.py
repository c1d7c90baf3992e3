"""The tables. Every column says what it holds (`comment`); migrations/ holds the same schema as revisions.

Small tables (engine_version, machine, test_cards, series, definition, series_list, run) are referred to; the
large ones (sample, evidence, timing, figure, stability_map, trajectory) refer to `run` and are referred to by
none. The time column leads the key of every large table, so that it can become a hypertable, a partitioned or a
distributed table as it stands. Ids are made by the application from the content (`identity`): two databases
that hold the same thing hold it under the same id, and shards merge without renumbering.
"""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING

from sqlalchemy import (
    BigInteger,
    CheckConstraint,
    DateTime,
    Dialect,
    Double,
    ForeignKey,
    Index,
    LargeBinary,
    MetaData,
    Text,
    TypeDecorator,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

from .rows import SPECIALS

if TYPE_CHECKING:
    from sqlalchemy.orm import MappedColumn

NAMING = {
    "pk": "pk_%(table_name)s",
    "fk": "fk_%(table_name)s_%(column_0_name)s",
    "uq": "uq_%(table_name)s_%(column_0_name)s",
    "ix": "ix_%(table_name)s_%(column_0_name)s",
    "ck": "ck_%(table_name)s_%(constraint_name)s",
}
OUTCOMES = (
    "value",
    "unsettled",
    "out_of_limit",
    "not_finite",
    "diverged",
    "timed_out",
    "crashed",
    "missing",
    "not_supported",
)


class UTCDateTime(TypeDecorator[datetime]):
    """A moment with its zone: written as UTC, read back as UTC. SQLite alone would forget the zone."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError(f"the time {value} has no zone; give it one")
        return value.astimezone(UTC)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


def _one_of(column: str, values: tuple[str, ...]) -> str:
    return f"{column} IN ({', '.join(repr(value) for value in values)})"


def _key(comment: str) -> MappedColumn[int]:
    return mapped_column(BigInteger, primary_key=True, autoincrement=False, comment=comment)


def _reference(target: str, comment: str, *, primary_key: bool = False) -> MappedColumn[int]:
    return mapped_column(
        BigInteger, ForeignKey(target), primary_key=primary_key, autoincrement=False, comment=comment
    )


def _text(comment: str, *, primary_key: bool = False, unique: bool | None = None) -> MappedColumn[str]:
    return mapped_column(Text, comment=comment, primary_key=primary_key, unique=unique)


def _started_at() -> MappedColumn[datetime]:
    return mapped_column(UTCDateTime, primary_key=True, comment="start of the run, UTC; leads the key")


class Base(DeclarativeBase):
    """Common metadata, with a name for every constraint so that any of them can be changed later."""

    metadata = MetaData(naming_convention=NAMING)


class EngineVersion(Base):
    """Which engine was measured: one row for each build that differs in anything below."""

    __tablename__ = "engine_version"
    __table_args__ = (Index(None, "git_hash"), {"comment": "a build of an engine"})

    id: Mapped[int] = _key("identity of all that follows")
    name: Mapped[str] = _text("engine, such as spook")
    version: Mapped[str] = _text("version as the build says it, from git")
    git_hash: Mapped[str] = _text("full hash of the commit; empty for engines without one")
    dirty: Mapped[bool] = mapped_column(comment="built from a tree with uncommitted changes")
    commit_time: Mapped[str] = _text("ISO 8601; empty if unknown")
    parents: Mapped[str] = _text("JSON list of the hashes of the parent commits; gives the commit order")
    compiler: Mapped[str] = _text("compiler and its version")
    flags: Mapped[str] = _text("compiler flags")
    subject: Mapped[str] = _text("first line of the commit's message; empty if unknown")
    author: Mapped[str] = _text("author of the commit; empty if unknown")


class Machine(Base):
    """Where it ran."""

    __tablename__ = "machine"
    __table_args__ = ({"comment": "a machine in one state of its software"},)

    id: Mapped[int] = _key("identity of all that follows")
    fingerprint: Mapped[str] = _text("equal fingerprints: run times may be compared")
    processor: Mapped[str] = _text("processor model")
    cores: Mapped[int] = mapped_column(BigInteger, comment="processor cores usable by the run")
    operating_system: Mapped[str] = _text("operating system and version")
    float_environment: Mapped[str] = _text("hash of the bits of a few library functions")


class TestCards(Base):
    """What the pages say about the tests, as worded in the runs that refer to it."""

    __test__ = False  # a table, not a test class
    __tablename__ = "test_cards"
    __table_args__ = ({"comment": "wording of all tests of a run, shared by runs with the same wording"},)

    id: Mapped[int] = _key("identity of body")
    body: Mapped[str] = _text("JSON list of test cards, as in the run document")


class Series(Base):
    """What is followed over versions; its wording and limits stand in `definition`."""

    __tablename__ = "series"
    __table_args__ = ({"comment": "a metric of a test in one configuration"},)

    id: Mapped[int] = _key("identity of key")
    key: Mapped[str] = _text("unique name: test/configuration/metric/h=...", unique=True)


class Alias(Base):
    """An earlier name of a series: its samples are read as part of the series named today."""

    __tablename__ = "series_alias"
    __table_args__ = ({"comment": "earlier names of series"},)

    alias: Mapped[str] = _text("earlier key", primary_key=True)
    series_id: Mapped[int] = _reference("series.id", "the series it is called today", primary_key=True)


class Definition(Base):
    """A series as defined in some runs. `body` is complete; the columns beside it are for queries."""

    __tablename__ = "definition"
    __table_args__ = (Index(None, "series_id"), {"comment": "a series as defined in one or more runs"})

    id: Mapped[int] = _key("identity of body")
    series_id: Mapped[int] = _reference("series.id", "the series defined")
    test: Mapped[str] = _text("scalar test")
    configuration: Mapped[str] = _text("configuration of the method")
    metric: Mapped[str] = _text("metric of the test")
    unit: Mapped[str] = _text("unit of the value")
    role: Mapped[str] = _text("gate decides green or red; companion; reported")
    better: Mapped[str] = _text("smaller_magnitude, larger, smaller or inside")
    kind: Mapped[str] = _text("scalar, ladder, order, time or break_point")
    time_step: Mapped[float | None] = mapped_column(Double, comment="time step, s")
    limit_low: Mapped[float | None] = mapped_column(Double, comment="lower end of the limit; NULL: none")
    limit_high: Mapped[float | None] = mapped_column(Double, comment="upper end of the limit; NULL: none")
    limit_kind: Mapped[str] = _text("of the limit: physical, or the method's own")
    set_point_kind: Mapped[str] = _text("of the set point: physical, or the method's own")
    test_version: Mapped[str] = _text("hash of the definition: values compare only where it is equal")
    body: Mapped[str] = _text("JSON of the whole definition, as in the run document")


class SeriesList(Base):
    """Which definitions a run used, in the order of its document; shared by runs with the same ones."""

    __tablename__ = "series_list"
    __table_args__ = ({"comment": "the definitions of a run, shared by runs with the same ones"},)

    id: Mapped[int] = _key("identity of the list of definitions")
    length: Mapped[int] = mapped_column(BigInteger, comment="number of definitions")


class SeriesListItem(Base):
    """One place of a series list."""

    __tablename__ = "series_list_item"
    __table_args__ = ({"comment": "one place of a series list"},)

    list_id: Mapped[int] = _reference("series_list.id", "the list", primary_key=True)
    position: Mapped[int] = mapped_column(BigInteger, primary_key=True, comment="place, from 0")
    definition_id: Mapped[int] = _reference("definition.id", "the definition at this place")


class Run(Base):
    """Everything measured at one engine version on one machine. `key` is what the large tables carry."""

    __tablename__ = "run"
    __table_args__ = (
        Index(None, "engine_version_id"),
        Index(None, "started_at"),
        {"comment": "one run of the tests"},
    )

    key: Mapped[int] = _key("identity of id")
    id: Mapped[str] = _text("UUID made by the application", unique=True)
    idempotency_key: Mapped[str] = _text("the same run is never stored twice", unique=True)
    started_at: Mapped[datetime] = mapped_column(UTCDateTime, comment="start, UTC")
    started: Mapped[str] = _text("start as the document words it, ISO 8601")
    finished: Mapped[str] = _text("end as the document words it, ISO 8601")
    trigger: Mapped[str] = _text("manual, nightly, import or test")
    tracker_version: Mapped[str] = _text("version of the tracker that measured")
    ci_address: Mapped[str] = _text("address of the CI job; empty if none")
    schema_version: Mapped[int] = mapped_column(BigInteger, comment="schema of the run document")
    engine_version_id: Mapped[int] = _reference("engine_version.id", "which engine")
    machine_id: Mapped[int] = _reference("machine.id", "where")
    test_cards_id: Mapped[int] = _reference("test_cards.id", "wording of the tests")
    series_list_id: Mapped[int] = _reference("series_list.id", "definitions used")
    gates: Mapped[int] = mapped_column(BigInteger, comment="number of gate samples")
    partial: Mapped[bool] = mapped_column(comment="interrupted: only what was finished by then")
    asked: Mapped[str] = _text("JSON of the tests and families asked for; empty if unknown")
    gates_passed: Mapped[int] = mapped_column(
        BigInteger, comment="gate samples inside their limit that night"
    )
    workers: Mapped[str] = _text("JSON list: machines of an executor and their pieces; empty: this one's own")
    content: Mapped[str] = _text(
        "hash of all samples and their definitions; empty for runs recorded before there was one"
    )


class Sample(Base):
    """One value of one series in one run. Narrow and append-only."""

    __tablename__ = "sample"
    __table_args__ = (
        CheckConstraint(_one_of("outcome", OUTCOMES), name="outcome"),
        CheckConstraint(f"special IS NULL OR {_one_of('special', SPECIALS)}", name="special"),
        CheckConstraint("(value IS NULL) = (coalesce(special, '') IN ('nan', 'inf', '-inf'))", name="value"),
        Index(None, "series_id", "started_at"),
        {"comment": "one value of one series in one run", "sqlite_with_rowid": False},
    )

    started_at: Mapped[datetime] = _started_at()
    run_key: Mapped[int] = _reference("run.key", "the run", primary_key=True)
    series_id: Mapped[int] = _reference("series.id", "the series", primary_key=True)
    definition_id: Mapped[int] = _reference("definition.id", "the series as defined in this run")
    position: Mapped[int] = mapped_column(BigInteger, comment="place in the document, from 0")
    value: Mapped[float | None] = mapped_column(Double, comment="the float64; NULL if it is not finite")
    special: Mapped[str | None] = _text("nan, inf, -inf or -0.0 where the value is one of these")
    outcome: Mapped[str] = _text(f"class: {', '.join(OUTCOMES)}")
    passed: Mapped[bool] = mapped_column(comment="inside the limit of that night")
    set_point_held: Mapped[bool] = mapped_column(comment="inside the band theory expects")


class Evidence(Base):
    """What stands behind a sample; no row where there is nothing to say."""

    __tablename__ = "evidence"
    __table_args__ = ({"comment": "what stands behind a sample", "sqlite_with_rowid": False},)

    started_at: Mapped[datetime] = _started_at()
    run_key: Mapped[int] = _reference("run.key", "the run", primary_key=True)
    series_id: Mapped[int] = _reference("series.id", "the series", primary_key=True)
    failure: Mapped[str] = _text("one sentence where there is no value; empty otherwise")
    state_hash: Mapped[str] = _text("hash of the bits of the final state; empty if not taken")
    counters: Mapped[str] = _text("JSON object of exact work counters")


class Timing(Base):
    """Run time of one simulation, nothing recorded while it ran."""

    __tablename__ = "timing"
    __table_args__ = ({"comment": "run time behind a sample", "sqlite_with_rowid": False},)

    started_at: Mapped[datetime] = _started_at()
    run_key: Mapped[int] = _reference("run.key", "the run", primary_key=True)
    series_id: Mapped[int] = _reference("series.id", "the series", primary_key=True)
    seconds: Mapped[str] = _text("JSON list: seconds of one simulation, a number for each repeat")
    runs_per_repeat: Mapped[int] = mapped_column(BigInteger, comment="simulations in one repeat")
    instructions: Mapped[int | None] = mapped_column(BigInteger, comment="retired; NULL if not counted")
    stage_seconds: Mapped[str] = _text("JSON object: seconds by stage of the step")
    cpu_seconds: Mapped[str] = _text("JSON list: processor time of each repeat, s; empty if not taken")
    calibration: Mapped[str] = _text(
        "JSON list: seconds of the calibration kernel beside each repeat; empty if not taken"
    )
    again: Mapped[str] = _text("JSON object: the same timed once more that night; empty if it was not")


class Figure(Base):
    """A figure's data. Dropped by the retention rule except for the newest and the released versions."""

    __tablename__ = "figure"
    __table_args__ = ({"comment": "data of a figure drawn from one run"},)

    started_at: Mapped[datetime] = _started_at()
    run_key: Mapped[int] = _reference("run.key", "the run", primary_key=True)
    position: Mapped[int] = mapped_column(
        BigInteger, primary_key=True, comment="place in the document, from 0"
    )
    test: Mapped[str] = _text("scalar test")
    name: Mapped[str] = _text("slug of the figure")
    body: Mapped[bytes] = mapped_column(LargeBinary, comment="zlib of the JSON of the figure")


class StabilityMap(Base):
    """A stability map. Dropped by the same rule as figures."""

    __tablename__ = "stability_map"
    __table_args__ = ({"comment": "a stability map of one run"},)

    started_at: Mapped[datetime] = _started_at()
    run_key: Mapped[int] = _reference("run.key", "the run", primary_key=True)
    position: Mapped[int] = mapped_column(
        BigInteger, primary_key=True, comment="place in the document, from 0"
    )
    test: Mapped[str] = _text("scalar test")
    name: Mapped[str] = _text("slug of the map")
    body: Mapped[bytes] = mapped_column(LargeBinary, comment="zlib of the JSON of the map")


class Trajectory(Base):
    """How a test's scene moved. Dropped by a rule of its own: the newest few nights and the released versions."""

    __tablename__ = "trajectory"
    __table_args__ = ({"comment": "the motion of a scene in one run, for the replay"},)

    started_at: Mapped[datetime] = _started_at()
    run_key: Mapped[int] = _reference("run.key", "the run", primary_key=True)
    position: Mapped[int] = mapped_column(
        BigInteger, primary_key=True, comment="place in the document, from 0"
    )
    test: Mapped[str] = _text("scalar test")
    name: Mapped[str] = _text("slug of the trajectory")
    body: Mapped[bytes] = mapped_column(LargeBinary, comment="zlib of the JSON of the trajectory")
