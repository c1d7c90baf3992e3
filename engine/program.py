"""What a compiled scene is: the stages it kept, and a native program that runs them."""

from __future__ import annotations

import math
import os
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from . import _core, check
from .errors import MethodError
from .observe import Final, Maximum, MaximumAbsolute, Mean, Minimum, Observable, Trace
from .result import Array, Broken, Result

MOST_NAMED = 8  # joints in one failure
_REDUCTIONS: dict[type[Observable], str] = {
    Trace: "trace",
    Final: "final",
    Maximum: "maximum",
    Minimum: "minimum",
    MaximumAbsolute: "maximum_absolute",
    Mean: "mean",
}


@dataclass(frozen=True, slots=True)
class StageChoice:
    """One stage of the step: whether this scene needs it, and why."""

    stage: str
    kept: bool
    reason: str
    within: str = ""  # of a stage kept: in whose loop it is done, and timed, where it has no time of its own


class NativeProgram(Protocol):
    """What a pipeline's native object offers; see bindings/common.hpp for the report."""

    @property
    def choices(self) -> list[tuple[str, bool, str, str]]: ...
    @property
    def stages(self) -> list[str]: ...
    def run(self, steps: int, time_limit: float, timed: bool) -> dict[str, Any]: ...


def _memory() -> float:
    """Bytes of memory there are; without limit where the system does not say."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, OSError, ValueError):
        return math.inf


def table(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Rows with the same names as columns by name, the form in which the native side takes a table."""
    if not rows:
        return {}
    return {name: _column([row[name] for row in rows]) for name in rows[0]}


def _column(values: list[Any]) -> Any:
    return values if isinstance(values[0], str) else np.array(values)


def observations(observe: Mapping[str, Observable]) -> list[_core.Observation]:
    """What the native side keeps, in the order given.

    Quantity k is the k-th of `distinct_quantities`: observables of equal quantities share one reading.
    """
    places = {quantity: place for place, quantity in enumerate(distinct_quantities(observe))}
    found = []
    for name, what in observe.items():
        if type(what) not in _REDUCTIONS:
            raise MethodError(
                f"observe {name!r}: give a Trace, Final, Maximum, … of a quantity, not {what!r}"
            )
        found.append(
            _core.Observation(
                quantity=places[what.quantity],
                reduction=_REDUCTIONS[type(what)],
                first=what.first,
                last=-1 if what.last is None else what.last,
                from_start=what.from_start,
                every=what.every if isinstance(what, Trace) else 1,
            )
        )
    return found


def distinct_quantities(observe: Mapping[str, Observable]) -> list[Any]:
    """The different quantities asked for, in order of first use."""
    if not isinstance(observe, Mapping):
        raise MethodError(f"observe must map names to a Trace, Final, Maximum, ..., not {observe!r}")
    quantities: dict[Any, None] = {}
    for name, what in observe.items():
        if not isinstance(name, str):
            raise MethodError(
                f"observe must map names to a Trace, Final, Maximum, ..., and {name!r} is not a name"
            )
        if not isinstance(what, Observable):
            raise MethodError(
                f"observe {name!r}: give a Trace, Final, Maximum, … of a quantity, not {what!r}"
            )
        quantities.setdefault(what.quantity)
    return list(quantities)


class Program:
    """A scene compiled for one time step and method. Running it again starts from the start again."""

    def __init__(
        self,
        native: NativeProgram,
        *,
        time_step: float,
        bodies: Sequence[str],
        joints: Sequence[str] = (),
        observe: Mapping[str, Observable],
        shapes: Sequence[tuple[int, ...]],
    ) -> None:
        """`shapes` are those of one sample of each observable, in order; `joints` are named where they fail."""
        self._native = native
        self._running = threading.Lock()  # one native state: a second thread waits
        self._choices = tuple(StageChoice(*choice) for choice in native.choices)
        self._bodies = tuple(bodies)
        self._joints = tuple(joints)
        self._observe = dict(observe)
        self._shapes = tuple(shapes)
        self.time_step = time_step  # s

    @property
    def stages(self) -> tuple[str, ...]:
        """The stages that the native step runs, in order: what this scene needs and nothing else."""
        return tuple(self._native.stages)

    def explain(self) -> tuple[StageChoice, ...]:
        """Every stage there is, kept or left out, with the reason in words."""
        return self._choices

    def run(
        self,
        steps: int,
        time_limit: float | None = None,
        time_stages: bool = False,
        *,
        since: float | None = None,
    ) -> Result:
        """Run from the start for that many steps, natively and with the GIL released.

        `time_limit` [s] of wall time, from now or `since` (as `time.monotonic` tells it), ends the run as "timed_out",
        before the first step or within one, too; velocities that only another solve would have told are then NaN.
        `time_stages` measures seconds by stage, which slows the run down.
        """
        steps, limit = check.step_count(steps), check.wall_time(time_limit)
        if limit and since is not None:
            limit = max(limit - (time.monotonic() - since), sys.float_info.min)
        for name, what in self._observe.items():
            if max(what.first, what.last or 0) > steps:
                raise MethodError(f"observe {name!r}: its samples end beyond the last step, {steps}")
        self._fit_memory(steps)
        with self._running:
            report = self._native.run(steps, limit, time_stages)
        return self.result(report, time_limit)

    def _fit_memory(self, steps: int) -> None:
        """Refuse traces that no memory of this machine can hold, before a run fails in the middle for them."""
        sizes = {}
        for (name, what), shape in zip(self._observe.items(), self._shapes, strict=True):
            if isinstance(what, Trace):
                last = steps if what.last is None else what.last
                sizes[name] = 8 * math.prod(shape) * max(0, (last - what.first) // what.every + 1)  # bytes
        needed, memory = sum(sizes.values()), _memory()
        if needed <= memory:
            return
        name = max(sizes, key=lambda one: sizes[one])
        raise MethodError(
            f"observe {name!r}: traces of {steps} steps are {needed / 2**30:.3g} GiB, and this machine has "
            f"{memory / 2**30:.3g}; take every n-th sample (every=), a part (first=, last=), or Final, Maximum, Mean, ..."
        )

    @property
    def native(self) -> Any:
        """The native program, for a run one holds."""
        return self._native

    def result(self, report: Mapping[str, Any], time_limit: float | None) -> Result:
        """A native report in the names of the scene."""
        observables: dict[str, Array] = {}
        sample_times: dict[str, Array] = {}
        for (name, what), shape, recording in zip(
            self._observe.items(), self._shapes, report["recordings"], strict=True
        ):
            if isinstance(what, Trace):
                observables[name] = recording.reshape((len(recording), *shape))
                samples = what.first + what.every * np.arange(len(recording), dtype=np.float64)
                sample_times[name] = samples * self.time_step
            else:
                observables[name] = recording.reshape(shape)
        status, step, body = report["status"], report["failed_step"], report["failed_body"]
        failed_body = self._bodies[body] if body >= 0 else None
        joints = [self._joints[joint] for joint in report["failed_joints"]]
        reason = report["reason"].replace("{joints}", _named(joints))
        failure = _failure(status, failed_body, step, time_limit, reason, report["residual"])
        if status == "completed" and (endless := self._endless(report["final_state"], observables)):
            status, failure = (
                "not_finite",
                f"{endless} after step {report['steps']}",
            )
        return Result(
            status=status,
            failure=failure,
            failed_body=failed_body,
            failed_step=step if step >= 0 else None,
            time_step=self.time_step,
            steps=report["steps"],
            seconds=report["seconds"],
            observables=observables,
            sample_times=sample_times,
            final_state=dict(zip(self._bodies, report["final_state"], strict=True)),
            counters=report["counters"],
            state_hash=report["state_hash"],
            stages=self.stages,
            stage_seconds=report["stage_seconds"],
            cpu_seconds=report["cpu_seconds"],
            residual=report["residual"],
            broken=tuple(
                Broken(joint=self._joints[joint], step=step, time=time, force=force, torque=torque)
                for joint, step, time, force, torque in report["broken"]
            ),
        )

    def _endless(self, final: Array, observables: Mapping[str, Array]) -> str:
        """Which body has a value that is not finite, or else which observable is infinite; empty if none."""
        for name, row in zip(self._bodies, final, strict=True):
            if not np.isfinite(row).all():
                return f"body {name!r} has a value that is not finite"
        for name, values in observables.items():
            if np.isinf(values).any():  # NaN is what there is nothing of
                return f"the observable {name!r} is infinite"
        return ""


def _named(joints: Sequence[str]) -> str:
    shown = [repr(name) for name in joints[:MOST_NAMED]]
    more = len(joints) - len(shown)
    return f"{', '.join(shown)} and {more} more" if more else ", ".join(shown)


def _failure(
    status: str, body: str | None, step: int, time_limit: float | None, reason: str, residual: float
) -> str:
    if status == "unsettled":
        said = (
            f"body {body!r} {reason}"
            if reason
            else f"rows of body {body!r} are off by up to {residual:.3g} m/s; "
            "use more iterations, smaller time steps or the direct solver"
        )
        return f"unsettled since step {step}: {said}"
    if reason:
        return f"in step {step} body {body!r} {reason}"
    if status == "diverged":
        return f"body {body!r} ran away (beyond 1e100 m or m/s) in step {step}; try a smaller time step"
    if status == "not_finite":
        return f"body {body!r} has a value that is not finite after step {step}; try a smaller time step"
    if status == "timed_out":
        return f"the time limit of {time_limit:g} s was reached before step {step}"
    return ""
