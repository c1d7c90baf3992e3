"""What a page may weigh, on a history with more nights, tests and faults than a reader is likely to have."""

import re

import msgspec
import pytest

from spook_tracker.tracker.website.publish import publish
from tests.synthetic_history import SEVEN, DocumentHistory, document

COPIES = 4  # of the seven tests: 28 in all, with 16 series each
NIGHTS = 70


def many(night):
    """A night of many tests, every one of them broken in the last ten nights."""
    told = document(night, broken=NIGHTS - 10 if night % 3 else 10**9)
    parts = {"tests": [], "series": [], "samples": [], "figures": []}
    for copy in range(COPIES):
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


def weight(page):
    """Bytes of a page without its charts."""
    text = page.read_text(encoding="utf-8")
    return len(re.sub(r'<figure class="chart.*?</figure>', "", text, flags=re.DOTALL).encode())


def test_the_first_page_is_light(site):
    assert (site / "index.html").stat().st_size <= 100_000


@pytest.mark.parametrize(
    "page", ["compare.html", "regressions.html", "tests/pendulum.html", "error-time.html"]
)
def test_other_pages_stay_below_their_budget_before_charts(site, page):
    assert weight(site / page) <= 400_000
