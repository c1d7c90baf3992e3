"""Which engine comes within an error first, scene by scene, and what a first place is worth: the tables of docs/engines.md."""

from __future__ import annotations

import textwrap
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import spook_tracker.tracker.judge.rank as ranks
from spook_tracker.tracker.document.wording import number, seconds

OURS = "spook"
# What this page said before budgets were equal: others had half a second and one timing beyond 50 ms, ours no limit and five.
UNEQUAL = "2026-11-23, 10 others, 172 places"
THEN = {"spook": 85, "mujoco": 14, "box3d": 3, "dart": 3, "cannon": 1, "jolt": 1}  # first of several
SINGLE = (
    "box3d",
    "jolt",
    "motrixsim",
    "newton",
    "rapier",
    "rapier3d",
    "sapien",
)  # whose packages count in single precision, in every setting


@dataclass(frozen=True)
class Place:
    """A scene at an error: the race, and which engines can be asked that scene at all."""

    race: ranks.Race
    askable: frozenset[str]

    @property
    def first(self) -> str:
        """The soonest."""
        return self.race.order[0][1]

    @property
    def how(self) -> str:
        """Whether the first is first of several, the only one to come so near, or the only one that can be asked."""
        if len(self.race.order) > 1:
            return "won"
        return "alone" if self.askable - {self.first} else "unasked"


def places(timed: Mapping[str, ranks.Samples]) -> list[Place]:
    """All races, with the engines that can be asked each."""
    askable: dict[tuple[str, str], set[str]] = {}
    for name, told in timed.items():
        for definition, sample in told.values():
            if definition.kind == "ladder" and sample.outcome != "not_supported":
                askable.setdefault((definition.test, definition.metric.split(":")[1]), set()).add(name)
    return [
        Place(race, frozenset(askable[race.test, race.ladder]))
        for race in ranks.races(ranks.standings(timed))
    ]


def choice(run: Sequence[Place]) -> list[str]:
    """Engine by engine: how many places it reaches, in how many it is first or near, and at which errors."""
    engines = sorted({name for one in run for name in one.askable}, key=lambda name: (name != OURS, name))
    rows = []
    for name in engines:
        here = [(one.race, time) for one in run for time, engine in one.race.order if engine == name]
        how = Counter(one.how for one in run if one.first == name)
        near = sum(race.order[0][0] < time <= 10.0 * race.order[0][0] for race, time in here)
        reached = [sum(race.error == error for race, _ in here) for error in ranks.ERRORS]
        asked = sum(name in one.askable for one in run)
        rows.append((name, asked, how["won"], how["alone"], how["unasked"], near, *reached))
    return [
        "## Which engine comes how far",
        "",
        f"Of {len(run)} places (a scene at an error that an engine reaches): at how many an engine can be asked; how often it is",
        "first of several that come within the error, the only one to come so near though others can be asked, or the only one",
        "that can be asked, which is no victory; how often it takes up to ten times as long as the first; and on how many",
        "scenes it comes within each error at all.",
        "",
        "| engine | can be asked | first of several | only one so near | only one asked | within ten times | "
        + " | ".join(f"reaches {error:g}" for error in ranks.ERRORS)
        + " |",
        "|---|---|---|---|---|---|" + "---|" * len(ranks.ERRORS),
        *(f"| {' | '.join(map(str, row))} |" for row in rows),
        "",
        *textwrap.wrap(_moved(run), 118),
        "",
    ]


def _moved(run: Sequence[Place]) -> str:
    """How first places moved when budgets became equal."""
    now = Counter(one.first for one in run if one.how == "won")
    before, after = (
        ", ".join(f"{name} {count}" for name, count in found.most_common()) for found in (Counter(THEN), now)
    )
    share = [100.0 * found[OURS] / max(1, found.total()) for found in (Counter(THEN), now)]
    return (
        f"First of several, while budgets were unequal ({UNEQUAL}): {before}. With one budget for all, and the scenes and engines "
        f"that came since: {after}. Ours is first in {share[0]:.0f} % of these then, {share[1]:.0f} % now."
    )


def single(run: Sequence[Place]) -> list[str]:
    """How far single precision comes."""
    told = []
    for name in SINGLE:
        asked = {(one.race.test, one.race.ladder) for one in run if name in one.askable}
        finest = [
            f"{one.race.test}, {one.race.ladder.replace('_', ' ')}"
            for one in run
            if one.race.error == min(ranks.ERRORS) and name in {engine for _, engine in one.race.order}
        ]
        if asked:
            where = f" ({'; '.join(finest)})" if finest else ""
            told.append(f"{name} {len(finest)} of {len(asked)} scenes{where}")
    if not told:
        return []
    text = f"Single precision ends near 1e-6 of what a scene is large: within {min(ranks.ERRORS):g} comes {', '.join(told)}."
    return [*textwrap.wrap(text, 118, break_on_hyphens=False), ""]


def first(run: Sequence[Place]) -> list[str]:
    """Scene by scene: which engine comes within an error first, in what time, and what the next needs."""
    lines = [
        "## Which engine is first",
        "",
        "Run time to come within an error, in the setting named; in brackets how much longer the next engine takes. *Alone*:",
        "others can be asked and do not come so near. *Only one asked*: no other has what the scene needs.",
        "",
        "| scene | " + " | ".join(f"{error:g}" for error in ranks.ERRORS) + " |",
        "|---|" + "---|" * len(ranks.ERRORS),
    ]
    scenes: dict[str, dict[float, str]] = {}
    for one in run:
        race = one.race
        (best, name), *rest = race.order
        further = {"alone": "alone", "unasked": "only one asked"}.get(one.how, "")
        further = further or f"{number(rest[0][0] / best, 2)} × {rest[0][1]}"
        scene = f"{race.test}, {race.ladder.replace('_', ' ')} [{race.unit}]"
        setting = f" ({race.settings[0]})" if race.settings and race.settings[0] else ""
        scenes.setdefault(scene, {})[race.error] = f"{name}{setting} {seconds(best)} ({further})"
    for scene, cells in scenes.items():
        lines.append(f"| {scene} | {' | '.join(cells.get(error, 'none') for error in ranks.ERRORS)} |")
    kinds = {"won": "first of several", "alone": "the only one so near", "unasked": "the only one asked"}
    told = []
    for how, words in kinds.items():
        score = Counter(one.first for one in run if one.how == how)
        if score:
            names = ", ".join(f"{name} {count}" for name, count in score.most_common())
            told.append(f"{words} in {sum(score.values())}: {names}")
    return [*lines, "", f"Of {len(run)} places (a scene at an error): {'; '.join(told)}.", ""]
