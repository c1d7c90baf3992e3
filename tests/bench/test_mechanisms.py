"""Random lifts, ladders, trusses and linkages: what can move is never refused, what locks never told as completed."""

from __future__ import annotations

import importlib.util
import sys
from typing import Any

import pytest

from tests.places import ROOT

FILE = ROOT / "bench" / "mechanisms.py"


@pytest.fixture(scope="module")
def mechanisms() -> Any:
    spec = importlib.util.spec_from_file_location("mechanisms", FILE)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules["mechanisms"] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("number", range(45))
def test_a_mechanism_is_judged_rightly(mechanisms: Any, number: int) -> None:
    ending = mechanisms.judged(number)

    assert ending.right, (ending.kind, ending.words)


@pytest.mark.parametrize("number", [142, 412, 249])
def test_what_little_pulls_is_seen_to_lock(mechanisms: Any, number: int) -> None:
    """Near their equilibrium, they stood for a second and were told as completed."""
    assert mechanisms.judged(number).right


def test_what_is_judged_wrongly_is_told(
    mechanisms: Any, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.setattr(mechanisms, "HELD", 0.0)
    monkeypatch.setattr(mechanisms, "KINDS", {"lift, held": mechanisms.held_lift})

    assert mechanisms.main(["--count", "2", "--first", "1"]) == 1
    assert capsys.readouterr().out.splitlines()[-1] == "0 of 2 mechanisms are judged rightly"
