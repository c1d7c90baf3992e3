"""The page of comparisons judges as the judge does: the same words, in Node, for ten thousand random pairs."""

import json
import math
import random
import shutil
import subprocess
from collections import Counter
from datetime import date

import pytest

from spook_tracker.tracker.document.json_form import boxed
from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.judge.compare import ComparedRun, Known, compare
from spook_tracker.tracker.judge.comparison_document import Side
from spook_tracker.tracker.website.comparisons import value_in_words, worst_first
from spook_tracker.tracker.website.judged_nights import Texts, accepted_fields, definition_fields
from tests.histories.synthetic import sample, series
from tests.places import ROOT

PAIRS = 10_000
ACCEPTED = (
    Accepted(series="t/plain/accepted*", low=-2.0, high=2.0, who="Ada", why="a better reference"),
    Accepted(series="t/plain/*", low=40.0, high=60.0, who="Bo", why="known", until=date(2025, 10, 3)),
    Accepted(
        series="t/plain/known*", low=math.inf, high=math.inf, who="Di", why="not mended yet", expected=True
    ),
    Accepted(series="t/*/gone*", low=math.inf, high=math.inf, who="Cy", why="removed", removed=True),
)
KINDS = ("scalar", "scalar", "ladder", "order", "time", "break_point", "work")


def some_value(rng):
    pick = rng.random()
    if pick < 0.08:
        return rng.choice([math.nan, math.inf, -math.inf])
    if pick < 0.16:
        return rng.choice([0.0, -0.0, 1.0, -1.0, 0.5, 50.0, 5e-324, -1e308, 2.5, 1000000.0, 0.125])
    return rng.choice([-1, 1]) * 10 ** rng.uniform(-16, 8)


def near(rng, value):
    """Another value, mostly a close one: equal, some last bits off, a tolerance off, a few decades off."""
    pick = rng.random()
    if pick < 0.15 or not math.isfinite(value):
        return value if rng.random() < 0.5 else some_value(rng)
    if pick < 0.45:
        for _ in range(rng.choice([1, 2, 3, 15, 16, 17, 40])):
            value = math.nextafter(value, rng.choice([math.inf, -math.inf]))
        return value
    if pick < 0.6:
        return value * (1.0 + rng.uniform(-1, 1) * 10 ** rng.uniform(-10, -1))
    if pick < 0.75:
        return -value
    return value * 10 ** rng.uniform(-5, 5)


def some_definition(rng, number):
    kind = rng.choice(KINDS)
    better = rng.choice(["smaller_magnitude", "larger", "smaller", "inside"])
    reference = rng.choice([None, 1.0, 10 ** rng.uniform(-3, 3)])
    limit = rng.choice(
        [None, 10 ** rng.uniform(-9, 4), tuple(sorted((rng.uniform(-2, 2), rng.uniform(-2, 2))))]
    )
    metric = rng.choice(["m", "accepted", "gone", "known", "ladder:x:time-to-error"]) + f"{number}"
    if metric.startswith("ladder"):
        metric = f"ladder{number}:time-to-error"
    return series(
        "t", metric, kind=kind, better=better, reference=reference, limit=limit,
        role=rng.choice(["gate", "companion", "reported"]), unit=rng.choice(["m", "1", "%", "s"]),
        set_point=rng.choice([None, None, (0.4999, 0.5001), (-1e-3, 2.5e-7)]), test_version=rng.choice("ab"),
        tolerance=rng.choice([0.0, 1e-6]), relative_tolerance=rng.choice([0.0, 1e-9, 1e-2]),
    )  # fmt: skip


def some_sample(rng, definition, value):
    changes = {"state_hash": rng.choice(["", "a", "b"]), "set_point_held": rng.random() < 0.6}
    if rng.random() < 0.15:
        outcome = rng.choice(
            [
                "not_finite",
                "diverged",
                "crashed",
                "timed_out",
                "missing",
                "not_supported",
                "out_of_limit",
                "unsettled",
                "value",
            ]
        )
        failure = rng.choice(["", "removed from the catalogue", "it flew away"])
        changes |= {"outcome": outcome, "failure": failure, "passed": rng.random() < 0.5}
    return sample(definition, value, **changes)


def some_side(rng, run):
    return Side(
        run=run, engine=rng.choice(["spook", "spook", "spook", "mujoco"]), version="1", dirty=rng.random() < 0.1,
        git_hash=rng.choice(["", "c1", "c2", "c3"]), started=f"2026-10-0{rng.randint(1, 6)}T03:00:00+00:00",
        machine=rng.choice(["m", "m", "n"]), float_environment=rng.choice(["f", "f", "f", "f", "g"]),
    )  # fmt: skip


def question(rng, number, texts):
    """One pair of nights with one series: what the page is given, and what the judge says."""
    old_definition = some_definition(rng, number)
    definition = old_definition
    if rng.random() < 0.1:
        definition = series(
            "t", old_definition.metric,
            **{n: getattr(old_definition, n) for n in ("kind", "better", "role", "reference", "set_point", "test_version")}
            | {"unit": rng.choice(["m", "kg"]), "limit": rng.choice([None, 3.0])},
        )  # fmt: skip
    value = some_value(rng)
    old = None if rng.random() < 0.06 else some_sample(rng, old_definition, value)
    now = None if old is not None and rng.random() < 0.06 else some_sample(rng, definition, near(rng, value))
    before, after = some_side(rng, "before"), some_side(rng, "after")
    asked = {rng.choice(["values", "sweep", "stability"]): {rng.choice(["t", "other"])}}
    whole, suspected = rng.random() < 0.5, rng.random() < 0.2
    usual = (10 ** rng.uniform(-6, 1), rng.choice([0.125, 0.05, rng.uniform(0.01, 0.5)]))
    usual = usual if rng.random() < 0.6 else None
    key = definition.key
    history = Known(
        usual={key: usual} if usual else {}, suspected=(key,) if suspected and usual else (),
        first_bad={key: ("good", "badc0de")} if now is not None else {},
    )  # fmt: skip
    document = compare(
        ComparedRun(side=before, samples={} if old is None else {key: (old_definition, old)}),
        ComparedRun(
            side=after, samples={} if now is None else {key: (definition, now)}, whole=whole, asked=asked
        ),
        ACCEPTED,
        history,
    )
    changes = [change for change in document.changes if change.kind != "run_time"]
    given = {
        "key": key,
        "old": None if old is None else texts.row(old_definition, old, usual),
        "now": None if now is None else texts.row(definition, now, None, suspected, "first bad commit badc0de"),
        "before": side(before, whole, asked), "after": side(after, whole, asked),
    }  # fmt: skip
    return given, changes[0] if changes else None


def side(told, whole, asked):
    return {
        "engine": told.engine, "commit": told.git_hash, "dirty": told.dirty, "machine": told.machine,
        "floats": told.float_environment, "day": told.started[:10], "whole": whole,
        "asked": {family: sorted(tests) for family, tests in asked.items()},
    }  # fmt: skip


@pytest.mark.skipif(shutil.which("node") is None, reason="no node here; .ci/install-system installs it")
def test_the_page_says_of_ten_thousand_pairs_what_the_judge_says():
    rng, texts = random.Random(20261122), Texts()
    asked = [question(rng, number, texts) for number in range(PAIRS)]
    definitions = [json.loads(text) for text in texts.definitions]
    fields = {"fields": list(definitions[0]), "definitions": [list(d.values()) for d in definitions]}
    block = {"texts": list(texts.texts), **fields}
    keys = [given["key"] for given, _ in asked]
    whole = {
        "block": block,
        "pairs": [given for given, _ in asked],
        "accepted": accepted_fields(ACCEPTED, keys),
    }
    scripts = [ROOT / "site" / "static" / name for name in ("judge.js", "compare-nights.js")]
    node = subprocess.run(
        ["node", ROOT / "tests" / "website" / "judge_in_node.js", *scripts],
        input=json.dumps(whole, allow_nan=False), capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip
    assert node.returncode == 0, node.stderr
    told, order = (json.loads(node.stdout)[name] for name in ("told", "sorted"))

    words = Counter()
    for (given, expected), found in zip(asked, told, strict=True):
        if expected is None or found is None:
            assert (expected, found) == (None, None), given
            continue
        words[expected.word] += 1
        wanted = {
            "word": expected.word, "red": expected.red, "stands": expected.stands, "name": expected.name,
            "sentence": expected.sentence, "ulps": None if expected.ulps is None else str(expected.ulps),
            "accepted": expected.accepted, "blame": f"first bad commit {expected.first_bad}" if expected.first_bad else "",
            "before": value_in_words(expected.before, expected.unit), "after": value_in_words(expected.after, expected.unit),
        }  # fmt: skip
        decades = (
            expected.decades if expected.decades is not None and math.isfinite(expected.decades) else None
        )
        assert {name: found[name] for name in wanted} == wanted, given
        assert (found["decades"] is None) == (decades is None)
        assert decades is None or found["decades"] == pytest.approx(decades, rel=1e-9, abs=1e-12)

    changes = [change for _, change in asked if change is not None]
    assert order == [change.series for change in worst_first(changes)]

    every = {
        "missing",
        "removed",
        "regressed",
        "non_deterministic",
        "accepted",
        "expected",
        "not_comparable",
        "fixed",
    }
    assert every | {"improved", "changed", "new", "not_measured", "same", "identical"} == set(words)
    assert min(words.values()) >= 10, words


def test_a_row_carries_every_bit():
    texts = Texts()
    definition = series("t", "m", limit=1.0, role="gate")
    for value in (5e-324, -0.0, 0.1 + 0.2, math.nan, -math.inf, 1e308):
        row = json.loads(json.dumps(texts.row(definition, sample(definition, value)), allow_nan=False))
        assert row[1] == boxed(value) and math.copysign(1, float(row[1])) == math.copysign(1, value)
    assert definition_fields(definition)["said"]["limit"] == "1.0"
