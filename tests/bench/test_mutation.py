"""The mutation runs say what they seem to say."""

from __future__ import annotations

import ast
import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType

import pytest

from tests.places import ROOT


def of_bench(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, ROOT / "bench" / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def test_every_mutant_of_the_mutation_run_still_applies() -> None:
    """A rule that is written differently takes its mutant along, or the run would say less than it seems to."""
    mutation = of_bench("mutation")

    for mutant in mutation.MUTANTS:
        text = (ROOT / mutant.file).read_text()
        assert mutant.applied(text) != text


@pytest.mark.parametrize("room", ["engine", "scalar_tests", "tracker/cli", "tracker/judge"])
def test_random_mutants_are_programs_that_differ_in_their_place_alone(room: str) -> None:
    mutants = of_bench("random_mutants").drawn(room, 25)

    assert len({(mutant.file, mutant.at, mutant.new) for mutant in mutants}) == 25
    for mutant in mutants:
        text = (ROOT / mutant.file).read_text()
        changed = mutant.applied(text)
        assert ast.dump(ast.parse(changed)) != ast.dump(ast.parse(text)), mutant.name
        at = len(text.encode()[: mutant.at].decode())
        assert (changed[:at], changed[at + len(mutant.new) :]) == (text[:at], text[at + len(mutant.old) :])


def test_what_is_drawn_of_lines_that_stay_stays_when_others_change(tmp_path: Path) -> None:
    (tmp_path / "room").mkdir()
    lines = [f"def f{n}(x):\n    return x + {n} if x < {n + 20} else not x{n}\n" for n in range(9)]

    def order(text: str) -> list[tuple[str, str]]:
        (tmp_path / "room" / "a.py").write_text(text)
        drawn = of_bench("random_mutants").drawn("room", 99, root=tmp_path)
        return [(mutant.old, mutant.new) for mutant in drawn if re.search(r"\d", mutant.old)]

    whole = order("".join(lines))
    changed = order("VALUE = 'a text'\n" + "".join(lines[1:]))

    assert len(whole) > len(changed) > 8
    assert [one for one in whole if one in changed] == changed


def test_every_guard_can_still_be_broken_and_its_tests_are_those_of_the_table() -> None:
    guards = of_bench("guards")
    table = (ROOT / "SECURITY.md").read_text(encoding="utf-8")

    for guard in guards.GUARDS:
        assert guards.broken(guard) != (ROOT / guard.file).read_text(encoding="utf-8")
        assert f"tests/{guard.tests.split()[0]}.py" in table, guard.name
