"""Tests of one topic stand together on every page, as the document of a run names the topics."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec import structs

from spook_tracker.engine import find
from spook_tracker.scalar_tests.catalogue import CATALOGUE, TOPIC
from spook_tracker.tracker.document.run_document import Asked, RunDocument
from spook_tracker.tracker.measure.cards import test_card as card_of
from spook_tracker.tracker.store.documents import DocumentHistory
from spook_tracker.tracker.website.publish import publish
from tests.histories.synthetic import document, of_test
from tests.website.test_engines import lines

OF = {"beam": "stacks", "door": "robots", "falling_object": "stacks", "pendulum": "robots"}
HEADINGS = ["Stacks", "Robots", "Other tests"]  # as they come in the document of the whole catalogue


def by_topic(run: RunDocument) -> RunDocument:
    cards = [structs.replace(card, seven=False, topic=OF.get(card.name, "")) for card in run.tests]
    return structs.replace(run, tests=tuple(cards))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two nights: the whole catalogue, one of whose limits is broken, and a test of the second topic alone."""
    few = by_topic(of_test(document(1), "pendulum"))
    asked = Asked(tests=("pendulum",), families=("values", "sweep"), whole=False)
    few = structs.replace(
        few, tests=tuple(card for card in few.tests if card.name == "pendulum"), asked=asked
    )
    folder = tmp_path_factory.mktemp("topics") / "public"
    publish(DocumentHistory([by_topic(document(0, broken=0)), few, document(0, name="rival")]), folder)
    return folder


def headings(found: list[list[str]]) -> list[str]:
    return [line[0] for line in found if len(line) == 1]


def test_the_first_page_has_what_is_red_then_topic_by_topic_after_a_night_of_few_tests(site: Path) -> None:
    found = lines(site, "index.html", "One row per test")

    assert headings(found) == ["Red", *HEADINGS]
    titles = [line[0].split(" Largest")[0] for line in found if len(line) != 1]
    assert titles[1] == "Friction" and titles[2:6] == [
        "Beam on two piles",
        "Falling object",
        "Door on hinges",
        "Pendulum",
    ]


def test_engines_stand_beside_each_other_topic_by_topic(site: Path) -> None:
    chooser = [line[0].split(" 1 ")[0] for line in lines(site, "engines.html", "The soonest to an error")]
    assert chooser == ["Topic", *[f"{title} 2 scenes" for title in HEADINGS[:2]], "Other tests 3 scenes"]
    for caption in ("A line for each gate", "Run time to an error of 10⁻²"):
        assert headings(lines(site, "engines.html", caption)) == HEADINGS


def test_a_run_says_the_topic_of_each_test_so_that_it_is_known_wherever_it_is_imported() -> None:
    engine = find.find("spook")

    assert {name: card_of(name, CATALOGUE[name], engine, None).topic for name in ("motor", "falling_object")} == {
        "motor": TOPIC["motor"], "falling_object": "thesis",
    }  # fmt: skip
