"""`tracker rank`: engines on the same scenes, from what is recorded. Nothing here is red; the exit code is 0."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import click

from spook_tracker.tracker.cli.options import database_option, example


@click.command(epilog=example("tracker run --engine spook,mujoco --sweep", "tracker rank"))
@click.argument("engines", nargs=-1, metavar="[ENGINE]...")
@database_option
def rank(engines: tuple[str, ...], database: str) -> None:
    """Table of engines and scenes: error at h = 1/60, run time to reach 1e-2, 1e-4 and 1e-6.

    ENGINE is a name (its latest run) or name@version; without any, every engine that is recorded.
    """
    from spook_tracker.tracker.cli.console import say
    from spook_tracker.tracker.cli.history import history_of

    with history_of(database) as history:
        names = engines or tuple(dict.fromkeys(run.engine.name for run in history.runs()))
        say("\n".join(table_lines(history, names)))


def table_lines(history: Any, names: Sequence[str]) -> list[str]:
    """The table, and between two engines who is ahead where."""
    import spook_tracker.tracker.judge.rank as ranks
    from spook_tracker.tracker.cli.console import Column, table, width

    runs = {name: history.resolve(name if "@" in name else f"{name}@latest") for name in names}
    titles = {name: f"{run.engine.name} {run.engine.version}" for name, run in runs.items()}
    found = ranks.standings({titles[name]: history.samples(run.id) for name, run in runs.items()})
    if not found:
        return ["no error against run time is recorded of these engines; measure it: tracker run --sweep"]
    columns = (
        Column("scene", flexible=True),
        Column("engine"),
        Column("error at 1/60", "right"),
        *(Column(f"to {error:g}", "right") for error in ranks.ERRORS),
    )
    rows: list[tuple[str, ...]] = []
    previous = ""
    for one in found:
        scene = f"{one.test} {one.ladder} [{one.unit}]"
        error = (
            one.outcome.replace("_", " ") if one.error is None else f"{one.error:.2g} ({one.configuration})"
        )
        rows.append(("" if scene == previous else scene, one.engine, error, *(_time(t) for t in one.seconds)))
        previous = scene
    lines = [*table(columns, rows, width(), {}), ""]
    machines = {run.machine.fingerprint for run in runs.values()}
    if len(machines) > 1:
        return [*lines, "measured on different machines: the run times are not comparable"]
    if len(titles) == 2:
        lines += _ahead(ranks.leads(found, *titles.values()))
    return lines


def _time(seconds: float | None) -> str:
    if seconds is None:
        return "-"
    return f"{seconds:.2g} s" if seconds >= 0.1 else f"{1e3 * seconds:.2g} ms"


def _ahead(leads: Sequence[Any]) -> list[str]:
    lines = ["at equal error"]
    for one in leads:
        by = "alone reaches it" if math.isinf(one.factor) else f"ahead {one.factor:.1f} times"
        lines.append(f"  {one.test} {one.ladder} at {one.error:g} {one.unit}: {one.ahead} {by}")
    return lines if leads else ["neither reaches any of these errors"]
