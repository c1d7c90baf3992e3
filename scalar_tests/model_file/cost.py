"""What a model costs, and whether it answers twice with the same bits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .. import case
from .facts import Asked, simulated

TIMED = 1.0  # s of simulated time
REPEATED = 2.0  # s of each of three runs


def _cost(name: str, description: str, unit: str, growth: float, better: Any = "smaller") -> case.Metric:
    """`growth` is what other work on the machine may add: no news."""
    return case.Metric(
        name=name,
        description=description,
        unit=unit,
        role="reported",
        better=better,
        noisy=True,
        relative_tolerance=growth,
    )


COST = (
    _cost("load_time", "how long the file takes to load, the shortest of three times", "s", 1.0),
    _cost("step_time", "one step in the mean, of the processor's time", "s", 0.25),
    _cost("worst_step_time", "the longest step", "s", 10.0),
    _cost("real_time_factor", "simulated time over the processor's time", "1", 0.25, "larger"),
    _cost("memory", "of the compiled model and its arena", "MB", 0.5),
)
REPEATABILITY = (
    case.Metric(
        name="differing_runs",
        description="of two runs, here and in another process: those whose last bits differ from the first run's",
        unit="1",
        role="gate",
        better="smaller",
        limit=0.0,
        limit_source="equal input, equal bits",
        limit_kind="physical",
        reference=0.0,
    ),
)


def cost(asked: Asked, simulate: case.Simulate) -> Mapping[str, float]:
    """Load it three times and step it, looking at the clock after each step."""
    run = simulated(simulate, asked, min(TIMED, asked.duration), timed=True)
    return {
        "load_time": float(run["load_seconds"]),
        "step_time": float(run["step_seconds"]),
        "worst_step_time": float(run["worst_step_seconds"]),
        "real_time_factor": float(run["real_time_factor"]),
        "memory": float(run["megabytes"]),
    }


def repeatability(asked: Asked, simulate: case.Simulate) -> Mapping[str, float]:
    """The same run three times: twice here, once in a process of its own."""
    lasts = min(REPEATED, asked.duration)
    first = simulated(simulate, asked, lasts)
    again = [simulated(simulate, asked, lasts), simulated(simulate, asked, lasts, elsewhere=True)]
    first["position"]  # of a run that broke off: the outcome is that
    return {"differing_runs": float(sum(other.state_hash != first.state_hash for other in again))}
