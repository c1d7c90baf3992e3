"""Every scalar test is complete: it asks one question, says in which units, and from what its limits are."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from dataclasses import replace
from typing import Any

import pytest
from click import unstyle

from spook_tracker.engine import PLAIN, Method, explain, protocol
from spook_tracker.scalar_tests.case import Configuration, Metric, ScalarTest
from spook_tracker.scalar_tests.catalogue import CATALOGUE, TOPICS
from spook_tracker.tracker.cli.report_catalogue import catalogue_table
from spook_tracker.tracker.document.run_document import keeps_limit
from spook_tracker.tracker.measure.others import asked_of
from tests.places import ROOT

PRINTED = {  # thesis, section 4.2: limit and unit of the seven continuous tests
    "beam": (4.9e-9, "%"),
    "door": (0.02, "%"),
    "falling_object": (4.904, "m"),
    "friction": ((0.5 - 1e-4, 0.5 + 1e-4), "1"),
    "pendulum": (0.004, "%"),
    "n_pendulum": (16.0, "%"),
    "planetarium": (2.37, "%"),
}
every_test = pytest.mark.parametrize(("name", "test"), CATALOGUE.items(), ids=list(CATALOGUE))


def metrics(test: ScalarTest) -> list[Metric]:
    return [metric for _, metric in test.metrics()]


def test_every_test_is_listed_once_under_its_topic_and_in_that_order() -> None:
    """The topics are those of a reader, the thesis first; nothing else says an order."""
    names = [name for tests in TOPICS.values() for name in tests]

    assert next(iter(TOPICS)) == "thesis" and len(TOPICS) == 12
    assert all(TOPICS.values()) and len(names) == len(set(names))
    assert names == list(CATALOGUE)
    rows = [
        line.split("  ") for line in unstyle(catalogue_table(CATALOGUE)).splitlines() if line[:1].islower()
    ]
    listed = [(row[0], next(cell.strip() for cell in row[1:] if cell)) for row in rows[1:]]
    assert listed == [(name, topic) for topic, tests in TOPICS.items() for name in tests]
    assert "topic" not in catalogue_table({"of_a_team": replace(CATALOGUE["door"], topic="")})


@every_test
def test_it_asks_one_question_and_says_all_a_reader_needs(name: str, test: ScalarTest) -> None:
    assert test.question.endswith("?") and test.question.count("?") == 1
    for text in (test.title, test.why, test.model, test.reference, test.conclusion, test.source):
        assert text.strip()
    assert test.theory and all(test.theory)
    assert any(label == "time step" for label, _ in test.parameters)
    assert all(label and value for label, value in test.parameters)


@every_test
def test_every_metric_has_unit_description_and_source(name: str, test: ScalarTest) -> None:
    assert test.measurements
    for metric in metrics(test):
        assert metric.description and metric.unit, metric.name
        assert (metric.limit is None) == (metric.role == "reported"), metric.name
        assert metric.limit is None or metric.limit_source, metric.name
        assert metric.set_point is None or metric.set_point_source, metric.name


@every_test
def test_at_least_one_gate_decides(name: str, test: ScalarTest) -> None:
    assert any(metric.role == "gate" for metric in metrics(test))


@every_test
def test_set_points_lie_inside_their_limits(name: str, test: ScalarTest) -> None:
    for metric in metrics(test):
        if metric.set_point is not None:
            low, high = metric.set_point
            assert low <= high
            assert metric.passes(low) and metric.passes(high), metric.name


@every_test
def test_no_limit_accepts_what_is_not_a_number(name: str, test: ScalarTest) -> None:
    for metric in metrics(test):
        assert not any(metric.passes(value) for value in (math.nan, math.inf, -math.inf)), metric.name


@every_test
def test_a_limit_is_kept_or_not_alike_where_it_is_measured_and_where_it_is_read(
    name: str, test: ScalarTest
) -> None:
    for metric in metrics(test):
        ends = metric.limit if isinstance(metric.limit, tuple) else (metric.limit or 0.0,)
        for end in (*ends, math.nan, math.inf):
            for value in (end, -end, *(math.nextafter(s * end, way) for s in (1, -1) for way in (-9e9, 9e9))):
                assert keeps_limit(value, metric.limit, metric.better) == metric.passes(value), metric.name


@every_test
def test_every_series_has_a_name_of_its_own(name: str, test: ScalarTest) -> None:
    keys = [
        (m.configuration, m.time_step, tuple(sorted(m.parameters.items())), metric.name)
        for m, metric in test.metrics()
    ]

    assert len(set(keys)) == len(keys)
    assert len({figure.name for figure in test.figures}) == len(test.figures)
    assert len({ladder.name for ladder in test.ladders}) == len(test.ladders)
    assert len({study.name for study in test.stability}) == len(test.stability)


@every_test
def test_ladders_run_from_coarse_to_fine_and_say_what_they_expect(name: str, test: ScalarTest) -> None:
    for ladder in test.ladders:
        for steps in (ladder.time_steps, *map(ladder.steps_of, ladder.configurations)):
            assert list(steps) == sorted(steps, reverse=True)
        assert len({configuration.name for configuration in ladder.configurations}) == len(
            ladder.configurations
        )
        for configuration in ladder.configurations:
            if configuration.order_range is not None:
                low, high = configuration.order_range
                steps = ladder.steps_of(configuration)
                inside = [h for h in steps if low * (1 - 1e-9) <= h <= high * (1 + 1e-9)]
                assert len(inside) >= 3, (ladder.name, configuration.name)


@every_test
def test_its_example_compiles_and_every_stage_has_a_reason(name: str, test: ScalarTest) -> None:
    example = test.example()

    choices = explain(
        example.scene, time_step=example.time_step, method=example.method, observe=example.observe
    )

    assert all(choice.reason for choice in choices)
    assert any(choice.kept for choice in choices)


def test_the_seven_stand_first_with_the_limits_as_printed() -> None:
    seven = {name: test for name, test in CATALOGUE.items() if test.seven}

    assert set(seven) <= set(PRINTED)
    for name, test in seven.items():
        gates = [(m, metric) for m, metric in test.metrics() if metric.role == "gate"]
        assert all(m.time_step == 1.0 / 60.0 for m, _ in gates)
        assert all((metric.limit, metric.unit) == PRINTED[name] for _, metric in gates)
        assert all("section 4.2" in metric.limit_source for _, metric in gates)
    assert all(
        metric.set_point for test in seven.values() for _, metric in test.metrics() if metric.role == "gate"
    )
    assert len(seven) == 7
    flags = [test.seven for test in CATALOGUE.values()]
    assert flags == sorted(flags, reverse=True)


def test_a_falling_object_needs_gravity_and_positions_only() -> None:
    example = CATALOGUE["falling_object"].example()

    choices = explain(example.scene, time_step=example.time_step, observe=example.observe)

    assert [choice.stage for choice in choices if choice.kept] == ["apply_gravity", "integrate_positions"]


def test_every_figure_of_the_thesis_with_data_is_redrawn() -> None:
    """Chapters 2 and 3: all figures but the sketches of models and the flow charts."""
    wanted = {
        *(f"2.{n}" for n in (4, 5, 6, 7, 8)),
        *(f"3.{n}" for n in (2, 3, 4, 5, 7, 8, 9, 10, 11, 12, 13, 16, 17, 18, 20, 21, 22, 23, 24)),
        *(f"3.{n}" for n in (26, 27, 28, 29, 30, 32, 33, 34, 35, 37)),
    }
    drawn = {
        figure.thesis.removeprefix("Fig ").split(",")[0]
        for test in CATALOGUE.values()
        for figure in test.figures
        if figure.thesis
    }

    assert drawn == wanted


@every_test
def test_what_is_asked_does_not_depend_on_our_configurations(name: str, test: ScalarTest) -> None:
    """Each quantity once for every time step and parameters; nothing of ours but the printed limit is in it."""
    questions = test.questions()
    asked = [
        (question.time_step, *sorted(question.parameters.items()), quantity.name)
        for question in questions
        for quantity in question.quantities
    ]
    places = {
        (measurement.time_step, *sorted(measurement.parameters.items()), metric.name)
        for measurement, metric in test.metrics()
    }

    assert len(asked) == len(set(asked))
    assert set(asked) == places
    assert all(
        quantity.limit is None or quantity.limit_source for q in questions for quantity in q.quantities
    )


def test_the_pendulum_is_asked_once_with_the_printed_limit_and_without_our_set_points() -> None:
    (question,) = CATALOGUE["pendulum"].questions()
    limits = {quantity.name: quantity.limit for quantity in question.quantities}

    assert limits == {
        "length_deviation": 0.004,
        "energy_deviation": None,
        "energy_at_the_end": None,
        "tension_at_the_bottom": None,
        "period_error": None,
    }


def test_printed_limits_are_for_every_engine() -> None:
    gates = [
        metric
        for test in CATALOGUE.values()
        if test.seven
        for _, metric in test.metrics()
        if metric.role == "gate"
    ]

    assert len(gates) >= 7
    assert all(metric.limit_kind == "physical" for metric in gates)


def test_a_command_that_measures_imports_no_engine_itself() -> None:
    """What measures does, in a process of its own: to import it takes a quarter of the command."""
    program = (
        "import sys; from spook_tracker.tracker.cli.main import main; main(['run', 'no_such_test', '--no-record'], "
        "standalone_mode=False)"
    )
    seen = "print(*({'numpy', 'spook_tracker.engine', 'spook_tracker.scalar_tests'} & set(sys.modules)))"
    told = f"import atexit, sys; atexit.register(lambda: {seen}); {program}"

    shown = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=False)

    assert "there is no test named 'no_such_test'" in shown.stderr
    assert shown.stdout.split() == []


def test_to_ask_one_test_imports_no_other() -> None:
    program = (
        "import sys; from spook_tracker.tracker.measure.run import Questions, select; "
        "select(Questions().tests(), ('falling_object',)); "
        "print(*(name for name in sys.modules if name == 'scipy' or '.multibody' in name))"
    )
    shown = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)

    assert shown.stdout.split() == []


def test_other_engines_are_asked_every_time_step_that_any_of_our_settings_takes() -> None:
    """Else our coarse compositions would race against none."""
    coarse = Configuration(name="coarse", method=PLAIN, expected_order=None, time_steps=(1.0, 0.5))
    ladder = replace(CATALOGUE["pendulum"].ladders[0], time_steps=(0.5, 0.25))
    ladder = replace(ladder, configurations=(*ladder.configurations, coarse))
    asked = asked_of(
        {"pendulum": replace(CATALOGUE["pendulum"], ladders=(ladder,))},
        (protocol.Configuration(name="theirs", reason=""),),
        False,
    )

    assert ladder.steps_of(coarse) == (1.0, 0.5)
    assert ladder.steps_of(ladder.configurations[0]) == (0.5, 0.25)
    assert all(theirs.time_steps == (1.0, 0.5, 0.25) for theirs in asked["pendulum"].ladders)


ASLEEP = "sleeping"  # the configuration that asks what sleeping itself does


def test_no_body_sleeps_while_another_question_is_asked() -> None:
    """What is asleep is out of the steps: neither answers nor run times would be those of the solver that is asked."""
    awake = Method().sleep_speed
    methods = [
        configuration.method
        for test in CATALOGUE.values()
        for ladder in test.ladders
        for configuration in ladder.configurations
    ]
    methods += [test.example().method for test in CATALOGUE.values()]

    assert awake == PLAIN.sleep_speed == 0.0
    assert {method.sleep_speed for method in methods} == {awake}
    for room in ("scalar_tests", "tracker/measure"):  # those that are made where a question is asked
        for file in sorted((ROOT / room).rglob("*.py")):
            text = file.read_text()
            assert not re.search(r"\bsleep_(speed|after)\b", text) or f'"{ASLEEP}"' in text, file


@pytest.mark.parametrize("name", CATALOGUE)
def test_no_first_run_of_a_question_has_sleepers(name: str) -> None:
    """As the engine is asked, and not as the file reads."""

    class Asked(Exception):
        pass

    def listen(scene: Any, *, method: Method = PLAIN, **options: Any) -> Any:
        raise Asked(method.sleep_speed)

    for measurement in CATALOGUE[name].measurements:
        with pytest.raises(Asked) as asked:
            measurement.measure(listen)
        assert (asked.value.args == (0.0,)) == (measurement.configuration != ASLEEP)
