"""Where a run happens: processor, operating system, and the bits its mathematics library gives.

Run times are compared only between equal fingerprints; values only between equal float environments, because
a sine that differs in its last bit makes another trajectory.
"""

from __future__ import annotations

import hashlib
import math
import os
import platform
import re
import struct
from collections.abc import Callable
from pathlib import Path

from spook_tracker.tracker.document.run_document import Machine

PLAIN = re.compile(r"[\w./:@-]{1,100}", re.ASCII)
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
    image, built = _image()
    known = (processor, str(cores), system, platform.libc_ver()[0], *filter(None, [image]))
    return Machine(
        fingerprint=hashlib.sha256("\n".join(known).encode()).hexdigest()[:16],
        processor=f"{processor}, any machine of the runner image {image}" if image else processor,
        cores=cores,
        operating_system=" ".join(filter(None, (system, platform.release(), image, built))),
        float_environment=float_environment(),
    )


def _image() -> tuple[str, str]:
    """The image of a hosted runner, whose host is another one in every job, and which of its builds; empty elsewhere.

    A build comes every week or two and is told, the image is part of the fingerprint: GitHub's ImageOS and
    ImageVersion; GitLab's CI_JOB_IMAGE, where CI_DISPOSABLE_ENVIRONMENT says that the machine is thrown away.
    """
    said = os.environ.get
    image, built = said("ImageOS", ""), said("ImageVersion", "")
    if not image and said("CI_DISPOSABLE_ENVIRONMENT") == "true":
        image = said("CI_JOB_IMAGE", "")
    return tuple(word if PLAIN.fullmatch(word) else "" for word in (image, built))  # type: ignore[return-value]


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
