"""Engines that are wrong on purpose: each still has its place in the sources and a test that is named for it."""

from __future__ import annotations

import datetime
import re
from collections import Counter

import pytest
import yaml

from bench import mutants
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from tests.places import ROOT

ROOMS = {
    "particles", "linear", "strings", "composition", "recorder", "rotation", "joints", "loads", "collision",
    "contacts", "friction", "tracker",
}  # fmt: skip


@pytest.mark.parametrize("mutant", mutants.MUTANTS, ids=lambda mutant: mutant.name)
def test_a_mutant_has_one_place_in_the_sources_and_a_test_that_is_named_for_it(
    mutant: mutants.Mutant,
) -> None:
    for file, old, new in mutant.changes:
        assert (ROOT / file).read_text(encoding="utf-8").count(old) == 1, (
            "bring bench/mutant_list.py up to date"
        )
        assert old != new
    if mutant.of_the_suite:
        file, _, name = mutant.caught_by.partition("::")
        text = (ROOT / file).read_text(encoding="utf-8")
        if file.endswith(".cpp"):
            assert len(mutants.lines_of(ROOT / file, name)) > 3
            assert f"    {name}();" in text
        else:
            assert f"def {name}(" in text
    else:
        assert mutant.caught_by in CATALOGUE


def test_every_room_has_a_mutant_and_no_two_have_one_name() -> None:
    assert {mutant.room for mutant in mutants.MUTANTS} == ROOMS
    assert max(Counter(mutant.name for mutant in mutants.MUTANTS).values()) == 1
    assert len(mutants.MUTANTS) >= 24


def test_a_few_each_night_are_all_of_them_in_time() -> None:
    first = datetime.date(2026, 11, 22)
    nights = -(-len(mutants.MUTANTS) // 4) + 1
    assert nights <= 14, "a fortnight, as the Makefile says"
    seen = {m.name for n in range(nights) for m in mutants.tonights(4, first + datetime.timedelta(days=n))}

    assert len(mutants.tonights(4, first)) == 4
    assert seen == {mutant.name for mutant in mutants.MUTANTS}


def test_every_night_puts_some_of_them_to_the_tests_without_holding_up_the_night() -> None:
    jobs = yaml.safe_load((ROOT / ".github" / "workflows" / "nightly.yml").read_text())["jobs"]
    (makefile,) = re.findall(r"^mutants-tonight:.*\n\t(.*)$", (ROOT / "Makefile").read_text(), re.MULTILINE)

    assert "make mutants-tonight" in jobs["mutants"]["steps"][-1]["run"]
    assert makefile.endswith("bench/mutants.py --tonight 4")
    assert not any("mutants" in job.get("needs", ()) for job in jobs.values())


def test_the_command_reads_its_options(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Down to the commit that is looked for: the rest builds engines."""
    monkeypatch.setattr("sys.argv", ["mutants.py", "sticky", "--commit", "absent"])

    with pytest.raises(mutants.commits.CommitError, match="git knows no commit 'absent'"):
        mutants.main()
