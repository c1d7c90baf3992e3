"""The mutation runs say what they seem to say."""

from __future__ import annotations

import importlib.util
import sys
from types import ModuleType

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
        assert mutation.applied(mutant, text) != text


def test_every_guard_can_still_be_broken_and_its_tests_are_those_of_the_table() -> None:
    guards = of_bench("guards")
    table = (ROOT / "SECURITY.md").read_text(encoding="utf-8")

    for guard in guards.GUARDS:
        assert guards.broken(guard) != (ROOT / guard.file).read_text(encoding="utf-8")
        assert f"tests/{guard.tests.split()[0]}.py" in table, guard.name
