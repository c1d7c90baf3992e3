"""Where a run happens: processor, operating system, and the bits its mathematics library gives.

Run times are compared only between equal fingerprints; values only between equal float environments, because
a sine that differs in its last bit makes another trajectory.
"""

from __future__ import annotations

import hashlib
import math
import os
import platform
import struct
from collections.abc import Callable
from pathlib import Path

from spook_tracker.tracker.document.run_document import Machine

PROBES = (0.1, 0.7, 1.3, 2.9, 11.0, 123.456, 600.1)
LIBRARY: tuple[Callable[[float], float], ...] = (
    math.sin,
    math.cos,
    math.tan,
    math.expm1,
    math.log,
    math.log10,
    math.cbrt,
    math.atan,
    math.tanh,
    math.lgamma,
)


def machine() -> Machine:
    """This machine as a run document names it."""
    processor = _processor()
    system = f"{platform.system()} {platform.machine()}"
    cores = os.cpu_count() or 1
    identity = "\n".join((processor, str(cores), system, platform.libc_ver()[0]))
    return Machine(
        fingerprint=hashlib.sha256(identity.encode()).hexdigest()[:16],
        processor=processor,
        cores=cores,
        operating_system=f"{system} {platform.release()}",
        float_environment=float_environment(),
    )


def float_environment() -> str:
    """Hash of the bits of a few library functions, of the C library and of NumPy's vector loops."""
    import numpy as np

    bits = b"".join(struct.pack("<d", function(x)) for function in LIBRARY for x in PROBES)
    bits += b"".join(struct.pack("<d", math.exp(-x) ** 0.3) for x in PROBES)
    grid = np.linspace(0.01, 12.0, 257)
    for vector in (np.sin(grid), np.exp(grid), np.log(grid), np.sqrt(grid), np.cumsum(grid)):
        bits += vector.astype("<f8").tobytes()
    return hashlib.sha256(bits).hexdigest()[:16]


def _processor() -> str:
    """The model name; /proc says it on Linux, where `platform` only knows the architecture."""
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return " ".join(line.partition(":")[2].split())
    except OSError:
        pass
    return platform.processor() or platform.machine() or "unknown"
