"""What a page may weigh, on a history with more nights, tests and faults than a reader is likely to have."""

import gzip
import random
import re

import msgspec
import pytest

from spook_tracker.tracker.website.publish import publish
from tests.histories.synthetic import SEVEN, DocumentHistory, document
from tests.website.browser import LIVE
from tests.website.page_weights import FIRST, OTHERS, SENT, WHOLE_HISTORY, too_heavy
from tests.website.scripts import handed_over

COPIES = 4  # of the seven tests: 28 in all, with 16 series each
NIGHTS = 70


def many(night, copies=COPIES, kept=lambda definition: True):
    """A night of many tests, every one of them broken in the last ten nights."""
    told = document(night, broken=NIGHTS - 10 if night % 3 else 10**9)
    keys = {d.key for d in told.series if kept(d)}
    told = msgspec.structs.replace(
        told,
        series=tuple(d for d in told.series if d.key in keys),
        samples=tuple(s for s in told.samples if s.series in keys),
    )
    parts = {"tests": [], "series": [], "samples": [], "figures": []}
    for copy in range(copies):
        names = {name: f"{name}_{copy}" if copy else name for name in SEVEN}

        def renamed(key, names=names):
            test, slash, rest = key.partition("/")
            return names[test] + slash + rest

        parts["tests"] += [
            msgspec.structs.replace(c, name=names[c.name], title=f"{c.title} {copy}") for c in told.tests
        ]
        parts["series"] += [
            msgspec.structs.replace(d, key=renamed(d.key), test=names[d.test]) for d in told.series
        ]
        parts["samples"] += [msgspec.structs.replace(s, series=renamed(s.series)) for s in told.samples]
        parts["figures"] += [msgspec.structs.replace(f, test=names[f.test]) for f in told.figures]
    return msgspec.structs.replace(told, **{name: tuple(items) for name, items in parts.items()})


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    out = tmp_path_factory.mktemp("heavy") / "public"
    publish(DocumentHistory([many(n) for n in range(NIGHTS)]), out)
    return out


def test_every_page_is_within_its_budget(site):
    """All there are: the first, those of tests and engines, the overviews, the live one."""
    pages = {path.relative_to(site).as_posix() for path in site.rglob("*.html")}
    assert {
        "index.html",
        "compare.html",
        "regressions.html",
        "error-time.html",
        "engines.html",
        *LIVE,
    } <= pages
    assert too_heavy(site) == []


def test_the_first_page_has_room_for_a_hundred_tests(tmp_path):
    """More than the catalogue has; the last night mended what the two before broke."""
    copies = 15
    nights = [many(n, copies, lambda definition: definition.role == "gate") for n in range(NIGHTS)]
    publish(DocumentHistory(nights), tmp_path / "public")
    page = tmp_path / "public" / "index.html"

    assert page.read_text().count("<tr data-state") == copies * len(SEVEN)
    assert page.stat().st_size <= FIRST


CHART = re.compile(r'<figure class="chart card"[^>]*data-key="([\w/-]+)" data-file="([^"]+)"')


def test_the_data_of_charts_are_in_files(site):
    """Each chart names a file that is there and hands over its numbers, and no file is of no chart."""
    named = {}
    for page in site.rglob("*.html"):
        if page.name in WHOLE_HISTORY:
            continue
        text = page.read_text()
        charts = CHART.findall(text)
        assert len(charts) == text.count('<figure class="chart')
        assert '<div class="static">' not in text, "no picture stands beside what the script draws"
        for key, address in charts:
            file = (page.parent / address).resolve()
            assert {"data", "layout"} <= handed_over(file, "charted")[key].keys()
            named.setdefault(file, set()).add(page.name)

    assert {*named, site / "charts" / "nights.js"} == set(site.glob("charts/*.js"))
    assert set().union(*named.values()) > {"error-time.html", "stability.html"}


def test_a_page_above_its_budget_is_named(tmp_path):
    (tmp_path / "index.html").write_text("x" * (FIRST + 1))
    chart = '<figure class="chart card">' + "x" * OTHERS + "</figure>"
    (tmp_path / "light.html").write_text(chart + "x" * OTHERS)
    (tmp_path / "heavy.html").write_text(chart + "x" * (OTHERS + 1))
    noise = random.Random(1).randbytes(SENT).hex()
    (tmp_path / "noise.html").write_text(f'<figure class="chart card">{noise}</figure>')
    sent = len(gzip.compress((tmp_path / "noise.html").read_bytes(), mtime=0))

    assert too_heavy(tmp_path) == [
        f"heavy.html: {OTHERS + 1} bytes of {OTHERS}",
        f"index.html: {FIRST + 1} bytes of {FIRST}",
        f"noise.html: {sent} bytes of {SENT} compressed",
    ]
