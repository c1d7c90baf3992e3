"""How a loaded model is run, whatever the engine: stepped, pushed, read at the samples, looked at until it is calm."""

from __future__ import annotations

import hashlib
import os
import pickle
import re
import signal
import subprocess
import sys
import time
from abc import ABC, abstractmethod
from collections import deque
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..errors import EngineError
from ..model_file import ModelRun
from ..protocol import NotSupported
from ..result import Result

Array = npt.NDArray[np.float64]
CALM = 1e-3  # of the size a second: nothing faster, nothing turning faster than that at its rim
CALM_FOR = 0.5  # s
LOOK = 0.02  # s between two looks at whether all is calm
ELSEWHERE_LIMIT = 120.0  # s
CHUNK = 200  # steps between two looks at the clock and at what failed, at most
SOON = 0.02  # of a time limit: so long a chunk may take, else the next one has fewer steps


def elsewhere(
    module: str, run: ModelRun, time_step: float, duration: float, time_limit: float | None
) -> Result:
    """What `run_model` of that module gives in a process of its own."""
    asked = pickle.dumps((replace(run, elsewhere=False), time_step, duration, time_limit))
    command = [sys.executable, "-m", __name__, module]
    try:
        done = subprocess.run(command, input=asked, capture_output=True, timeout=ELSEWHERE_LIMIT)
    except subprocess.TimeoutExpired:
        raise EngineError(f"the model's run gave no answer within {ELSEWHERE_LIMIT:g} s") from None
    if done.returncode:
        last = done.stderr.decode(errors="replace").strip()[-200:]
        why = f"signal {-done.returncode}" if done.returncode < 0 else last
        raise EngineError(f"the model's run died in a process of its own: {why}")
    found: Result | EngineError = pickle.loads(done.stdout)
    if isinstance(found, EngineError):
        raise found
    return found


def refuse_settings(engine: str, run: ModelRun) -> None:
    """What is asked of an engine's file loader beyond running the file as it is."""
    if (
        run.model.drive.kind != "zero"
        or run.model.keyframe
        or run.conservative
        or run.swing
        or run.accurate
        or run.gain != 1.0
        or run.without
        or run.rigid
    ):
        raise NotSupported(f"{engine} is asked without controls, keyframes and other settings than its own")


def said(error: object, path: Path) -> str:
    """A loader's message on one line, without the folder of the file."""
    return " ".join(str(error).split()).replace(f"{path.absolute().parent}/", "")[:200]


def packages(run: ModelRun) -> dict[str, str]:
    """Folders of the packages that a file's meshes are named by: package://NAME/meshes/a.stl."""
    text = Path(run.model.path).read_text(encoding="utf-8", errors="replace")
    found = {}
    for kind, name, rest in re.findall(r"""(package|model)://([^/"']+)/([^"'<]+)""", text):
        file = run.model.assets.get(f"{kind}://{name}/{rest}", "")
        if file.endswith(f"/{rest}"):
            found[name] = file[: -len(rest) - 1]
    return found


def resident() -> float:
    """Memory this process has now [MB]; 0 where it is not known."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


class LoadedModel(ABC):
    """One model in an engine, at its start. A subclass sets `size` and says how to step and what to read."""

    size: float  # m, of what moves
    freedom: int  # numbers in a push

    def __init__(self, run: ModelRun, time_step: float, time_limit: float | None) -> None:
        self.run, self.step, self.limit = run, time_step, time_limit
        self.random = np.random.default_rng(run.seed)
        self.given = np.random.default_rng([run.model.seed, 1])
        self.done = self.total = 0  # steps taken, and to take
        self.chunk = CHUNK if time_limit is None else 1  # steps to the next look at the clock
        self.seconds = self.cpu = self.worst = 0.0
        self.failure = ""

    varies = False  # whether controls change from step to step

    @abstractmethod
    def take(self, count: int) -> None:
        """So many steps, in the engine's own loop where it has one."""

    @abstractmethod
    def push(self, change: Array) -> None:
        """Change the velocities by that, (freedom,) m/s or rad/s."""

    @abstractmethod
    def control(self) -> None:
        """Set the controls for the next step, where they vary."""

    @abstractmethod
    def trouble(self) -> str:
        """Why the state is no good; empty if it is."""

    @abstractmethod
    def read(self) -> None:
        """Bring what is read up to the last step."""

    @abstractmethod
    def poses(self) -> tuple[Array, Array]:
        """Places (B, 3) m and orientations (B, 4) of the watched bodies."""

    @abstractmethod
    def speeds(self) -> tuple[Array, Array]:
        """Of everything that moves: of centres of mass [m/s], and of turning [rad/s]."""

    @abstractmethod
    def state(self) -> Array:
        """Whatever the next step depends on, for its hash."""

    def shapes(self) -> dict[str, Array]:
        """What is seen of the model at its start, as ModelRun has it."""
        raise NotSupported("this engine does not tell what a model looks like")

    def seen(self) -> tuple[Array, Array]:
        """Places (N, 3) m and orientations (N, 4) of the bodies of those shapes."""
        raise NotSupported("this engine does not tell what a model looks like")

    def at_sample(self) -> dict[str, Any]:
        """What else is read at each sample."""
        return {}

    def at_end(self) -> dict[str, Any]:
        """What else is read of the last state."""
        return {}

    def result(self, duration: float, load_seconds: float) -> Result:
        """Run for `duration` [s], or until all is sampled and calm, and read what is asked for."""
        run, total = self.run, round(duration / self.step)
        self.total = total
        shapes = self.shapes() if run.shown else {}
        marks = {min(total, round(at / self.step)) for at in run.samples}
        looks = {total}
        if run.until_settled:
            every = max(1, round(LOOK / self.step))
            looks |= set(range(every, total, every))
        samples: dict[str, list[Any]] = {"position": [], "orientation": []}
        calm, last = _Calm(self.step), max(marks, default=0)
        for mark in sorted(marks | looks):
            self.advance(mark)
            if self.failure:
                break
            self.read()
            if mark in marks or (mark == total and not marks):
                self.sample(samples)
            if run.until_settled and mark in looks:
                settled = calm.at(mark, self.poses()[0], self.is_calm())
                if settled and mark >= last:
                    break
        return self.told(samples, calm, load_seconds, shapes)

    def sample(self, samples: dict[str, list[Any]]) -> None:
        places, turns = self.poses()
        told = {"position": places, "orientation": turns, **self.at_sample()}
        if self.run.shown:
            told["body_place"], told["body_turn"] = self.seen()
        for name, value in told.items():
            samples.setdefault(name, []).append(np.array(value, dtype=float))

    def is_calm(self) -> bool:
        moving, turning = self.speeds()
        return bool(max(moving.max(), 0.5 * self.size * turning.max()) < CALM * self.size)

    def advance(self, to: int) -> None:
        """Step to that many steps; in one call where nothing changes on the way."""
        run = self.run
        stepwise = self.is_pushed or run.timed or self.varies
        while self.done < to and not self.failure:
            count = min(to - self.done, self.chunk)
            pushes = self._pushes(count) if self.is_pushed else None
            began, begun = time.perf_counter(), time.process_time()
            if stepwise:
                self.one_by_one(count, pushes)
            else:
                self.take(count)
            took = time.process_time() - begun
            self.seconds += time.perf_counter() - began
            if self.limit is not None:
                self.chunk = max(1, count // 2) if took > SOON * self.limit else min(CHUNK, 2 * self.chunk)
            self.cpu += took
            self.done += count
            if trouble := self.trouble():
                self.failure = f"{trouble} before {self.done * self.step:.4g} s"
            elif self.limit is not None and self.cpu > self.limit and self.done < self.total:
                self.failure = (
                    f"stopped after {self.limit:.3g} s, at {self.done * self.step:.4g} s of simulated time"
                )

    @property
    def is_pushed(self) -> bool:
        """Whether velocities are changed at random: as the model's question says, or to see what that grows to."""
        return bool(self.run.push or self.run.model.push)

    def _pushes(self, count: int) -> Array:
        """Of so many steps, (count, freedom)."""
        found: Array = np.zeros((count, self.freedom))
        for size, random in ((self.run.push, self.random), (self.run.model.push, self.given)):
            if size:
                found += size * self.size * random.uniform(-1.0, 1.0, found.shape)
        return found

    def one_by_one(self, count: int, pushes: Array | None) -> None:
        last = time.perf_counter()
        for k in range(count):
            self.control()
            if pushes is not None:
                self.push(pushes[k])
            self.take(1)
            if self.run.timed:
                now = time.perf_counter()
                self.worst, last = max(self.worst, now - last), now

    def told(
        self, samples: dict[str, list[Any]], calm: _Calm, load: float, shapes: dict[str, Array]
    ) -> Result:
        count = len(self.run.model.watched)
        status: Any = "completed"
        if self.failure:
            status = "timed_out" if self.failure.startswith("stopped") else "diverged"
        values: dict[str, Any] = {name: np.array(read) for name, read in samples.items()}
        values["position"] = values["position"].reshape(-1, count, 3)
        values["orientation"] = values["orientation"].reshape(-1, count, 4)
        values |= {"size": np.array(self.size), **shapes}
        if not self.failure:
            values |= self.at_end() | {"fastest": np.array(self.speeds()[0].max())}
        if self.run.until_settled:
            values |= {"settled": np.array(calm.settled), "creep": calm.creep(count)}
        if self.run.timed:
            each = self.cpu / max(1, self.done)
            values |= {
                "load_seconds": np.array(load),
                "step_seconds": np.array(each),
                "worst_step_seconds": np.array(self.worst),
                "real_time_factor": np.array(self.step / each if each else np.inf),
            }
        names = [one.label for one in self.run.model.watched]
        return Result(
            status=status,
            failure=self.failure,
            failed_body=None,
            failed_step=self.done if self.failure else None,
            time_step=self.step,
            steps=self.done,
            seconds=self.seconds,
            cpu_seconds=self.cpu,
            observables=values,
            sample_times={},
            final_state=dict(zip(names, np.hstack(self.poses()), strict=True)),
            counters={},
            state_hash=hashlib.sha256(np.ascontiguousarray(self.state()).tobytes()).hexdigest()[:16],
            stages=(),
            stage_seconds={"setup": load},
        )


class _Calm:
    """Since when all is calm, and how far the watched bodies crept while it was."""

    def __init__(self, step: float) -> None:
        self.step = step
        self.recent: deque[tuple[int, Array]] = deque()
        self.since: int | None = None
        self.settled = float("nan")

    def at(self, mark: int, places: Array, calm: bool) -> bool:
        """Whether all has been calm long enough, by this look."""
        self.recent.append((mark, np.array(places)))
        self.since = (mark if self.since is None else self.since) if calm else None
        while (mark - self.recent[0][0]) * self.step > CALM_FOR + 1e-9:
            self.recent.popleft()
        settled = self.since is not None and (mark - self.since) * self.step >= CALM_FOR - 1e-9
        self.settled = self.since * self.step if settled and self.since is not None else float("nan")
        return settled

    def creep(self, count: int) -> Array:
        """Speed [m/s] of each watched body over the last half second."""
        if len(self.recent) < 2:
            return np.full(count, np.nan)
        (first, before), (last, after) = self.recent[0], self.recent[-1]
        speed: Array = np.linalg.norm(after - before, axis=1) / ((last - first) * self.step)
        return speed


def _answer(module: str) -> None:
    """The other end of `elsewhere`; what an engine prints goes where it disturbs nothing."""
    _end_with_parent()
    answers = os.dup(1)
    os.dup2(2, 1)
    asked = pickle.loads(sys.stdin.buffer.read())
    try:
        found = import_module(module).run_model(*asked)
    except EngineError as refused:
        found = refused
    with os.fdopen(answers, "wb") as pipe:
        pipe.write(pickle.dumps(found))


def _end_with_parent() -> None:
    """The parent may be ended for taking too long: this process ends with it. Linux alone can say so."""
    if sys.platform == "linux":
        import ctypes

        die_with_parent = 1  # PR_SET_PDEATHSIG
        ctypes.CDLL(None).prctl(die_with_parent, int(signal.SIGKILL))


if __name__ == "__main__":
    _answer(sys.argv[1])
