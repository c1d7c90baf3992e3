"""What a scalar test is: a physical question whose answer is a number with a unit, and how it is judged.

A test file builds one ScalarTest. It never imports a simulator: `simulate` is handed in, so that the same
question can be put to the native engine, to the NumPy oracle or to another engine.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

from spook_tracker.engine.method import PLAIN, Method
from spook_tracker.engine.observe import Observable
from spook_tracker.engine.result import Result
from spook_tracker.engine.scene import Scene
from spook_tracker.misuse import explain_misuse


class Simulate(Protocol):
    """The signature of `engine.simulate`; reading an observable of a failed run raises SimulationFailed."""

    def __call__(
        self,
        scene: Scene,
        *,
        time_step: float,
        duration: float | None = None,
        steps: int | None = None,
        method: Method = PLAIN,
        observe: Mapping[str, Observable] = ...,
        time_limit: float | None = None,
    ) -> Result: ...


Better = Literal["smaller_magnitude", "larger", "smaller", "inside"]
Role = Literal["gate", "companion", "reported", "explaining"]
LimitKind = Literal[
    "physical",  # printed, or about the world alone: an ideal engine keeps it, and any engine is held to it
    "method",  # what the method the question was written for owes, in errors or in rounding, and no other
]


ReferenceKind = Literal[
    "physical",
    "method",  # what this method gives
    "of another method",  # asked of an engine that owes it nothing: not told, though it stays in the definition
]
Part = Literal["ladder", "stability"]  # what every scene has, or the reason why not
Reason = Literal[  # the world's own, and no others
    "exact at every step",  # an error that is rounding whatever the step: nothing to buy with run time
    "no parameter can break it",
]


class OutOfTime(Exception):
    """The time of a first look is over: what is not known by then is left out."""


class Estimate(float):
    """A value that a measurement gives together with what moves it, in its own unit.

    `rounding` is how far pushes of the last bits have moved it: a difference up to that is none, one beyond is a
    change, however small. `step_error` is what halving the time step changes (None: not measured), `scale` what is
    large: both say how much a change is. `unsettled` says in a sentence why the value is not the one that was sought.
    """

    __slots__ = ("rounding", "scale", "step_error", "unsettled")

    def __new__(
        cls,
        value: float,
        *,
        rounding: float,
        step_error: float | None = None,
        scale: float | None = None,
        unsettled: str = "",
    ) -> Estimate:
        made = super().__new__(cls, value)
        made.rounding, made.step_error, made.scale = rounding, step_error, scale
        made.unsettled = unsettled
        return made

    rounding: float
    step_error: float | None
    scale: float | None
    unsettled: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """What is measured, whichever engine is asked: the question's own part of a metric.

    `limit` is the physical one, for every engine; None where only a method's own limit exists.
    """

    name: str
    description: str
    unit: str
    better: Better
    reference: float | None
    limit: float | tuple[float, float] | None
    limit_source: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Metric:
    """One scalar of a test: a series over versions. A quantity, and what the SPOOK engine's configuration owes it.

    gate       decides green or red by `limit`
    companion  keeps the gate honest; its `limit` and `set_point` are ours
    reported   shown and followed, no limit
    explaining says why a run time of the same configuration is what it is: told beside it, never red, no limit

    `limit` is a magnitude (smaller_magnitude), a bound (larger, smaller) or a band (inside). `set_point` is
    the band theory lets us expect, far tighter than the limit: leaving it is a regression even inside the
    limit. `tolerance` (absolute, in the metric's unit) and `relative_tolerance` say which change is only
    "changed".
    """

    name: str
    description: str  # one sentence a reader of the table understands
    unit: str
    role: Role
    better: Better = "smaller_magnitude"
    limit: float | tuple[float, float] | None = None
    limit_source: str = ""  # "thesis, section 3.5" or the derivation
    limit_kind: LimitKind = "method"
    set_point: tuple[float, float] | None = None
    set_point_source: str = ""
    set_point_kind: LimitKind = "method"
    reference: float | None = None  # the right value, where one exists
    reference_kind: ReferenceKind = "physical"
    tolerance: float = 0.0
    relative_tolerance: float = 1e-9
    formerly: tuple[str, ...] = ()  # its earlier names, the first one first: its history goes on
    noisy: bool = False  # a run time or what depends on one: judged by statistics

    @property
    def quantity(self) -> Quantity:
        """The part that any engine can be asked."""
        return Quantity(
            name=self.name,
            description=self.description,
            unit=self.unit,
            better=self.better,
            reference=self.reference,
            limit=self.limit if self.limit_kind == "physical" else None,
            limit_source=self.limit_source if self.limit_kind == "physical" else "",
        )

    def passes(self, value: float) -> bool:
        """Whether the value keeps the limit; NaN and infinities never do. No limit: any finite value."""
        if not math.isfinite(value):
            return False
        if self.limit is None:
            return True
        if isinstance(self.limit, tuple):
            low, high = self.limit
            return low <= value <= high
        if self.better == "larger":
            return value >= self.limit
        if self.better == "smaller":
            return value <= self.limit
        return abs(value) <= self.limit

    def holds_set_point(self, value: float) -> bool:
        """Whether the value lies where theory puts it; True if no set point is declared."""
        if not math.isfinite(value):
            return False
        return self.set_point is None or self.set_point[0] <= value <= self.set_point[1]


@dataclass(frozen=True, slots=True, kw_only=True)
class Measurement:
    """Simulations that give the values of some metrics: one configuration at one time step.

    `measure(simulate)` returns {metric name: value}. If it raises SimulationFailed, every metric of the
    measurement is recorded with that outcome class.
    """

    configuration: str  # "plain", "curved", "half-step", ...: named in every table
    time_step: float | None  # s; none of what does not step
    metrics: tuple[Metric, ...]
    measure: Callable[[Simulate], Mapping[str, float]]
    parameters: Mapping[str, float] = field(
        default_factory=dict
    )  # what else makes it another series: N, mass
    note: str = ""  # what this configuration is, in one sentence


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """A question without a method: quantities of one scene at one time step, for any engine's own configurations.

    `measure(simulate)` passes this engine's options on as `method`; another engine's `simulate` has its own instead.
    """

    time_step: float | None  # s
    parameters: Mapping[str, float]
    quantities: tuple[Quantity, ...]
    measure: Callable[[Simulate], Mapping[str, float]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """One line or cloud of points of a figure."""

    name: str
    x: tuple[float, ...]
    y: tuple[float, ...]
    style: Literal["line", "points", "both", "reference", "limit"] = "both"


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawing:
    """A figure's data, drawn from this run. NaN in y is a failed point."""

    curves: tuple[Curve, ...]
    x_label: str
    y_label: str
    x_scale: Literal["linear", "log", "angle"] = "linear"  # angle: polar plot, x in degrees
    y_scale: Literal["linear", "log"] = "linear"
    note: str = ""  # what to see; where it differs from the thesis and why


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """A figure of the thesis redrawn, or one of our own."""

    name: str  # a slug: "length-deviation-against-time-step"
    title: str
    draw: Callable[[Simulate], Drawing]
    thesis: str = ""  # "Fig 3.20"


@dataclass(frozen=True, slots=True, kw_only=True)
class Configuration:
    """A named way to run a test on the error-against-run-time ladder, with its expected order of accuracy."""

    name: str
    method: Method
    expected_order: float | None  # None: no order expected (rounding level, or no smooth error)
    order_range: tuple[float, float] | None = None  # time steps [s] of the asymptotic range
    time_steps: tuple[float, ...] = ()  # s, coarse to fine; none: those of the ladder
    formerly: tuple[str, ...] = ()  # its names before, oldest first: histories go on


class _Simulated(BaseException):
    """Carries a simulation out of what asked for it."""

    def __init__(self, result: Result) -> None:
        self.result = result


@dataclass(frozen=True, slots=True)
class Unobserved:
    """The simulation that an error is read off, with nothing observed: the first one that it asks for."""

    error: Callable[[Simulate, float, Method], float]

    def __call__(self, simulate: Simulate, time_step: float, method: Method) -> Result:
        def bare(scene: Scene, *, observe: Mapping[str, Observable] | None = None, **how: Any) -> Result:
            raise _Simulated(simulate(scene, **how))

        try:
            self.error(bare, time_step, method)
        except _Simulated as simulated:
            return simulated.result
        raise ValueError("this error simulates nothing, so there is nothing to time: give its ladder a `run`")


@dataclass(frozen=True, slots=True, kw_only=True)
class Ladder:
    """Error against run time: time steps from coarse to fine, run in each configuration.

    `error(simulate, time_step, method)` measures; what is timed is the same simulation with nothing observed. That is
    found by itself; a `run(simulate, time_step, method)` is given where the error works long before it simulates, or
    to be shared: ladders with equal runs share their times.
    """

    name: str
    description: str  # which error, against which reference
    unit: str
    time_steps: tuple[float, ...]  # s, coarse to fine
    configurations: tuple[Configuration, ...]
    error: Callable[[Simulate, float, Method], float]
    run: Callable[[Simulate, float, Method], Result] | None = None
    target_error: float | None = None  # for "time to reach a given error", in `unit`
    target_seconds: float | None = None  # for "error reached in a given time", s
    time_tolerance: float = (
        0.0  # relative: a change of run time below is not told; 0 leaves it to the noise, 1 % at least
    )

    @property
    def timed(self) -> Callable[[Simulate, float, Method], Result]:
        """What is timed."""
        return self.run or Unobserved(self.error)

    def steps_of(self, configuration: Configuration) -> tuple[float, ...]:
        """Time steps [s] of one configuration, coarse to fine."""
        return configuration.time_steps or self.time_steps

    def all_steps(self) -> tuple[float, ...]:
        """Time steps [s] of the ladder and of any configuration, coarse to fine: those of other engines."""
        own = {h for one in self.configurations for h in one.time_steps}
        return tuple(sorted({*self.time_steps, *own}, reverse=True))


@dataclass(frozen=True, slots=True, kw_only=True)
class BreakPoint:
    """The last value of a parameter at which a scene is still stable, to a stated resolution."""

    value: float
    resolution: float  # relative width of the final bracket
    evaluations: int


@dataclass(frozen=True, slots=True, kw_only=True)
class StabilityMap:
    """Cells over two parameters, each settled / bounded / growing / diverged / not_finite."""

    x: tuple[float, ...]
    y: tuple[float, ...]
    cells: tuple[tuple[str, ...], ...]  # cells[row of y][column of x]
    x_label: str
    y_label: str
    prediction: tuple[tuple[float, ...], ...] | None = None  # the method's own |eigenvalue|, same layout
    note: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class StabilityStudy:
    """One question about where a scene stops being stable. `study` returns a break point or a map."""

    name: str  # slug
    title: str
    configuration: str
    definition: str  # what counts as stable: energy, violation and finiteness together
    study: Callable[[Simulate], BreakPoint | StabilityMap]
    unit: str = ""
    better: Literal["larger", "smaller"] = "larger"
    expected: tuple[float, float] | None = None  # band for a break point: always the method's own
    expected_source: str = ""  # where the band comes from; or, without one, why theory has none


@dataclass(frozen=True, slots=True, kw_only=True)
class Example:
    """The scene a test is about, as `tracker explain` compiles it and the page draws it."""

    scene: Scene
    time_step: float  # s
    method: Method = PLAIN
    observe: Mapping[str, Observable] = field(default_factory=dict)
    duration: float = 8.0  # s, how long the page's replay is
    exact: Callable[[float], Mapping[str, tuple[float, float, float]]] | None = (
        None  # places [m] of bodies at a time [s], by a closed form, for the replay's ghost
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """How what is no scene of ours moves: a run with all that is seen of it, as `engine.model_file.ModelRun` has it."""

    run: Callable[[Simulate], Result]
    step: float  # s between samples
    gravity: tuple[float, float, float]  # m/s²


@dataclass(frozen=True, slots=True, kw_only=True)
class ScalarTest:
    """A physical question put to an engine. Texts are plain; `theory` has Unicode formulas, a line each."""

    title: str
    question: str  # one sentence with a question mark
    why: str  # why it matters
    model: str  # what is simulated, in words
    parameters: tuple[tuple[str, str], ...]  # ("mass", "1 kg"), for the reader
    theory: tuple[str, ...]  # sentences and formulas
    reference: str  # the right answer and its source
    conclusion: str  # what to conclude from green and from red
    source: str  # "thesis, section 3.6"
    measurements: tuple[Measurement, ...]
    example: Callable[[], Example]
    seen: Seen | None = None  # in place of an example, of what is no scene
    figures: tuple[Figure, ...] = ()
    ladders: tuple[Ladder, ...] = ()
    stability: tuple[StabilityStudy, ...] = ()
    misprints: tuple[str, ...] = ()  # where a reader comparing with the thesis would stumble
    lacks: Mapping[str, Reason] = field(
        default_factory=dict
    )  # why it has no ladder, or no break point or map
    topic: str = ""  # what it is about, in a word or two: lists and pages put tests of a topic together
    measured: bool = False  # its right answer was measured, not derived: validation
    seven: bool = False  # one of the thesis' seven continuous tests
    formerly: tuple[str, ...] = ()  # its earlier names: its history goes on
    as_given: bool = False  # its measurements say all themselves: no engine puts it in settings of its own
    iteration_tolerance: float = (
        0.1  # relative: how many more sweeps, pivots, corrections are not yet more work
    )
    counter_roles: Mapping[str, Literal["gate", "explaining"]] = field(
        default_factory=dict
    )  # of the engine's counters: more of it is more work, or only says why a run time changed

    def questions(self) -> tuple[Asked, ...]:
        """What is asked apart from how: each quantity once for every time step and parameters.

        Our configurations ask the same more than once; the one that has a printed limit, or else stands first, counts.
        """
        seen: set[tuple[object, ...]] = set()
        found = []
        printed_first = sorted(
            self.measurements, key=lambda m: not any(q.limit_kind == "physical" for q in m.metrics)
        )
        for measurement in printed_first:
            place = (measurement.time_step, *sorted(measurement.parameters.items()))
            new = [metric.quantity for metric in measurement.metrics if (place, metric.name) not in seen]
            seen.update((place, quantity.name) for quantity in new)
            if new:
                found.append(
                    Asked(
                        time_step=measurement.time_step,
                        parameters=measurement.parameters,
                        quantities=tuple(new),
                        measure=measurement.measure,
                    )
                )
        return tuple(found)

    def metrics(self) -> tuple[tuple[Measurement, Metric], ...]:
        """Every metric with the measurement it belongs to, gates first."""
        order = {"gate": 0, "companion": 1, "reported": 2, "explaining": 3}
        pairs = [(measurement, metric) for measurement in self.measurements for metric in measurement.metrics]
        return tuple(sorted(pairs, key=lambda pair: order[pair[1].role]))


explain_misuse(one for one in tuple(globals().values()) if getattr(one, "__module__", "") == __name__)
