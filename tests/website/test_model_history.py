"""The page of a model says what each version changed; nights of another model or another arithmetic are not compared."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from spook_tracker.tracker.document.run_document import Point
from spook_tracker.tracker.website.model_history import model_history
from tests.histories.documents import gate
from tests.tracker.judge.test_verdict import sample
from tests.tracker.measure.test_model_files import KNOWN


def _night(version: str, value: float, edit: str = "1", arithmetic: str = "f") -> Point:
    run = SimpleNamespace(
        engine=SimpleNamespace(version=version), machine=SimpleNamespace(float_environment=arithmetic)
    )
    return Point(run, sample(value, state=f"{value!r}"), edit)


def _trend(*nights: Point, known=KNOWN) -> SimpleNamespace:
    definition = gate(metric="ball.rest_z", better="inside", role="reported", sensitivity=known)
    return SimpleNamespace(definition=definition, told=SimpleNamespace(points=nights))


def test_each_version_is_told_beside_the_one_before_newest_first() -> None:
    trend = _trend(
        _night("1", 0.1), _night("1", 0.1), _night("2", 0.1), _night("3", 0.1 + 9e-15), _night("4", 0.2)
    )

    found = model_history([trend])

    assert [(one.version, one.before) for one in found] == [("4", "3"), ("3", "2"), ("2", "1")]
    assert found[0].told[0].startswith("ball rests 0.1 m higher (1e+04 times what halving")
    assert found[1].told == ["the same but for rounding, in 1 of 1 values"]
    assert found[2].told == ["the same bits in all 1 values"]


@pytest.mark.parametrize("other", [{"edit": "2"}, {"arithmetic": "g"}])
def test_another_model_or_arithmetic_is_no_change(other: dict[str, str]) -> None:
    assert model_history([_trend(_night("1", 0.1), _night("2", 0.2, **other))]) == []


def test_what_is_no_model_has_no_such_table() -> None:
    assert model_history([_trend(_night("1", 0.1), _night("2", 0.2), known=None)]) == []
