"""Checks shared by scenes and runs: each returns the clean value or names the culprit."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable
from typing import Any

from .errors import MethodError, SceneError

Vector = tuple[float, float, float]
Rotation = tuple[float, float, float, float]  # unit quaternion (w, x, y, z), body to world
MOST_NAMED = 8  # names that a message lists


def number(owner: str, field: str, value: object) -> float:
    """A finite float, or a SceneError naming owner and field."""
    if type(value) is float and math.isfinite(value):  # nearly always
        return value
    try:
        if isinstance(value, bool | str | bytes):  # float() takes them, and "1" or True is a slip
            raise TypeError
        result = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise SceneError(f"{owner}: {field} must be a number, not {value!r}") from None
    except OverflowError:
        raise SceneError(f"{owner}: {field} is a number too large for arithmetic") from None
    if not math.isfinite(result):
        raise SceneError(f"{owner}: {field} must be finite, not {result}")
    return result


def positive(owner: str, field: str, value: object) -> float:
    """A finite float above zero."""
    result = number(owner, field, value)
    if result <= 0.0:
        raise SceneError(f"{owner}: {field} must be positive, not {result:g}")
    return result


def not_negative(owner: str, field: str, value: object) -> float:
    """A finite float, zero or above."""
    result = number(owner, field, value)
    if result < 0.0:
        raise SceneError(f"{owner}: {field} must not be negative, not {result:g}")
    return result


def entries(value: Any) -> list[Any] | None:
    """What a sequence holds; None for a text and for whatever cannot be gone through."""
    if isinstance(value, str | bytes):
        return None
    try:
        return list(value)
    except TypeError:
        return None


def one_of(value: object, words: tuple[str, ...]) -> bool:
    """Whether it is one of some words: arrays, too, can be asked."""
    return isinstance(value, str) and value in words


def vector(owner: str, field: str, value: Any) -> Vector:
    """Three finite floats."""
    try:
        x, y, z = value
    except (TypeError, ValueError):
        raise SceneError(f"{owner}: {field} must be three numbers, not {value!r}") from None
    if type(x) is type(y) is type(z) is float and math.isfinite(x + y + z):
        return x, y, z
    return (number(owner, field, x), number(owner, field, y), number(owner, field, z))


def direction(owner: str, field: str, value: object) -> Vector:
    """Three finite floats, scaled to unit length; the zero vector has no direction and is refused."""
    x, y, z = vector(owner, field, value)
    length = math.hypot(x, y, z)
    if length == 0.0:
        raise SceneError(f"{owner}: {field} must not be the zero vector")
    return (x / length, y / length, z / length)


def rotation(owner: str, field: str, value: Any) -> Rotation:
    """Four finite floats (w, x, y, z), scaled to unit length."""
    try:
        w, x, y, z = value
    except (TypeError, ValueError):
        raise SceneError(f"{owner}: {field} must be a quaternion (w, x, y, z), not {value!r}") from None
    if not (type(w) is type(x) is type(y) is type(z) is float and math.isfinite(w + x + y + z)):
        w, x, y, z = (number(owner, field, component) for component in (w, x, y, z))
    square = w * w + x * x + y * y + z * z
    length = math.sqrt(square) if 1e-280 < square < 1e280 else math.hypot(w, x, y, z)
    if length == 0.0:
        raise SceneError(f"{owner}: {field} must not be the zero quaternion")
    return (w / length, x / length, y / length, z / length)


def name(kind: str, value: object) -> str:
    """A body's, constraint's or force's name: any text that is not blank."""
    if not isinstance(value, str) or not value.strip():
        raise SceneError(f"a {kind} needs a name, not {value!r}")
    return value


def nearest(value: object, names: Iterable[str]) -> str:
    """The way out of a name that is not there: those like it, else the first there are."""
    import difflib  # only where something is wrong

    there = list(names)
    near = difflib.get_close_matches(value, there, n=3) if isinstance(value, str) else []
    if near:
        return f"did you mean {' or '.join(map(repr, near))}?"
    more = f" and {len(there) - MOST_NAMED} more" if len(there) > MOST_NAMED else ""
    return f"there {'is' if len(there) == 1 else 'are'} {', '.join(map(repr, there[:MOST_NAMED]))}{more}"


def unknown(kind: str, value: object, names: Iterable[str]) -> str:
    """There is none of that name, and which there are."""
    there = list(names)
    return f"there is no {kind} named {value!r}" + (
        f"; {nearest(value, there)}" if there else ", nor any other"
    )


def step_count(value: Any) -> int:
    """A number of steps, or a MethodError."""
    try:
        steps = -1 if isinstance(value, bool) else operator.index(value)
    except TypeError:
        steps = -1
    if steps < 0:
        raise MethodError(f"steps must be a whole number, zero or above, not {value!r}")
    if steps >= 2**53:
        raise MethodError("so many steps are more than any machine can do; use a larger time step")
    return steps


def wall_time(value: Any) -> float:
    """A limit of wall time [s] as the core takes it, 0 for none; or a MethodError."""
    if value is None:
        return 0.0
    try:
        seconds = math.nan if isinstance(value, bool | str) else float(value)
    except (TypeError, ValueError, OverflowError):
        seconds = math.nan
    if not seconds > 0.0:
        raise MethodError(f"time_limit must be a positive number of seconds, not {value!r}")
    return seconds
