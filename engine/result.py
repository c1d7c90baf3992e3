"""What a run gave: a status, the observables asked for, exact work counters and a hash of the final state."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from html import escape
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from .display import Figure, Shown, display, framed
from .errors import EngineError

if TYPE_CHECKING:
    from .method import Method
    from .scene import Scene

Status = Literal["completed", "unsettled", "diverged", "not_finite", "timed_out"]
Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Broken:
    """A joint or wire that broke: in a step, at its end, under the load its rows held there."""

    joint: str
    step: int  # counted from 1
    time: float  # s
    force: float  # N
    torque: float  # N m

    def __str__(self) -> str:
        load = f"{self.force:.4g} N" + (f" and {self.torque:.4g} N m" if self.torque else "")
        return f"{self.joint!r} broke in step {self.step} ({self.time:.4g} s) under {load}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Books:
    """Where a run's energy came from and went: T + V of its end is that of its start + energy_in − dissipated + unexplained.

    `engine/books.py` says what counts as which.
    """

    energy_in: float  # J, by loads, motors, and bodies and surfaces that are led
    dissipated: float  # J, by contacts, limits, friction, viscosity, fluids and motors that brake
    unexplained: float  # J, by neither: what the method errs by; less than 0 is lost
    stopped_impacts: int  # that ended without a rebound
    largest_turn: float  # rad, of any body in a step


SHORT = 2.0  # s: a run that took longer is not run again just because a cell ends with it


@dataclass(frozen=True, slots=True, kw_only=True)
class Origin:
    """What a run is a run of: enough to run it again, to the same bits, and watch it."""

    scene: Scene
    method: Method
    simulate: Callable[..., Result]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Result:
    """One run of a scene.

    `result["name"]` is an observable (a NumPy array, 0-dimensional for scalars) and raises SimulationFailed
    if the run broke off; `partial` holds what was seen until then. `sample_times["name"]` are the
    times [s] of a trace. `final_state` maps body name to (13,) position,
    orientation, velocity, angular velocity.
    An "unsettled" run did all its steps, but in some of them the solver left more than
    `Method.unsettled_residual`: values are kept, `failure` says where, `residual` how much; a later step rests
    on a wrong one. So did one that made more than a twentieth of the largest kinetic energy out of nothing, by a composition or
    by corrections; with its books kept, by whatever method. So did one whose particles came off a rod by its length, one whose
    motor pulled a loop of joints open that cannot move, and one that lost as much in impacts that were stopped without the
    rebound they were to have.
    `counters` are exact integers, equal on every machine: steps, rows_assembled, block_operations, ...
    `state_hash` is a hash of the bits of the final state.
    `broken` lists the joints and wires that broke, in that order.
    """

    status: Status
    failure: str  # one sentence naming body and step; empty if completed
    failed_body: str | None
    failed_step: int | None
    time_step: float  # s
    steps: int  # steps done
    seconds: float  # wall time of the native loop
    observables: Mapping[str, Array]
    sample_times: Mapping[str, Array]
    final_state: Mapping[str, Array]
    counters: Mapping[str, int]
    state_hash: str
    stages: tuple[str, ...]
    stage_seconds: Mapping[str, float] = field(default_factory=dict)
    cpu_seconds: float = 0.0  # processor time of the native loop; 0 where it cannot be told
    residual: float = 0.0  # largest row residual [m/s] a solve stopped at
    broken: tuple[Broken, ...] = ()
    books: Books | None = None  # where `simulate` was asked to keep them
    origin: Origin | None = None  # of what `simulate` gave

    def __getitem__(self, name: str) -> Any:
        if self.status not in ("completed", "unsettled"):
            raise SimulationFailed(self)
        if name not in self.observables:
            asked = ", ".join(sorted(self.observables)) or "nothing"
            raise KeyError(f"{name!r} was not observed; this run observed {asked}")
        return self.observables[name]

    @property
    def partial(self) -> Mapping[str, Array]:
        """The observables as far as the run went, whatever its status."""
        return self.observables

    @property
    def completed(self) -> bool:
        """Whether every step was done with finite, bounded values."""
        return self.status == "completed"

    def __repr__(self) -> str:
        seen = ", ".join(f"{name} {value.shape}" for name, value in self.observables.items())
        rows = [self.failure or self.status, f"{self.steps} steps of {self.time_step:.4g} s"]
        rows += [str(joint) for joint in self.broken] + ([str(self.books)] if self.books else [])
        return f"<Result: {'; '.join([*rows, seen or 'nothing observed'])}>"

    def _repr_html_(self) -> str:
        """The same for notebooks, with every observable that is one number; a run of at most two seconds with its replay."""
        rows = [("status", self.failure or self.status), ("steps", f"{self.steps} of {self.time_step:.4g} s")]
        rows += [("broken", str(joint)) for joint in self.broken]
        for name, value in self.observables.items():
            rows.append((name, f"{value:.6g}" if value.shape == () else f"array of shape {value.shape}"))
        cells = "".join(f"<tr><th>{escape(name)}</th><td>{escape(text)}</td></tr>" for name, text in rows)
        seen = ""
        if self.origin and 0.0 < self.seconds <= SHORT:
            with suppress(EngineError):  # as of a run that ended in its first step: the table says so
                seen = framed(self.show().html)
        return f"<table>{cells}</table>{seen}"

    def show(self) -> Shown:
        """The run as a replay in three dimensions, as the website has it, in a document that needs no other file.

        The scene is run again with everything traced that is drawn: as long as the run took, at most 20 s. EngineError
        where it cannot be: a run that was held, or of a scene whose time was over while it was compiled.
        """
        return Shown(display().motion(self))

    def plot(self, *names: str) -> Figure:
        """These traces (none: all) over time [s] as a Plotly figure, a line per component, named as by `to_dataframe`.

        The values are those of `result[name]`, in the units of its quantity. EngineError if nothing was traced, for a
        name that was not, and without Plotly.
        """
        if not self.sample_times:
            raise EngineError("plot: nothing was traced; observe a Trace")
        for name in names:
            if name not in self.sample_times:
                raise EngineError(f"plot: {name!r} was not traced; there are {', '.join(self.sample_times)}")
        return display().traces(self, names or tuple(self.sample_times))

    def to_dataframe(self) -> Any:
        """The traces as a pandas DataFrame: a row per sample time [s], a column per component.

        A scalar's column has the observable's name; those of more numbers are "name.x", "name.y", "name.z" (three),
        "name.w" … (four), else "name.0", … in the order of the flattened sample. Traces taken at different times
        leave gaps (NaN). Reductions are no rows: read them as result["name"]. Of each joint that broke a column
        "name broken" says from when on.
        """
        if not self.sample_times:
            raise EngineError("to_dataframe: nothing was traced; observe a Trace")
        pandas = import_module("pandas")  # the engine itself needs NumPy at most
        frames = [
            pandas.DataFrame(
                self[name].reshape(len(times), -1),
                index=pandas.Index(times, name="time"),
                columns=columns_of(name, self[name].shape[1:]),
            )
            for name, times in self.sample_times.items()
        ]
        together = pandas.concat(frames, axis=1).sort_index()
        for joint in self.broken:
            together[f"{joint.joint} broken"] = together.index >= joint.time - 1e-9 * self.time_step
        return together


def columns_of(name: str, shape: tuple[int, ...]) -> list[str]:
    """What the components of a sample of that shape are called."""
    if shape == ():
        return [name]
    named: dict[tuple[int, ...], str] = {(3,): "xyz", (4,): "wxyz"}
    parts = named.get(shape) or range(math.prod(shape))
    return [f"{name}.{part}" for part in parts]


class SimulationFailed(EngineError):
    """An observable of an incomplete run was read; `result` holds the run with its partial data."""

    def __init__(self, result: Result) -> None:
        super().__init__(result.failure)
        self.result = result
