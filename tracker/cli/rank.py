"""`tracker rank`: engines on the same scenes, from what is recorded. Nothing here is red; the exit code is 0."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from .filters import test_option
from .options import database_option, example

if TYPE_CHECKING:
    from spook_tracker.tracker.document.run_document import EngineVersion, Sample, SeriesDefinition
    from spook_tracker.tracker.judge.rank import Lead, Standing
    from spook_tracker.tracker.judge.work import Samples
    from spook_tracker.tracker.store.history import History
    from spook_tracker.tracker.store.versions import RunInfo


@click.command(epilog=example("tracker run --engine spook,mujoco --sweep", "tracker rank"))
@click.argument("engines", nargs=-1, metavar="[ENGINE]...")
@test_option
@database_option
def rank(engines: tuple[str, ...], tests: tuple[str, ...], database: str) -> None:
    """Table of engines and scenes: error at h = 1/60, run time to reach 1e-2, 1e-4 and 1e-6.

    ENGINE is a name or name@version; by default every recorded engine. A name stands for the latest run; tests that it
    did not include are taken from earlier runs on the same machine, of the same version or of earlier commits.
    """
    from .console import say
    from .recorded import history_of

    with history_of(database) as history:
        names = engines or tuple(dict.fromkeys(run.engine.name for run in history.runs()))
        if not names:
            raise click.UsageError(
                "nothing is recorded yet; measure: tracker run --engine spook,mujoco --sweep"
            )
        say("\n".join(table_lines(history, names, tests)))


def table_lines(history: History, names: Sequence[str], tests: Sequence[str] = ()) -> list[str]:
    """The table, of these tests alone if some are named, and between two engines which is ahead where."""
    from fnmatch import fnmatchcase

    import spook_tracker.tracker.judge.rank as ranks
    from spook_tracker.tracker.document.wording import day

    from .console import NARROW, Column, clean, table, width

    runs = {name: history.resolve(name if "@" in name else f"{name}@latest") for name in names}
    titles = _titles([run.engine for run in runs.values()])
    answered = [
        history.samples(run.id) if "@" in name else _newest(history, run) for name, run in runs.items()
    ]
    found = ranks.standings(dict(zip(titles, answered, strict=True)))
    if tests:
        found = [one for one in found if any(fnmatchcase(one.test, pattern) for pattern in tests)]
    if not found:
        again = f"tracker run --engine {','.join(names)} --sweep"
        return [f"no error against run time is recorded of {' or '.join(names)}; measure it: {again}"]
    heading = [
        clean(f"{run.engine.name} {run.engine.version}, measured {day(run.started)}") for run in runs.values()
    ]
    columns = (
        Column("scene", flexible=True),
        Column("engine"),
        Column("error at 1/60", "right", flexible=True, least=17),
        *(Column(f"to {error:g}", "right") for error in ranks.ERRORS),
    )
    rows: list[tuple[str, ...]] = []
    previous = ""
    for one in found:
        scene = f"{one.test} {one.ladder} [{one.unit}]"
        rows.append(("" if scene == previous else scene, one.engine, _error(one), *map(_time, one.seconds)))
        previous = scene
    if width() < NARROW:  # the scene stands above its engines
        columns, rows = columns[1:], [part for row in rows for part in (row[:1], row[1:]) if any(part)]
    lines = [*heading, "", *table(columns, rows, width(), {}), ""]
    machines = {run.machine.fingerprint for run in runs.values()}
    if len(machines) > 1:
        return [*lines, "measured on different machines: the run times are not comparable"]
    if len(titles) == 2:
        lines += _ahead(ranks.leads(found, *titles), ranks.ERRORS)
    return lines


def _newest(history: History, latest: RunInfo) -> Samples:
    """The ladders of a run, and of tests it was not asked those of the newest run before that was."""
    found: dict[str, tuple[SeriesDefinition, Sample]] = {}
    earlier = [
        run
        for run in history.runs(latest.engine.name)
        if run.machine.fingerprint == latest.machine.fingerprint
        and (run.engine.version == latest.engine.version or run.engine.git_hash)
        and run.started_at <= latest.started_at
    ]
    for run in sorted(earlier, key=lambda run: run.started_at, reverse=True):
        told = {definition.test for definition, _ in found.values()}
        ladders = ((key, one) for key, one in history.samples(run.id).items() if one[0].kind == "ladder")
        found |= {key: one for key, one in ladders if one[0].test not in told}
        if run.asked is None or (run.asked.whole and "sweep" in run.asked.families):
            break
    return found


def _titles(engines: Sequence[EngineVersion]) -> list[str]:
    """Names, with versions where one name stands for two engines."""
    names = [engine.name for engine in engines]
    alone = len(set(names)) == len(names)
    return names if alone else [f"{engine.name} {engine.version}" for engine in engines]


def _error(one: Standing) -> str:
    if one.error is not None:
        return f"{one.error:.2g} ({one.configuration})"
    return one.outcome.replace("_", " ")


def _time(seconds: float | None) -> str:
    if seconds is None:
        return "-"
    return f"{seconds:.2g} s" if seconds >= 0.1 else f"{1e3 * seconds:.2g} ms"


def _ahead(leads: Sequence[Lead], errors: Sequence[float]) -> list[str]:
    """Scenes down, errors across: which gets there first, and by what factor."""
    from .console import Column, table, width

    if not leads:
        return ["neither reaches any of these errors"]
    rows: dict[tuple[str, ...], dict[float, str]] = {}
    won: dict[str, int] = {}
    for one in leads:
        by = "alone" if math.isinf(one.factor) else f"{one.factor:.1f} ×"
        rows.setdefault((f"{one.test} {one.ladder} [{one.unit}]",), {})[one.error] = f"{one.ahead} {by}"
        won[one.ahead] = won.get(one.ahead, 0) + 1
    columns = (
        Column("ahead at equal error", flexible=True),
        *(Column(f"at {e:g}", "right") for e in errors),
    )
    lines = table(
        columns, [(*scene, *(at.get(e, "-") for e in errors)) for scene, at in rows.items()], width(), {}
    )
    score = ", ".join(f"{name} {count}" for name, count in won.items())
    return [*lines, "", f"ahead in {len(leads)} places (a scene at an error): {score}"]
