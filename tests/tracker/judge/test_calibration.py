"""A machine that is slower is not an engine that is slower: the calibration kernel tells them apart."""

from __future__ import annotations

import math
import time
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace

from spook_tracker.tracker.document.run_document import Timing
from spook_tracker.tracker.judge.tonight import tonight
from spook_tracker.tracker.measure.calibration import calibrate
from spook_tracker.tracker.measure.timing import interleaved
from tests.histories.synthetic import DocumentHistory
from tests.tracker.judge.test_one_judge import night, rungs

KEY = "t/plain/ladder:e:run-time"
DRAWS = np.random.default_rng(3).standard_normal((3, 40))


def timed(
    number: int, code: float = 1.0, machine: float = 1.0, elsewhere: float = 1.0, unsteady: float = 0.02
) -> Any:
    """A night whose engine and whose machine take so many times as long, or wait so long for others."""
    pairs = []
    for definition, found in rungs(1e-3):
        own = found.timing.seconds[0] * code * machine * (1.0 + 0.01 * DRAWS[0, number])
        kernel = 1e-3 * machine * (1.0 + 0.003 * DRAWS[1, number])
        timing = Timing(
            seconds=(own * elsewhere, 1.01 * own * elsewhere), runs_per_repeat=1, cpu_seconds=(own, 1.01 * own),
            calibration=(kernel, kernel * (1.0 + 2.0 * unsteady)),
        )  # fmt: skip
        pairs.append((definition, replace(found, timing=timing)))
    return night(number, pairs)


def told(nights: list[Any]) -> Any:
    (found,) = (f for f in tonight(DocumentHistory(nights), nights[-1]) if f.series == KEY)
    return found


def nights(count: int = 30) -> list[Any]:
    return [timed(n) for n in range(count)]


def test_everything_slower_with_its_kernel_is_the_machine() -> None:
    assert not told([*nights(), *(timed(n, machine=1.3) for n in (30, 31, 32))]).red


def test_slower_than_its_kernel_is_the_engine() -> None:
    found = told([*nights(), *(timed(n, code=1.1, machine=0.9) for n in (30, 31))])

    assert found.red
    assert abs(math.log10(1.1) - found.verdict.decades) < 0.01


def test_time_that_the_machine_spent_elsewhere_is_not_the_engines() -> None:
    found = told([*nights(), *(timed(n, elsewhere=1.8) for n in (30, 31))])

    assert not found.red
    assert found.judged.night.value == pytest.approx(
        1.8e-3 / math.sqrt(0.1 * 0.05), rel=0.05
    )  # shown as it was


def test_a_night_on_which_the_kernel_was_unsteady_is_not_judged() -> None:
    found = told([*nights(), *(timed(n, code=1.5, unsteady=0.4) for n in (30, 31))])

    assert (found.red, found.verdict.word) == (False, "not_comparable")
    assert "the machine was not quiet, its calibration kernel took 40 % more" in found.verdict.sentence
    assert not told([*nights(), timed(30, code=1.5, unsteady=0.4), timed(31)]).red


def test_a_history_may_begin_without_a_kernel() -> None:
    before = [night(n, rungs(1e-3 * (1.0 + 0.01 * DRAWS[2, n]))) for n in range(20)]

    assert not told([*before, *(timed(n) for n in range(20, 26))]).red


class Sleeper:
    """An engine that leaves the processor to others for most of its time."""

    def __call__(self, scene: Any, **options: Any) -> Any:
        started, own = time.perf_counter(), time.thread_time()
        time.sleep(0.02)
        return SimpleNamespace(
            seconds=time.perf_counter() - started,
            cpu_seconds=time.thread_time() - own,
            status="completed",
            stage_seconds={},
        )


def test_processor_time_and_kernel_stand_beside_every_repeat() -> None:
    (timing,) = interleaved([lambda simulate: simulate(None)], Sleeper(), 3)

    assert len(timing.seconds) == len(timing.cpu_seconds) == len(timing.calibration) == 3
    assert min(timing.seconds) >= 0.02
    assert max(timing.cpu_seconds) < 0.01
    assert min(timing.calibration) > 0.0


def test_the_kernel_does_the_same_work_every_time() -> None:
    """Its least times of two halves agree far better than a change worth a word needs."""
    first, second = (min(calibrate() for _ in range(30)) for _ in range(2))

    assert 0.5 < first / second < 2.0


def test_the_engine_tells_its_processor_time_from_the_time_that_passes() -> None:
    from spook_tracker.engine import Particle, Scene, simulate

    scene = Scene(bodies=(Particle(name="a", position=(0.0, 0.0, 0.0), mass=1.0),))
    result = simulate(scene, time_step=1e-3, steps=200_000)

    assert 0.0 < result.cpu_seconds <= 1.05 * result.seconds + 1e-3


def test_an_engine_that_cannot_tell_has_no_processor_time() -> None:
    def engine(scene: Any, **options: Any) -> Any:
        return SimpleNamespace(seconds=0.01, status="completed", stage_seconds={})

    (timing,) = interleaved([lambda simulate: simulate(None)], engine, 2)

    assert timing.cpu_seconds == ()
    assert len(timing.calibration) == 2
