"""A class that is called wrongly says so in one sentence with the way out: for all public classes at once."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Iterable, Mapping
from dataclasses import is_dataclass

from spook_tracker.engine.check import nearest


def explain_misuse(kinds: Iterable[object]) -> None:
    """Let the dataclasses among them name the culprit where values do not fit their fields; still a TypeError."""
    for kind in kinds:
        if isinstance(kind, type) and is_dataclass(kind):
            _explain(kind)


def _explain(kind: type) -> None:
    construct = kind.__init__  # type: ignore[misc]  # a dataclass has one of its own

    @functools.wraps(construct)
    def explained(self: object, *given: object, **named: object) -> None:
        try:
            construct(self, *given, **named)
        except TypeError:
            sentence = _sentence(kind, given, named)
            if sentence is None:  # the values fit: it is from within
                raise
            raise TypeError(sentence) from None

    kind.__init__ = explained  # type: ignore[misc]


def _sentence(kind: type, given: tuple[object, ...], named: Mapping[str, object]) -> str | None:
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
    if vector and by_place and _constructs(kind, given, named):
        return f"{kind.__name__} takes them as one value, {by_place[0]}: write {kind.__name__}({given!r})"
    if by_place:
        return f"{kind.__name__} takes {' and '.join(by_place)}, not {len(given)} values"
    return (
        f"{kind.__name__} takes its values by name: write {_call(kind, needed or list(fields)[: len(given)])}"
    )


def _call(kind: type, names: Iterable[str]) -> str:
    return f"{kind.__name__}({', '.join(f'{name}=…' for name in names)})"


def _constructs(kind: type, value: object, named: Mapping[str, object]) -> bool:
    try:
        kind(value, **named)
    except (TypeError, ValueError):
        return False
    return True
