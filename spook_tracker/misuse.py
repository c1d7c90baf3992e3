"""What is called wrongly says so in one sentence with the way out: public classes at once, functions one by one."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import is_dataclass
from typing import ParamSpec, TypeVar

Given = ParamSpec("Given")
Result = TypeVar("Result")


def explain_misuse(kinds: Iterable[object]) -> None:
    """Let the dataclasses among them name the culprit where values do not fit their fields; still a TypeError."""
    for kind in kinds:
        if isinstance(kind, type) and is_dataclass(kind):
            _explain(kind)


def explained(function: Callable[Given, Result]) -> Callable[Given, Result]:
    """The same function, which names the culprit where values do not fit its parameters; still a TypeError."""
    return _explained(function, function)


def _explain(kind: type) -> None:
    construct = kind.__init__  # type: ignore[misc]  # a dataclass has one of its own
    kind.__init__ = _explained(construct, kind)  # type: ignore[misc]


def _explained(function: Callable[Given, Result], whose: Callable[..., object]) -> Callable[Given, Result]:
    @functools.wraps(function)
    def call(*given: Given.args, **named: Given.kwargs) -> Result:
        try:
            return function(*given, **named)
        except TypeError:
            sentence = _sentence(whose, given if whose is function else given[1:], named)  # without self
            if sentence is None:  # the values fit: it is from within
                raise
            raise TypeError(sentence) from None

    return call


def _sentence(
    kind: Callable[..., object], given: tuple[object, ...], named: Mapping[str, object]
) -> str | None:
    from spook_tracker.engine.check import nearest

    signature = inspect.signature(kind)
    try:
        signature.bind(*given, **named)
    except TypeError:
        pass
    else:
        return None
    fields = signature.parameters
    if not fields:
        return f"{kind.__name__} takes no values: write {kind.__name__}()"
    for name in named:
        if name not in fields:
            return f"{kind.__name__} has no {name!r}; {nearest(name, fields)}"
    by_place = [name for name, field in fields.items() if field.kind is not field.KEYWORD_ONLY]
    twice = [name for name in by_place[: len(given)] if name in named]
    if twice:
        return f"{kind.__name__} is given {twice[0]!r} twice, by its place and by its name"
    needed = [name for name, field in fields.items() if field.default is field.empty]
    if len(given) <= len(by_place):
        lacks = [name for name in needed if name not in {*named, *by_place[: len(given)]}]
        return f"{kind.__name__} needs {' and '.join(lacks)}: write {_call(kind, needed)}"
    vector = not any(isinstance(value, str) for value in given)  # several names are not the name of one
    if vector and by_place and isinstance(kind, type) and _constructs(kind, given, named):
        return f"{kind.__name__} takes them as one value, {by_place[0]}: write {kind.__name__}({given!r})"
    if by_place and isinstance(kind, type):
        return f"{kind.__name__} takes {' and '.join(by_place)}, not {len(given)} values"
    if by_place:
        rest = [name for name in needed if name not in by_place]
        return f"{kind.__name__} takes only {' and '.join(by_place)} by place: write {_call(kind, [*by_place, *rest])}"
    return (
        f"{kind.__name__} takes its values by name: write {_call(kind, needed or list(fields)[: len(given)])}"
    )


def _call(kind: Callable[..., object], names: Iterable[str]) -> str:
    return f"{kind.__name__}({', '.join(f'{name}=…' for name in names)})"


def _constructs(kind: type, value: object, named: Mapping[str, object]) -> bool:
    try:
        kind(value, **named)
    except (TypeError, ValueError):
        return False
    return True
