"""Which engine for what: the scenes of a topic together, and in what time each engine comes within an error on half of them.

Counted are scenes that at least two engines can be asked. One that an engine cannot be asked, or on which it never comes
so near, takes for ever: so all are measured on the same scenes, and a half has a time where the mean would have none.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from spook_tracker.tracker.document.addresses import page_of
from spook_tracker.tracker.document.run_document import OutcomeClass, TestCard
from spook_tracker.tracker.document.wording import seconds
from spook_tracker.tracker.judge.rank import Rungs, Samples, ladders, soonest

from .charts import Chart, Line
from .diagrams import View, view
from .topics import grouped

ERRORS = (1e-2, 1e-3, 1e-4)  # in the unit of a scene
DRAWN = tuple(10.0 ** (-place / 2.0) for place in range(1, 15))
FIRST = 3  # engines named at an error
SEVERE: tuple[OutcomeClass, ...] = (
    "crashed",
    "not_finite",
    "diverged",
    "timed_out",
    "unsettled",
)  # the worst first
Scene = tuple[str, str, str]  # test, ladder, unit


@dataclass(frozen=True)
class Facts:
    """What no measurement says of an engine, from its package."""

    floats: str  # in which it counts as it is asked here
    licence: str
    language: str
    devices: str


FACTS: Mapping[str, Facts] = {
    "spook": Facts("64 bits", "MIT", "C++, Python", "CPU"),
    "box3d": Facts("32 bits", "MIT", "C", "CPU"),
    "cannon": Facts("64 bits", "MIT", "JavaScript", "CPU"),
    "dart": Facts("64 bits", "BSD-2-Clause", "C++, Python", "CPU"),
    "drake": Facts("64 bits", "BSD and others", "C++, Python", "CPU"),
    "exudyn": Facts("64 bits", "EXUDYN General License", "C++, Python", "CPU"),
    "jolt": Facts("32 bits", "MIT", "C++, JavaScript", "CPU"),
    "mjx": Facts("64 bits", "Apache-2.0", "Python (JAX)", "CPU, GPU, TPU"),
    "motrixsim": Facts("32 bits", "Apache-2.0", "Rust, Python", "CPU"),
    "mujoco": Facts("64 bits", "Apache-2.0", "C, Python", "CPU"),
    "mujoco_warp": Facts("32 bits", "Apache-2.0", "Python (Warp)", "CPU, GPU"),
    "newton": Facts("32 bits", "Apache-2.0", "Python (Warp)", "CPU, GPU"),
    "p2": Facts("64 bits", "MIT", "JavaScript", "CPU, in a plane"),
    "pybullet": Facts("64 bits", "Zlib", "C++, Python", "CPU"),
    "rapier": Facts("32 bits", "Apache-2.0", "Rust, JavaScript", "CPU"),
    "rapier3d": Facts("32 bits", "Apache-2.0", "Rust, Python", "CPU"),
    "sapien": Facts("32 bits", "MIT", "C++ (PhysX), Python", "CPU, GPU"),
    "simbody": Facts("64 bits", "Apache-2.0", "C++ (OpenSim), Python", "CPU"),
}


@dataclass(frozen=True)
class Row:
    """One engine on one topic."""

    engine: str
    address: str
    times: tuple[
        tuple[str, int], ...
    ]  # for each of ERRORS: time for half of the scenes, or "", and on how many
    worst: str
    lacking: tuple[tuple[str, str], ...]  # scenes it cannot be asked, and where they stand
    facts: Facts | None


@dataclass(frozen=True)
class Topic:
    """Scenes of one topic: which engine is soonest at each error, and every engine."""

    title: str
    anchor: str
    count: int  # of scenes
    first: tuple[
        tuple[tuple[str, str, str], ...], ...
    ]  # for each of ERRORS: engine, its page and time, soonest first
    lines: tuple[Row, ...]
    chart: View | None


def topics(
    asked: Mapping[str, Samples],
    addresses: Mapping[str, tuple[str, str]],
    tests: Mapping[str, TestCard],
) -> list[Topic]:
    """Every topic of which two engines were asked a scene; `addresses` gives an engine's page and its plain name, `tests`
    are those that have a page, topic by topic."""
    groups = {name: ladders(samples) for name, samples in asked.items()}
    able = Counter(scene for mine in groups.values() for scene, found in mine.items() if _able(found))
    places = {name: place for place, name in enumerate(tests)}
    scenes = sorted(
        (scene for scene, count in able.items() if count > 1), key=lambda one: places.get(one[0], len(places))
    )
    return [
        _topic(one.title or "Every test", one.anchor, one.lines, groups, addresses, tests)
        for one in grouped(scenes, lambda scene: tests[scene[0]].topic if scene[0] in tests else "")
    ]


def _able(found: Mapping[str, Rungs]) -> bool:
    """Whether an engine can be asked a scene at all."""
    return any(sample.outcome != "not_supported" for rungs in found.values() for _, sample in rungs)


def half(times: Sequence[float | None]) -> float | None:
    """The time within which half of the scenes are reached; None where fewer ever are."""
    known = sorted(time for time in times if time is not None)
    needed = math.ceil(len(times) / 2)
    return known[needed - 1] if len(known) >= needed > 0 else None


def _topic(
    title: str,
    anchor: str,
    scenes: Sequence[Scene],
    groups: Mapping[str, Mapping[Scene, Mapping[str, Rungs]]],
    addresses: Mapping[str, tuple[str, str]],
    tests: Mapping[str, TestCard],
) -> Topic:
    halves: dict[str, tuple[float | None, ...]] = {}
    lines: list[Row] = []
    drawn: list[Line] = []
    for engine, mine in groups.items():

        def times(error: float, mine: Mapping[Scene, Mapping[str, Rungs]] = mine) -> list[float | None]:
            return [soonest(mine.get(scene, {}), error)[0] for scene in scenes]

        reached = [times(error) for error in ERRORS]
        halves[engine] = tuple(half(one) for one in reached)
        address, plain = addresses[engine]
        told = [
            (seconds(h) if (h := half(one)) is not None else "", sum(t is not None for t in one))
            for one in reached
        ]
        lacking = [scene for scene in scenes if not _able(mine.get(scene, {}))]
        if len(lacking) == len(scenes):
            continue
        lines.append(
            Row(
                engine,
                address,
                tuple(told),
                _worst(mine, scenes),
                tuple(_named(lacking, tests)),
                FACTS.get(plain),
            )
        )
        curve = [(h, error) for error in DRAWN if (h := half(times(error))) is not None]
        if curve:
            drawn.append(
                Line(
                    name=engine, x=tuple(t for t, _ in curve), y=tuple(e for _, e in curve), colour=len(drawn)
                )
            )
    lines.sort(
        key=lambda one: [
            (-many, h if h is not None else math.inf)
            for (_, many), h in zip(one.times, halves[one.engine], strict=True)
        ]
    )
    chart = Chart(
        name=anchor, title=f"{title}: error on half of {len(scenes)} scenes against run time", x_label="run time [s]",
        y_label="error", x_scale="log", y_scale="log", lines=tuple(drawn),
    )  # fmt: skip
    return Topic(
        title,
        anchor,
        len(scenes),
        tuple(_first(halves, i, addresses) for i in range(len(ERRORS))),
        tuple(lines),
        view(chart) if drawn else None,
    )


def _first(
    halves: Mapping[str, Sequence[float | None]], place: int, addresses: Mapping[str, tuple[str, str]]
) -> tuple[tuple[str, str, str], ...]:
    order = sorted((h, engine) for engine, found in halves.items() if (h := found[place]) is not None)
    return tuple((addresses[engine][1], addresses[engine][0], seconds(h)) for h, engine in order[:FIRST])


def _worst(mine: Mapping[Scene, Mapping[str, Rungs]], scenes: Sequence[Scene]) -> str:
    """The worst that became of a rung, and on how many scenes."""
    met = Counter(
        outcome
        for scene in scenes
        for outcome in {s.outcome for rungs in mine.get(scene, {}).values() for _, s in rungs}
    )
    worst = next((outcome for outcome in SEVERE if met[outcome]), None)
    return f"{worst.replace('_', ' ')} on {met[worst]}" if worst else "none failed"


def _named(scenes: Sequence[Scene], tests: Mapping[str, TestCard]) -> list[tuple[str, str]]:
    found = dict.fromkeys(test for test, _, _ in scenes)
    return [(tests[test].title, page_of(test)) if test in tests else (test, "") for test in found]
