"""The history as one table, a row for each value: a pandas DataFrame, and from it CSV and Parquet.

pandas is in the extra `standard`, and both pandas and fastparquet, for Parquet, in `data`.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from importlib import import_module
from operator import itemgetter
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from spook_tracker.tracker.document.errors import TrackerError

from .reader import CHUNK, Reader, SqlValue, listed
from .rows import SPECIALS, stored_moment

if TYPE_CHECKING:
    import pandas

COLUMNS = {
    "night": "r.started_at", "run": "r.id", "engine": "v.name", "version": "v.version", "git_hash": "v.git_hash",
    "machine": "m.fingerprint", "test": "d.test", "configuration": "d.configuration", "metric": "d.metric",
    "role": "d.role", "kind": "d.kind", "time_step": "d.time_step", "unit": "d.unit", "series": "series.key",
    "value": "s.value", "special": "s.special", "outcome": "s.outcome", "passed": "s.passed",
    "set_point_held": "s.set_point_held", "limit_low": "d.limit_low", "limit_high": "d.limit_high",
}  # fmt: skip
QUERY = """SELECT {columns} FROM run r
    JOIN engine_version v ON v.id = r.engine_version_id
    JOIN machine m ON m.id = r.machine_id
    JOIN sample s ON s.started_at = r.started_at AND s.run_key = r.key
    JOIN definition d ON d.id = s.definition_id
    JOIN series ON series.id = s.series_id
    WHERE r.key IN {runs} ORDER BY r.started_at, r.key, s.position"""


class TableError(TrackerError):
    """The table cannot be made; one sentence that names the way out."""


def values_table(reader: Reader, run_keys: Iterable[int]) -> pandas.DataFrame:
    """Every value of these runs, in the order of time and of their documents.

    Numbers are the float64 that were recorded, NaN and infinities included; where there is no number, `outcome`
    says why. Times are UTC.
    """
    frames = _pandas()
    keys = sorted(run_keys)
    rows: list[tuple[SqlValue, ...]] = []
    for start in range(0, len(keys), CHUNK):
        chosen = listed(keys[start : start + CHUNK])
        found = reader.rows(QUERY.format(columns=", ".join(COLUMNS.values()), runs=chosen))
        rows += [(stored_moment(night), *rest) for night, *rest in found]
    rows.sort(key=itemgetter(0))  # chunks of keys are not in the order of time; within a night they are
    table: pandas.DataFrame = frames.DataFrame(rows, columns=list(COLUMNS))
    numbers = {name: float(name) for name in SPECIALS}
    special = table.pop("special").map(numbers)
    table["value"] = (
        table["value"].astype("float64").where(special.isna() & ~(table["value"].isna()), special)
    )
    for name in ("passed", "set_point_held"):
        table[name] = table[name].astype("bool")
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


def _pandas() -> ModuleType:
    try:
        return import_module("pandas")
    except ImportError:
        raise TableError(
            "tables need pandas; install it with: pip install 'spook-tracker[standard]'"
        ) from None
