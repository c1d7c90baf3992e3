"""One run as a document: what `run` measures, `record` stores, `export` writes and `import` reads.

This is the one place where the published JSON Schema comes from (`tracker schema`). A document is complete in
itself: it carries the definitions of its series, so that results of other machines, engines and tools can be
imported with nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, NamedTuple, Protocol

import msgspec

from .json_form import Number, Numbers

SCHEMA_VERSION = 1

OutcomeClass = Literal[
    "value",
    "unsettled",  # a solve was left off by more than its method allows: the value is kept and does not pass
    "out_of_limit",
    "not_finite",
    "diverged",
    "timed_out",
    "crashed",
    "missing",
    "not_supported",
]
LimitKind = Literal["physical", "method"]  # any engine's, or what one method owes: see scalar_tests/case.py
Text = Annotated[str, msgspec.Meta(max_length=65_536)]
Name = Annotated[str, msgspec.Meta(min_length=1, max_length=200)]


class Struct(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base of every part of the document: frozen, keyword only, nothing unknown accepted."""


class EngineVersion(Struct, frozen=True, kw_only=True):
    """Which engine was measured."""

    name: Name  # "spook"
    version: Name  # from git: "1.2.0" or "1.2.1.dev3+g1a2b3c4"
    git_hash: Text  # full hash; empty for engines without one
    dirty: bool  # built from a tree with uncommitted changes
    commit_time: Text  # ISO 8601 UTC; empty if unknown
    parents: tuple[str, ...] = ()  # hashes; commit order comes from ancestry
    compiler: Text = ""
    flags: Text = ""
    subject: Text = ""  # first line of the commit's message; empty where no repository was at hand
    author: Text = ""  # of the commit


class Machine(Struct, frozen=True, kw_only=True):
    """Where it ran. `fingerprint` decides whether run times may be compared."""

    fingerprint: Name
    processor: Text
    cores: int
    operating_system: Text
    float_environment: Text  # hash of a few library functions' bits: values may differ where this does


class Worker(Struct, frozen=True, kw_only=True):
    """A machine beside this one, of the same float environment, and how many pieces of the work it did."""

    fingerprint: Name
    processor: Text
    operating_system: Text
    pieces: Annotated[int, msgspec.Meta(ge=1)]


class Sensitivity(Struct, frozen=True, kw_only=True):
    """What moves a value, measured in the same run, in the series' unit."""

    rounding: Number  # as far as pushes of the last bits have moved it: a difference up to that is none
    step_error: Number | None = None  # what halving the time step changes
    scale: Number | None = None  # what is large


class SeriesDefinition(Struct, frozen=True, kw_only=True):
    """What is followed over versions: one metric of one test in one configuration."""

    key: Name  # "pendulum/curved/max_length_deviation/h=0.0166667": unique and stable
    test: Name
    title: Text
    configuration: Name
    metric: Name
    description: Text
    unit: Text
    role: Literal["gate", "companion", "reported", "explaining"]
    better: Literal["smaller_magnitude", "larger", "smaller", "inside"]
    kind: Literal["scalar", "ladder", "order", "time", "break_point", "work"]
    time_step: float | None  # s
    parameters: dict[str, float]
    limit: float | tuple[float, float] | None
    limit_source: Text
    set_point: tuple[float, float] | None
    set_point_source: Text
    reference: float | None
    tolerance: float
    relative_tolerance: float
    test_version: Name  # hash of the definition: when it changes, values are not comparable
    aliases: tuple[str, ...] = ()  # earlier keys of the same series
    time_tolerance: float = 0.0  # of a ladder: relative change of its run time below which none is told
    iteration_tolerance: float = 0.1  # relative growth of its iteration counts that is not yet more work
    counter_roles: dict[
        str, Literal["gate", "explaining"]
    ] = {}  # of its counters, where it is not the usual one
    limit_kind: LimitKind = "method"
    set_point_kind: LimitKind = "method"
    sensitivity: Sensitivity | None = None  # of a value without a reference: what a difference of it means


def keeps_limit(value: float, limit: float | tuple[float, float] | None, better: str) -> bool:
    """Whether a value keeps a series' limit, as `scalar_tests.case.Metric.passes` says where it is measured."""
    if not math.isfinite(value):
        return False
    if limit is None:
        return True
    if isinstance(limit, tuple):
        return limit[0] <= value <= limit[1]
    if better == "larger":
        return value >= limit
    return value <= limit if better == "smaller" else abs(value) <= limit


class Again(Struct, frozen=True, kw_only=True):
    """The same run timed once more in the same night, because it had seemed slower."""

    seconds: tuple[float, ...]  # per run
    cpu_seconds: tuple[float, ...] = ()
    calibration: tuple[float, ...] = ()  # s of the calibration kernel beside each repeat


class Timing(Struct, frozen=True, kw_only=True):
    """Run time of one simulation, nothing recorded: every repeat, and the exact work."""

    seconds: tuple[float, ...]  # per run
    runs_per_repeat: int  # very short runs are repeated until the clock resolves them
    instructions: int | None = None  # retired, where the machine counts them
    stage_seconds: dict[str, float] = {}
    cpu_seconds: tuple[float, ...] = ()  # of each repeat, without what the machine spent elsewhere
    calibration: tuple[float, ...] = ()  # s of the calibration kernel beside each repeat
    again: Again | None = None


class Sample(Struct, frozen=True, kw_only=True):
    """One value of one series in this run."""

    series: Name  # a SeriesDefinition's key
    value: Number  # exactly the float64; NaN if there is none
    outcome: OutcomeClass
    passed: bool  # against the limit of that night
    set_point_held: bool
    failure: Text = ""  # one sentence where there is no value, or one that no settled solve stands behind
    counters: dict[str, int] = {}  # exact work: steps, block operations, sweeps, contacts
    state_hash: Text = ""  # of the final state bits of every simulation behind the value
    timing: Timing | None = None


class Curve(Struct, frozen=True, kw_only=True):
    """One line of a figure."""

    name: Text
    x: Numbers
    y: Numbers
    style: Literal["line", "points", "both", "reference", "limit"]


class FigureData(Struct, frozen=True, kw_only=True):
    """A figure drawn from this run."""

    test: Name
    name: Name
    title: Text
    thesis: Text
    x_label: Text
    y_label: Text
    x_scale: Literal["linear", "log", "angle"]
    y_scale: Literal["linear", "log"]
    note: Text
    curves: tuple[Curve, ...]


class MapData(Struct, frozen=True, kw_only=True):
    """A stability map of this run; cells[row of y][column of x]."""

    test: Name
    name: Name
    title: Text
    configuration: Name
    definition: Text
    x_label: Text
    y_label: Text
    x: tuple[float, ...]
    y: tuple[float, ...]
    cells: tuple[tuple[str, ...], ...]
    prediction: tuple[tuple[Number, ...], ...] | None
    note: Text


class StageChoice(Struct, frozen=True, kw_only=True):
    """A stage kept or left out of a test's compiled scene, and why."""

    stage: Name
    kept: bool
    reason: Text
    saved_seconds_per_step: float | None = None  # measured by forcing the stage in


class Saving(Struct, frozen=True, kw_only=True):
    """What a whole step of a test's example scene saves by what it leaves out, measured by forcing all of it in."""

    stages: tuple[Name, ...]  # left out, and can be forced in; none: every such stage is needed
    factor: Number | None = None  # the step with them over the step as compiled, median of a few rounds
    spread: tuple[float, float] | None = None  # the least and the largest round
    difference: Number | None = None  # of the answers, over the largest; 0: the same to the bit


class DrawnSolid(Struct, frozen=True, kw_only=True):
    """One body of a drawing. Size: sphere radius; box edges; capsule radius, length; plane normal; of facets the number
    of corners of each, followed by their places; m."""

    kind: Literal["particle", "sphere", "box", "capsule", "facets", "plane"]
    position: tuple[float, float, float]  # m
    orientation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    size: tuple[float, ...] = ()
    fixed: bool = False
    driven: bool = False  # by a motion that is given, or by a motor
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)  # m/s


class DrawnLink(Struct, frozen=True, kw_only=True):
    """What ties two places of a drawing; both ends are one place for a joint with a point of its own."""

    kind: Literal["distance", "spring", "joint"]
    ends: tuple[tuple[float, float, float], tuple[float, float, float]]  # m


class SceneDrawing(Struct, frozen=True, kw_only=True):
    """What a reader sees of a test's scene at its start."""

    solids: tuple[DrawnSolid, ...]
    links: tuple[DrawnLink, ...] = ()
    attractors: tuple[tuple[float, float, float], ...] = ()  # centres of gravity, m
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)  # m/s²


class TrackedLink(Struct, frozen=True, kw_only=True):
    """A link whose ends move with bodies: their index, or −1 for the world, and the place in their axes."""

    kind: Literal["distance", "spring", "joint"]
    bodies: tuple[int, int]
    anchors: tuple[tuple[float, float, float], tuple[float, float, float]]  # m
    row: int = -1  # its column of the violation; −1: none


class Channel(Struct, frozen=True, kw_only=True):
    """One quantity over the samples of a trajectory, in sixteen bits a number: low + step × code.

    `data` is deflated: differences from sample to sample modulo 65536, the low bytes of all before the high
    ones. Code 65535 is no value. The largest error of quantising is step / 2.
    """

    name: Name
    unit: Text
    width: int  # numbers per sample
    low: float
    step: float
    data: bytes


class Trajectory(Struct, frozen=True, kw_only=True):
    """How a scene moved in this run, as a page replays it."""

    test: Name
    name: Name
    time_step: float  # s, of the simulation
    step: float  # s between samples
    count: int
    bodies: int
    solids: tuple[DrawnSolid, ...]
    body_of_solid: tuple[int, ...]
    links: tuple[TrackedLink, ...] = ()
    attractors: tuple[tuple[float, float, float], ...] = ()  # m
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)  # m/s²
    rows: int = 0  # columns of the violation
    exact: Text = ""  # what the positions to compare with are
    failure: Text = ""  # why the motion ends before its time
    channels: tuple[Channel, ...] = ()


LEFT_OUT = "look"


class TestCard(Struct, frozen=True, kw_only=True):
    """What a page says about a test, as it was worded in this run."""

    name: Name
    title: Text
    question: Text
    why: Text
    model: Text
    parameters: tuple[tuple[Text, Text], ...]
    theory: tuple[Text, ...]
    reference: Text
    conclusion: Text
    source: Text
    misprints: tuple[Text, ...]
    seven: bool
    stages: tuple[StageChoice, ...]
    scene: SceneDrawing | None = None
    lacks: dict[Name, Text] = {}  # why it has no "ladder" or "stability"; what a "look" left out
    saving: Saving | None = None  # None: not measured
    measured: bool = False  # its right answer was measured in the world: validation, not verification
    topic: Text = ""  # what it is about: pages put tests of a topic together, in the order of the document


Family = Literal["values", "sweep", "stability"]


class Asked(Struct, frozen=True, kw_only=True):
    """What a run was asked for: what of it is not answered is missing, not forgotten."""

    tests: tuple[Name, ...]
    families: tuple[Family, ...]
    whole: bool  # the whole catalogue: a gate that is not in it any more was removed


class RunDocument(Struct, frozen=True, kw_only=True):
    """One run: everything measured at one engine version on one machine."""

    schema_version: Literal[1]
    id: Name  # UUID, made by the application
    idempotency_key: Name  # importing the same key twice changes nothing
    started: Text  # ISO 8601 UTC
    finished: Text
    trigger: Literal["manual", "nightly", "import", "test"]
    tracker_version: Text
    ci_address: Text
    engine: EngineVersion
    machine: Machine
    tests: tuple[TestCard, ...]
    series: tuple[SeriesDefinition, ...]
    samples: tuple[Sample, ...]
    figures: tuple[FigureData, ...] = ()
    maps: tuple[MapData, ...] = ()
    trajectories: tuple[Trajectory, ...] = ()
    partial: bool = False  # interrupted: only what was finished by then
    asked: Asked | None = None  # None: not known, and told from what is answered
    workers: tuple[Worker, ...] = ()  # of an executor that measured the values; none: `machine` did


class Run(Protocol):
    """What is read of a run: a stored run, a run document, or any value with these."""

    @property
    def id(self) -> str: ...
    @property
    def started(self) -> str: ...
    @property
    def trigger(self) -> str: ...
    @property
    def engine(self) -> EngineVersion: ...
    @property
    def machine(self) -> Machine: ...
    @property
    def asked(self) -> Asked | None: ...


class Point(NamedTuple):
    """One value of a series over versions, and the definition hash it was measured under."""

    run: Run
    sample: Sample
    test_version: str
    recorded: bool = True  # False: asked for and not answered; no document has this sample

    @property
    def value(self) -> float:
        return self.sample.value


Said = tuple[Sample, str, bool]  # of a night: all of a `Point` but its run


class Runs(tuple[Run, ...]):
    """Runs that the series measured in all of them share. Equal to itself alone: what is known of it can be kept by it."""

    __slots__ = ()

    def __hash__(self) -> int:
        return id(self)

    def __eq__(self, other: object) -> bool:
        return self is other


@dataclass(frozen=True, slots=True)
class SeriesHistory:
    """A series over versions, in commit order; `definition` as of the newest run that has it.

    The one shape in which histories travel from the store to the judge and the pages.
    """

    definition: SeriesDefinition
    points: Sequence[Point]  # a `Points` where there are many
