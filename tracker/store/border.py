"""What comes from outside is checked here, before anything is written: sizes, depth, types, text, sense.

Databases refuse some text (NUL in PostgreSQL, lone surrogates everywhere); it is made storable here, once.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections import Counter
from collections.abc import Callable
from functools import cache
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import msgspec
from msgspec import inspect

from spook_tracker.tracker.document.errors import DocumentError
from spook_tracker.tracker.document.json_form import boxed, builtins, convert, decode
from spook_tracker.tracker.document.outside import clean_text
from spook_tracker.tracker.document.run_document import RunDocument

from .rows import moment

if TYPE_CHECKING:
    from spook_tracker.tracker.document.json_form import Writable

MAX_BYTES = 32 * 1024 * 1024  # of one document
MAX_SAMPLES = 100_000  # of one document, and as many series
MAX_TEXT = 65_536  # characters of one text
MAX_INTEGER = 2**63 - 1  # what a column holds
NUL = rb"\u0000"  # as JSON has to write it
FITTING = (
    inspect.FloatType, inspect.BoolType, inspect.NoneType, inspect.BytesType, inspect.LiteralType,
    inspect.CustomType,
)  # fmt: skip
ESCAPE = re.compile(rb"\\(?:u([0-9a-fA-F]{4})|.)", re.DOTALL)  # one escape of a JSON text


def _cleaned(part: Writable, place: str) -> Writable:
    if isinstance(part, bytes):  # of a motion: no text, and as long as it has to be
        return part
    if isinstance(part, str):
        if len(part) > MAX_TEXT:
            raise DocumentError(f"{place}: a text of {len(part)} characters; at most {MAX_TEXT} are stored")
        return clean_text(part)
    if isinstance(part, float):
        return boxed(part)
    if isinstance(part, int):
        if abs(part) > MAX_INTEGER:
            digits = int(part.bit_length() * 0.30103) + 1
            raise DocumentError(f"{place}: a whole number of {digits} digits; 64 bits hold 19")
        return part
    if isinstance(part, dict):
        return {
            str(_cleaned(name, f"{place}, a key")): _cleaned(inner, f"{place}.{name}")
            for name, inner in part.items()
        }
    if isinstance(part, (list, tuple)):
        return tuple(_cleaned(inner, place) for inner in part)
    return part


Check = Callable[[Any], bool]


@cache
def _fits(kind: type) -> Check:
    """Whether a part that was read as this type can be stored: what its type leaves open, and no more, is looked at."""
    return _check(inspect.type_info(kind)) or (lambda part: True)


def _check(kind: inspect.Type) -> Check | None:
    """The check of one type; None if any value of it fits. Lengths of most texts are in their types."""
    if isinstance(kind, FITTING) or (isinstance(kind, inspect.StrType) and kind.max_length is not None):
        return None
    if isinstance(kind, inspect.StrType):
        return lambda text: len(text) <= MAX_TEXT
    if isinstance(kind, inspect.IntType):
        return lambda number: -MAX_INTEGER <= number <= MAX_INTEGER
    if isinstance(kind, inspect.DictType):
        key, value = _check(kind.key_type), _check(kind.value_type)
        if key is None:
            return None if value is None else lambda part: all(map(value, part.values()))
        if value is None:
            return lambda part: all(map(key, part))
        return lambda part: all(map(key, part)) and all(map(value, part.values()))
    if isinstance(kind, inspect.VarTupleType):
        item = _check(kind.item_type)
        return None if item is None else lambda part: all(map(item, part))
    if isinstance(kind, inspect.TupleType):
        items = [check for check in map(_check, kind.item_types) if check is not None]
        if not items:
            return None
        if len(items) == len(kind.item_types):
            return lambda part: all(check(inner) for check, inner in zip(items, part, strict=True))
    if isinstance(kind, inspect.UnionType):
        some = [check for check in map(_check, kind.types) if check is not None]
        if not some:
            return None
        if len(some) == 1 and kind.includes_none and len(kind.types) == 2:
            return lambda part: part is None or some[0](part)
    if isinstance(kind, inspect.StructType):
        fields = [(attrgetter(field.name), _check(field.type)) for field in kind.fields]
        looked_at = [(of, check) for of, check in fields if check is not None]
        return (lambda part: all(check(of(part)) for of, check in looked_at)) if looked_at else None
    raise TypeError(f"{kind} has no rule for what can be stored of it")


def checked(run: RunDocument) -> RunDocument:
    """The document as it can be stored. DocumentError, naming the place, if it is not valid."""
    try:
        parts = builtins(run)
    except TypeError as error:
        raise DocumentError(f"the run document holds what JSON cannot: {error}") from None
    except UnicodeError as error:  # msgspec checks no text here, but a hook might
        raise DocumentError(f"the run document holds text that is not Unicode: {error}") from None
    return _sensible(_typed(_cleaned(parts, "$")))


def decoded(data: bytes, origin: str = "the document", whole: set[bytes] | None = None) -> RunDocument:
    """A run document from JSON bytes. DocumentError if it is too large, malformed or makes no sense.

    Read straight into the types, which are not nested deeply: a hostile file costs no more than its size. `whole` are
    digests of bytes that were found to need nothing: these are added, and are not looked at again.
    """
    if len(data) > MAX_BYTES:
        raise DocumentError(f"{origin}: {len(data)} bytes; a run document has at most {MAX_BYTES}")
    digest = b"" if whole is None else hashlib.sha256(data).digest()
    try:
        if whole and digest in whole:
            return decode(data, RunDocument)
        given, data = data, _without_surrogates(data)
        run = decode(data, RunDocument)
        storable = NUL not in data and _fits(RunDocument)(run)  # as `_cleaned` would leave it
        if not storable:
            return checked(run)
        run = _sensible(run)
        if whole is not None and data is given:
            whole.add(digest)
        return run
    except (msgspec.ValidationError, DocumentError) as error:
        raise DocumentError(f"{origin} is not a valid run document: {error!s:.300}") from None
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise DocumentError(f"{origin} is not JSON: {error}") from None


def _without_surrogates(data: bytes) -> bytes:
    """JSON with every escaped surrogate that has no partner replaced: other tools write them, none can be read."""
    if not re.search(rb"\\u[dD][89a-fA-F]", data):
        return data
    pieces, end, waiting = [], 0, None  # waiting: a high surrogate just seen, with its place
    for escape in ESCAPE.finditer(data):
        code = int(escape[1], 16) if escape[1] else 0
        adjacent = waiting is not None and waiting.end() == escape.start()
        if 0xDC00 <= code <= 0xDFFF and adjacent:
            waiting = None
            continue
        lone = [waiting] if waiting is not None else []
        waiting = escape if 0xD800 <= code <= 0xDBFF else None
        if 0xDC00 <= code <= 0xDFFF:
            lone.append(escape)
        for found in lone:
            pieces += [data[end : found.start()], rb"\ufffd"]
            end = found.end()
    if waiting is not None:
        pieces += [data[end : waiting.start()], rb"\ufffd"]
        end = waiting.end()
    return b"".join([*pieces, data[end:]])


def _typed(parts: Writable) -> RunDocument:
    try:
        return convert(parts, RunDocument)
    except msgspec.ValidationError as error:
        raise DocumentError(str(error)) from None


def _sensible(run: RunDocument) -> RunDocument:
    """What types cannot say: times are times, every sample has one definition, nothing is there twice."""
    moment(run.started)
    moment(run.finished)
    if len(run.samples) > MAX_SAMPLES or len(run.series) > MAX_SAMPLES:
        raise DocumentError(f"more than {MAX_SAMPLES} samples or series in one run")
    defined = Counter(definition.key for definition in run.series)
    for key, count in defined.items():
        if count > 1:
            raise DocumentError(f"the series {key!r} is defined {count} times")
    for key, count in Counter(sample.series for sample in run.samples).items():
        if key not in defined:
            raise DocumentError(f"a sample belongs to the series {key!r}, which the document does not define")
        if count > 1:
            raise DocumentError(f"the series {key!r} has {count} samples; one run has one")
    for sample in run.samples:
        if (sample.outcome == "value" or sample.passed) and not math.isfinite(sample.value):
            raise DocumentError(f"the series {sample.series!r} is {sample.value} and yet called good")
    return run
