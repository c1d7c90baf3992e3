"""How long a website takes and what its pages weigh: many nights at once, and one more night on top.

Synthetic runs (`tests/histories/synthetic.py`) stand for the nights; 51 series with every chart. Then the recorded night
of ours beside all engines, without replays and the live page, which are more.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import msgspec

from bench.costs import asked, bench, cost, exact, in_units
from spook_tracker.tracker.website.options import SiteOptions
from spook_tracker.tracker.website.publish import publish
from spook_tracker.tracker.website.recorded import read_files
from tests.histories.synthetic import DocumentHistory, decade
from tests.website.page_weights import too_heavy

NIGHTS, SERIES = 1000, 51
REPEATS = 3  # the least counts: others at work on the machine only make it longer
RECORDED = Path(__file__).parent / "recorded"


def history(nights: int, series: int) -> DocumentHistory:
    """That many nights of that many series."""
    cut = []
    for document in decade(nights).documents.values():
        kept = document.series[:series]
        keys = {definition.key for definition in kept}
        samples = tuple(sample for sample in document.samples if sample.series in keys)
        cut.append(msgspec.structs.replace(document, series=kept, samples=samples))
    return DocumentHistory(cut)


def recorded_night(out: Path) -> float:
    """MB a test of the website of our own recorded night, all recorded engines beside it."""
    ours = [run for run in read_files(RECORDED).night if run.engine.name == "spook"]
    tests = {definition.test for run in ours for definition in run.series}
    return (
        publish(DocumentHistory(ours), out, options=SiteOptions(recorded=RECORDED)).bytes / len(tests) / 1e6
    )


def website() -> dict[str, float]:
    """A thousand nights from nothing, and one more on top of them."""
    taken: dict[str, list[float]] = {"all_nights": [], "one_more": []}
    grown = [history(nights, SERIES) for nights in (NIGHTS, NIGHTS + 1)]
    with tempfile.TemporaryDirectory() as folder:
        for attempt in range(REPEATS):
            site = Path(folder) / f"public-{attempt}"
            for name, found in zip(taken, grown, strict=True):
                start = time.process_time()
                publish(found, site)
                taken[name].append(time.process_time() - start)
        heavy = len(too_heavy(site))
    return {name: in_units(min(times), "entry") for name, times in taken.items()} | {"heavy_pages": heavy}


def recorded() -> dict[str, float]:
    with tempfile.TemporaryDirectory() as folder:
        return {"size_per_test": recorded_night(Path(folder) / "recorded")}


TESTS = {
    "publish": bench(
        "Website",
        "What does a website of a thousand nights cost, and what do its pages weigh?",
        asked(
            f"{NIGHTS} nights",
            website,
            cost("all_nights", "published from nothing", 1.1e7, "a second and a half", unit="entry"),
            cost("one_more", "published on top", 3.7e6, "half a second", unit="entry"),
            exact(
                "heavy_pages",
                "above their budget, as tests/website has it",
                0.0,
                "what a phone loads",
                unit="1",
            ),
        ),
        asked(
            "recorded night",
            recorded,
            exact(
                "size_per_test",
                "a test of it, beside all engines",
                11.0 / 77,
                "11 MB for the 77 tests that were recorded when it was set",
                unit="MB",
                change=0.01,
            ),
        ),
        beside="Python on this machine, and what a reader waits for",
    )
}
