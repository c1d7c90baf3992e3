"""Which engine for what: half of the scenes of a topic, and what no adapter can ask."""

from __future__ import annotations

import math
import re
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path

import pytest

from spook_tracker.engine import find
from spook_tracker.tracker.document.run_document import OutcomeClass, Sample, SeriesDefinition, Timing
from spook_tracker.tracker.document.wording import seconds as within
from spook_tracker.tracker.store.documents import DocumentHistory
from spook_tracker.tracker.website.page_chooser import FACTS, half, topics
from spook_tracker.tracker.website.publish import publish
from tests.histories.documents import card
from tests.histories.synthetic import history, rival, sample, series
from tests.website.test_engines import table


@pytest.mark.parametrize(
    ("times", "within"),
    [([], None), ([3.0], 3.0), ([3.0, None], 3.0), ([3.0, None, None], None), ([5.0, 1.0, None], 5.0)],
)
def test_half_of_the_scenes_have_a_time_and_what_is_never_reached_takes_for_ever(
    times: list[float | None], within: float | None
) -> None:
    assert half(times) == within


def test_the_first_answer_names_the_soonest_engines_and_below_what_each_cannot_be_asked(
    tmp_path: Path,
) -> None:
    """By hand: ours of order 2 is 0.3 h² in 4.04e-6/h s, theirs 0.3 h⁴ in 2e-5/h s; one scene, so half of it is it."""
    site = tmp_path / "public"
    publish(DocumentHistory([*history(3).documents.values(), rival("3.3")]), site)
    first = table(site, "engines.html", "The soonest to an error")
    every = table(site, "engines.html", "Every test: time for half of 1 scene,")

    (soonest,) = [line for name, line in first.items() if name != "Topic"]
    assert soonest == [
        "spook 40.4 µs, rival 200 µs",
        "spook 70 µs, rival 200 µs",
        "rival 200 µs, spook 221 µs",
    ]
    assert list(every)[:1] == ["Engine"] and set(every) == {"Engine", "spook 0.1.2", "rival 3.3"}
    assert every["spook 0.1.2"][3:7] == ["none failed", "-", "64 bits", "MIT"]


def rungs(test: str, *seconds: float | OutcomeClass) -> dict[str, tuple[SeriesDefinition, Sample]]:
    """A ladder: the seconds of a rung within every error, or what became of it."""
    found = {}
    for place, told in enumerate(seconds):
        definition = series(test, "ladder:error", kind="ladder", time_step=0.01 * (place + 1))
        found[definition.key] = (
            definition,
            (
                sample(definition, math.nan, outcome=told)
                if isinstance(told, str)
                else sample(definition, 1e-6, timing=Timing(seconds=(told,), runs_per_repeat=1))
            ),
        )
    return found


def test_what_an_engine_cannot_be_asked_takes_for_ever_and_is_named() -> None:
    """Two scenes count: the third only one engine can be asked. A scene whose test has no page is of no topic."""
    cannot: OutcomeClass = "not_supported"
    asked = {
        "one": rungs("friction", 1.0) | rungs("grasp", 2.0) | rungs("grain", 3.0),
        "two": rungs("friction", 3.0, "timed_out") | rungs("grasp", 4.0, "crashed") | rungs("grain", cannot),
        "three": rungs("friction", cannot) | rungs("grasp", 0.5) | rungs("grain", cannot),
    }
    addresses = {name: (f"{name}.html", name) for name in asked}
    cards = {name: card(name=name, title=name.title(), topic="friction") for name in ("friction", "grasp")}
    (topic,) = topics(asked, addresses, cards)
    lines = {line.engine: line for line in topic.lines}

    assert (topic.title, topic.count) == ("Friction", 2)
    assert [(one.title, one.count) for one in topics(asked, addresses, {"grasp": cards["grasp"]})] == [
        ("Friction", 1),
        ("Other tests", 1),
    ]
    assert list(lines) == ["one", "two", "three"], "the most scenes first, then the soonest"
    assert {name: line.times[0] for name, line in lines.items()} == {
        "one": (within(1.0), 2), "two": (within(3.0), 2), "three": (within(0.5), 1),
    }  # fmt: skip
    assert lines["three"].lacking == (("Friction", "tests/friction.html"),)
    assert [line.worst for line in topic.lines] == ["none failed", "crashed on 1", "none failed"]


def test_every_engine_has_its_facts_and_the_licence_that_its_package_names() -> None:
    assert FACTS.keys() == {"spook", *find.EXTRAS, *find.NODE, *find.BUILT}
    for name, package in find.EXTRAS.items():
        try:
            said = metadata(package)
        except PackageNotFoundError:
            continue
        words = f"{said.get('License')} {said.get('License-Expression')} {said.get_all('Classifier')}".lower()
        licence = FACTS[name].licence.lower().split()[0].split("-")[0]
        assert re.search(rf"\b{licence}\b", words), name
