"""What a test has simulated is not simulated again: equal input gives equal bits.

A measurement and its figure, and ladders that read two errors off one run, ask for the same simulations. Of scenes in our
engine alone, whose law that is, and of model files, in any engine, what is read at samples: motion, rest and figures are read
off the same runs, also by several processes that work on a test at once: these share a folder, and who wants a run that another
is making waits for it. A run that is timed, one of which its last bits alone are asked, and one that a clock ended are made again.
"""

from __future__ import annotations

import contextlib
import hashlib
import pickle
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from spook_tracker.engine.method import Method
from spook_tracker.engine.model_file import ModelRun
from spook_tracker.engine.observe import Observable
from spook_tracker.engine.result import Array, Result
from spook_tracker.engine.scene import Scene
from spook_tracker.scalar_tests.case import Simulate

Option = float | bool | None | Method | Mapping[str, Observable]  # of a simulation

WORTH = 2e-3  # s that a run takes; what is shorter is run again sooner than it is found
MOST_BYTES = 1 << 23  # of one run's observables
MOST_KEPT = 1 << 27  # bytes of those of all runs of a test, beside what a worker may use
HOW = ("time_limit", "time_stages")  # options that say how a run is watched, not what it is


@dataclass
class Remembered:
    """Forwards to the engine what was not asked before."""

    simulate: Callable[..., Result]
    scenes: bool = True  # or of model files alone
    shared: Path | None = None  # a folder, for runs of model files
    kept: dict[tuple[Option, ...], list[tuple[bytes, Result]]] = field(
        default_factory=dict
    )  # by what is cheap to compare
    size: int = 0  # bytes

    def __call__(self, scene: Scene | ModelRun, **options: Option) -> Result:
        known_again = (
            self.scenes
            if isinstance(scene, Scene)
            else isinstance(scene, ModelRun) and bool(scene.samples) and not scene.timed
        )
        if not known_again:
            return self.simulate(scene, **options)
        asked = {name: option for name, option in options.items() if name not in HOW}
        bodies = len(scene.bodies) if isinstance(scene, Scene) else 0
        place = (bodies, *(asked.get(name) for name in ("time_step", "duration", "steps")))
        known = self.kept.get(place)
        if known and (found := dict(known).get(_bytes(scene, asked))) is not None:
            return _copy(found)
        if self.shared and isinstance(scene, ModelRun) and (said := _bytes(scene, asked)):
            result = _once(
                self.shared / hashlib.sha256(said).hexdigest(), lambda: self.simulate(scene, **options)
            )
        else:
            result = self.simulate(scene, **options)
        size = _size(result)
        worth = result.status != "timed_out" and result.seconds > WORTH and size <= MOST_BYTES
        if worth and self.size + size <= MOST_KEPT and (key := _bytes(scene, asked)):
            self.kept.setdefault(place, []).append((key, _copy(result)))
            self.size += size
        return result


def _once(file: Path, make: Callable[[], Result]) -> Result:
    """What one of several processes makes and the others read."""
    with _alone(file.with_suffix(".lock")):
        if file.exists():
            kept: Result = pickle.loads(file.read_bytes())
            return kept
        result = make()
        if result.status != "timed_out":
            file.with_suffix(".part").write_bytes(pickle.dumps(result))
            file.with_suffix(".part").rename(file)  # whole, or not there
        return result


@contextlib.contextmanager
def _alone(lock: Path) -> Iterator[None]:
    """No other process is in here with this lock; the kernel takes it from one that dies."""
    if sys.platform == "win32":
        yield
        return
    import fcntl

    with lock.open("w") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        yield


def _bytes(scene: Scene | ModelRun, asked: Mapping[str, Option]) -> bytes:
    """All that a run is decided by, to the bit; nothing where it cannot be told, as of a function."""
    try:
        return pickle.dumps((scene, sorted(asked.items())))
    except (AttributeError, TypeError, pickle.PicklingError):
        return b""


def _size(result: Result) -> int:
    return sum(np.asarray(values).nbytes for values in result.observables.values())


def _copy(result: Result) -> Result:
    """With arrays of its own: who reads a result may write into it."""

    def own(arrays: Mapping[str, Array]) -> dict[str, Array]:
        return {name: np.array(values) for name, values in arrays.items()}

    return replace(
        result,
        observables=own(result.observables),
        sample_times=own(result.sample_times),
        final_state=own(result.final_state),
    )


_of_thread = threading.local()  # an executor may answer in several threads at once


def of_test(test: str, simulate: Simulate, scenes: bool, shared: Path | None = None) -> Simulate:
    """This simulator with what it has simulated for the test in this thread; what it did for another is forgotten."""
    if getattr(_of_thread, "test", None) != (test, simulate):
        _of_thread.test, _of_thread.simulate = (test, simulate), Remembered(simulate, scenes, shared)
    remembered: Simulate = _of_thread.simulate
    return remembered
