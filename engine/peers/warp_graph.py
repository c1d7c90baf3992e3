"""What the engines of Warp share: its kernels on the CPU, in single precision, and steps replayed as one graph.

Launches from Python cost more than small scenes' kernels: a graph of one step is recorded once, without running it, and
replayed by a call that goes through all its kernels, as these engines' own examples do on a GPU.
"""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Callable, Iterator
from typing import Any

from .stepped import quiet

with quiet():  # it says which devices it has found
    import warp

    warp.config.log_level = warp.LOG_ERROR
    warp.init()

DEVICE = "cpu"
CONTACTS_PER_BODY, ROWS_PER_CONTACT, LEAST_ROOM = 16, 6, 64  # of MuJoCo Warp, whose own guess is 64 of both
LACKING = ("NEFC", "NJMAX_NNZ", "BROADPHASE", "NARROWPHASE", "CCD")  # what it had no room for, by its names
MADE = f"wheel from the package index, float32, {DEVICE} by Warp {warp.__version__}"


@contextlib.contextmanager
def silent() -> Iterator[None]:
    """No word of what is compiled, nor a warning of what is young or of another version; the steps run on the CPU."""
    with quiet(), warnings.catch_warnings(), warp.ScopedDevice(DEVICE):
        warnings.simplefilter("ignore")
        yield


def room(bodies: int, freedoms: int, rows: int = 0) -> dict[str, int]:
    """For contacts and constraints in MuJoCo Warp; `rows` are those that there are at the start."""
    contacts = max(LEAST_ROOM, CONTACTS_PER_BODY * bodies)
    return {"nconmax": contacts, "njmax": ROWS_PER_CONTACT * contacts + max(LEAST_ROOM, 2 * freedoms + rows)}


def overflowed(data: Any) -> str:
    """What MuJoCo Warp had no room for: it leaves that out and goes on. Its other kinds tell of what was not iterated on."""
    from mujoco_warp import OverflowType

    full = int(data.overflow.numpy().max())
    names = [kind for kind in LACKING if full & int(OverflowType[kind])]
    return f"it ran out of room ({', '.join(names)})" if names else ""


def replayed(step: Callable[[], None]) -> Callable[[], None]:
    """The launches of `step` as one call; it is not taken by being recorded, but all it needs is compiled."""
    with warp.ScopedCapture(device=DEVICE) as capture:
        step()
    graph = capture.graph
    return lambda: warp.capture_launch(graph)
