"""The version of a definition changes with what is measured and with nothing else."""

from __future__ import annotations

import ast
import importlib
import itertools
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import spook_tracker.tracker.measure.definition as definition
from spook_tracker.tracker.measure.definition import definition_hash

MODULE = '''"""A question."""
from spook_tracker.engine.method import Method

MASS = 2.0  # kg
WHY = "because"
METHOD = Method(corrections=0)


def scene(length):
    """A rope."""
    return {"mass": MASS, "length": length}


def measure(simulate):
    """Asks."""
    return {"sag": simulate(scene(1.0), method=METHOD)}


def draw(simulate):
    return [simulate(1), WHY]


VARIANT = lambda simulate: measure(simulate)
'''
COUNTER = itertools.count()


@pytest.fixture
def version(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(str(tmp_path))

    def of(source: str, function: str = "measure", facts: object = ("m", 0.1)) -> str:
        name = f"question_{next(COUNTER)}"
        (tmp_path / f"{name}.py").write_text(source, encoding="utf-8")
        importlib.invalidate_caches()
        module = importlib.import_module(name)
        try:
            return definition_hash(getattr(module, function), facts)
        finally:
            del sys.modules[name]

    return of


def test_the_same_source_has_the_same_version(version):
    assert version(MODULE) == version(MODULE)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"""A rope."""', '"""A rope that is worded better."""'),
        ('"because"', '"for a better reason"'),
        ("# kg", "# kilograms"),
        ("[simulate(1), WHY]", "[simulate(2)]"),
        ("def scene(length):", "def scene(length: float) -> dict:"),
        ("def measure", "\n\n\ndef measure"),
    ],
)
def test_rewording_and_redrawing_keep_it(version, old, new):
    assert old in MODULE
    assert version(MODULE.replace(old, new)) == version(MODULE)


@pytest.mark.parametrize("function", ["measure", "VARIANT"])
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("MASS = 2.0", "MASS = 2.5"),
        ('"length": length', '"length": 2 * length'),
        ("scene(1.0)", "scene(1.5)"),
        ("corrections=0", "corrections=1"),
    ],
)
def test_another_scene_constant_or_method_is_another_version(version, function, old, new):
    assert old in MODULE
    assert version(MODULE.replace(old, new), function) != version(MODULE, function)


def test_what_the_engine_gives_counts_by_its_name_however_it_is_imported(version):
    inside = MODULE.replace("method=METHOD", "method=Method(corrections=0)")
    by_module = inside.replace(
        "from spook_tracker.engine.method import Method", "from spook_tracker import engine"
    )
    by_module = by_module.replace("Method(", "engine.Method(")
    assert by_module.count("engine.") == 2
    assert version(by_module) == version(inside)
    assert version(by_module.replace("corrections=0))", "corrections=1))")) != version(inside)


def test_another_limit_is_another_version(version):
    assert version(MODULE, facts=("m", 0.2)) != version(MODULE, facts=("m", 0.1))


def test_an_option_the_engine_gains_is_not_another_version():
    @dataclass(frozen=True)
    class Method:
        corrections: int = 0

    @dataclass(frozen=True)
    class Grown:
        corrections: int = 0
        sweeps: int = 50

    Method.__module__ = Grown.__module__ = "spook_tracker.engine.method"
    Method.__qualname__ = Grown.__qualname__ = "Method"

    assert definition_hash(abs, Grown(corrections=1)) == definition_hash(abs, Method(corrections=1))
    assert definition_hash(abs, Grown(corrections=1, sweeps=9)) != definition_hash(abs, Method(corrections=1))


def test_values_caught_in_a_closure_count():
    def asking(mass: float):
        return lambda simulate: {"sag": simulate(mass)}

    assert definition_hash(asking(1.0), ()) == definition_hash(asking(1.0), ())
    assert definition_hash(asking(1.0), ()) != definition_hash(asking(2.0), ())


def test_threads_parse_one_after_another(monkeypatch: pytest.MonkeyPatch) -> None:
    """CPython 3.11 fails now and then where two threads parse at once: "AST constructor recursion depth mismatch"."""
    within, alone, parse = threading.Semaphore(1), [], ast.parse

    def slowly(source: str, *rest: Any, **more: Any) -> Any:
        alone.append(within.acquire(blocking=False))
        time.sleep(0.01)
        if alone[-1]:
            within.release()
        return parse(source, *rest, **more)

    modules = ("json", "ast", "bisect", "inspect", "threading")
    definition._module_tree.cache_clear()
    with monkeypatch.context() as patched, ThreadPoolExecutor(3) as threads:
        patched.setattr(ast, "parse", slowly)
        list(threads.map(definition._module_tree, modules))

    assert alone == [True] * len(modules)
