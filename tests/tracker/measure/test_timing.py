"""Timing protocol, orders of accuracy and the ladder's scalars, on runs of known cost."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest

import spook_tracker.tracker.measure.timing as timing
from spook_tracker.tracker.document.order import error_in_time, in_range, observed_order, time_at_error
from spook_tracker.tracker.document.run_document import Timing
from spook_tracker.tracker.measure.question import Outcome
from spook_tracker.tracker.measure.timing import MOST_RUNS, Repeats, Stopwatch, interleaved, once


class Clockwork:
    """An engine whose runs take as long as their scene says, on paper."""

    def __init__(self, failing: str = "") -> None:
        self.calls: list[tuple[str, bool]] = []
        self.failing = failing

    def __call__(self, scene, *, time_stages: bool = False, **options):
        self.calls.append((scene.name, time_stages))
        return SimpleNamespace(
            seconds=scene.seconds,
            status="diverged" if scene.name == self.failing else "completed",
            failure="body 'b' is far away" if scene.name == self.failing else "",
            stage_seconds={"solve_path": 0.5 * scene.seconds} if time_stages else {},
        )


def runs(**seconds: float):
    return [lambda s, n=n, t=t: s(SimpleNamespace(name=n, seconds=t)) for n, t in seconds.items()]


def test_repeats_are_interleaved_and_all_kept():
    engine = Clockwork()
    slow, fast = interleaved(runs(slow=0.012, fast=0.01), engine, 5)
    assert engine.calls == [("slow", True), ("fast", True), *[("slow", False), ("fast", False)] * 5]
    assert slow.seconds == (0.012,) * 5
    assert (fast.runs_per_repeat, fast.stage_seconds) == (1, {"solve_path": 0.005})


def test_short_runs_are_repeated_until_the_clock_resolves_them():
    engine = Clockwork()
    (short, cold, shortest) = interleaved(runs(a=2.5e-4, b=1.5e-3, c=1e-9), engine, 3)

    assert (short.runs_per_repeat, len(short.seconds)) == (4, 3)
    assert cold.runs_per_repeat == 2, "the first of each repeat finds cold caches, and does not count"
    assert shortest.runs_per_repeat == MOST_RUNS


def test_long_runs_are_repeated_less_often_but_never_once():
    engine = Clockwork()
    (long,) = interleaved(runs(a=10.0), engine, 5, expected=[9.0])

    assert len(long.seconds) == len(long.calibration) == 2
    assert len(engine.calls) == 2, "the first one counts, too"


def test_each_repeat_has_the_lesser_of_what_the_kernel_took_before_and_after_it(monkeypatch):
    """It is taken again once a moment is over: several short repeats are beside the same."""
    took, clock = iter([5.0, 4.0, 6.0, 3.0, 7.0]), iter(range(100))
    monkeypatch.setattr(timing, "calibrate", lambda: next(took))
    monkeypatch.setattr(timing, "time", SimpleNamespace(perf_counter=lambda: float(next(clock))))
    (slow,) = interleaved(runs(slow=0.02), Clockwork(), 3, expected=[1e-3])

    assert slow.calibration == (4.0, 4.0, 6.0)
    monkeypatch.setattr(timing, "BESIDE", 1e9)
    short = interleaved(runs(a=1e-3, b=1e-3), Clockwork(), 3, expected=[1e-3] * 2)
    assert [one.calibration for one in short] == [(3.0,) * 3] * 2


def test_the_first_run_of_what_is_expected_to_take_long_counts_and_has_no_clock_of_stages():
    """But one of them is to tell its stages, and a short one finds cold caches when it comes first."""
    engine = Clockwork()
    asked = runs(first=0.02, staged=0.02, short=1e-3)
    first, staged, short = interleaved(asked, engine, 5, expected=[0.04, 0.04, 0.04], staged={1})

    assert [len(timing.seconds) for timing in (first, staged, short)] == [3, 3, 5]
    assert [len(timing.calibration) for timing in (first, staged, short)] == [3, 3, 5]
    assert [set(timing.stage_seconds) for timing in (first, staged, short)] == [set(), {"solve_path"}, set()]
    assert [name for name, _ in engine.calls].count("first") == 3
    assert [name for name, _ in engine.calls].count("staged") == 4


def test_where_patience_is_short_long_runs_are_timed_once_and_stages_are_left_out():
    engine = Clockwork()
    (long, short) = interleaved(
        runs(a=0.1, b=1e-4), engine, Repeats(most=3, seconds=0.05, fewest=1, stages_up_to=1e-3, runs=7)
    )

    assert (long.seconds, long.stage_seconds) == ((0.1,), {})
    assert (len(short.seconds), short.runs_per_repeat, set(short.stage_seconds)) == (3, 7, {"solve_path"})


def test_an_engine_without_a_clock_for_stages_is_not_asked_for_them_again():
    engine = Clockwork()
    asked = [lambda s, n=n: s(SimpleNamespace(name=n, seconds=0.1)) for n in ("a", "b", "c")]

    def without(scene, **options):
        result = engine(scene, **options)
        result.stage_seconds = {}
        return result

    assert all(timing.stage_seconds == {} for timing in interleaved(asked, without, 2))
    assert [name for name, stages in engine.calls if stages] == ["a"]


def test_runs_that_were_disturbed_do_not_count():
    times = iter([1e-4] + [1e-4, 9e-4] * 30)
    engine = Clockwork()
    (timing,) = interleaved([lambda s: s(SimpleNamespace(name="a", seconds=next(times)))], engine, 2)

    assert timing.seconds == pytest.approx((1e-4, 1e-4))


def test_a_run_that_fails_is_not_timed_and_says_what_came_of_it():
    good, bad = interleaved(runs(a=0.01, b=0.01), Clockwork(failing="b"), 3)

    assert isinstance(good, Timing)
    assert bad == Outcome(None, "diverged", "body 'b' is far away")


def test_a_run_that_fails_in_a_later_repeat_has_failed():
    left = iter([0.1] * 3)

    def engine(scene, **options):
        if scene.name == "b" and next(left, None) is None:
            raise MemoryError
        return SimpleNamespace(seconds=0.01, status="completed", stage_seconds={})

    asked = [lambda s, n=n: s(SimpleNamespace(name=n)) for n in ("a", "b")]
    good, bad = interleaved(asked, engine, 5)

    assert isinstance(good, Timing) and len(good.seconds) == 5
    assert bad == Outcome(None, "crashed", "the test ran out of memory")


class Compiler:
    """An engine that compiles apart from running."""

    def __init__(self) -> None:
        self.compiled, self.ran = 0, 0

    def prepare(self, scene, **options):
        self.compiled += 1
        return SimpleNamespace(run=lambda **how: self.run(scene))

    def run(self, scene):
        self.ran += 1
        return SimpleNamespace(
            seconds=0.01, cpu_seconds=0.01, status=scene.status, failure="", stage_seconds={}
        )


def test_a_scene_is_compiled_once_however_often_it_is_timed():
    engine = Compiler()
    (timing,) = interleaved(
        [lambda s: [s(SimpleNamespace(status="completed")) for _ in range(2)]],
        lambda scene, **options: engine.run(scene),
        3,
        prepare=engine.prepare,
    )

    assert timing.seconds == (0.02,) * 3 and timing.cpu_seconds == (0.02,) * 3
    assert engine.compiled == 2 and engine.ran == 2 * (
        1 + 3
    )  # the first, with the clock of stages, and three repeats


def test_a_prepared_run_that_fails_when_it_is_run_again_has_failed():
    scene = SimpleNamespace(status="completed")
    engine = Compiler()

    def begin(number):
        scene.status = "diverged" if engine.ran else "completed"

    (found,) = interleaved(
        [lambda s: s(scene)], lambda scene, **options: engine.run(scene), 3, begin, engine.prepare
    )

    assert found == Outcome(None, "diverged", "")


def test_nothing_is_recorded_while_timing_but_the_time_limit_is_passed_on():
    seen = {}

    def engine(scene, **options):
        seen.update(options)
        return SimpleNamespace(seconds=0.1, status="completed", stage_seconds={})

    assert once(lambda s: s(None), engine, time_limit=3.0) == 0.1
    assert seen == {"time_limit": 3.0}


def test_the_stopwatch_adds_up_the_native_loops_of_one_run():
    watch = Stopwatch(Clockwork())
    for seconds in (0.1, 0.2):
        watch(SimpleNamespace(name="a", seconds=seconds))

    assert watch.seconds == pytest.approx(0.3, rel=1e-15)


STEPS = [0.1 / 2**k for k in range(6)]


@pytest.mark.parametrize("order", [1, 2, 4])
def test_the_order_of_a_power_law_is_found(order):
    assert observed_order(STEPS, [3.0 * h**order for h in STEPS]) == pytest.approx(order, abs=1e-12)


def test_one_spoiled_rung_does_not_move_the_order():
    errors = [h**2 for h in STEPS]
    errors[3] *= -1e-3  # a lucky zero crossing

    assert observed_order(STEPS, errors) == pytest.approx(2.0, abs=0.05)


def test_too_few_usable_rungs_give_no_order():
    assert observed_order(STEPS[:2], [1.0, 2.0]) is None
    assert observed_order(STEPS, [0.0] * 6) is None
    assert observed_order(STEPS, [math.nan] * 4 + [1.0, 2.0]) is None


def test_the_asymptotic_range_includes_its_ends():
    assert in_range(1.0 / 60.0, (1.0 / 960.0, 1.0 / 60.0))
    assert not in_range(0.1, (0.001, 0.01))
    assert in_range(0.1, None)


def test_time_and_error_are_read_between_rungs_by_powers():
    seconds, errors = [1.0, 2.0, 4.0], [0.04, -0.01, 0.0025]

    assert time_at_error(seconds, errors, 0.02) == pytest.approx(math.sqrt(2.0), rel=1e-12)
    assert error_in_time(seconds, errors, math.sqrt(8.0)) == pytest.approx(0.005, rel=1e-12)
    assert time_at_error(seconds, errors, 0.01) == 2.0


def test_rungs_as_far_apart_as_numbers_go_are_read_by_powers_too():
    """Ratios of these are lost below the smallest number or above the largest: on a line of logarithms they are not."""
    assert time_at_error([1.0, 4.0], [1e308, 1e-308], 1.0) == pytest.approx(2.0, rel=1e-12)
    assert time_at_error([4.0, 1.0], [5e-324, 1.7e308], 1e-8) == pytest.approx(2.0, abs=0.01)
    assert time_at_error([1e-300, 1e300], [1e2, 1e-2], 1.0) == pytest.approx(1.0, rel=1e-9)
    assert error_in_time([1e-300, 1e300], [1e200, 1e-200], 1.0) == pytest.approx(1.0, rel=1e-9)


def test_what_no_rung_reaches_is_infinite():
    assert time_at_error([1.0, 2.0], [0.1, 0.01], 1e-6) == math.inf
    assert error_in_time([1.0, 2.0], [0.1, 0.01], 0.5) == math.inf
    assert time_at_error([], [], 1.0) == math.inf
    assert time_at_error([1.0], [math.nan], 1.0) == math.inf
