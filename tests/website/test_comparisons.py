"""Comparisons on the page are those of the command, made once."""

from __future__ import annotations

import json
from typing import Any

import pytest

from spook_tracker.tracker.website import comparisons as module
from spook_tracker.tracker.website.comparisons import chosen, comparisons
from spook_tracker.tracker.website.nights import book
from tests.histories.synthetic import DocumentHistory, document, history


def made(nights: DocumentHistory, known: dict[str, Any] | None = None) -> module.Comparisons:
    told = book(nights)
    return comparisons(nights, told, (), known or {})


def test_every_ordered_pair_of_the_newest_versions_is_there() -> None:
    told = made(history(4))

    runs = [f"run-spook-000{i}" for i in range(4)]
    assert set(told.pairs) == {json.dumps([a, b]) for a in runs for b in runs if a != b}


def test_the_choice_is_bounded_and_keeps_releases() -> None:
    from msgspec.structs import replace

    runs = [document(n) for n in range(30)]
    runs[3] = replace(runs[3], engine=replace(runs[3].engine, version="1.0.0"))

    nights = chosen(book(DocumentHistory(runs)))

    assert [night.index for night in nights] == [3, *range(20, 30)]


def test_a_regression_names_its_first_bad_commit() -> None:
    runs = history(6, broken=3)
    told = made(runs)
    bad = runs.runs()[3].engine.git_hash[:12]

    pair = told.pairs[json.dumps(["run-spook-0002", "run-spook-0005"])]
    friction = next(c for c in pair["changes"] if c[3] == "Friction" and c[1] == "fail")
    assert (pair["verdict"], pair["code"]) == ("regressed", 1)
    assert friction[-1] == f"first bad commit {bad}"


def test_what_was_compared_before_is_not_compared_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """From the night on that the first ones' noise is known."""
    first = made(history(8))
    asked = []

    def counting(before: Any, after: Any, *rest: Any) -> Any:
        asked.append((before.side.run, after.side.run))
        return original(before, after, *rest)

    original = module.compare
    monkeypatch.setattr(module, "compare", counting)
    second = made(history(9), first.kept())

    newest = "run-spook-0008"
    assert all(newest in pair for pair in asked)
    assert {k: v for k, v in second.pairs.items() if newest not in k} == {
        k: v for k, v in first.pairs.items() if newest not in k
    }
