"""What commands print for programs: `--json` of trend, list, show, explain and db stats."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from spook_tracker.scalar_tests.case import ScalarTest
from spook_tracker.tracker.document.coverage import HEADINGS, Coverage
from spook_tracker.tracker.document.json_form import Number, Writable, readable
from spook_tracker.tracker.judge.judged import Judged
from spook_tracker.tracker.judge.maps import ToldMap
from spook_tracker.tracker.judge.series_history import Told

from .report_compare import accused

if TYPE_CHECKING:
    from spook_tracker.tracker.measure.questions import Stage
    from spook_tracker.tracker.measure.step_cost import LeavingOut, StepCost
    from spook_tracker.tracker.store.storage_counts import Statistics


def trend_json(trends: Iterable[Told], maps: Iterable[ToldMap] = ()) -> str:
    """A list with an object for each series: its definition, and every night with its verdict, oldest first.

    Stability maps stand after them, with what became of them in place of nights.
    """
    told: list[dict[str, Writable]] = [
        {"series": told.key, "definition": told.definition, "nights": [_night(j) for j in told.nights]}
        for told in trends
    ]
    return readable(told + list(map(_map, maps)))


def _map(told: ToldMap) -> dict[str, Writable]:
    red = told.verdict.red
    return {
        "series": told.key,
        "definition": None,
        "nights": [],
        "word": told.verdict.word,
        "sentence": told.verdict.sentence,
        "stands": told.stands,
        "news": red and told.news,
        "state": told.state,
        "first_bad": told.bad.engine.git_hash if red else "",
        "last_good": told.good.engine.git_hash if red else "",
    }


def _night(judged: Judged) -> dict[str, Writable]:
    run = judged.night.run
    return {
        "run": run.id,
        "started": run.started,
        "version": run.engine.version,
        "commit": run.engine.git_hash,
        "dirty": run.engine.dirty,
        "machine": run.machine.fingerprint,
        "value": judged.night.sample.value,
        "outcome": judged.night.sample.outcome,
        "word": judged.verdict.word,
        "name": judged.verdict.name,
        "sentence": judged.verdict.sentence,
        "state": judged.state,
        "stands": judged.stands,
        "news": judged.news,
        "levels": judged.levels,
        "first_bad": judged.worse_at.run.engine.git_hash if judged.worse_at else "",
        "last_good": judged.before_worse.run.engine.git_hash if judged.before_worse else "",
        **accused(judged),
        "accepted": judged.accepted,
    }


def list_json(tests: Mapping[str, ScalarTest]) -> str:
    """A list with an object for each test: its question and what is measured."""
    return readable([_test(name, test) for name, test in tests.items()])


def coverage_json(rows: Sequence[Coverage]) -> str:
    """A list with an object for each scene: its cells by their headings."""
    return readable(
        [
            {"test": row.test, "title": row.title, **dict(zip(HEADINGS, row.cells, strict=True))}
            for row in rows
        ]
    )


def _test(name: str, test: ScalarTest) -> dict[str, Writable]:
    return {
        "test": name,
        "title": test.title,
        "question": test.question,
        "topic": test.topic,
        "seven": test.seven,
        "metrics": [
            {
                "metric": metric.name,
                "configuration": measurement.configuration,
                "time_step": measurement.time_step,
                "role": metric.role,
                "unit": metric.unit,
                "better": metric.better,
                "limit": _limit(metric.limit),
                "limit_source": metric.limit_source,
                "limit_kind": metric.limit_kind,
                "set_point": _limit(metric.set_point),
                "set_point_source": metric.set_point_source,
                "set_point_kind": metric.set_point_kind,
                "description": metric.description,
            }
            for measurement, metric in test.metrics()
        ],
    }


def _limit(limit: float | tuple[float, float] | None) -> Number | tuple[Number, ...] | None:
    if limit is None:
        return None
    return tuple(map(Number, limit)) if isinstance(limit, tuple) else Number(limit)


def show_json(name: str, test: ScalarTest) -> str:
    """One test in full: an object of `list --json` and all that its page says."""
    words = ("why", "model", "parameters", "theory", "reference", "conclusion", "source", "misprints")
    return readable(_test(name, test) | {word: getattr(test, word) for word in words})


def explain_json(
    name: str,
    choices: Iterable[Stage],
    costs: StepCost | None = None,
    out: LeavingOut | None = None,
) -> str:
    """The stages of a test's scene in order; `seconds_per_step` is what one takes or, left out, saves, `within` the stage
    that has the time of one that is part of its loop. The times of stages and `beside_stages` add up to the whole step.

    `leaving_out`, where it was measured: how many times as long a step takes with all that could be forced in, and the
    least and the largest of its rounds.
    """
    told: list[Writable] = []
    for choice in choices:
        measured = (costs.stages if costs else {}) if choice.kept else (out.saved if out else {})
        told.append(
            {
                "stage": choice.stage,
                "kept": choice.kept,
                "reason": choice.reason,
                "seconds_per_step": measured.get(choice.stage),
                "within": getattr(choice, "within", ""),
            }
        )
    whole: dict[str, Writable] = (
        {"seconds_per_step": costs.whole, "beside_stages": costs.beside} if costs else {}
    )
    saving: dict[str, Writable] = {} if out is None else {"leaving_out": out.told()}
    return readable({"test": name, "stages": told} | whole | saving)


def stats_json(found: Statistics) -> str:
    """How much is stored: bytes, rows by table, runs by engine."""
    told = {name: getattr(found, name) for name in ("database", "revision", "size", "rows", "engines")}
    ends = {
        end: getattr(found, end).isoformat() if getattr(found, end) else None for end in ("first", "last")
    }
    return readable(told | ends)
