"""Every row of the verdict table, on values."""

from __future__ import annotations

import math

import pytest

from spook_tracker.tracker.document.json_form import NAN, Number
from spook_tracker.tracker.document.run_document import MapData, Sample
from spook_tracker.tracker.judge.verdict import RANK, Verdict, judge, judge_map, ulp_distance
from tests.histories.documents import gate, stability_map


def sample(value: float, outcome: str = "value", held: bool = True, state: str = "") -> Sample:
    if outcome == "value" and not math.isfinite(value):
        outcome = "not_finite"
    return Sample(
        series="t/c/m",
        value=Number(value),
        outcome=outcome,
        passed=outcome == "value",
        set_point_held=held and outcome == "value",
        state_hash=state,
    )


def verdict(before: float, after: float, **facts) -> Verdict:
    definition = gate(**facts)

    def measured(value: float) -> Sample:
        inside = definition.limit is None or (
            value >= definition.limit if definition.better == "larger" else abs(value) <= definition.limit
        )
        return sample(value, "value" if inside or not math.isfinite(value) else "out_of_limit")

    return judge(definition, measured(before), measured(after))


def test_the_same_bits_are_identical():
    assert verdict(0.1, 0.1).word == "identical"
    assert verdict(math.nan, math.nan).word == "identical"
    assert not verdict(0.1, 0.1).red


def test_bits_that_differ_inside_the_tolerance_are_changed_with_their_distance():
    found = verdict(0.1, 0.1 + 3 * math.ulp(0.1), limit=1.0)

    assert (found.word, found.ulps, found.red) == ("changed", 3, False)
    assert "3 ULP" in found.sentence
    assert verdict(1.0, 1.04, tolerance=0.05).word == "changed"


def test_growth_past_the_tolerance_is_regressed():
    found = verdict(1.0, 1.06, tolerance=0.05)

    assert (found.word, found.red) == ("regressed", True)
    assert math.isclose(found.decades, math.log10(1.06))


def test_crossing_the_limit_is_regressed_however_small_the_step():
    found = verdict(0.999_999_999_9, 1.000_000_000_1, limit=1.0, tolerance=0.1)

    assert (found.word, found.name) == ("regressed", "limit crossed")
    assert verdict(1.000_000_000_1, 0.999_999_999_9, limit=1.0, tolerance=0.1).word == "fixed"


def test_a_smaller_error_is_improved():
    assert verdict(2e-3, 1e-3).word == "improved"


def test_an_error_that_changed_sign_only_is_the_same():
    assert verdict(-1e-3, 1e-3).word == "same"
    assert verdict(-1e-3, 1e-3, limit=4e-3).word == "same"


@pytest.mark.parametrize("limit", [None, 4e-3, 1e-2, 1.0])
@pytest.mark.parametrize(("before", "after"), [(-1e-3, -2e-3), (1e-3, -2e-3), (0.0, 1e-3), (0.0, -1e-3)])
def test_a_doubled_negative_error_and_a_lost_exact_zero_are_regressed(before, after, limit):
    assert verdict(before, after, limit=limit).word == "regressed"


@pytest.mark.parametrize("limit", [None, 10.0])
def test_a_halved_value_is_regressed_where_larger_is_better(limit):
    assert verdict(100.0, 50.0, better="larger", limit=limit).word == "regressed"
    assert verdict(50.0, 100.0, better="larger", limit=limit).word == "improved"
    assert verdict(100.0, 50.0, better="smaller", unit="s").word == "improved"


def test_a_gain_is_as_bad_as_a_loss_where_a_reference_says_what_is_right():
    """Energy, % of what it was, nothing to be lost: 1.7 % to 40 % gained is worse, whatever the limit on losses."""
    gain = verdict(1.7, 40.0, better="larger", limit=-0.205, reference=0.0)

    assert gain.word == "regressed" and "by 1.4 decades" in gain.sentence
    assert verdict(40.0, -0.1, better="larger", limit=-0.205, reference=0.0).word == "improved"
    assert verdict(9.0, 8.0, better="smaller", reference=10.0).word == "regressed"


def test_six_decades_worse_far_inside_the_limit_is_changed():
    found = verdict(1e-15, 1e-9, limit=1e-6)

    assert (found.word, found.red) == ("changed", False)
    assert abs(found.decades - 6.0) < 1e-12
    assert found.sentence == "worse by 6.0 decades, far inside the limit"
    assert verdict(1e-15, 1e-8, limit=1e-6).word == "regressed"


def test_rounding_without_a_limit_is_no_regression():
    assert verdict(1e-16, 4e-16).word == "changed"
    assert verdict(0.0, 2e-16).word == "changed"


@pytest.mark.parametrize("broken", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_the_worst_value_at_once(broken):
    assert verdict(1e-3, broken, limit=1.0).word == "regressed"
    assert verdict(1e-3, broken).name == "not finite"
    assert verdict(broken, 1e-3, limit=1.0).word == "fixed"


def test_a_document_that_calls_nan_a_value_is_not_believed():
    lying = Sample(series="t/c/m", value=NAN, outcome="value", passed=True, set_point_held=True)

    assert judge(gate(limit=1.0), sample(0.1), lying).name == "not finite"


def test_every_worse_class_is_regressed_and_every_better_one_is_not():
    for old in RANK:
        for new in RANK:
            found = judge(gate(), sample(1.0, old), sample(1.0, new))
            assert found.red == (RANK[new] > RANK[old]), (old, new)


def test_leaving_the_set_point_is_regressed_inside_the_limit():
    definition = gate(limit=1.0, set_point=(0.4, 0.5))

    assert judge(definition, sample(0.45), sample(0.3, held=False)).name == "set point left"
    assert judge(definition, sample(0.3, held=False), sample(0.45)).word == "fixed"


def test_inside_a_band_the_reference_says_what_is_worse():
    assert verdict(0.50001, 0.50005, better="inside", reference=0.5).word == "regressed"
    assert verdict(0.3, 0.4, better="inside").word == "changed"


def test_the_same_commit_with_two_values_is_non_deterministic():
    found = judge(gate(limit=1.0), sample(0.1), sample(0.1 + math.ulp(0.1)), same_commit=True)
    by_state = judge(gate(limit=1.0), sample(0.1, state="a"), sample(0.1, state="b"), same_commit=True)

    assert (found.word, found.red) == ("non_deterministic", True)
    assert by_state.word == "non_deterministic"
    assert judge(gate(), sample(0.1, state="a"), sample(0.1, state="b")).word == "changed"


@pytest.mark.parametrize("broken", ["same_definition", "same_environment"])
def test_another_definition_or_float_environment_is_not_comparable_and_never_red(broken):
    found = judge(gate(), sample(1e-3), sample(math.nan), **{broken: False})

    assert (found.word, found.red) == ("not_comparable", False)


def test_ulps_count_the_doubles_between():
    assert ulp_distance(1.0, math.nextafter(1.0, 2.0)) == 1
    assert ulp_distance(-5e-324, 5e-324) == 2
    assert ulp_distance(0.0, -0.0) == 0
    assert ulp_distance(1.0, math.nan) is None


def cells(*rows: tuple[str, ...], x=(1.0, 2.0)) -> MapData:
    return stability_map(x=x, y=tuple(float(i) for i in range(len(rows))), cells=rows)


def test_a_cell_that_moves_for_the_worse_is_a_regression_with_its_place():
    found = judge_map(cells(("settled", "bounded")), cells(("settled", "diverged")))

    assert (found.word, found.name) == ("regressed", "less stable")
    assert "x = 2, y = 0: bounded became diverged" in found.sentence
    assert judge_map(cells(("settled", "growing")), cells(("settled", "settled"))).word == "improved"
    assert judge_map(cells(("settled", "growing")), cells(("settled", "growing"))).word == "identical"
    assert (
        judge_map(cells(("settled", "growing")), cells(("settled", "x"), x=(1.0, 3.0))).word
        == "not_comparable"
    )
