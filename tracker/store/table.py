"""The history as one table, a row for each value: a pandas DataFrame, and from it CSV and Parquet.

pandas, and fastparquet for Parquet, are an optional extra: `pip install 'spook-tracker[data]'`.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sqlalchemy import select

from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.store import models

if TYPE_CHECKING:
    import pandas
    from sqlalchemy.orm import Session

CHUNK = 500  # runs in one IN (...)


class TableError(TrackerError):
    """The table cannot be made; one sentence that names the way out."""


def values_table(session: Session, run_keys: Iterable[int]) -> pandas.DataFrame:
    """Every value of these runs, in the order of time and of their documents.

    Numbers are the float64 that were recorded, NaN and infinities included; where there is no number, `outcome`
    says why. Times are UTC.
    """
    frames = _pandas()
    run, engine, machine = models.Run, models.EngineVersion, models.Machine
    sample, definition, series = models.Sample, models.Definition, models.Series
    columns: dict[str, Any] = {
        "night": run.started_at, "run": run.id, "engine": engine.name, "version": engine.version,
        "git_hash": engine.git_hash, "machine": machine.fingerprint, "test": definition.test,
        "configuration": definition.configuration, "metric": definition.metric, "role": definition.role,
        "kind": definition.kind, "time_step": definition.time_step, "unit": definition.unit,
        "series": series.key, "value": sample.value, "special": sample.special, "outcome": sample.outcome,
        "passed": sample.passed, "set_point_held": sample.set_point_held,
        "limit_low": definition.limit_low, "limit_high": definition.limit_high,
    }  # fmt: skip
    query = (
        select(*(column.label(name) for name, column in columns.items()))
        .join_from(run, engine, engine.id == run.engine_version_id)
        .join(machine, machine.id == run.machine_id)
        .join(sample, (sample.started_at == run.started_at) & (sample.run_key == run.key))
        .join(definition, definition.id == sample.definition_id)
        .join(series, series.id == sample.series_id)
        .order_by(run.started_at, run.key, sample.position)
    )
    keys = sorted(run_keys)
    rows: list[Any] = []
    for start in range(0, len(keys), CHUNK):
        rows += session.execute(query.where(run.key.in_(keys[start : start + CHUNK]))).all()
    rows.sort(
        key=lambda row: row.night
    )  # chunks of keys are not in the order of time; within a night they are
    table: pandas.DataFrame = frames.DataFrame(rows, columns=list(columns))
    numbers = {name: float(name) for name in models.SPECIALS}
    special = table.pop("special").map(numbers)
    table["value"] = (
        table["value"].astype("float64").where(special.isna() & ~(table["value"].isna()), special)
    )
    for name in ("time_step", "limit_low", "limit_high"):
        table[name] = table[name].astype("float64")
    return table


def write_table(table: pandas.DataFrame, file: Path, form: str) -> int:
    """Write it as csv or parquet; returns the number of values. Floats of a CSV read back to the same bits."""
    try:
        if form == "csv":
            table.to_csv(file, index=False, date_format="%Y-%m-%dT%H:%M:%S.%f%z")
        else:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # what fastparquet and pandas have to settle with each other
                table.to_parquet(file, index=False)
    except ImportError:
        raise TableError("Parquet needs fastparquet; install spook-tracker[data], or ask for csv") from None
    except OSError as error:
        raise TableError(f"{file} cannot be written: {error.strerror or error}") from None
    return len(table)


def _pandas() -> Any:
    try:
        return import_module("pandas")
    except ImportError:
        raise TableError("tables need pandas; install spook-tracker[data]") from None
