"""What programs, pull requests and the first page read of a night: each is told the same of every series."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from click import unstyle

from spook_tracker.tracker.cli.report_ci import night_markdown
from spook_tracker.tracker.cli.report_compare import escape, findings_json, summary
from spook_tracker.tracker.cli.report_json import trend_json
from spook_tracker.tracker.website.page_index import lead

BOTH = ("word", "sentence", "state", "news", "value", "levels", "accused")


def read_alike(run: Any, findings: Sequence[Any], trends: Sequence[Any], book: Any, causes: Any) -> None:
    """JSON of the night and of its trends, its Markdown and the first page."""
    night = {one["series"]: one for one in json.loads(findings_json(findings))}
    nights = {one["series"]: one["nights"][-1] for one in json.loads(trend_json(trends))}
    here = {key: one for key, one in nights.items() if one["run"] == run.id}
    assert here.keys() == night.keys()
    for key, one in night.items():
        told = [
            [name, one.get(name), here[key].get(name)] for name in BOTH
        ]  # as text: no number equals itself
        assert [str(pair[1]) for pair in told] == [str(pair[2]) for pair in told], told

    red, new = ([one["series"] for one in night.values() if one[what]] for what in ("red", "news"))
    assert set(new) <= set(red)
    also = [finding.series for finding in findings if finding.recovered or finding.worse_than_expected]
    rows = [
        row.split("|")[1].strip()
        for row in night_markdown(run, findings).splitlines()
        if row.startswith("| ")
    ]
    assert rows[1:] == [escape(key) for key in (*red, *also)] if rows else not [*red, *also]
    said = unstyle(summary(findings))
    assert (f"{len(new) or 'none of them'} new tonight" in said) == bool(red)
    fresh = [hit.series for cause in lead(book, causes)["new"] for hit in cause.fresh]
    assert set(new) == set(fresh) & night.keys()
