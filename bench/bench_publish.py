"""How long a website takes and what its pages weigh: many nights at once, and one more night on top.

    make bench-publish

Synthetic runs (`tests/histories/synthetic.py`) stand for the nights; 51 series with every chart. Then the recorded night
of ours beside all engines, without replays and the live page, which are more. Ends with 1 where a thousand
nights take more than 1.5 s of the processor, one more night more than 0.5 s (on another machine as much more as Python
takes there), a page weighs too much, or the recorded
night more than 11 MB.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
import time
from pathlib import Path

import msgspec

sys.path.insert(0, str(Path(__file__).parent.parent))

from bench.floors import here
from spook_tracker.tracker.website.options import SiteOptions
from spook_tracker.tracker.website.publish import publish
from spook_tracker.tracker.website.recorded import read_files
from tests.histories.synthetic import DocumentHistory, decade
from tests.website.page_weights import before_charts, too_heavy

REPEATS = 3  # the least counts: others at work on the machine only make it longer
MOST = (1.5, 0.5)  # s of the processor for a thousand nights, and for one more
RECORDED = Path(__file__).parent / "recorded"
BYTES = 11_000_000  # of the recorded night


def history(nights: int, series: int) -> DocumentHistory:
    """That many nights of that many series."""
    cut = []
    for document in decade(nights).documents.values():
        kept = document.series[:series]
        keys = {definition.key for definition in kept}
        samples = tuple(sample for sample in document.samples if sample.series in keys)
        cut.append(msgspec.structs.replace(document, series=kept, samples=samples))
    return DocumentHistory(cut)


def recorded_night(out: Path) -> int:
    """Bytes of the website of our own recorded night, all recorded engines beside it."""
    ours = [run for run in read_files(RECORDED).night if run.engine.name == "spook"]
    return publish(DocumentHistory(ours), out, options=SiteOptions(recorded=RECORDED)).bytes


def main() -> None:
    reader = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    reader.add_argument("--nights", type=int, default=1000)
    reader.add_argument("--series", type=int, default=51)
    asked = reader.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "public"
        seconds = []
        grown = [history(nights, asked.series) for nights in (asked.nights, asked.nights + 1)]
        for found in grown:
            least = math.inf
            for attempt in range(REPEATS):
                site = out.with_name(f"{out.name}-{attempt}")
                start = time.process_time()
                report = publish(found, site)
                least = min(least, time.process_time() - start)
            seconds.append(least)
            told = f"{report.written} files written, {report.skipped} kept"
            nights = len(found.documents)
            print(f"{nights} nights, {asked.series} series: {least:.2f} s of processor time, {told}")
        out = site
        print(f"one more night / all nights: {seconds[1] / seconds[0]:.2f}")
        slow = [
            f"{took:.2f} s"
            for took, most in zip(seconds, MOST, strict=True)
            if took > here(most, "interpreter")
        ]
        print(f"{'page':<32}{'bytes':>10}{'before charts':>15}")
        for page in sorted(out.rglob("*.html")):
            name = str(page.relative_to(out))
            bare = before_charts(page)
            print(f"{name:<32}{page.stat().st_size:>10}{bare:>15}")
        blocks = sorted((out / "compare").glob("nights-*.js"), key=lambda path: path.stat().st_size)
        if blocks:
            print(
                f"{len(blocks)} blocks of nights for comparisons, the largest {blocks[-1].stat().st_size} bytes"
            )
        total = sum(path.stat().st_size for path in out.rglob("*") if path.is_file())
        print(f"the whole site: {total / 1e6:.1f} MB")
        heavy = too_heavy(out)
        whole = recorded_night(Path(folder) / "recorded")
        print(f"the recorded night beside all engines: {whole / 1e6:.1f} MB")
        if whole > BYTES:
            heavy.append(f"recorded night: {whole} bytes of {BYTES}")
        if heavy or (slow and asked.nights <= 1000):
            sys.exit(f"over budget: {', '.join([*heavy, *slow])}")


if __name__ == "__main__":
    main()
