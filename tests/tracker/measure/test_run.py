"""A run asks everything, survives everything, and writes down exactly what it saw."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from spook_tracker.tracker.document.json_form import decode, encode
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.measure import ladder as ladders
from spook_tracker.tracker.measure.question import NoAnswer
from spook_tracker.tracker.measure.run import Questions, Request, RunError, ci_address, run

SOURCE = Questions(catalogue="toy_questions:CATALOGUE", engine="toy_engine")


pytestmark = pytest.mark.usefixtures("toys")


def alone(**options) -> RunDocument:
    return run(SOURCE, Request(workers=0, **options))


def by_key(document: RunDocument):
    return {sample.series: sample for sample in document.samples}


def test_a_run_carries_value_counters_hash_and_verdict_of_the_night():
    document = alone()
    sample = by_key(document)["fall/plain/position_error/h=0.01"]

    assert abs(sample.value + 0.05) < 1e-12  # ½ g t h below the exact place
    assert (sample.outcome, sample.passed, sample.set_point_held) == ("value", True, True)
    assert sample.counters == {"steps": 100}
    assert len(sample.state_hash) == 16
    assert [card.name for card in document.tests] == ["fall", "stand"]
    assert [(s.stage, s.kept) for s in document.tests[0].stages] == [
        ("apply_gravity", True),
        ("collision", False),
    ]
    assert document.engine.name == "toy"


def test_a_second_run_gives_the_same_values_bit_for_bit():
    first, second = alone(), run(SOURCE, Request(workers=2))

    assert by_key(first) == by_key(second)
    assert first.series == second.series
    assert first.id != second.id


def test_a_document_survives_its_way_through_json():
    document = alone(figures=True, sweep=True, stability=True, repeats=2)

    assert decode(encode(document), RunDocument) == document


@pytest.mark.parametrize(
    ("fault", "outcome", "sentence"),
    [
        ("diverge", "diverged", "body 'ball' left the finite numbers at step 7"),
        ("nan", "not_finite", "the value is nan"),
        ("raise", "crashed", "ValueError: the toy refuses"),
    ],
)
def test_whatever_fails_is_a_sample_of_its_class_and_never_passes(monkeypatch, fault, outcome, sentence):
    monkeypatch.setenv("TOY_FAULT", fault)
    samples = by_key(alone())

    assert len(samples) == 3
    for sample in samples.values():
        assert (sample.outcome, sample.passed, sample.set_point_held) == (outcome, False, False)
        assert sample.failure == sentence
        assert math.isnan(sample.value)


def test_native_code_that_dies_loses_its_own_answers_only(monkeypatch):
    monkeypatch.setenv("TOY_FAULT", "die")
    document = run(SOURCE, Request(workers=2, tests=("stand",)))

    (sample,) = document.samples
    assert (sample.outcome, sample.failure) == ("crashed", "the engine's process died while answering")


def test_whatever_hangs_is_timed_out_and_everything_else_is_answered(monkeypatch):
    """Measurement, figure, ladder, study: each loses its own answer, and none changes its definition."""
    asked = {"figures": True, "sweep": True, "stability": True, "repeats": 1}
    healthy = alone(**asked)
    monkeypatch.setenv("TOY_FAULT", "hang")
    document = run(SOURCE, Request(workers=4, time_limit=0.3, **asked))

    samples = by_key(document)
    read_off = {key: s for key, s in samples.items() if "/ladder:" in key and "/h=" not in key}
    assert {s.outcome for key, s in samples.items() if key not in read_off} == {"timed_out"}
    said = {key.rpartition(":")[2]: (s.outcome, s.value, s.failure) for key, s in read_off.items()}
    assert said["time-to-error"] == ("not_finite", math.inf, "no step reaches 0.1 m")
    assert said["error-in-time"] == ("not_finite", math.inf, "every step takes longer than 1 s")
    assert said["order"][::2] == ("missing", "fewer than three usable points in the asymptotic range")
    assert math.isnan(said["order"][1])
    assert len(said) == 3
    assert not any(s.passed for s in samples.values())
    expected = {s.key for s in healthy.series if "/ladder:" in s.key and "/h=" not in s.key}
    assert read_off.keys() == expected, "no scalar of a ladder is lost"
    assert samples["fall/plain/position_error/h=0.01"].failure.startswith("no answer within 0.3 s")
    assert document.figures[0].note.startswith("could not be drawn: no answer within")
    versions = {s.key: s.test_version for s in healthy.series}
    assert all(s.test_version == versions[s.key] for s in document.series if s.key in versions)


def test_out_of_limit_keeps_its_value(monkeypatch):
    monkeypatch.setenv("TOY_ERROR", "-0.5")
    sample = by_key(alone())["fall/plain/position_error/h=0.01"]

    assert (sample.outcome, sample.passed, sample.set_point_held) == ("out_of_limit", False, False)
    assert abs(sample.value + 0.55) < 1e-12


def test_an_unknown_test_is_refused_with_its_neighbour():
    with pytest.raises(RunError, match="no test named 'fal'; did you mean fall"):
        alone(tests=("fal",))


def test_figures_maps_and_break_points_come_when_asked():
    document = alone(tests=("fall",), figures=True, stability=True)
    (figure,), (cells,) = document.figures, document.maps
    point = by_key(document)["fall/plain/stability:largest-step"]

    assert figure.curves[0].x == (0.1, 0.01)
    assert cells.cells == (("settled", "bounded"),)
    assert abs(point.value - 1.5) < 1e-12
    assert point.counters == {"evaluations": 8, "steps": 10}
    assert not alone(tests=("fall",)).figures


def test_the_ladder_gives_errors_timings_order_and_time_at_equal_error():
    document = alone(tests=("fall",), sweep=True, repeats=3)
    samples = by_key(document)
    rung = samples["fall/plain/ladder:end-error/h=0.05"]

    assert abs(rung.value + 0.25) < 1e-12
    assert len(rung.timing.seconds) >= 2
    assert min(rung.timing.seconds) > 0.0
    assert rung.timing.stage_seconds == {"apply_gravity": 1e-6}
    assert abs(samples["fall/plain/ladder:end-error:order"].value - 1.0) < 1e-9
    assert 0.0 < samples["fall/plain/ladder:end-error:time-to-error"].value < 1.0
    assert abs(samples["fall/plain/ladder:end-error:error-in-time"].value - 0.0625) < 1e-12
    assert "fall/half-step/ladder:end-error:order" not in samples  # none is expected at rounding level


def test_a_failed_rung_is_a_point_of_its_own_class(monkeypatch):
    monkeypatch.setenv("TOY_FAULT", "diverge")
    samples = by_key(alone(tests=("fall",), sweep=True, repeats=2))

    assert samples["fall/plain/ladder:end-error/h=0.05"].outcome == "diverged"
    assert samples["fall/plain/ladder:end-error/h=0.05"].timing is None
    assert samples["fall/plain/ladder:end-error:order"].outcome == "missing"
    assert samples["fall/plain/ladder:end-error:time-to-error"].value == math.inf


def test_rungs_finer_than_one_that_ran_out_of_time_are_not_tried_and_say_so():
    from toy_questions import CATALOGUE

    ladder, asked = CATALOGUE["fall"].ladders[0], []
    slow = ladder.time_steps[1]

    def out_of_time_from_the_second_on(simulate, h, method):
        asked.append(h)
        if h <= slow:
            raise NoAnswer("timed_out", "2 s were over")
        return 0.5

    points = ladders.error_points(
        replace(ladder, error=out_of_time_from_the_second_on), ladder.configurations[0], lambda: None
    ).points

    assert asked == list(ladder.time_steps[:2])
    assert [p.outcome for p in points] == ["value"] + ["timed_out"] * (len(points) - 1)
    assert points[1].failure == "2 s were over"
    assert points[2].failure.startswith(f"not tried: at {slow:g} s a step, with fewer steps")


def test_progress_names_every_test_once_it_is_finished():
    seen = []
    run(SOURCE, Request(workers=0), watch=seen.append)

    assert [(p.done, p.total) for p in seen] == [(0, 2), (1, 2), (2, 2)]  # the first: all is imported
    assert [p.test for p in seen if p.finished] == ["fall", "stand"]


@pytest.mark.parametrize("workers", [0, 1])
def test_progress_of_a_sweep_goes_to_its_end(workers):
    """Run times are work, too: it used to stop when only they were left."""
    seen = []
    run(SOURCE, Request(workers=workers, sweep=True, repeats=1), watch=seen.append)

    assert [p.done for p in seen] == list(range(seen[0].total + 1))
    assert {p.total for p in seen} == {seen[-1].done}
    assert [p.test for p in seen][-2:] == ["fall, run times", "stand, run times"]


def test_the_address_of_the_ci_log_is_kept():
    github = {"GITHUB_RUN_ID": "7", "GITHUB_SERVER_URL": "https://x", "GITHUB_REPOSITORY": "a/b"}

    assert ci_address(github) == "https://x/a/b/actions/runs/7"
    assert ci_address({}) == ""
