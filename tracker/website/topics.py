"""Tests of one topic stand together; which topic comes first, the document of a run says."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from spook_tracker.tracker.document.run_document import TestCard
from spook_tracker.tracker.document.wording import clean, slug

Line = TypeVar("Line")


@dataclass(frozen=True)
class Group(Generic[Line]):
    """Lines of a table under one heading; without a title they have none."""

    title: str
    anchor: str
    lines: list[Line]


def order_of(documents: Iterable[Sequence[TestCard]]) -> Callable[[TestCard], tuple[int, int]]:
    """A key that sorts tests by topic and name as they first come in the document of the most tests: a night of few does
    not turn pages round."""
    longest = max(documents, key=len, default=())
    topics = {topic: place for place, topic in enumerate(dict.fromkeys(card.topic for card in longest))}
    names = {card.name: place for place, card in enumerate(longest)}
    return lambda card: (topics.get(card.topic, len(topics)), names.get(card.name, len(names)))


def grouped(lines: Iterable[Line], topic: Callable[[Line], str]) -> list[Group[Line]]:
    """Lines of one topic together, as topics first come; those without a topic last."""
    found: dict[str, list[Line]] = {}
    for line in lines:
        found.setdefault(topic(line), []).append(line)
    rest = found.pop("", [])
    groups = [
        Group(titled(name), f"topic-{slug('-'.join(name.split()))}", together)
        for name, together in found.items()
    ]
    return [*groups, Group("Other tests" if groups else "", "topic-others", rest)] if rest else groups


def titled(topic: str) -> str:
    """A topic as a heading."""
    return clean(topic[:1].upper() + topic[1:])
