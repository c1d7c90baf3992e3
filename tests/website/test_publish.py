"""The website as files: complete, the same bytes twice, harmless, and never half written."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from html.parser import HTMLParser
from pathlib import Path
from typing import ClassVar

import msgspec
import plotly.graph_objects as go
import plotly.offline
import pytest

from spook_tracker.tracker.document.json_form import NAN, Number
from spook_tracker.tracker.resources import resource
from spook_tracker.tracker.website.folder import MARKER, FolderError, replacing
from spook_tracker.tracker.website.publish import publish
from tests.histories.synthetic import SEVEN, DocumentHistory, decade, document, history, of_test
from tests.places import ROOT
from tests.website.scripts import handed_over


class Reader(HTMLParser):
    """Gathers what a browser would: elements, scripts, links, text."""

    VOID: ClassVar = {"meta", "link", "input", "br", "img", "hr"}

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.open: list[str] = []
        self.texts: list[str] = []
        self.data: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {name: value or "" for name, value in attrs}))
        if tag not in self.VOID:
            self.open.append(tag)
        if tag == "script":
            self.data.append("")

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {name: value or "" for name, value in attrs}))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag, f"</{tag}> closes another element"

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] == "script":
            self.data[-1] += data
        else:
            self.texts.append(data)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A site of thirty nights with a regression, a NaN and a hostile test."""
    out = tmp_path_factory.mktemp("published") / "public"
    publish(history(30, broken=26, hostile=True), out)
    return out


MODULE = resource("site") / "static" / "live.wasm"  # built by `make wasm`, where clang-19 is


def html_pages(site: Path) -> list[Path]:
    return sorted(site.rglob("*.html"))


def files(site: Path) -> dict[str, str]:
    return {
        str(path.relative_to(site)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in site.rglob("*")
        if path.is_file()
    }


def test_every_test_has_a_page_and_every_local_link_leads_somewhere(site: Path) -> None:
    assert {f"{name}.html" for name in SEVEN} < {path.name for path in (site / "tests").iterdir()}

    for page in html_pages(site):
        for tag, attributes in Reader(page.read_text()).elements:
            target = attributes.get("href") if tag in ("a", "link") else attributes.get("src")
            if target and not target.startswith(("#", "https://github.com/example/")):
                assert (page.parent / target.partition("#")[0]).is_file(), f"{page.name} links to {target}"


def test_the_index_says_what_is_red_with_unit_limit_and_margin(site: Path) -> None:
    text = " ".join(" ".join(Reader((site / "index.html").read_text()).texts).split())

    assert "One limit is broken tonight" in text
    assert "6 of 7 limits from the thesis are kept." in text
    assert "1.635 m ≤ 4.904 m 33.3 % of the limit PASS" in text
    assert "0.5003 0.4999 … 0.5001 3 times the limit FAIL" in text


def test_no_page_runs_anything_but_its_own_files(site: Path) -> None:
    for page in html_pages(site):
        reader = Reader(page.read_text())
        assert reader.open == [], f"{page.name} leaves elements open"
        policy = [
            a["content"] for tag, a in reader.elements if a.get("http-equiv") == "Content-Security-Policy"
        ]
        assert len(policy) == 1
        wasm = (
            " 'wasm-unsafe-eval'; worker-src blob:" if page.name == "live.html" and MODULE.exists() else ""
        )  # only where needed
        assert f"default-src 'none'; script-src 'self'{wasm};" in policy[0]
        scripts = [a for tag, a in reader.elements if tag == "script"]
        assert all("src" in a or a["type"] == "application/json" for a in scripts)
        for tag, attributes in reader.elements:
            assert not [name for name in attributes if name.startswith("on")], f"{page.name}: {tag}"
            assert "javascript:" not in attributes.get("href", "")
            assert not attributes.get("src", "").startswith(("http", "//"))


def test_hostile_text_stays_text(site: Path) -> None:
    hostile_page = next(p for p in (site / "tests").iterdir() if p.stem not in SEVEN)
    reader = Reader(hostile_page.read_text())

    assert re.fullmatch(r"[a-z0-9-]{1,60}\.html", hostile_page.name)
    assert not [tag for tag, _ in reader.elements if tag in ("img", "b")]
    assert "<img src=x onerror=alert(1)>" in "".join(reader.texts)
    assert "\u202e" not in hostile_page.read_text()
    assert "\x00" not in hostile_page.read_text()
    for told in (json.loads(data) for data in reader.data if data.strip()):
        assert "<" not in json.dumps([told.get("title"), told["layout"]["xaxis"]["title"]])


def test_the_csv_files_hold_every_digit_and_no_formula(site: Path) -> None:
    lines = list(csv.DictReader(io.StringIO((site / "data" / "tonight.csv").read_text())))
    gates = {line["test"]: line for line in lines if line["role"] == "gate"}

    assert float(gates["friction"]["value"]) == 0.5003
    assert gates["friction"]["outcome"] == "out_of_limit"
    assert float(gates["beam"]["value"]) == 4.1e-16
    assert any(line["value"] == "nan" for line in lines)
    assert not [c for line in lines for c in line.values() if c.startswith(("=", "@", "+"))]
    changes = list(csv.DictReader(io.StringIO((site / "data" / "friction.csv").read_text())))
    gate = [(line["since"][:10], float(line["value"])) for line in changes if line["role"] == "gate"]
    assert [value for _, value in gate] == [0.5 + 8e-14, 0.5003], (
        "a line for the first night, and one for the change"
    )
    work = list(csv.DictReader(io.StringIO((site / "data" / "work.csv").read_text())))
    friction = next(line for line in work if line["test"] == "friction")
    assert (friction["configuration"], friction["part"], friction["since"][:10]) == (
        "plain",
        "values",
        "2025-10-01",
    )
    times = [csv.reader(io.StringIO(month.read_text())) for month in site.glob("data/run-times-*.csv")]
    assert sum(len(list(month)) - 1 for month in times) == 30, "a line for each night"


def test_the_json_files_are_strict_json(site: Path) -> None:
    def refuse(text: str) -> float:
        raise AssertionError(f"{text} is no JSON")

    whole = json.loads((site / "data" / "n_pendulum.json").read_text(), parse_constant=refuse)

    changes = [change for series in whole["series"] for change in series["changes"]]
    assert "nan" in [value for _, value, _ in changes]
    assert {night for night, _, _ in changes} == set(whole["nights"])
    assert all(whole["definitions"][series["definition"]]["metric"] for series in whole["series"])


def test_feed_and_badge_tell_the_regressions(site: Path) -> None:
    feed = ElementTree.parse(site / "feed.xml").getroot()
    names = {"a": "http://www.w3.org/2005/Atom"}
    titles = [entry.text or "" for entry in feed.findall("a:entry/a:title", names)]
    ids = [entry.text for entry in feed.findall("a:entry/a:id", names)]

    friction = next(
        title for title in titles if "3 tests" in title
    )  # friction, door and chain broke together
    assert re.fullmatch(
        r"red: [0-9a-f]{10}: 1 limit broken, 2 values lost, 1 worse, limits kept \(4 series of 3 tests\)",
        friction,
    )
    assert sum(title == friction for title in titles) == 1
    assert len(ids) == len(set(ids))
    badge = json.loads((site / "badge.json").read_text())
    assert badge == {
        "schemaVersion": 1,
        "label": "physics",
        "message": "21 of 22 limits kept",
        "color": "red",
    }
    assert "21 of 22 limits kept" in ElementTree.parse(site / "badge.svg").getroot().attrib["aria-label"]


def test_plotly_accepts_every_figure(site: Path) -> None:
    """The figures are plain data made without Plotly; its own validators must take them."""
    texts = [page.read_text() for page in html_pages(site)]
    inside = [json.loads(data) for text in texts for data in Reader(text).data if data.strip()]
    files = sorted(site.glob("charts/*.js"))
    loaded = list(handed_over(files, "charted").values())
    drawn = [told for told in inside + loaded if "layout" in told]
    for told in drawn:
        layout = {k: v for k, v in told["layout"].items() if k not in ("shapes", "annotations")}
        go.Figure(data=told["data"], layout=layout)

    assert len(drawn) > 50
    assert loaded
    calls = sum(path.read_text().count("charted(") for path in files)
    assert len(drawn) == sum(text.count('"layout":') for text in texts) + calls, "none is passed over"
    with pytest.raises(ValueError, match="Did you mean"):  # they would see a misspelt property
        go.Figure(data=[{**drawn[-1]["data"][0], "nmae": "x"}])


def test_the_bundle_is_the_version_plotly_for_python_expects() -> None:
    bundle = resource("site") / "static" / "plotly-cartesian.min.js"

    assert bundle.stat().st_size < 3e6
    assert f"v{plotly.offline.get_plotlyjs_version()}" in bundle.read_text(encoding="utf-8")[:200]


def test_the_same_history_gives_the_same_bytes(site: Path, tmp_path: Path) -> None:
    publish(history(30, broken=26, hostile=True), tmp_path / "again")

    assert files(site) == files(tmp_path / "again")


PUBLISHED = """
import sys
from pathlib import Path
from spook_tracker.tracker.website.publish import publish
from tests.website.test_replays import nights
publish(nights(1.0, 2.0, 9.0, tests=("friction", "pendulum"), broken=2), Path(sys.argv[1]))
"""


def test_the_bytes_do_not_depend_on_the_order_of_sets(tmp_path: Path) -> None:
    """Another seed of hashes for each of two processes; with recorded motion and a fault."""
    for seed in ("1", "2"):
        environment = os.environ | {"PYTHONHASHSEED": seed}
        command = [sys.executable, "-c", PUBLISHED, str(tmp_path / seed)]
        subprocess.run(command, cwd=ROOT, env=environment, check=True)
    one, two = (files(tmp_path / seed) for seed in ("1", "2"))

    assert any(name.startswith("replay/") for name in map(str, one))
    assert one == two


def test_what_a_night_leaves_as_it_was_is_not_written_again(tmp_path: Path) -> None:
    """The sixth night has other run times and the values of the fifth, the eighth has another value of friction."""
    out = tmp_path / "public"
    first = publish(history(5), out)
    second = publish(history(5), out)
    before = inodes(out)
    third = publish(history(6), out)
    quiet = {name for name, inode in inodes(out).items() if before.get(name) != inode}
    before = inodes(out)
    publish(history(8, broken=7), out)
    told = {name for name, inode in inodes(out).items() if before.get(name) != inode}

    assert first.skipped == 0
    assert (0, first.written) == (second.written, second.skipped)
    assert third.written == len(quiet - {".tracker-site.json"}) <= 45
    assert not {name for name in quiet if name.startswith("tests/") or name[5:-4] in SEVEN}
    assert {"index.html", "tonight.js", "charts/nights.js", "data/tonight.csv", "data/nights.csv"} < quiet
    assert {"tests/friction.html", "data/friction.csv"} < told
    assert not {"tests/beam.html", "data/beam.csv"} & told
    assert (out / "tests" / "beam.html").stat().st_nlink == 1
    assert {path.name for path in tmp_path.iterdir()} == {"public", ".public.kept"}


def inodes(site: Path) -> dict[str, int]:
    return {str(p.relative_to(site)): p.stat().st_ino for p in site.rglob("*") if p.is_file()}


def test_a_strange_folder_is_not_touched(tmp_path: Path) -> None:
    mine = tmp_path / "photos"
    mine.mkdir()
    (mine / "cat.jpg").write_text("meow")
    link = tmp_path / "link"
    link.symlink_to(mine)
    (tmp_path / "file").write_text("")

    for out in (mine, link, tmp_path / "file"):
        with pytest.raises(FolderError, match="choose"):
            publish(history(1), out)
    assert [path.name for path in mine.iterdir()] == ["cat.jpg"]


def test_an_interrupted_build_leaves_the_old_site(tmp_path: Path) -> None:
    out = tmp_path / "public"
    publish(history(2), out)
    before = files(out)

    with pytest.raises(KeyboardInterrupt), replacing(out) as folder:
        folder.add("index.html", "half", lambda: b"half")
        raise KeyboardInterrupt

    assert before == files(out)
    assert {path.name for path in tmp_path.iterdir()} == {"public", ".public.kept"}


def test_the_site_can_be_swapped_without_exchanging_folders(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the system cannot exchange two folders in one step, the old one steps aside."""
    out = tmp_path / "public"
    publish(history(1), out)
    monkeypatch.setattr("spook_tracker.tracker.website.folder._exchange", lambda one, other: False)
    publish(history(2), out)

    assert (out / MARKER).is_file()
    assert {path.name for path in tmp_path.iterdir()} == {"public", ".public.kept"}


def test_a_history_without_runs_still_says_so(tmp_path: Path) -> None:
    publish(DocumentHistory([]), tmp_path / "public")

    assert "Nothing is recorded yet" in (tmp_path / "public" / "index.html").read_text()


def test_other_engines_do_not_mix_into_the_nights_of_ours(tmp_path: Path) -> None:
    runs = [document(0), document(1), document(0, name="other")]
    publish(DocumentHistory(runs), tmp_path / "public")

    lines = (tmp_path / "public" / "data" / "nights.csv").read_text().splitlines()
    assert len(lines) == 3


def test_ten_years_of_nights_do_not_bloat_a_page(tmp_path: Path) -> None:
    publish(decade(test="beam"), tmp_path / "public")  # the page of no other is longer

    assert (tmp_path / "public" / "tests" / "beam.html").stat().st_size < 1_500_000


def test_values_without_a_description_have_a_page_too(tmp_path: Path) -> None:
    """Results of another tool may come with nothing but numbers."""
    bare = msgspec.structs.replace(document(0), tests=())
    publish(DocumentHistory([bare]), tmp_path / "public")

    assert (
        "No description of the scene was recorded."
        in (tmp_path / "public" / "tests" / "beam.html").read_text()
    )
    assert Reader((tmp_path / "public" / "index.html").read_text()).open == []


def test_gates_at_two_time_steps_say_which_is_which(tmp_path: Path) -> None:
    run = document(0)
    gate = next(s for s in run.series if s.role == "gate" and s.test == "beam")
    fine = msgspec.structs.replace(gate, key=f"{gate.key}-fine", time_step=1.0 / 240.0)
    same = next(s for s in run.samples if s.series == gate.key)
    both = msgspec.structs.replace(
        run,
        series=(*run.series, fine),
        samples=(*run.samples, msgspec.structs.replace(same, series=fine.key)),
    )
    publish(DocumentHistory([both]), tmp_path / "public")
    pages = tmp_path / "public" / "tests"

    assert all(f", h = {h} s</bdi>" in (pages / "beam.html").read_text() for h in ("0.01667", "0.004167"))
    assert (
        ", h = "
        not in (pages / "door.html").read_text().partition('class="gate card')[2].partition("<nav")[0]
    )


def test_a_night_of_one_test_does_not_pass_for_the_others(tmp_path: Path) -> None:
    whole, part = document(0), document(1)
    short = msgspec.structs.replace(
        of_test(part, "beam"),
        trigger="manual",  # a nightly would have asked for all: what it lacks is removed, and red
    )
    publish(DocumentHistory([whole, short]), tmp_path / "public")
    text = " ".join(" ".join(Reader((tmp_path / "public" / "index.html").read_text()).texts).split())

    assert "1 test ran on spook 0.1.1. 6 were not run tonight." in text
    assert text.count("of 2025-10-01, not run tonight") == 6


def test_what_the_engine_does_not_support_takes_no_line_of_the_first_page(tmp_path: Path) -> None:
    whole = document(0)
    lacking = {one.key for one in whole.series if one.test == "beam"}
    samples = tuple(
        msgspec.structs.replace(
            one, value=Number(float("nan")), outcome="not_supported", passed=False, timing=None, counters={}
        )
        if one.series in lacking
        else one
        for one in whole.samples
    )
    publish(DocumentHistory([msgspec.structs.replace(whole, samples=samples)]), tmp_path / "public")
    page = (tmp_path / "public" / "index.html").read_text()
    tables, _, beside = page.partition("1 test needs what <bdi>spook</bdi> does not support")

    assert "6 tests ran on spook 0.1.0; 1 needs what it does not support." in page
    assert 'tests/beam.html"' not in tables and 'tests/door.html"' in tables
    assert 'tests/beam.html"' in beside


def test_no_element_of_a_page_has_the_name_of_another(tmp_path: Path) -> None:
    """A script fills elements by name: one heading was overwritten with the hour of the night."""
    run = document(0)
    cards = tuple(msgspec.structs.replace(card, seven=False, measured=True) for card in run.tests)
    physical = tuple(msgspec.structs.replace(one, limit_kind="physical") for one in run.series)
    run = msgspec.structs.replace(run, tests=cards, series=physical)
    publish(DocumentHistory([run]), tmp_path / "public")

    for page in (tmp_path / "public").rglob("*.html"):
        named = re.findall(r'\sid="([^"]+)"', page.read_text())
        assert len(named) == len(set(named)), page
    assert "Against measured data" in (tmp_path / "public" / "index.html").read_text()


def test_a_value_that_is_no_number_is_never_green(tmp_path: Path) -> None:
    run = document(0)
    gate = next(s for s in run.series if s.role == "gate" and s.test == "beam")
    lost = tuple(
        type(s)(series=s.series, value=NAN, outcome="diverged", passed=False, set_point_held=False)
        if s.series == gate.key else s
        for s in run.samples
    )  # fmt: skip
    changed = type(run)(**{name: getattr(run, name) for name in run.__struct_fields__} | {"samples": lost})
    publish(DocumentHistory([changed]), tmp_path / "public")
    text = " ".join(" ".join(Reader((tmp_path / "public" / "index.html").read_text()).texts).split())

    assert "diverged ≤ 4.9×10⁻⁹ % no value FAIL" in text


def test_the_first_page_does_not_say_that_all_is_well_when_a_companion_is_red(tmp_path: Path) -> None:
    """The command ends with 1 then, so the page must not be green."""
    runs = [msgspec.structs.replace(document(n, broken=1), trigger="nightly") for n in range(2)]
    quiet = [
        msgspec.structs.replace(
            run,
            series=tuple(s for s in run.series if s.test == "door"),
            samples=tuple(s for s in run.samples if s.series.startswith("door/")),
            tests=tuple(t for t in run.tests if t.name == "door"),
        )
        for run in runs
    ]
    publish(DocumentHistory(quiet), tmp_path / "public")

    assert "Every limit is kept; one other series is red" in (tmp_path / "public" / "index.html").read_text()


def test_the_table_of_scalars_says_of_each_limit_and_set_point_whose_it_is(tmp_path: Path) -> None:
    """A physical limit binds every engine; a set point of one method's own does not."""
    run = of_test(document(0), "pendulum")
    asked = {"limit_kind": "physical", "set_point": (0.1, 0.2), "set_point_kind": "method"}
    first, *_ = [d for d in run.series if d.kind == "scalar" and d.limit is not None]
    changed = {first.key: msgspec.structs.replace(first, **asked)}
    run = msgspec.structs.replace(run, series=tuple(changed.get(d.key, d) for d in run.series))
    publish(DocumentHistory([run]), tmp_path / "public")

    page = (tmp_path / "public" / "tests" / "pendulum.html").read_text()
    table = page[page.index("Every scalar of this test") :]
    limit, band = re.findall(r'<td class="num">[^<]+<span class="sub">([^<]*)</span>', table)[:2]
    assert (limit, band) == ("physical", "method-specific")
