"""Where the time of a step goes: shares by stage, for each configuration of a test's ladders."""

from __future__ import annotations

from dataclasses import dataclass

from spook_tracker.tracker.document.wording import number, seconds

from .nights import TestHistory, Trend


@dataclass(frozen=True)
class Part:
    """One stage's share of a step."""

    stage: str
    share: str  # per cent, in words
    took: str  # of one step, in words
    x: str  # in the bar, per cent of its width
    width: str
    colour: int  # slot of the palette, the same for a stage in every bar


@dataclass(frozen=True)
class StageTimes:
    """One configuration: its bar."""

    configuration: str
    time_step: str
    total: str  # of one step, with the clocks between the stages
    parts: tuple[Part, ...]


def stage_times(test: TestHistory) -> list[StageTimes]:
    """A bar for each configuration that was timed by stage, from its longest such run."""
    chosen: dict[str, Trend] = {}
    for trend in test.of_kind("ladder"):
        configuration = trend.definition.configuration
        if _total(trend) > (_total(chosen[configuration]) if configuration in chosen else 0.0):
            chosen[configuration] = trend
    colours: dict[str, int] = {}
    return [_bar(configuration, trend, colours) for configuration, trend in chosen.items()]


def _by_stage(trend: Trend) -> dict[str, float]:
    timing = trend.latest.timing if trend.latest else None
    return timing.stage_seconds if timing else {}


def _total(trend: Trend) -> float:
    return sum(_by_stage(trend).values())


def _bar(configuration: str, trend: Trend, colours: dict[str, int]) -> StageTimes:
    total = _total(trend)
    steps = max(1, trend.latest.counters.get("steps", 1)) if trend.latest else 1
    parts, x = [], 0.0
    for stage, took in sorted(_by_stage(trend).items(), key=lambda item: (-item[1], item[0])):
        share = 100.0 * took / total
        colour = colours.setdefault(stage, len(colours) % 8)
        width = f"{share:.2f}"
        parts.append(Part(stage, f"{share:.0f} %", seconds(took / steps), f"{x:.2f}", width, colour))
        x += share
    step = f"{number(trend.definition.time_step, 4)} s"
    return StageTimes(configuration, step, seconds(total / steps), tuple(parts))
