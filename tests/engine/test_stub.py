"""The committed stub of the native module says what the module says."""

from __future__ import annotations

import ast
import re

from spook_tracker.engine import _core
from tests.places import ROOT

STUB = ROOT / "engine" / "_core.pyi"


def test_the_stub_lists_what_the_module_has() -> None:
    tree = ast.parse(STUB.read_text())
    declared = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef | ast.ClassDef)}

    assert set(declared) == {name for name in dir(_core) if not name.startswith("_")}
    for name, node in declared.items():
        if isinstance(node, ast.ClassDef):
            members = {entry.name for entry in node.body if isinstance(entry, ast.FunctionDef)} - {"__init__"}
            assert members == {entry for entry in vars(getattr(_core, name)) if not entry.startswith("_")}


def test_the_stub_names_the_parameters_of_the_module() -> None:
    for node in ast.walk(ast.parse(STUB.read_text())):
        if not isinstance(node, ast.ClassDef):
            continue
        for entry in node.body:
            if isinstance(entry, ast.FunctionDef) and not entry.decorator_list:
                compiled = getattr(getattr(_core, node.name), entry.name)
                ((told, *_),) = compiled.__nb_signature__
                told = re.sub(r"\\[0-9]+", "...", told)  # a default stands there by its number
                (module,) = ast.parse(f"{told}: ...").body
                assert isinstance(module, ast.FunctionDef)
                assert [a.arg for a in entry.args.args] == [a.arg for a in module.args.args], told
