"""Views for people who ask with SQL: a night's gates in one table, without joins and without our ids.

    gate_values        every value that decides green or red, in every run
    run_times          every run time: the shortest of its repeats, and their middle
    latest_verdicts    the gates of each engine's newest run, green or red
    column_comments    what every table and column holds, also where the database keeps no comments (SQLite)

They hold no data, so they are made anew after every migration, from here: the same text for both databases, but
for the way each reads a JSON list.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from sqlalchemy import Connection, MetaData, inspect, text

from .models import Base

_RUN = """
SELECT run.started_at AS night, run.id AS run, engine_version.name AS engine,
    engine_version.version AS version, engine_version.git_hash AS git_hash,
    machine.fingerprint AS machine"""
_SERIES = """
    definition.test AS test, definition.configuration AS configuration, definition.metric AS metric,
    definition.time_step AS time_step, definition.unit AS unit, series.key AS series"""
_JOINED = """
FROM run
JOIN engine_version ON engine_version.id = run.engine_version_id
JOIN machine ON machine.id = run.machine_id
JOIN sample ON sample.started_at = run.started_at AND sample.run_key = run.key
JOIN definition ON definition.id = sample.definition_id
JOIN series ON series.id = sample.series_id"""
_GATES = f"""{_RUN},{_SERIES},
    sample.value AS value, definition.limit_low AS limit_low, definition.limit_high AS limit_high,
    sample.outcome AS outcome, sample.passed AS passed, sample.set_point_held AS set_point_held
{_JOINED}
WHERE definition.role = 'gate'"""

VIEWS: Mapping[str, str] = {
    "gate_values": _GATES,
    "run_times": f"""{_RUN},{_SERIES},
    sample.value AS error, {{shortest}} AS seconds, {{middle}} AS middle_seconds,
    timing.runs_per_repeat AS runs_per_repeat, timing.instructions AS instructions
{_JOINED}
JOIN timing ON timing.started_at = sample.started_at AND timing.run_key = sample.run_key
    AND timing.series_id = sample.series_id""",
    "latest_verdicts": """
SELECT gate_values.*,
    CASE WHEN outcome = 'not_supported' THEN 'not supported'
        WHEN passed AND set_point_held THEN 'green' ELSE 'red' END AS verdict
FROM gate_values
WHERE night = (SELECT max(run.started_at) FROM run
    JOIN engine_version ON engine_version.id = run.engine_version_id
    WHERE engine_version.name = gate_values.engine)""",
}
ABOUT: Mapping[str, str] = {
    "gate_values": "every value that decides green or red, in every run",
    "run_times": "every run time, in every run",
    "latest_verdicts": "the gates of each engine's newest run, green or red",
}
COLUMNS: Mapping[str, str] = {  # of all views
    "night": "start of the run, UTC",
    "run": "id of the run, as `tracker compare` takes it",
    "engine": "engine, such as spook",
    "version": "version of the engine",
    "git_hash": "full hash of the commit; empty for engines without one",
    "machine": "fingerprint: where it is equal, run times may be compared",
    "test": "scalar test",
    "configuration": "configuration of the method",
    "metric": "metric of the test",
    "time_step": "time step, s",
    "unit": "unit of the value",
    "series": "unique name of the series",
    "value": "the value; NULL where there is none, or it is not finite",
    "limit_low": "lower end of the limit; NULL: none",
    "limit_high": "upper end of the limit; NULL: none",
    "outcome": "value, or what came instead",
    "passed": "inside the limit of that night",
    "set_point_held": "inside the band theory expects",
    "error": "the error of the run that was timed, in `unit`",
    "seconds": "shortest of the repeats, s for one simulation",
    "middle_seconds": "mean of the repeats, s for one simulation",
    "runs_per_repeat": "simulations in one repeat",
    "instructions": "retired; NULL if not counted",
    "verdict": "green; red: limit or set point left, or no value; not supported",
}
_READ = {  # one number of a JSON list
    "sqlite": "(SELECT {function}(value) FROM json_each(timing.seconds))",
    "postgresql": "(SELECT {function}(value::float8) FROM json_array_elements_text(timing.seconds::json) AS value)",
}


def create_views(connection: Connection) -> None:
    """Make them; none may be there."""
    for statement in statements(connection.dialect.name):
        connection.execute(text(statement))


def drop_views(connection: Connection) -> None:
    """Take away those that are there, the ones that rest on others first: tables can then be altered."""
    there = set(inspect(connection).get_view_names())
    for name in reversed([*VIEWS, "column_comments"]):
        if name in there:
            connection.execute(text(f"DROP VIEW {name}"))


def statements(dialect: str) -> Iterator[str]:
    """The SQL that makes them, for sqlite or postgresql."""
    read = {
        name: _READ[dialect].format(function=function)
        for name, function in (("shortest", "min"), ("middle", "avg"))
    }
    for name, query in VIEWS.items():
        yield f"CREATE VIEW {name} AS" + (query.format(**read) if name == "run_times" else query)
    rows = ",\n".join(f"({', '.join(map(_quoted, row))})" for row in comments(Base.metadata))
    names = "column1 AS table_name, column2 AS column_name, column3 AS comment"
    yield f"CREATE VIEW column_comments AS SELECT {names} FROM (VALUES\n{rows}) AS listed"


def comments(metadata: MetaData) -> Iterator[tuple[str, str, str]]:
    """(table or view, column, what it holds); for the whole the column is empty."""
    for name, words in ABOUT.items():
        yield name, "", words
        for shown in columns_of(name):
            yield name, shown, COLUMNS[shown]
    for table in metadata.sorted_tables:
        yield table.name, "", table.comment or ""
        for column in table.columns:
            yield table.name, column.name, column.comment or ""


def columns_of(view: str) -> list[str]:
    """Columns of a view, in their order."""
    named = re.findall(r"\bAS (\w+)", VIEWS[view].partition("FROM run")[0].partition("FROM gate")[0])
    return [*columns_of("gate_values"), *named] if view == "latest_verdicts" else named


def _quoted(words: str) -> str:
    return "'" + words.replace("'", "''").replace(":", "\\:") + "'"  # a colon would begin a parameter
