"""One name, one meaning: no two types of the engine and the tracker are called alike, but those that are meant to."""

from __future__ import annotations

import ast
import re
from collections import defaultdict

from tests.places import ROOT

NAMES = {
    "GROSS",
    "ORDER",
    "State",
    "Told",
    "Night",
    "Measured",
    "Source",
    "Overall",
    "Class",
    "Word",
    "Verdict",
    "Judged",
}
DEFINES = re.compile(rf"\b({'|'.join(NAMES)})\b *[=(:]")  # any of them, or something else; without it none


def test_what_the_judge_speaks_of_is_defined_once() -> None:
    homes = defaultdict(set)
    for path in [
        p for room in ("engine", "tracker", "scalar_tests", "tests") for p in (ROOT / room).rglob("*.py")
    ]:
        text = path.read_text(encoding="utf-8")
        for node in ast.parse(text).body if DEFINES.search(text) else ():
            names = [node.name] if isinstance(node, ast.ClassDef) else []
            if isinstance(node, ast.Assign):
                names = [target.id for target in node.targets if isinstance(target, ast.Name)]
            for name in names:
                homes[name].add(str(path.relative_to(ROOT)))

    assert {name: sorted(homes[name]) for name in NAMES if len(homes[name]) > 1} == {}


def test_boxed_numbers_are_decoded_at_the_border_and_nowhere_else() -> None:
    """A `Number` is a float: code that turns one into a float again does not trust the border."""
    found = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for room in ("judge", "website", "cli")
        for path in (ROOT / "tracker" / room).rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "float"
        and isinstance(node.args[0], ast.Attribute) and node.args[0].attr in ("value", "before", "after")
    ]  # fmt: skip

    assert found == []
