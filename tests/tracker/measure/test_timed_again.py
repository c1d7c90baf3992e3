"""What seems slower is timed once more the same night: a slow measurement stays green, a slow engine turns red."""

from __future__ import annotations

import random
import shutil
from datetime import timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from msgspec.structs import replace

from spook_tracker.tracker import library
from spook_tracker.tracker.document.run_document import Again, RunDocument, Timing
from spook_tracker.tracker.document.wording import instant
from spook_tracker.tracker.judge import compare_ladders
from spook_tracker.tracker.judge.calibration import ladder_timing, that_counts, unquiet
from spook_tracker.tracker.measure import timing as clock
from spook_tracker.tracker.store.database import session_on
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.record import add_again, record
from tests.places import TOYS

ASKED: dict[str, Any] = {
    "catalogue": "toy_timed:CATALOGUE", "engine": "spook_tracker.engine", "sweep": True, "workers": 0, "repeats": 2,
    "apart": False,
}  # fmt: skip
THRICE = ASKED | {"repeats": 3}  # once or twice a side prove nothing
NIGHTS = 30


class ScriptedNight:
    """Run times as scripted: by the time a ladder is timed, so many times what it usually takes.

    Step costs have clocks of their own and are left out: thirty nights that repeat one of them have no noise, and a
    loaded machine would be red for it.
    """

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.factors = [1.0]
        self.times = 0  # ladders were timed
        measure = clock.interleaved

        def interleaved(runs: Any, simulate: Any, repeats: int, begin: Any, *prepare: Any) -> Any:
            factor = self.factors[min(self.times, len(self.factors) - 1)]
            self.times += 1
            patch.setattr(clock, "_taken", lambda *asked: (2e-3 * factor, 2e-3 * factor))
            return measure(runs, simulate, repeats, begin)

        patch.setattr(clock, "calibrate", lambda: 1e-3)
        patch.setattr(clock, "_stages", lambda *asked: {})
        patch.setattr(clock, "_instructions", lambda *asked: None)
        patch.setattr("spook_tracker.tracker.measure.ladder.interleaved", interleaved)
        patch.setattr("spook_tracker.tracker.measure.run_times.step_costs", lambda *asked: ([], None))


def scripted(patch: pytest.MonkeyPatch) -> ScriptedNight:
    patch.syspath_prepend(str(TOYS))
    patch.setattr(library, "publish", lambda *asked, **named: None)
    return ScriptedNight(patch)


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch) -> ScriptedNight:
    return scripted(monkeypatch)


def before(document: RunDocument, number: int, chance: random.Random) -> RunDocument:
    """The same night, so many nights earlier, with one per cent of noise."""
    started = instant(document.started)
    assert started is not None
    noise = 1.0 + 0.01 * chance.gauss(0.0, 1.0)
    samples = [
        sample
        if (timing := sample.timing) is None
        else replace(
            sample,
            timing=replace(
                timing,
                seconds=tuple(noise * s for s in timing.seconds),
                cpu_seconds=tuple(noise * s for s in timing.cpu_seconds),
            ),
        )
        for sample in document.samples
    ]
    when = (started - timedelta(days=number)).isoformat()
    return replace(
        document, id=f"night-{number:04}", idempotency_key=str(number), started=when, samples=tuple(samples)
    )


@pytest.fixture(scope="module")
def earlier(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Nights of one per cent noise, the last of them as slow as whatever comes next."""
    file = tmp_path_factory.mktemp("earlier") / "tracker.db"
    url = f"sqlite:///{file}"
    with pytest.MonkeyPatch.context() as patch:
        measured = scripted(patch)
        document, chance = library.run(**ASKED), random.Random(5)
        measured.times, measured.factors = 0, [1.3]
        slow = library.run(**ASKED)
        with session_on(url) as session:
            for number in range(NIGHTS, 1, -1):
                record(session, before(document, number, chance))
            record(session, before(slow, 1, chance))
    return file


@pytest.fixture
def history(earlier: Path, tmp_path: Path) -> str:
    """A copy of those nights, to be gone on with."""
    return f"sqlite:///{shutil.copy(earlier, tmp_path / 'tracker.db')}"


def night(url: str, out: Path) -> library.NightlyReport:
    return library.nightly(url, out, **ASKED)


def run_times(report: library.NightlyReport) -> list[Any]:
    return [finding for finding in report.findings if finding.series.endswith(":run-time")]


def red(report: library.NightlyReport) -> dict[str, str]:
    return {finding.series: finding.verdict.sentence for finding in report.findings if finding.red}


def test_a_slow_measurement_that_does_not_repeat_stays_green_with_a_note(
    measured: ScriptedNight, history: str, tmp_path: Path
) -> None:
    ladders = len(set(toy().ladders))
    measured.factors = [1.3] * ladders + [1.0]
    report = night(history, tmp_path / "public")

    assert measured.times == 2 * ladders
    assert run_times(report) and red(report) == {}
    for finding in run_times(report):
        assert finding.verdict.word == "same"
        assert "timed again at once: -23.1 %, the lesser counts" in finding.verdict.sentence


def test_a_slow_engine_is_red_and_both_measurements_are_kept(
    measured: ScriptedNight, history: str, tmp_path: Path
) -> None:
    measured.factors = [1.3]
    report = night(history, tmp_path / "public")

    sentences = red(report)
    assert sentences.keys() == {finding.series for finding in run_times(report)} != set()
    assert all("timed again at once: +0.0 %" in sentence for sentence in sentences.values())
    with History.open(history) as stored:
        kept = stored.document(report.document.id)
    assert kept == report.document
    timings = [sample.timing for sample in kept.samples if sample.timing is not None]
    assert timings and all(timing.again is not None for timing in timings)


def test_a_night_that_seems_as_fast_as_ever_is_timed_once(
    measured: ScriptedNight, history: str, tmp_path: Path
) -> None:
    measured.factors = [1.0]
    report = night(history, tmp_path / "public")

    assert measured.times == len(set(toy().ladders))
    assert red(report) == {}
    assert all(s.timing is None or s.timing.again is None for s in report.document.samples)


def toy() -> Any:
    from toy_timed import CATALOGUE

    return CATALOGUE["falling_object"]


def test_the_measurement_that_was_disturbed_less_counts() -> None:
    first = Timing(seconds=(3.0, 4.0), runs_per_repeat=1, cpu_seconds=(2.0, 2.5), calibration=(1.0, 1.1))
    again = Again(seconds=(2.5,), cpu_seconds=(2.4,), calibration=(2.0,))  # a machine of half the speed
    both = replace(first, again=again)

    assert that_counts(first) is first
    assert that_counts(both) is again
    assert that_counts(replace(both, again=replace(again, calibration=(1.0,)))).cpu_seconds == (2.0, 2.5)
    assert ladder_timing([both, both]).again == replace(again, calibration=(2.0, 2.0))
    assert ladder_timing([both, first]).again is None  # means over other rungs say nothing


def test_a_comparison_counts_the_lesser_time_too(measured: ScriptedNight) -> None:
    before = library.run(**THRICE)
    measured.times, measured.factors = 0, [1.3]
    slow = library.run(**THRICE)
    measured.times, measured.factors = 0, [1.0]
    again = library.time_again(slow, ["falling_object"], **THRICE)

    def words(after: RunDocument) -> set[str]:
        sides = [
            {sample.series: (definition, sample) for definition in run.series for sample in run.samples
             if sample.series == definition.key}
            for run in (before, after)
        ]  # fmt: skip
        return {change.word for change in compare_ladders.run_times(*sides)}

    assert "regressed" in words(slow)
    assert words(again) == {"same"}


def night_of(timing: Timing) -> Any:
    return SimpleNamespace(sample=SimpleNamespace(timing=timing))


def test_whether_the_machine_was_quiet_is_asked_of_the_time_that_counts() -> None:
    loud = Timing(seconds=(3.0,), runs_per_repeat=1, cpu_seconds=(2.0,), calibration=(1.0, 2.0))
    quiet = Again(seconds=(1.0,), cpu_seconds=(1.0,), calibration=(1.0, 1.0))

    assert "not quiet" in unquiet(night_of(loud))
    assert unquiet(night_of(replace(loud, again=quiet))) == ""


def test_what_was_timed_again_is_written_once(measured: ScriptedNight, tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'tracker.db'}"
    first = library.run(**ASKED)
    library.record(first, url)
    once = library.time_again(first, ["falling_object"], **ASKED)
    measured.factors = [2.0]
    twice = library.time_again(first, ["falling_object"], **ASKED)
    with session_on(url) as session:
        add_again(session, once)
        add_again(session, twice)
    with History.open(url) as stored:
        assert stored.document(first.id) == once != twice
