"""`tracker report`: one HTML file that needs no other, a PDF where a browser is, a sentence where none is."""

import math
import os
import re
import time

import pytest
from click import unstyle

from spook_tracker.tracker.website import printed
from spook_tracker.tracker.website.folder import YOUNG, replacing
from tests.histories.synthetic import SEVEN, DocumentHistory, history
from tests.website.browser import MISSING, programs


@pytest.fixture(scope="module")
def page():
    return printed.one_file(history(3, hostile=True))


def test_the_file_needs_nothing_else(page):
    assert "<script" not in page and 'rel="stylesheet"' not in page
    assert re.findall(r'<(?:img|script|link|iframe)[^>]*(?:src|href)="([^"]*)"', page) == []
    assert [a for a in re.findall(r'<a[^>]*href="([^"]*)"', page) if not a.startswith(("#", "http"))] == []
    assert "@page" in page and page.count('<h2 id="t-') > 5


def test_without_a_night_it_says_so():
    with pytest.raises(printed.PrintError, match="no night is recorded yet"):
        printed.one_file(DocumentHistory([]))


def test_without_a_browser_it_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(printed.shutil, "which", lambda name: None)

    with pytest.raises(printed.PrintError, match=r"none of chromium, .* is here"):
        printed.print_pdf(tmp_path / "a.html", tmp_path / "a.pdf")


@pytest.fixture(scope="module")
def pdf(tmp_path_factory, page):
    """The document as it is printed, read by a library that did not make it."""
    if programs() is None:
        pytest.skip(MISSING)
    pypdf = pytest.importorskip("pypdf")
    folder = tmp_path_factory.mktemp("printed")
    (folder / "night.html").write_text(page, encoding="utf-8")
    printed.print_pdf(folder / "night.html", folder / "night.pdf")
    return pypdf.PdfReader(folder / "night.pdf")


def words(text):
    return re.sub(r"\s+", " ", text)


def test_the_pdf_has_pages_of_a4_each_with_its_number(pdf):
    count = len(pdf.pages)
    assert count > 8
    for number, page in enumerate(pdf.pages, 1):
        size = [float(length) * 25.4 / 72.0 for length in (page.mediabox.width, page.mediabox.height)]  # mm
        assert size == pytest.approx([210.0, 297.0], abs=0.5)
        if number in (1, 2, count):  # reading a page's text takes long
            assert f"{number} / {count}" in words(page.extract_text())


def test_the_contents_name_every_test_and_the_page_it_stands_on(pdf):
    """Titles are read as text, numbers are compared with where the links lead."""
    contents = words(pdf.pages[0].extract_text())
    places = {
        name[3:]: pdf.get_destination_page_number(place)
        for name, place in pdf.named_destinations.items()
        if name.startswith("/t-")
    }

    assert len(places) == len(SEVEN) + 1  # and a hostile one
    for name, (title, *_) in SEVEN.items():
        at = places[name]
        assert re.search(rf"{re.escape(title)} [A-Z ]*{at + 1}\b", contents), title
        assert title in words(pdf.pages[at].extract_text())


def test_the_outline_of_the_pdf_leads_to_every_test(pdf):
    def leaves(entries):
        for entry in entries:
            yield from leaves(entry) if isinstance(entry, list) else [entry]

    outline = {words(entry.title): pdf.get_destination_page_number(entry) for entry in leaves(pdf.outline)}
    for title, *_ in SEVEN.values():
        (page,) = {
            page for head, page in outline.items() if re.fullmatch(f"{re.escape(title)} ?[A-Z ]+", head)
        }
        assert title in words(pdf.pages[page].extract_text())


def test_the_figures_of_the_pdf_are_drawn_and_not_copied(pdf):
    """No picture of points anywhere; lines and curves where the figures are, with their axes as text."""
    assert not any(page.images for page in pdf.pages)
    at = pdf.get_destination_page_number(pdf.named_destinations["/t-pendulum"])
    drawn = b"".join(page.get_contents().get_data() for page in pdf.pages[at : at + 3])
    assert len(re.findall(rb"\bl\b", drawn)) > 100


def test_pages_are_only_told_where_a_browser_told_them():
    html = '<span class="page-of" data-of="t-a"></span><span class="page-of" data-of="t-b"></span>'

    assert printed.pages_of(b"%PDF-1.7 of another printer") == {}
    assert printed.with_pages(html, {}) == html
    assert printed.with_pages(html, {"t-b": 12}) == html.replace('"t-b">', '"t-b">12')


def test_the_conclusions_are_tonight_s_and_the_figures_have_their_notes(page):
    """A red night is told by its red side, a green one by its green."""
    told = {}
    for broken in (10**9, 2):
        text = words(re.sub("<[^>]*>", "", printed.one_file(history(3, broken=broken))))
        told[broken] = text[text.index("Friction", text.index("Limits of the thesis")) :]

    assert "Green: " not in told[2] and "Green: " not in told[10**9]
    assert "It failed tonight" in told[2] and "It failed tonight" not in told[10**9]
    assert "chart-note" in page


def test_what_a_killed_publication_left_is_swept_and_a_running_one_is_not(tmp_path):
    old, young, foreign = (
        tmp_path / name for name in (".public.new-dead", ".public.new-alive", ".publicity")
    )
    for folder in (old, young, foreign):
        folder.mkdir()
    long_ago = time.time() - 2.0 * YOUNG
    os.utime(old, (long_ago, long_ago))
    os.utime(foreign, (long_ago, long_ago))

    with replacing(tmp_path / "public") as folder:
        folder.add("index.html", "1", lambda: b"here")

    assert not old.exists() and young.exists() and foreign.exists()


def test_an_engine_without_gates_is_shown_by_what_has_a_limit() -> None:
    from spook_tracker.tracker.cli.report_table import pass_table
    from tests.histories.documents import definition, run, sample

    shown, followed = "fall/rk4/error", "fall/rk4/energy"
    document = run(
        series=(
            definition(shown, metric="error", role="reported", limit=1.0),
            definition(followed, metric="energy", role="reported", limit=None),
        ),
        samples=(sample(shown, 0.5), sample(followed, 0.5)),
    )

    assert "error" in pass_table(document, room=120)
    assert "energy" not in pass_table(document, room=120)
    assert "energy" in pass_table(document, everything=True, room=120)


def test_an_engine_that_gates_nothing_is_shown_against_the_limits_and_counted_apart() -> None:
    from spook_tracker.tracker.cli.report_table import pass_table
    from tests.histories.documents import definition, run, sample

    kept, broken, lacking = (f"fall/rk4/{name}" for name in ("kept", "broken", "lacking"))
    document = run(
        series=tuple(
            definition(key, metric=key.rpartition("/")[2], role="reported", limit=1.0)
            for key in (kept, broken, lacking)
        ),
        samples=(
            sample(kept, 0.5),
            sample(broken, 2.0, outcome="out_of_limit", passed=False),
            sample(lacking, float("nan"), outcome="not_supported", passed=False),
        ),
    )

    table = pass_table(document, room=120)

    lines = {line.split()[0]: line for line in table.splitlines() if line.startswith("  ")}
    assert "PASS" in lines["kept"] and "FAIL" in lines["broken"] and "not supported" in lines["lacking"]
    assert "keeps 1 of the 2 limits it can be asked; 1 are not supported" in table


def test_what_an_engine_lacks_and_what_its_adapter_does_not_ask_are_summed_up_apart() -> None:
    from spook_tracker.tracker.cli.report_table import failures
    from tests.histories.documents import definition, run, sample

    said = {
        "rod/a/m": "rapier (a) does not support the joint distance; our adapter cannot ask rapier for friction",
        "log/a/m": "our adapter cannot ask rapier for the shape capsule, friction",
        "bag/a/m": "no engine has bags",
    }
    document = run(
        series=tuple(definition(key, test=key[:3], role="gate", limit=1.0) for key in said),
        samples=tuple(
            sample(key, float("nan"), outcome="not_supported", passed=False, failure=why)
            for key, why in said.items()
        ),
    )

    assert failures(document) == [
        "not supported by our adapter: friction: 2 values of rod, log",
        "not supported by our adapter: the shape capsule: 1 value of log",
        "not supported: no engine has bags: 1 value of bag",
        "not supported: the joint distance: 1 value of rod",
    ]


def test_at_80_columns_the_configurations_of_a_metric_are_told_apart() -> None:
    """One wide limit among all of a night left twelve columns to every name."""
    from spook_tracker.tracker.cli.report_table import pass_table
    from tests.histories.documents import definition, run, sample

    facts = {"parameters": {}, "limit": (-9.834567e-05, -9.634567e-05), "set_point": None}
    keys = {f"pendulum/{told}/length_deviation": told for told in ("plain", "corrected")}
    document = run(
        series=tuple(definition(key, configuration=told, **facts) for key, told in keys.items()),
        samples=tuple(sample(key) for key in keys),
    )

    narrow, wide = (unstyle(pass_table(document, room=room)).splitlines() for room in (80, 99))

    assert any("length_deviation [plain" in line for line in narrow)
    assert any("length_deviation [cor" in line for line in narrow)
    assert max(map(len, narrow[1:])) <= 80
    assert "margin" not in narrow[2] and "margin" in wide[2]


def test_the_short_table_has_a_line_a_test_and_one_for_every_broken_limit() -> None:
    from spook_tracker.tracker.cli.report_short import short_table
    from tests.histories.documents import definition, run, sample

    values = {"sound/a/far": 0.1, "sound/a/near": 0.9, "bad/a/one": 2.0, "bad/a/two": 3.0, "bad/a/held": 0.99}
    document = run(
        series=tuple(
            definition(key, test=key.split("/")[0], metric=key.split("/")[2], role="gate", limit=1.0)
            for key in values
        ),
        samples=tuple(
            sample(key, value) if value <= 1.0 else sample(key, value, outcome="out_of_limit", passed=False)
            for key, value in values.items()
        ),
    )

    lines = unstyle(short_table(document, room=120)).splitlines()

    shown = [line.split()[1] for line in lines if "PASS" in line or "FAIL" in line]
    assert sorted(shown) == ["near", "one", "two"]
    assert "not shown: 2 further limits, 1 stability map; --all prints them" in lines
    assert lines[-1] == "✗ red: 2 of 5 limits broken"


def test_a_model_file_is_told_in_a_line_and_what_broke_off_too() -> None:
    """It has one limit, that it repeats its bits: without the line a first look showed nothing of the model."""
    from spook_tracker.tracker.cli.report_table import model_looks
    from tests.histories.documents import definition, run, sample

    metrics = {
        "settled": ("rest", {"value": 10.0, "outcome": "unsettled", "failure": "still moves at 2 m/s after 10 s"}),
        "predictable_time": ("motion", {"value": 0.3}),
        "energy_drift": ("books", {"value": math.nan, "outcome": "diverged", "failure": "no number before 1 s"}),
    }  # fmt: skip
    document = run(
        series=tuple(
            definition(
                name, test="bowl", metric=name, configuration=of, role="reported", limit=None, set_point=None
            )
            for name, (of, _) in metrics.items()
        ),
        samples=tuple(sample(name, **facts) for name, (_, facts) in metrics.items()),
    )

    assert model_looks(document) == [
        "bowl: still moves at 2 m/s after 10 s; can be predicted for 0.3 s; books diverged: no number before 1 s"
    ]
    assert model_looks(run()) == []
