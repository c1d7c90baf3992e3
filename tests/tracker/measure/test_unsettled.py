"""An answer that no settled solve stands behind is a class of its own, from the solver to the page.

Fifty sweeps do not carry the load of two hundred boxes. The value is kept, it does not pass, and the run, the
database, the judge and the pages name the body, the step and the residual.
"""

from __future__ import annotations

import math
import re

import msgspec
import pytest
from click import unstyle

from spook_tracker.tracker import library
from spook_tracker.tracker.cli.report_table import failures, pairs, pass_table
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.judge.standing import count
from spook_tracker.tracker.measure.run import Questions, Request, run
from spook_tracker.tracker.store.history import History
from tests.places import TOYS

SOURCE = Questions(catalogue="toy_unsettled:CATALOGUE", engine="spook_tracker.engine")
SAID = re.compile(
    r"unsettled since step \d+: body 'box \d+' has sunk into another by a fiftieth of the smaller one's"
)
WIDE = "stack/asked/wide/h=0.0166667"
TIGHT, FOLLOWED = WIDE.replace("wide", "tight"), WIDE.replace("wide", "followed")


@pytest.fixture(scope="module")
def nights() -> tuple[RunDocument, RunDocument]:
    """One night solved directly, and the next by sweeps."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(TOYS))
        good = run(SOURCE, Request(workers=0, sweep=True, stability=True, repeats=2))
        patch.setenv("TOY_SOLVER", "iterative")
        bad = run(SOURCE, Request(workers=0))
    engine = msgspec.structs.replace
    return (
        engine(good, engine=engine(good.engine, git_hash="a" * 40, dirty=False, parents=())),
        engine(bad, engine=engine(bad.engine, git_hash="b" * 40, dirty=False, parents=("a" * 40,))),
    )


def by_key(document: RunDocument):
    return {sample.series: sample for sample in document.samples}


def test_the_value_is_kept_with_body_step_and_residual_and_does_not_pass(nights):
    good, bad = map(by_key, nights)

    assert good[WIDE].outcome == "value" and good[WIDE].passed
    for key in (WIDE, FOLLOWED):
        assert (bad[key].outcome, bad[key].passed) == ("unsettled", False)
        assert math.isfinite(bad[key].value)
        assert SAID.match(bad[key].failure)
    assert bad[WIDE].set_point_held


def test_out_of_limit_is_worse_and_still_says_what_was_unsettled(nights):
    _, bad = map(by_key, nights)

    assert bad[TIGHT].outcome == "out_of_limit"
    assert SAID.match(bad[TIGHT].failure)


def test_a_rung_is_unsettled_and_reaches_no_error_but_a_break_point_is_a_value(nights):
    """A study looks for where sweeps end; that some of its trials did not settle is its answer."""
    good = by_key(nights[0])

    swept = good["stack/fifty sweeps/ladder:top/h=0.0166667"]
    assert swept.outcome == "unsettled" and swept.timing is None and SAID.match(swept.failure)
    assert good["stack/direct/ladder:top/h=0.0166667"].outcome == "value"
    assert good["stack/fifty sweeps/ladder:top:time-to-error"].value == math.inf
    point = good["stack/plain/stability:tallest"]
    assert point.outcome == "value" and 2 <= point.value < 200


def test_the_table_shows_value_and_class_and_counts_no_kept_limit(nights):
    bad = nights[1]

    assert " m unsettled" in unstyle(pass_table(bad))
    assert any(line.startswith(f"{WIDE}: unsettled: unsettled since step") for line in failures(bad))
    assert (count(pairs(bad)).limits, count(pairs(bad)).broken) == (2, 2)


def test_database_judge_and_pages_tell_it(nights, url, tmp_path):
    for document in nights:
        assert library.record(document, url)
    with History.open(url) as history:
        stored = history.document(nights[1].id)
        compared = library.compare(history, nights[0].id, nights[1].id)
        findings = library.judge_run(history, nights[1].id)
        library.publish(history, tmp_path / "public")

    assert by_key(stored) == by_key(nights[1])
    change = next(c for c in compared.changes if c.series == WIDE)
    assert (change.word, change.before_outcome, change.after_outcome) == ("regressed", "value", "unsettled")
    assert "value became unsettled: unsettled since step" in change.sentence
    finding = next(f for f in findings if f.series == WIDE)
    assert finding.red and finding.verdict.name == "unsettled"
    page = next((tmp_path / "public").rglob("stack.html")).read_text()
    assert "unsettled since step" in page
