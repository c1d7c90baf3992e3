"""What one publication has read and found out and the next need not: parts by name, in one file.

All of it can be had anew from the database. What other code has kept, or what cannot be read, is as if it were not there.
Each part says what it was made from, and counts as long as that is still the same.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
from pathlib import Path
from typing import Any, TypeVar

import msgspec

Part = TypeVar("Part")


class Kept:
    """The parts in a file; without one there are none, and nothing is kept. `code` names the code that made them."""

    def __init__(self, path: Path | None = None, code: str = "") -> None:
        self._path, self._code = path, code.encode()
        self._there: dict[str, msgspec.Raw] = self._read()
        self._new: dict[str, bytes] = {}

    def get(self, name: str, kind: type[Part]) -> Part | None:
        """The part of that name; None if there is none of that kind."""
        try:
            return msgspec.msgpack.decode(self._there[name], type=kind)
        except (KeyError, msgspec.DecodeError):
            return None

    def put(self, name: str, part: Any) -> None:
        """Keep a part for the next time."""
        if self._path is not None:
            self._new[name] = msgspec.msgpack.encode(part)

    def save(self) -> None:
        """Write what was put. Where that is not possible, the next time takes longer."""
        if self._path is None:
            return
        whole = msgspec.msgpack.encode({name: msgspec.Raw(part) for name, part in sorted(self._new.items())})
        beside = self._path.with_name(f"{self._path.name}.{os.getpid()}")
        with contextlib.suppress(OSError):
            try:
                beside.write_bytes(self._head(whole) + whole)
                beside.replace(self._path)
            finally:
                beside.unlink(missing_ok=True)

    def _head(self, whole: bytes) -> bytes:
        return hashlib.sha256(self._code + b"\0" + whole).digest()

    def _read(self) -> dict[str, msgspec.Raw]:
        try:
            data = b"" if self._path is None else self._path.read_bytes()
            head, whole = data[:32], data[32:]
            if head != self._head(whole):
                return {}
            return msgspec.msgpack.decode(whole, type=dict[str, msgspec.Raw])
        except (OSError, msgspec.DecodeError):
            return {}
