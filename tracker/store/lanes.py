"""The series of whole engines, of what is kept of an earlier reading and what was recorded since."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import accumulate, chain
from operator import sub

from spook_tracker.tracker.document.kept import Kept
from spook_tracker.tracker.document.points import Points, Stretches
from spook_tracker.tracker.document.run_document import Run, Runs, Said, SeriesDefinition, SeriesHistory

from .columns import Lane, together
from .identity import identity
from .reader import Reader, Row, listed
from .sample_rows import OF_ITS_RUN, SAMPLE, bare_sample_of
from .versions import RunInfo

AT_ONCE = 64  # runs read together
Definitions = Callable[
    [Iterable[int]], Mapping[int, SeriesDefinition]
]  # by id; those asked for are among them


def read_lanes(reader: Reader, engines: Mapping[str, Sequence[RunInfo]], kept: Kept) -> dict[str, Lane]:
    """What the runs of every engine said."""
    lanes = {}
    for engine, runs in engines.items():
        lane = lanes[engine] = Lane(engine, [(run.key, run.content) for run in runs], kept)
        for start in range(lane.known, len(runs), AT_ONCE):
            of = {run.key: start + i for i, run in enumerate(runs[start : start + AT_ONCE])}
            query = (
                f"SELECT {SAMPLE} FROM run r CROSS JOIN sample s WHERE r.key IN {listed(of)} AND {OF_ITS_RUN}"
            )
            found: dict[int, list[Row]] = {key: [] for key in of}
            for run_key, *row in reader.each_row(query):
                found[run_key].append(row)
            for key, place in of.items():
                lane.add(place, found[key])
        lane.keep(kept)
    return lanes


def newest_definitions(
    lanes: Mapping[str, Lane],
    place: Mapping[int, int],
    canonical: Mapping[int, str],
    read_definitions: Definitions,
) -> dict[str, int]:
    """By today's key the definition in the last run that has the series, whichever engine's; `place` is that of a run."""
    newest: dict[str, tuple[int, int]] = {}

    def later(one: tuple[int, int], other: tuple[int, int], key: str) -> bool:
        if one[0] != other[0]:
            return one[0] > other[0]
        return read_definitions([one[1]])[one[1]].key == key  # of two names in one run, today's

    for lane in lanes.values():
        told = list(lane.told)
        for series_id, column in lane.series.items():
            found = place[lane.runs[column.ends[-1] - 1][0]], told[column.codes[-1]][0]
            key = canonical[series_id]
            if key not in newest or later(found, newest[key], key):
                newest[key] = found
    return {key: definition for key, (_, definition) in newest.items()}


def histories_of(
    lane: Lane,
    runs: Sequence[Run],
    newest: Mapping[str, int],
    canonical: Mapping[int, str],
    read_definitions: Definitions,
) -> dict[str, SeriesHistory]:
    """The histories of all series of a lane over its runs, by today's key; `newest` has their definitions."""
    definitions = read_definitions({told[0] for told in lane.told} | set(newest.values()))
    said: list[Said | None] = []
    for definition_id, *told in lane.told:
        definition = definitions.get(definition_id)  # None: of a run that is not there any more
        sample = definition and bare_sample_of(definition.key, *told)  # type: ignore[arg-type]
        said.append((sample, definition.test_version, True) if definition and sample else None)
    by_key: dict[str, list[int]] = {}
    for series_id in sorted(lane.series):
        by_key.setdefault(canonical[series_id], []).append(series_id)
    shared: dict[tuple[tuple[int, int], ...], Runs] = {}
    result = {}
    for key in sorted(by_key):
        columns = [lane.series[series_id] for series_id in by_key[key]]
        if len(columns) > 1:
            own = identity("series", key)
            column = together(columns, [series_id == own for series_id in by_key[key]])
        else:
            (column,) = columns
        covered = tuple(column.covered())
        if covered not in shared:
            shared[covered] = Runs(chain.from_iterable(runs[begin:end] for begin, end in covered))
        ends = (
            [end - covered[0][0] for end in column.ends]
            if len(covered) == 1
            else list(accumulate(map(sub, column.ends, column.begins)))
        )
        stretches = Stretches([said[code] for code in column.codes], ends)  # type: ignore[misc]
        result[key] = SeriesHistory(definitions[newest[key]], Points(shared[covered], stretches))
    return result
