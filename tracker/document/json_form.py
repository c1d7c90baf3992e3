"""A document as JSON, and the numbers in it: the one place where they are written and read.

JSON has no NaN and no infinity: there they are the strings "nan", "inf" and "-inf". Everywhere else a `Number` is
the float it stands for.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, TypeVar

import msgspec

from .outside import escaped

SPECIAL = ("nan", "inf", "-inf")  # how JSON says what is not finite
Part = TypeVar("Part")
# What can be written: parts of documents, and plain values with them inside.
Writable = None | bool | int | float | str | msgspec.Struct | Sequence["Writable"] | Mapping[str, "Writable"]


Json = None | bool | int | float | str | list["Json"] | dict[str, "Json"]  # as json.loads gives it


class Number(float):
    """A float64, read also from "nan", "inf" and "-inf". All NaN are one object, so equal documents compare equal."""

    __slots__ = ()

    def __new__(cls, value: float | str) -> Number:
        number = float(value)
        return NAN if math.isnan(number) else float.__new__(cls, number)


NAN: Number = float.__new__(Number, "nan")


class Numbers(tuple[float, ...]):
    """Many such numbers, read at once: a document has thousands. What is not finite is a `Number`."""

    __slots__ = ()


def boxed(number: float) -> float | str:
    """As JSON carries it."""
    if math.isfinite(number):
        return float(number)
    return "nan" if math.isnan(number) else "inf" if number > 0 else "-inf"


def encode(part: Writable) -> bytes:
    """A part of a document as compact JSON; floats in the shortest form that reads back to the same bits."""
    return msgspec.json.encode(part, enc_hook=plain)


def decode(data: bytes | str, kind: type[Part]) -> Part:
    """A part of a document from JSON. msgspec.DecodeError if it is no such part."""
    return _decoder(kind).decode(data)  # type: ignore[no-any-return, arg-type]


@cache
def _decoder(kind: Any) -> msgspec.json.Decoder[Any]:
    return msgspec.json.Decoder(kind, dec_hook=_read)


def readable(document: Writable) -> str:
    """The JSON that files and terminals get: a line for each part, nothing a reader cannot see."""
    return escaped(msgspec.json.format(encode(document), indent=1).decode())


def convert(parts: Writable, kind: type[Part]) -> Part:
    """The same from dictionaries and lists. msgspec.ValidationError if it is no such part."""
    return msgspec.convert(parts, kind, dec_hook=_read)


def builtins(part: Writable) -> Writable:
    """A part as dictionaries, tuples, texts, bytes and numbers, numbers as JSON carries them."""
    found: Writable = msgspec.to_builtins(part, enc_hook=plain, builtin_types=(bytes,))
    return found


def plain(thing: object) -> object:
    """What msgspec does not know itself, for its `enc_hook`. TypeError if it has no place in a document."""
    if isinstance(thing, Number):
        return boxed(thing)
    if hasattr(thing, "item"):  # NumPy's scalars
        return thing.item()
    raise TypeError(f"a {type(thing).__name__} cannot be part of a document")


def _read(kind: type, told: Any) -> Any:
    if kind is Numbers and isinstance(told, (list, tuple)):
        if {*map(type, told)} <= {float} and math.isfinite(sum(told)):  # nearly all: as they are
            return Numbers(told)
        return Numbers(_read(Number, one) for one in told)
    if type(told) is float and kind is Number and told == told:  # nearly all: a document has thousands
        return float.__new__(Number, told)
    if kind is Number and (told in SPECIAL if isinstance(told, str) else type(told) in (int, float)):
        try:
            return Number(told)
        except OverflowError:
            raise ValueError("a whole number beyond what a float64 holds") from None
    raise TypeError(f'expected a number, "nan", "inf" or "-inf", got {str(told)[:40]!r}')


def schema_hook(kind: type) -> dict[str, Writable]:
    """What the published schema says of a `Number`."""
    if kind is Number:
        return {"anyOf": [{"type": "number"}, {"enum": sorted(SPECIAL)}]}
    if kind is Numbers:
        return {"type": "array", "items": schema_hook(Number)}
    raise NotImplementedError(kind)
