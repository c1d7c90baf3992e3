"""The page of models: what changed, what only rounded, what stayed to the bit, per release."""

from __future__ import annotations

import re
from types import SimpleNamespace

from spook_tracker.tracker.cli.release_models import model_page, only_models, without_models
from spook_tracker.tracker.judge.compare import ComparedRun, compare
from spook_tracker.tracker.judge.release_notes import Step, alike, read_changelog, visible
from tests.histories.documents import gate
from tests.places import ROOT
from tests.tracker.judge.test_verdict import sample
from tests.tracker.measure.test_model_files import KNOWN, _side


def _step(values: dict[str, tuple[float, float]]) -> Step:
    """From one release to the next: a value of each model before and after."""
    runs = []
    for side in (0, 1):
        samples = {}
        for model, pair in values.items():
            key = f"{model}/motion/ball.place@1s/h=0.002"
            definition = gate(
                key=key,
                test=model,
                metric="ball.place@1s",
                better="inside",
                role="reported",
                sensitivity=KNOWN,
            )
            samples[key] = (definition, sample(pair[side], state=f"{model}{pair[side]!r}"))
        runs.append(ComparedRun(side=_side(str(side)), samples=samples))
    changes = compare(*runs).changes
    return Step(
        release="2.0", before="1.0", changes=tuple(filter(visible, changes)), asked=3, alike=alike(changes)
    )


STEP = _step({"falls": (0.1, 0.102), "rounds": (0.1, 0.1 + 9e-15), "stays": (0.1, 0.1)})
CARDS = [SimpleNamespace(name="falls", parameters=(("file", "robots/falls.xml"),))]


def test_each_model_is_said_to_have_changed_rounded_or_stayed() -> None:
    page = "\n".join(model_page("mujoco", CARDS, [STEP]))

    assert "| falls | `robots/falls.xml` | **changed**, 1 of 1 values |" in page
    assert "| rounds | `` | rounding, 1 of 1 values |" in page
    assert "| stays | `` | same bits |" in page
    assert "3 models. 2.0: 1 changed, 1 rounded, 1 the same bits." in page
    assert "- **falls**: moves otherwise from 1 s on: ball by 0.002 m at 1 s (2e+02 times" in page


def test_an_edited_model_is_another_one_and_did_not_change() -> None:
    runs = []
    for side, value in enumerate((0.1, 0.5)):
        definition = gate(better="inside", role="reported", sensitivity=KNOWN, test_version=f"edit {side}")
        runs.append(ComparedRun(side=_side(str(side)), samples={"t/c/m": (definition, sample(value))}))
    changes = compare(*runs).changes

    assert [change.word for change in changes] == ["not_comparable"]
    assert not any(map(visible, changes))
    assert alike(changes) == {}


def test_a_model_that_one_of_both_was_not_asked_about_is_not_called_the_same() -> None:
    """It was told as rounding in all of its values."""
    asked = {"t/c/m": (gate(better="inside", role="reported", sensitivity=KNOWN), sample(0.1))}
    sides = [ComparedRun(side=_side(str(side)), samples=asked if side else {}) for side in (0, 1)]

    for runs in (sides, sides[::-1]):
        assert alike(compare(*runs).changes) == {}
    assert alike(compare(sides[1], sides[1]).changes) == {"t": (1, 0)}


def test_models_stand_apart_from_other_tests() -> None:
    (rest,) = without_models([STEP])

    assert rest.changes == ()
    assert only_models(["falls", "stays"], [STEP])
    assert not only_models(["falls", "pendulum"], [STEP])
    assert model_page("mujoco", CARDS, []) == []


def test_the_page_of_models_answers_every_entry_of_its_changelog() -> None:
    docs = ROOT / "docs"
    page = (docs / "mujoco-models.md").read_text(encoding="utf-8")
    told_there = re.findall(r"^- (\S+), item (\d+): (.+?)\. Seen in", page, re.MULTILINE)
    asked = read_changelog(docs / "mujoco-models-changelog.toml").entries

    assert sorted(told_there) == sorted((entry.release, str(entry.item), entry.says) for entry in asked)
    assert len(re.findall(r"^\| \w+ \| `[^`]+\.xml` \|", page, re.MULTILINE)) >= 30
    assert "- **box_on_box**: box rests 0.000108 m higher" in page
