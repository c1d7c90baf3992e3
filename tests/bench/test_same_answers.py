"""Two documents compared by value: a changed bit is said, a changed clock or definition is not a changed answer."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.places import ROOT

FILE = ROOT / "bench" / "same_answers.py"
Document = dict[str, Any]


@pytest.fixture
def exit_code(tmp_path: Path) -> Callable[[Document, Document], int]:
    spec = importlib.util.spec_from_file_location("same_answers", FILE)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)

    def compare(before: Document, after: Document) -> int:
        for name, document in (("before", before), ("after", after)):
            (tmp_path / name).write_text(json.dumps(document))
        return int(module.main(tmp_path / "before", tmp_path / "after"))

    return compare


def document(value: float | str = 0.1, seconds: float = 1.0, version: str = "a", pivots: int = 3) -> Document:
    return {
        "series": [
            {"key": "fall/plain/depth", "kind": "value", "test_version": version},
            {"key": "fall/plain/time", "kind": "time", "test_version": version},
        ],
        "samples": [
            {
                "series": "fall/plain/depth",
                "value": value,
                "counters": {"pivots": pivots},
                "timing": [seconds],
            },
            {"series": "fall/plain/time", "value": seconds, "timing": [seconds]},
        ],
        "maps": [],
        "figures": [],
    }


def test_clocks_and_definitions_are_no_answers(
    exit_code: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    assert exit_code(document(), document(seconds=2.0, version="b")) == 0
    assert (
        "1 answers: 0 differ, 0 only in final state or work\n2 definitions, 2 differ"
        in capsys.readouterr().out
    )


@pytest.mark.parametrize("value", (0.1 + 2**-56, "nan", -0.1))
def test_one_bit_is_another_answer(
    exit_code: Callable[..., int], capsys: pytest.CaptureFixture[str], value: float | str
) -> None:
    assert exit_code(document(), document(value)) == 1
    assert f"fall/plain/depth: value; 0.1 -> {value!r}" in capsys.readouterr().out


def test_zero_has_a_sign_and_nan_is_itself(exit_code: Callable[..., int]) -> None:
    assert exit_code(document(0.0), document(-0.0)) == 1
    assert exit_code(document("nan"), document("nan")) == 0


def test_work_alone_is_said_apart(exit_code: Callable[..., int], capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code(document(), document(pivots=4)) == 1
    assert "1 answers: 0 differ, 1 only in final state or work" in capsys.readouterr().out


def test_what_one_side_lacks_is_said(
    exit_code: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    fewer = document() | {"samples": document()["samples"][1:]}
    assert exit_code(document(), fewer) == 1
    assert exit_code(fewer, document()) == 1
    assert capsys.readouterr().out.count("fall/plain/depth: ") == 2
