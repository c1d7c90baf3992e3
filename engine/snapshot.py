"""Where a run is, to go back to: in this process, or as bytes in another one of the same build."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from . import _core
from .build_info import build_info
from .errors import MethodError
from .result import Result

FORMAT = 1
# For all formats: these letters, the format in two bytes, SHA-256 of what comes before and behind it, and the content.
LETTERS = b"spook snapshot"
HASHED = len(LETTERS) + 2
CONTENT = HASHED + hashlib.sha256().digest_size
_KINDS: Mapping[str, Any] = {"rigid": _core.RigidSnapshot, "particles": _core.ParticleSnapshot}


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Where a run is, with what was set; any run of an equal scene, step, method and observation can go there.

    It can be pickled, and goes on with the same bits in another process of the same build of the engine. What was
    damaged since, or written by another build, is refused. Like any pickle it may run code of its author: take
    those of strangers as little as you would run their programs.
    """

    of: tuple[Any, ...]
    native: Any
    settings: Mapping[tuple[str, str], tuple[Any, ...]]
    failure: Result | None

    def __repr__(self) -> str:
        scene = self.of[0]
        return f"<Snapshot of a run of {len(scene.bodies)} {'body' if len(scene.bodies) == 1 else 'bodies'}; Run.restore goes there>"

    def to_bytes(self) -> bytes:
        """All of it, with the hash of its bytes and the build it is for."""
        kind = next(name for name, made in _KINDS.items() if isinstance(self.native, made))
        state = (self.of, kind, self.native.bytes(), dict(self.settings), self.failure)
        content = pickle.dumps((_build(), pickle.dumps(state)))
        start = LETTERS + FORMAT.to_bytes(2, "big")
        return start + _hash(start, content) + content

    @staticmethod
    def from_bytes(data: bytes) -> Snapshot:
        """What `to_bytes` of this build gave. Raises MethodError for anything else."""
        if not isinstance(data, bytes | bytearray | memoryview):
            raise MethodError(f"a snapshot is read from bytes, not from {type(data).__name__}")
        data = bytes(data)
        if not data.startswith(LETTERS):
            raise MethodError("these bytes are no snapshot of a run; take what to_bytes() gave")
        if len(data) < CONTENT or data[HASHED:CONTENT] != _hash(data[:HASHED], data[CONTENT:]):
            raise MethodError("the snapshot was damaged or cut short; save the run again")
        found = int.from_bytes(data[len(LETTERS) : HASHED], "big")
        if found != FORMAT:
            raise MethodError(
                f"the snapshot has format {found}, and this engine reads {FORMAT}; use the one that wrote it"
            )
        build, content = pickle.loads(data[CONTENT:])
        if build != _build():
            raise MethodError(
                f"the snapshot is of engine {build}, and this is {_build()}: only the same build goes on with the "
                "same bits; start from its final state instead"
            )
        of, kind, native, settings, failure = pickle.loads(content)
        try:
            return Snapshot(of, _KINDS[kind].of_bytes(native), settings, failure)
        except ValueError as error:
            raise MethodError(f"the snapshot holds another state: {error}") from None

    def __reduce__(self) -> tuple[Any, ...]:
        return Snapshot.from_bytes, (self.to_bytes(),)


def _build() -> str:
    return f"{build_info.version} ({build_info.compiler})"


def _hash(start: bytes, content: bytes) -> bytes:
    return hashlib.sha256(start + content).digest()
