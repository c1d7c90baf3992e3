"""Retired instructions of this thread in user mode, where the machine counts them (Linux perf events).

They tell two builds apart where the clock is too noisy; on machines without a counter every reading is None.
"""

from __future__ import annotations

import ctypes
import functools
import os
import platform
import struct
import sys
from collections.abc import Iterator
from contextlib import contextmanager

# perf_event_attr of linux/perf_event.h: type, size, config, …, flags; the rest of its 112 bytes is zero.
SYSTEM_CALL = {"x86_64": 298, "aarch64": 241}
HARDWARE, RETIRED_INSTRUCTIONS, ATTRIBUTE_SIZE = 0, 1, 112
EXCLUDE_KERNEL, EXCLUDE_HYPERVISOR, DISABLED = 1 << 5, 1 << 6, 1
ENABLE, DISABLE, RESET = 0x2400, 0x2401, 0x2403


class InstructionCounter:
    """Counts inside `counting()`; `count` is None where nothing can be counted."""

    def __init__(self) -> None:
        self._file = _open()
        self.count: int | None = None if self._file < 0 else 0

    @contextmanager
    def counting(self) -> Iterator[None]:
        """Add the instructions retired inside to `count`."""
        if self._file < 0:
            yield
            return
        import fcntl

        fcntl.ioctl(self._file, RESET, 0)
        fcntl.ioctl(self._file, ENABLE, 0)
        try:
            yield
        finally:
            fcntl.ioctl(self._file, DISABLE, 0)
            (retired,) = struct.unpack("<q", os.read(self._file, 8))
            self.count = (self.count or 0) + retired

    def close(self) -> None:
        """Give the counter back."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1


@functools.lru_cache(maxsize=1)
def can_count() -> bool:
    """Whether this machine lets us count; asked once."""
    counter = InstructionCounter()
    with counter.counting():
        sum(range(100))
    counter.close()
    return bool(counter.count)


def _open() -> int:
    """A perf event of this thread, or -1."""
    number = SYSTEM_CALL.get(platform.machine())
    if sys.platform != "linux" or number is None:
        return -1
    flags = DISABLED | EXCLUDE_KERNEL | EXCLUDE_HYPERVISOR
    attribute = struct.pack("<IIQQQQQ", HARDWARE, ATTRIBUTE_SIZE, RETIRED_INSTRUCTIONS, 0, 0, 0, flags)
    attribute = attribute.ljust(ATTRIBUTE_SIZE, b"\0")
    try:
        library = ctypes.CDLL(None, use_errno=True)
        return int(library.syscall(number, attribute, 0, -1, -1, 0))
    except (OSError, AttributeError):
        return -1
