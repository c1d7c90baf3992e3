"""What the outputs say of series that recovered."""

from __future__ import annotations

import json
from typing import Any

from click import unstyle

from spook_tracker.tracker.cli.report_ci import night_markdown
from spook_tracker.tracker.cli.report_compare import finding_lines, findings_json
from spook_tracker.tracker.cli.report_trend import summary


def recovered_alike(
    findings: Any, recovered: set[str], cases: Any, trend: Any, records: Any, accepted: Any
) -> None:
    """Recovered is what was red when it was last judged and is not now: text, JSON, JUnit, Markdown, trend say so."""
    lines = [unstyle(line) for line in finding_lines(findings)]
    assert {line.split()[1].rstrip(":") for line in lines if ": recovered; " in line} == recovered
    many = f"; {len(recovered)} recovered"
    assert (many in lines[0]) == bool(recovered)
    told = json.loads(findings_json(findings))
    assert {one["series"] for one in told if one["state"] == "recovered"} == recovered
    said = {
        f"{c.get('classname')}/{c.get('name')}"
        for c in cases
        if c.findtext("system-out", "").startswith("recovered: ")
    }
    assert said == recovered
    rows = [
        row for row in night_markdown(records.runs()[-1], findings).splitlines() if "| recovered |" in row
    ]
    assert len(rows) == len(recovered)
    for test in {finding.test for finding in findings}:
        trends = trend(records, test, None, accepted)
        found = {told.key for told in trends if told.nights[-1].state == "recovered"}
        assert (f"; {len(found)} recovered" in summary(trends)) == bool(found)
        assert found & {f.series for f in findings} == {
            key for key in recovered if key.startswith(f"{test}/")
        }
        for series_told in trends:
            _recovers_once(series_told)


def _recovers_once(told: Any) -> None:
    """Of each clock and each definition: after red comes, with nothing said between, recovered; and never else."""
    last: dict[Any, str] = {}
    for judged in told.nights:
        machine = judged.night.run.machine
        on = machine.fingerprint if told.definition.kind == "time" else machine.float_environment
        where = judged.night.test_version, on
        if judged.state == "unjudged":
            continue
        before = last.get(where)
        if judged.state == "recovered":
            assert before == "detected"
        elif judged.state == "green":
            assert before != "detected" or judged.verdict.word in ("new", "not_comparable")
        last[where] = judged.state
