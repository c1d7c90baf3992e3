"""Retired instructions of this thread in user mode, where the machine counts them (Linux perf events).

They tell two builds apart where the clock is too noisy. Where nothing can be counted every reading is None, and
`why_not` says why: most virtual machines show no counter to their guests.
"""

from __future__ import annotations

import ctypes
import errno
import functools
import os
import platform
import struct
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

# perf_event_attr of linux/perf_event.h: type, size, config, …, flags; the rest of its 112 bytes is zero.
SYSTEM_CALL = {"x86_64": 298, "aarch64": 241}
HARDWARE, RETIRED_INSTRUCTIONS, ATTRIBUTE_SIZE = 0, 1, 112
EXCLUDE_KERNEL, EXCLUDE_HYPERVISOR, DISABLED = 1 << 5, 1 << 6, 1
ENABLE, DISABLE, RESET = 0x2400, 0x2401, 0x2403


class InstructionCounter:
    """Counts inside `counting()`; `count` is None where nothing can be counted."""

    def __init__(self) -> None:
        self._file, _ = _open()
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
def why_not() -> str:
    """Why this machine does not let us count, in a sentence without its full stop; empty where it does. Asked once."""
    file, reason = _open()
    if file < 0:
        return reason
    os.close(file)
    counter = InstructionCounter()
    with counter.counting():
        sum(range(100))
    counter.close()
    return "" if counter.count else "the counter of this machine stands still"


def can_count() -> bool:
    """Whether this machine lets us count."""
    return not why_not()


def _open() -> tuple[int, str]:
    """A perf event of this thread, or −1 and why there is none."""
    number = SYSTEM_CALL.get(platform.machine())
    if sys.platform != "linux" or number is None:
        return -1, f"there is no perf_event_open for {sys.platform} on {platform.machine()}"
    flags = DISABLED | EXCLUDE_KERNEL | EXCLUDE_HYPERVISOR
    attribute = struct.pack("<IIQQQQQ", HARDWARE, ATTRIBUTE_SIZE, RETIRED_INSTRUCTIONS, 0, 0, 0, flags)
    attribute = attribute.ljust(ATTRIBUTE_SIZE, b"\0")
    try:
        library = ctypes.CDLL(None, use_errno=True)
        file = int(library.syscall(number, attribute, 0, -1, -1, 0))
    except (OSError, AttributeError) as error:
        return -1, f"perf_event_open cannot be called: {error}"
    return file, "" if file >= 0 else _reason(ctypes.get_errno())


def _reason(error: int) -> str:
    """What the kernel means by refusing."""
    if error in (errno.EACCES, errno.EPERM):
        try:
            level = Path("/proc/sys/kernel/perf_event_paranoid").read_text(encoding="ascii").strip()
        except OSError:
            level = "unknown"
        return f"the kernel does not allow it here (kernel.perf_event_paranoid is {level}, a container may forbid it)"
    if error in (errno.ENOENT, errno.EOPNOTSUPP, errno.ENODEV):
        return "the processor shows no counter, as in most virtual machines"
    return f"the kernel refuses: {os.strerror(error)}"
