"""The version of a test's definition: a hash that changes when what is measured changes, and only then.

Hashed are the parsed source of a measuring function and of every function of the test's own package it
reaches, the values of the constants it reads (a Method, a mass, a table), and the facts of the metric: unit,
direction, limit, reference, time step, parameters. Docstrings, comments, layout, names of tests and every
text a reader sees are not reached, so rewording never makes two runs incomparable. The engine is not hashed
either: it is what is being measured, and of its options only those a test sets itself count. Set points and
tolerances judge a value and do not make another one. What the engine or the questions' vocabulary gives counts by its
name, imported by itself or with its module. A field with the metadata definition=False is left out: where a file
lies, whose content is hashed.
"""

from __future__ import annotations

import ast
import dataclasses
import functools
import hashlib
import inspect
import struct
import sys
import threading
import types
from collections.abc import Callable, Iterator, Mapping, Set
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

OWN_PACKAGES = ("scalar_tests",)
INSTALLED = "spook_tracker."
NAMED_ALONE = ("engine", "scalar_tests.case")  # modules: `engine.Box` is `Box`
WORDING = {
    "conclusion",
    "counter_roles",
    "definition",
    "formerly",
    "iteration_tolerance",
    "description",
    "limit_kind",
    "limit_source",
    "misprints",
    "model",
    "note",
    "question",
    "reference_kind",
    "reference_source",
    "relative_tolerance",
    "role",
    "set_point",
    "set_point_kind",
    "set_point_source",
    "source",
    "theory",
    "time_tolerance",
    "title",
    "tolerance",
    "topic",
    "why",
    "x_label",
    "y_label",
}


def definition_hash(measure: Callable[..., object], facts: object) -> str:
    """Twelve hexadecimal digits over the function, all it reaches and the facts."""
    described = _describe(facts, _Seen(home=""))
    try:
        digest = _digest(measure)
    except TypeError:  # a callable that cannot be a key
        digest = _digest.__wrapped__(measure)
    return hashlib.sha256(f"{digest} {described!r}".encode()).hexdigest()[:12]


@functools.lru_cache(maxsize=4096)
def _digest(measure: Callable[..., object]) -> str:
    """Of a function and all it reaches; a measurement's metrics share it."""
    asked = measure.args[0] if isinstance(measure, functools.partial) and measure.args else measure
    seen = _Seen(home=_package(getattr(asked, "__module__", "") or ""))
    return hashlib.sha256(repr(_describe(measure, seen)).encode()).hexdigest()


@dataclasses.dataclass
class _Seen:
    """What a walk has met already; a second meeting is named, not walked again."""

    home: str
    names: dict[int, int] = dataclasses.field(default_factory=dict)
    alive: list[object] = dataclasses.field(default_factory=list)  # keeps ids unique during the walk

    def meets(self, thing: object) -> int | None:
        known = self.names.get(id(thing))
        if known is None:
            self.names[id(thing)] = len(self.names)
            self.alive.append(thing)
        return known

    def owns(self, module: str) -> bool:
        return _package(module) in (self.home, *OWN_PACKAGES)


Described = None | bool | int | str | bytes | complex | tuple["Described", ...]


def _package(module: str) -> str:
    return _inside(module).partition(".")[0]


def _inside(module: str) -> str:
    """A module's name below the one that is installed: what the whole is called changes no definition."""
    return module.removeprefix(INSTALLED)


def _describe(thing: object, seen: _Seen) -> Described:
    """Nested tuples that stand for a value; floats by their bits."""
    if isinstance(thing, float):
        return ("f", struct.pack("<d", thing).hex())
    if thing is None or isinstance(thing, bool | int | str | bytes | complex):
        return thing
    if isinstance(thing, tuple | list):
        return ("list", *(_describe(item, seen) for item in thing))
    if isinstance(thing, Mapping):
        pairs = [(_describe(key, seen), _describe(value, seen)) for key, value in thing.items()]
        return ("map", *sorted(pairs, key=repr))
    if isinstance(thing, Set):
        return ("set", *sorted((_describe(item, seen) for item in thing), key=repr))
    known = seen.meets(thing)
    if known is not None:
        return ("again", known)
    if isinstance(thing, functools.partial):
        return ("partial", *(_describe(part, seen) for part in (thing.func, thing.args, thing.keywords)))
    if isinstance(thing, types.MethodType):
        return ("method", _describe(thing.__func__, seen), _describe(thing.__self__, seen))
    if isinstance(thing, types.FunctionType):
        return _describe_function(thing, seen)
    if isinstance(thing, type):
        return _describe_class(thing, seen)
    if isinstance(thing, types.ModuleType):
        return ("module", _inside(thing.__name__))
    if dataclasses.is_dataclass(thing):
        chosen = dataclasses.fields(thing) if seen.owns(type(thing).__module__) else _chosen(thing)
        named = [
            f.name
            for f in chosen
            if not _is_wording(type(thing), f.name) and f.metadata.get("definition", True)
        ]
        fields = tuple((name, _describe(getattr(thing, name), seen)) for name in named)
        return (type(thing).__qualname__, _describe(type(thing), seen), fields)
    if hasattr(thing, "tobytes") and hasattr(thing, "shape") and hasattr(thing, "dtype"):
        return ("array", str(thing.dtype), tuple(thing.shape), thing.tobytes().hex())
    if hasattr(thing, "__wrapped__"):
        return ("wrapped", _describe(thing.__wrapped__, seen))
    return (type(thing).__qualname__, getattr(thing, "__name__", ""))


def _chosen(thing: DataclassInstance | type[DataclassInstance]) -> list[dataclasses.Field[object]]:
    """Fields a test set itself: an option the engine gains later, or a default it changes, is the engine's."""
    return [
        f
        for f in dataclasses.fields(thing)
        if f.default is dataclasses.MISSING or repr(getattr(thing, f.name)) != repr(f.default)
    ]


def _is_wording(kind: type, field: str) -> bool:
    """A text for the reader, or what judges a value, in a class of the questions' own vocabulary."""
    return _inside(kind.__module__) == "scalar_tests.case" and field in WORDING


def _describe_class(kind: type, seen: _Seen) -> Described:
    if not seen.owns(kind.__module__):
        return ("class", _inside(kind.__module__), kind.__qualname__)
    node = _classes(kind.__module__).get(kind.__name__)
    if node is None:
        return ("class", kind.__qualname__)
    return ("class", _definition(node, kind.__module__))


def _describe_function(function: types.FunctionType, seen: _Seen) -> Described:
    if not seen.owns(function.__module__ or ""):
        return ("function", _inside(function.__module__ or ""), function.__qualname__)
    code = function.__code__
    nodes = _functions(function.__module__).get((code.co_name, code.co_firstlineno), ())
    written = tuple(_definition(node, function.__module__) for node in nodes)
    body: Described = written or ("bytecode", code.co_code.hex(), _plain(code))
    captured = tuple(_describe(_cell(cell), seen) for cell in function.__closure__ or ())
    defaults = _describe((function.__defaults__, function.__kwdefaults__), seen)
    reached = []
    alone = _named_alone(function.__module__) if nodes else {}
    given = {name: module for node in nodes for name, module in _given(node, alone)}
    for name in sorted(_names(code) - alone.keys()):
        if name not in given and name not in function.__globals__:
            continue
        value = getattr(given[name], name, None) if name in given else function.__globals__[name]
        if isinstance(value, types.ModuleType) and seen.owns(value.__name__):
            inside = {n: getattr(value, n) for n in sorted(_names(code)) if hasattr(value, n)}
            reached.append((name, _describe(inside, seen)))
        else:
            reached.append((name, _describe(value, seen)))
    return ("function", body, captured, defaults, tuple(reached))


@functools.lru_cache(maxsize=256)
def _named_alone(module: str) -> dict[str, types.ModuleType]:
    """What a module calls those whose things count by their own names."""
    return {
        name: value
        for name, value in vars(sys.modules[module]).items()
        if isinstance(value, types.ModuleType) and _inside(value.__name__) in NAMED_ALONE
    }


def _given(
    node: ast.AST | list[ast.AST], alone: Mapping[str, types.ModuleType]
) -> Iterator[tuple[str, types.ModuleType]]:
    """What a function takes out of those modules: names, and where from."""
    if isinstance(node, list):
        for item in node:
            yield from _given(item, alone)
    elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in alone:
        yield node.attr, alone[node.value.id]
    elif isinstance(node, ast.AST):
        for name, value in ast.iter_fields(node):
            if name not in SKIPPED_FIELDS:
                yield from _given(value, alone)


def _cell(cell: types.CellType) -> object:
    try:
        return cell.cell_contents
    except ValueError:
        return None  # still empty: a function that refers to itself


def _names(code: types.CodeType) -> set[str]:
    """Global and attribute names used by the code and by what is nested in it."""
    names = set(code.co_names)
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            names |= _names(constant)
    return names


def _plain(code: types.CodeType) -> tuple[Described, ...]:
    return tuple(_plain(c) if isinstance(c, types.CodeType) else repr(c) for c in code.co_consts)


_PARSING = threading.Lock()  # CPython 3.11's parser counts its depth for all threads at once, and fails


@functools.lru_cache(maxsize=256)
def _module_tree(module: str) -> ast.Module | None:
    try:
        with _PARSING:
            return ast.parse(inspect.getsource(sys.modules[module]))
    except (OSError, TypeError, KeyError, SyntaxError):
        return None  # no source: defined in a session or a frozen application


@functools.lru_cache(maxsize=256)
def _functions(module: str) -> Mapping[tuple[str, int], list[ast.AST]]:
    """What a module defines, by name and first line; several lambdas of a line count together."""
    found: dict[tuple[str, int], list[ast.AST]] = {}
    for node in _nodes(module):
        if isinstance(node, ast.Lambda):
            place = "<lambda>", node.lineno
        elif isinstance(node, ast.FunctionDef):
            place = node.name, min([node.lineno, *(decorator.lineno for decorator in node.decorator_list)])
        else:
            continue
        found.setdefault(place, []).append(node)
    return found


@functools.lru_cache(maxsize=256)
def _classes(module: str) -> Mapping[str, ast.AST]:
    """The first class of each name that a module defines."""
    found: dict[str, ast.AST] = {}
    for node in _nodes(module):
        if isinstance(node, ast.ClassDef):
            found.setdefault(node.name, node)
    return found


def _nodes(module: str) -> Iterator[ast.AST]:
    tree = _module_tree(module)
    return ast.walk(tree) if tree else iter(())


@functools.lru_cache(maxsize=4096)
def _definition(node: ast.AST, module: str) -> Described:
    """Of a function or class: what several reach is put in its canonical form once."""
    return _canonical(node, module)


SKIPPED_FIELDS = {"type_comment", "type_params", "kind", "ctx", "returns", "annotation"}


def _canonical(node: object, module: str) -> Described:
    """The tree without positions, docstrings and annotations; the same on every version of Python."""
    if isinstance(node, list):
        return tuple(_canonical(item, module) for item in node)
    if not isinstance(node, ast.AST):
        return repr(node)
    if (
        isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and node.value.id in _named_alone(module)
    ):
        return ("Name", ("id", repr(node.attr)))
    if isinstance(node, ast.AnnAssign) and node.value is not None:
        return ("Assign", _canonical(node.target, module), _canonical(node.value, module))
    parts: list[Described] = [type(node).__name__]
    for name, value in ast.iter_fields(node):
        if name in SKIPPED_FIELDS or value is None or value == []:
            continue
        if name == "body" and isinstance(value, list) and _is_docstring(value[0]):
            value = value[1:]
        parts.append((name, _canonical(value, module)))
    return tuple(parts)


def _is_docstring(statement: ast.AST) -> bool:
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )
