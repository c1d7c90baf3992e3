"""Imports are such as tools can follow: no circles, not even through functions, and relative within a room.

The rooms are linked below `spook_tracker`: a name that is absolute there leads an editor away from the file that is open.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter

import pytest

from tests.places import ROOT

ROOMS = ("engine", "scalar_tests", "tracker")
Sources = Mapping[str, str]  # path of a module below the tree: its text


def sources() -> dict[str, str]:
    files = (path for room in ROOMS for path in (ROOT / room).rglob("*.py"))
    return {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in files}


def imports(path: str, tree: ast.AST) -> Iterator[tuple[ast.Import | ast.ImportFrom, str]]:
    """Every import that is ever run, with each module it may name; relative ones in full."""
    room = "spook_tracker/" + path.rpartition("/")[0]
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            continue
        if isinstance(node, ast.Import):
            yield from ((node, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = room.split("/")[: len(room.split("/")) - node.level + 1] if node.level else []
            module = ".".join([*above, *([node.module] if node.module else [])])
            yield from (
                (node, name) for name in (module, *(f"{module}.{alias.name}" for alias in node.names))
            )
        else:
            yield from imports(path, node)


def module_of(path: str) -> str:
    return "spook_tracker." + path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def circle(texts: Sources) -> list[str]:
    """Modules that import each other, one after the other; empty if there are none. What a package's face imports is
    no part of it: to import a module of a package is not to ask the face for anything."""
    graph = {}
    for path, text in texts.items():
        if not path.endswith("__init__.py"):
            graph[module_of(path)] = {module for _, module in imports(path, ast.parse(text))}
    for module, named in graph.items():
        graph[module] = (named & graph.keys()) - {module}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as found:
        return list(found.args[1])
    return []


def room_of(path: str) -> str:
    """The engine and the scalar tests are a room each; the tracker has one a folder."""
    folder = path.rpartition("/")[0]
    return folder if path.startswith("tracker/") else path.partition("/")[0]


def not_relative(texts: Sources) -> list[str]:
    """Imports within a room that are absolute, and relative ones that leave it."""
    modules = {module_of(path): room_of(path) for path in texts}
    found = []
    for path, text in texts.items():
        room = room_of(path)
        below = path.removeprefix(room).count("/")
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.ImportFrom) and node.level > below:
                found.append(f"{path}:{node.lineno}: say {ast.unparse(node)} absolutely")
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and not node.level and node.module:
                names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
            if any(modules.get(name) == room for name in names):
                found.append(f"{path}:{node.lineno}: say {ast.unparse(node)} relatively")
    return found


def test_no_module_is_in_a_circle_of_imports() -> None:
    assert circle(sources()) == []


def test_imports_are_relative_within_a_room_and_absolute_between_rooms() -> None:
    assert not_relative(sources()) == []


ROOM = {"tracker/store/head.py": "", "tracker/store/git.py": "", "tracker/judge/lane.py": ""}


@pytest.mark.parametrize(
    ("head", "git"),
    [
        ("def late():\n    from .git import tags\n", "from .head import revision\n"),
        (
            "from spook_tracker.tracker.store import git\n",
            "def late():\n    if 1:\n        from . import head\n",
        ),
        ("import spook_tracker.tracker.store.git as git\n", "import spook_tracker.tracker.store.head\n"),
    ],
)
def test_a_planted_circle_is_seen(head: str, git: str) -> None:
    names = {"spook_tracker.tracker.store.head", "spook_tracker.tracker.store.git"}

    assert set(circle(ROOM | {"tracker/store/head.py": head, "tracker/store/git.py": git})) == names
    assert circle(ROOM | {"tracker/store/head.py": head}) == []


def test_what_only_a_type_checker_reads_closes_no_circle() -> None:
    typed = "if TYPE_CHECKING:\n    from .git import Tag\n"

    assert (
        circle(ROOM | {"tracker/store/head.py": typed, "tracker/store/git.py": "from .head import at\n"})
        == []
    )


TREE = ROOM | {
    "engine/scene.py": "",
    "engine/peers/jolt.py": "",
    "scalar_tests/ropes/rope.py": "",
    "scalar_tests/case.py": "",
}


@pytest.mark.parametrize(
    ("path", "line", "said"),
    [
        ("tracker/store/head.py", "from spook_tracker.tracker.store.git import tags", "relatively"),
        ("tracker/store/head.py", "from spook_tracker.tracker.store import git", "relatively"),
        ("tracker/store/head.py", "import spook_tracker.tracker.store.git as git", "relatively"),
        ("tracker/store/head.py", "from ..judge.lane import gather", "absolutely"),
        ("tracker/store/head.py", "from .git import tags", ""),
        ("tracker/store/head.py", "from spook_tracker.tracker.judge.lane import gather", ""),
        ("engine/peers/jolt.py", "from spook_tracker.engine.scene import Scene", "relatively"),
        ("engine/peers/jolt.py", "from ..scene import Scene", ""),
        ("scalar_tests/ropes/rope.py", "from spook_tracker.scalar_tests import case", "relatively"),
        ("scalar_tests/ropes/rope.py", "from ...engine.scene import Scene", "absolutely"),
        ("scalar_tests/ropes/rope.py", "from spook_tracker.engine.scene import Scene", ""),
    ],
)
def test_a_planted_breach_of_the_form_is_seen(path: str, line: str, said: str) -> None:
    found = not_relative(TREE | {path: f"def late():\n    {line}\n"})

    assert [one.rpartition(" ")[2] for one in found] == ([said] if said else [])
