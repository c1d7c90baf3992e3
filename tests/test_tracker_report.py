"""`tracker report`: one HTML file that needs no other, a PDF where a browser is, a sentence where none is."""

import os
import re
import time

import pytest

from spook_tracker.tracker.website import printed
from spook_tracker.tracker.website.folder import YOUNG, replacing
from tests.browser import MISSING, programs
from tests.synthetic_history import DocumentHistory, history


@pytest.fixture(scope="module")
def page():
    return printed.one_file(history(3, hostile=True))


def test_the_file_needs_nothing_else(page):
    assert "<script" not in page and 'rel="stylesheet"' not in page
    assert re.findall(r'<(?:img|script|link|iframe)[^>]*(?:src|href)="([^"]*)"', page) == []
    assert [a for a in re.findall(r'<a[^>]*href="([^"]*)"', page) if not a.startswith(("#", "http"))] == []
    assert "@page" in page and page.count('<section id="t-') > 5


def test_without_a_night_it_says_so():
    with pytest.raises(printed.PrintError, match="no night is recorded yet"):
        printed.one_file(DocumentHistory([]))


def test_without_a_browser_it_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(printed.shutil, "which", lambda name: None)

    with pytest.raises(printed.PrintError, match=r"none of chromium, .* is here"):
        printed.print_pdf(tmp_path / "a.html", tmp_path / "a.pdf")


def test_the_pdf_has_pages(tmp_path, page):
    if programs() is None:
        pytest.skip(MISSING)
    source = tmp_path / "night.html"
    source.write_text(page, encoding="utf-8")
    printed.print_pdf(source, tmp_path / "night.pdf")
    made = (tmp_path / "night.pdf").read_bytes()

    assert made.startswith(b"%PDF-")
    assert len(re.findall(rb"/Type\s*/Page\b", made)) > 5


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
    from tests.run_documents import definition, run, sample

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
    from tests.run_documents import definition, run, sample

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
