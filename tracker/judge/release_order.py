"""How the changes of a release are told: direct questions first, a collapse once, nothing decisive left out.

A question about one body says what an engine does; one about a heap says that something did. Where a body ends
farther from where it should be than it is large, the scene has become another one: whatever else was asked of that
run changed with it, and says no more.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from spook_tracker.tracker.document.run_document import DrawnSolid, TestCard

from .comparison_document import Change

SHOWN = 3  # changes of one test in a list, and of every other quantity the worst; the database has them all


@dataclass(frozen=True, kw_only=True)
class Scene:
    """What a test's drawing says about how direct its question is."""

    bodies: int  # that move
    links: int
    size: float  # m, of the smallest body that moves; infinite where none has a size


@dataclass(frozen=True, kw_only=True)
class ToldLine:
    """One line: a change, or a collapse with what it brought along."""

    change: Change
    word: str
    brought: tuple[Change, ...] = ()


NOT_DRAWN = Scene(bodies=10**6, links=0, size=math.inf)


def scenes(cards: Iterable[TestCard]) -> dict[str, Scene]:
    """By test."""
    found = {}
    for card in cards:
        if card.scene is not None:
            moving = [solid for solid in card.scene.solids if not solid.fixed]
            sizes = [size for solid in moving if (size := _size(solid)) > 0.0]
            found[card.name] = Scene(
                bodies=len(moving), links=len(card.scene.links), size=min(sizes, default=math.inf)
            )
    return found


def _size(solid: DrawnSolid) -> float:
    """Its largest extent [m]; zero for what has none."""
    if solid.kind == "sphere":
        return 2.0 * solid.size[0]
    if solid.kind == "box":
        return max(solid.size)
    if solid.kind == "capsule":
        return 2.0 * solid.size[0] + solid.size[1]
    return 0.0


def direct_first(changes: Sequence[Change], drawn: Mapping[str, Scene]) -> list[Change]:
    """Those of the fewest bodies first, then of the fewest links, then of the test that changed by most decades.

    Those of one test as they were, the worst first.
    """
    largest: dict[str, float] = {}
    for change in changes:
        largest[change.test] = max(largest.get(change.test, 0.0), abs(change.decades or 0.0))

    def directness(change: Change) -> tuple[int, int, float]:
        scene = drawn.get(change.test, NOT_DRAWN)
        return scene.bodies, scene.links, -largest[change.test]

    return sorted(changes, key=directness)


def told_of(found: Sequence[Change], scene: Scene = NOT_DRAWN) -> tuple[list[ToldLine], list[Change]]:
    """The lines for one test's changes, and what they leave out: other settings of what they tell."""
    lines: list[ToldLine] = []
    rest = list(found)
    for change in found:
        word = _collapse(change, scene)
        if word and change in rest:
            brought = [one for one in rest if one.configuration == change.configuration and one is not change]
            lines.append(ToldLine(change=change, word=word, brought=tuple(brought)))
            rest = [one for one in rest if one.configuration != change.configuration]
    few = scene.bodies <= 1
    kinds = {(line.change.metric, line.change.word) for line in lines}
    out = []
    for place, change in enumerate(rest):
        kind = change.metric, change.word
        if few or place < SHOWN or kind not in kinds:
            lines.append(ToldLine(change=change, word=change.word))
            kinds.add(kind)
        else:
            out.append(change)
    return lines, out


def _collapse(change: Change, scene: Scene) -> str:
    """Whether a body ends farther off than it is large, since this release or until it."""
    if change.unit != "m" or change.before is None or change.after is None:
        return ""
    off = [abs(float(value)) > scene.size for value in (change.before, change.after)]
    return {(False, True): "collapses", (True, False): "holds"}.get((off[0], off[1]), "")


def left_out(test: str, out: Sequence[Change]) -> str:
    """What is not told, by quantity and setting."""
    metrics = ", ".join(dict.fromkeys(change.metric for change in out))
    settings = ", ".join(dict.fromkeys(change.configuration for change in out))
    return f"… and {len(out)} more of {test}: {metrics} in {settings}"
