"""Engines beside each other: one matrix, one table at equal error, and a page for every other engine."""

from __future__ import annotations

import re
from collections import Counter
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import msgspec
import pytest

from spook_tracker.tracker.document.wording import clean
from spook_tracker.tracker.judge.compare import ComparedRun, compare, side_of
from spook_tracker.tracker.judge.rank import answers
from spook_tracker.tracker.judge.work import with_work
from spook_tracker.tracker.website.page_engines import _cells, _value
from spook_tracker.tracker.website.publish import publish
from tests.histories.synthetic import (
    HOSTILE,
    MACHINE,
    SEVEN,
    DocumentHistory,
    history,
    of_test,
    rival,
    with_rival,
)
from tests.website.browser import arrive, look, wait_for


class Tables(HTMLParser):
    """Every table of a page: lines of cells, as a reader without a pointer has them."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: dict[str, list[list[str]]] = {}
        self.caption, self.cell, self.inside = "", "", ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag in ("caption", "th", "td"):
            self.inside, self.cell = tag, ""
        if tag == "tr" and self.caption:
            self.found[self.caption].append([])

    def handle_endtag(self, tag: str) -> None:
        words = " ".join(self.cell.split())
        if tag == "caption":
            self.caption = words
            self.found[words] = []
        elif tag in ("th", "td"):
            self.found[self.caption][-1].append(words)
        self.inside = "" if tag == self.inside else self.inside

    def handle_data(self, data: str) -> None:
        if self.inside:
            self.cell += data + " "


def lines(site: Path, page: str, caption: str) -> list[list[str]]:
    """The table whose caption starts so."""
    tables = Tables((site / page).read_text(encoding="utf-8").replace("\u202f", " ")).found
    return next(found for name, found in tables.items() if name.startswith(caption))


def table(site: Path, page: str, caption: str) -> dict[str, list[str]]:
    """Its lines by their first words."""
    return {line[0]: line[1:] for line in lines(site, page, caption)}


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("engines") / "public"
    publish(with_rival(history(3)), out)
    return out


def test_every_gate_shows_what_each_engine_says_in_the_configuration_it_names_first(site: Path) -> None:
    told = table(site, "engines.html", "A line for each gate")

    assert told["Test"] == ["Limit", "spook 0.1.2", "rival 3.3"]
    assert told["Pendulum Largest pendulum deviation"][1:] == ["kept: 9.3×10⁻⁴ %"] * 2
    assert told["Door on hinges Largest door deviation"][2] == "kept: 0.0125 %"
    alone = table(site, "engines.html", "The value of ours, and whether the limit is kept")
    assert "Friction Largest friction deviation" not in told, "rival cannot be asked"
    assert alone["Friction Largest friction deviation"][1:] == ["kept: 0.5"]


def test_the_first_engine_at_an_error_stands_out_and_ours_is_not_spared(site: Path) -> None:
    """By hand: ours of order 2 is 0.3 h² in 4.04e-6/h s, theirs 0.3 h⁴ in 2e-5/h s, between the steps by powers."""
    scene = "Pendulum length [%]"
    one, middle, fine = (
        table(site, "engines.html", f"Run time to an error of 10{e}") for e in ("⁻²", "⁻⁴", "⁻⁶")
    )

    assert one[scene] == ["40.4 µs", "200 µs 5 times the best"]
    assert middle[scene] == ["221 µs 1.1 times the best", "200 µs"]
    assert fine[scene] == ["not reached", "468 µs"]
    behind = lines(site, "engines.html", "Scenes and errors that another engine reaches first")
    assert behind[1:] == [
        ["Pendulum length", "10⁻⁶ %", "rival 3.3", "468 µs", "never", ""],
        ["Pendulum length", "10⁻⁴ %", "rival 3.3", "200 µs", "221 µs", "1.1 ×"],
    ]
    page = (site / "engines.html").read_text(encoding="utf-8")
    assert len(re.findall('class="best"', page)) == 3  # one a column that any engine fills


def test_scenes_that_one_engine_alone_was_asked_are_no_race(site: Path) -> None:
    fine = table(site, "engines.html", "Run time to an error of 10⁻⁴")

    assert [scene for scene in fine if scene != "Scene"] == ["Pendulum length [%]"]


def test_the_page_of_an_engine_has_all_its_configurations_and_names_the_release_of_a_change(
    site: Path,
) -> None:
    gates = table(site, "engines/rival.html", "The value, and whether the limit is kept")
    releases = table(site, "engines/rival.html", "The newest first")

    assert gates["Test"] == ["Limit", "rk4", "euler"]
    assert gates["Door on hinges Largest door deviation"][1:] == ["kept: 0.0125 %", "not kept: 0.0375 %"]
    assert releases["3.3"][1:3] == ["2", releases["3.3"][2]]
    assert "door (2)" in releases["3.3"][2]
    assert "0.5 % to 0.0125 %" in releases["3.3"][2]
    assert releases["3.2"][1] == "0"
    assert releases["3.1"][1] == "the first"


def test_run_times_of_another_machine_are_not_set_beside_ours(tmp_path: Path) -> None:
    elsewhere = msgspec.structs.replace(MACHINE, fingerprint="another")
    ours = history(2).documents.values()
    publish(DocumentHistory([*ours, rival("3.1", machine=elsewhere)]), tmp_path / "public")

    coarse = table(tmp_path / "public", "engines.html", "Run time to an error of 10⁻²")

    assert coarse["Pendulum length [%]"][1] == "another machine"
    assert "no times are shown of rival 3.1: another machine" in (
        tmp_path / "public" / "engines.html"
    ).read_text(encoding="utf-8")


def test_one_engine_alone_is_told_how_others_are_asked(tmp_path: Path) -> None:
    publish(history(2), tmp_path / "public")

    text = (tmp_path / "public" / "engines.html").read_text(encoding="utf-8")

    assert "tracker run --engine mujoco" in text
    assert "<table" not in text


def test_a_hostile_name_of_an_engine_is_text_and_a_file_within_the_folder(tmp_path: Path) -> None:
    publish(DocumentHistory([*history(2).documents.values(), rival("1", name=HOSTILE)]), tmp_path / "public")

    pages = list((tmp_path / "public" / "engines").iterdir())

    assert len(pages) == 1
    assert "<img src=x" not in pages[0].read_text(encoding="utf-8")
    assert "<img src=x" not in (tmp_path / "public" / "engines.html").read_text(encoding="utf-8")


def test_two_versions_of_another_engine_can_be_compared_in_the_page(driver: Any, site: Path) -> None:
    def told(before: str, after: str) -> str:
        arrive(
            driver, f"{(site / 'compare.html').as_uri()}#after=run-rival-{after}&before=run-rival-{before}"
        )
        places = {"3.1": 3, "3.2": 4, "3.3": 5}
        shown = f"{places[before]},{places[after]}"
        wait_for(driver, "document.getElementById('told').dataset.shown === arguments[0]", shown)
        return str(driver.find_element("id", "told").text)

    sides = [
        ComparedRun(side=side_of(run), samples=with_work(DocumentHistory([run]).samples(run.id), run.engine))
        for run in (rival("3.1"), rival("3.2"))
    ]
    words = Counter(change.word for change in compare(*sides).changes if change.kind != "run_time")
    assert words.keys() == {"identical", "same"} and words["identical"] > 30  # work counters, each by itself
    assert f"{words['identical']} identical, {words['same']} same" in told("3.1", "3.2")
    changed = told("3.2", "3.3")
    assert "Door on hinges" in changed and "0.0125" in changed
    assert "Pendulum" not in changed


def test_two_engines_stand_beside_each_other_gate_by_gate(driver: Any, site: Path) -> None:
    """What the page says of each is what `tracker rank` says; first those of which one breaks what the other keeps."""
    runs = {"before": history(3).runs()[1].id, "after": "run-rival-3.2"}
    documents = with_rival(history(3))
    samples = {side: documents.samples(run) for side, run in runs.items()}
    gates = [d for d, _ in samples["before"].values() if d.role == "gate"]
    arrive(driver, f"{(site / 'compare.html').as_uri()}#after={runs['after']}&before={runs['before']}")
    wait_for(driver, "document.getElementById('told').dataset.shown === '1,4'")
    shown = driver.execute_script(
        "return [...document.querySelectorAll('#told tbody tr')].map((r) => [Number(r.dataset.group),"
        " ...[...r.querySelectorAll('[data-stands]')].map((c) => [c.dataset.stands, c.querySelector('.value').textContent]),"
        " r.lastElementChild.textContent])"
    )

    told = [
        tuple((answer.stands, _value(answer.definition, answer.sample)) for answer in of_gate)
        for _, of_gate in answers(gates, samples)
    ]
    assert sorted(told) == sorted((tuple(before), tuple(after)) for _, before, after, _ in shown)
    groups = [group for group, *_ in shown]
    assert groups == sorted(groups)
    assert (groups[0], shown[0][1][0], shown[0][2][0]) == (0, "pass", "fail")  # the door
    assert shown[0][3].startswith("only spook 0.1.1 keeps it")
    assert [words for group, *_, words in shown if group == 2] == ["only spook 0.1.1 answers"]  # friction
    text = driver.execute_script("return document.getElementById('told').innerText")
    kept = [sum(stands == "pass" for stands, _ in side) for side in zip(*told, strict=True)]
    assert f"spook 0.1.1 keeps {kept[0]} of" in text
    assert f"rival 3.2 keeps {kept[1]} of" in text
    assert "REGRESSED" not in text.upper()


def test_errors_within_rounding_are_a_tie_and_no_ratio_of_rounding_is_said() -> None:
    cells = _cells([1e-15, 4e-13, 3e-12, None], [""] * 4, str, tie=1e-12)

    assert [cell.best for cell in cells] == [True, True, False, False]
    assert [cell.what for cell in cells] == [""] * 4, "the best is rounding itself"
    assert [cell.what for cell in _cells([2e-12, 6e-12], [""] * 2, str, tie=1e-12)] == [
        "",
        "3 times the best",
    ]


NAMES = (
    "", 'a"b\\c\nd', "</style><b>x</b>", "}body{display:none}", "\N{ROCKET} rocket", "\u202egnp.exe", "\u05d0\u05d1 \u05d2",
    "x" * 10_000, "it's; content: 'y'", "a\0b", "\u00bd\u00b2\u01c5",
)  # fmt: skip


def test_where_tables_are_cards_a_column_bears_the_name_of_its_engine_as_cleaned(
    driver: Any, tmp_path: Path
) -> None:
    """Also one that would end a string, a rule or the style sheet; each row has as many cells as the head."""
    others = []
    for place, name in enumerate(NAMES):
        run = rival("1", name=f"rival-{place}")
        others.append(msgspec.structs.replace(run, engine=msgspec.structs.replace(run.engine, name=name)))
    report = publish(DocumentHistory([*history(2).documents.values(), *others]), tmp_path / "public")
    look(driver, width=360, height=740)
    arrive(driver, (tmp_path / "public" / "engines.html").as_uri())

    tables = driver.execute_script(
        """return [...document.querySelectorAll("table.matrix")].map((table) => [...table.rows].slice(1).map((row) =>
          [...row.cells].slice(-arguments[0]).map((cell) => getComputedStyle(cell, "::before").content)))""",
        len(NAMES) + 1,
    )
    said = ["spook 0.1.1", *(clean(f"{name} 1") for name in NAMES)]
    quoted = [text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\a ") for text in said]
    assert report.failed == ()
    assert sum(bool(rows) for rows in tables) > 1
    assert {tuple(row) for rows in tables for row in rows} == {tuple(f'"{text}"' for text in quoted)}
    assert driver.execute_script("return getComputedStyle(document.body).display") == "block"
    assert driver.execute_script("return document.documentElement.scrollWidth") <= 360


def check_totals(site: Path) -> None:
    """Of each engine those of its column, of the gates those of both lists, in the catalogue's order; links lead somewhere."""
    page = (site / "engines.html").read_text(encoding="utf-8")
    head, *gates = lines(site, "engines.html", "A line for each gate")
    own, *alone = lines(site, "engines.html", "The value of ours")
    cards = re.findall(r"asked</dt><dd>(\d+) <small>of (\d+)</small>.*?there are</dt><dd>(\d+)</dd>", page)
    assert len(cards) == len(head) - 2
    assert {int(asked) for _, _, asked in cards} == {len(gates) + len(alone)}
    assert alone and {line[0] for line in gates}.isdisjoint(line[0] for line in alone)
    for place, (kept, answered, _) in enumerate(cards, 2):
        cells = [line[place] for line in gates]
        if head[place] in own:
            cells += [line[own.index(head[place])] for line in alone]
        else:
            assert all(head[place] != name for name in own)
        signed = [cell.partition(": ")[0] for cell in cells if cell.startswith(("kept: ", "not kept: "))]
        assert (int(kept), int(answered)) == (signed.count("kept"), len(signed)), head[place]
    catalogue = [test for test, *_ in SEVEN.values()]
    for rows in (gates, alone):
        order = [next(i for i, title in enumerate(catalogue) if row[0].startswith(title)) for row in rows]
        assert order == sorted(order), "as the catalogue has them"
    for address in re.findall(r'<a href="([^"#:]+)(?:#[^"]*)?"', page):
        assert (site / address).is_file(), address


def test_the_totals_of_an_engine_are_those_of_its_column_and_every_link_leads_somewhere(site: Path) -> None:
    check_totals(site)


def test_gates_that_no_other_engine_was_asked_are_not_said_to_be_beyond_them(tmp_path: Path) -> None:
    """A test newer than the night of the others, or asked otherwise by then: their adapters may well do it."""
    publish(
        DocumentHistory([*history(2).documents.values(), of_test(rival("3.3"), "pendulum")]),
        tmp_path / "site",
    )
    text = (tmp_path / "site" / "engines.html").read_text(encoding="utf-8")

    assert len(lines(tmp_path / "site", "engines.html", "The value of ours")) == 1 + len(SEVEN) - 1
    assert "Gates that no other engine answers" in text
    assert "no other engine can be asked" not in text
