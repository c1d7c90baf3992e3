"""Runs as documents, read as a history is: what was recorded elsewhere is shown without a database."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property

from spook_tracker.tracker.document.json_form import encode
from spook_tracker.tracker.document.kept import Kept
from spook_tracker.tracker.document.points import Points, Stretches
from spook_tracker.tracker.document.run_document import (
    FigureData,
    MapData,
    Point,
    Run,
    RunDocument,
    Runs,
    Said,
    Sample,
    SeriesDefinition,
    SeriesHistory,
    TestCard,
    Trajectory,
)


class DocumentHistory:
    """What pages read of `tracker.store.history.History`, over documents in memory, oldest first."""

    def __init__(self, documents: Sequence[RunDocument]) -> None:
        self.documents = {d.id: d for d in documents}
        self.kept = Kept()
        self.bare: dict[int, list[Sample]] = {}
        self.said: dict[tuple[str, str, str, bool, bool], Sample] = {}
        made = {id(d.samples): d for d in documents}  # many nights may have the same
        self.made = {
            samples: hashlib.sha256(encode((d.series, d.samples))).hexdigest() for samples, d in made.items()
        }

    def content(self, run_id: str) -> str:
        return self.made[id(self.documents[run_id].samples)]

    def runs(self, engine: str | None = None) -> list[RunDocument]:
        return [d for d in self.documents.values() if engine in (None, d.engine.name)]

    def series(
        self, keys: Iterable[str] | None = None, *, evidence: bool = True
    ) -> Mapping[str, SeriesHistory]:
        points: dict[str, list[Point]] = {}
        newest: dict[str, SeriesDefinition] = {}
        for run in self.documents.values():
            newest |= {d.key: d for d in run.series}
            for found in run.samples if evidence else self._bare(run):
                points.setdefault(found.series, []).append(
                    Point(run, found, newest[found.series].test_version)
                )
        chosen = points.keys() if keys is None else points.keys() & set(keys)
        return {key: SeriesHistory(newest[key], tuple(points[key])) for key in sorted(chosen)}

    def series_of(self, engine: str) -> Mapping[str, SeriesHistory]:
        return self._by_engine.get(engine, {})

    @cached_property
    def _by_engine(self) -> Mapping[str, Mapping[str, SeriesHistory]]:
        """The series of each engine: a page is about one, a table about all of them."""
        newest: dict[str, SeriesDefinition] = {}
        gathered: dict[str, dict[str, tuple[list[Run], list[Said]]]] = {}
        known: dict[tuple[int, str], Said] = {}
        for run in self.documents.values():
            newest |= {d.key: d for d in run.series}
            of_engine = gathered.setdefault(run.engine.name, {})
            for sample in self._bare(run):
                version = newest[sample.series].test_version
                said = known.setdefault((id(sample), version), (sample, version, True))
                runs, told = of_engine.setdefault(sample.series, ([], []))
                runs.append(run)
                told.append(said)
        shared: dict[tuple[int, ...], Runs] = {}
        found: dict[str, dict[str, SeriesHistory]] = {}
        for engine, of_engine in gathered.items():
            for key, (runs, told) in sorted(of_engine.items()):
                of_all = shared.setdefault(tuple(map(id, runs)), Runs(runs))
                found.setdefault(engine, {})[key] = SeriesHistory(
                    newest[key], Points(of_all, Stretches.of(told))
                )
        return found

    def _bare(self, run: RunDocument) -> list[Sample]:
        """The samples of a run without what stands behind them: what says the same is one object, as out of a database."""
        place = id(run.samples)  # many nights may have the same
        if place not in self.bare:
            self.bare[place] = [
                self.said.setdefault(
                    (s.series, s.value.hex(), s.outcome, s.passed, s.set_point_held),
                    Sample(
                        series=s.series, value=s.value, outcome=s.outcome, passed=s.passed,
                        set_point_held=s.set_point_held,
                    ),
                )
                for s in run.samples
            ]  # fmt: skip
        return self.bare[place]

    def samples(self, run_id: str) -> dict[str, tuple[SeriesDefinition, Sample]]:
        run = self.documents[run_id]
        definitions = {d.key: d for d in run.series}
        return {s.series: (definitions[s.series], s) for s in run.samples}

    def samples_of(
        self, run_ids: Sequence[str], tests: set[str] | None = None, keys: Iterable[str] | None = None
    ) -> dict[str, dict[str, tuple[SeriesDefinition, Sample]]]:
        chosen = None if keys is None else set(keys)
        return {
            run_id: {
                key: pair
                for key, pair in self.samples(run_id).items()
                if (tests is None or pair[0].test in tests) and (chosen is None or key in chosen)
            }
            for run_id in run_ids
        }

    def answered(self, run_ids: Sequence[str]) -> dict[str, set[tuple[str, str]]]:
        return {run_id: {(d.test, d.kind) for d, _ in self.samples(run_id).values()} for run_id in run_ids}

    def cards(self, run_id: str) -> tuple[TestCard, ...]:
        return self.documents[run_id].tests

    def figures(self, run_id: str) -> tuple[FigureData, ...]:
        return self.documents[run_id].figures

    def maps(self, run_id: str) -> tuple[MapData, ...]:
        return self.documents[run_id].maps

    def with_maps(self) -> set[str]:
        return {run_id for run_id, document in self.documents.items() if document.maps}

    def trajectories(self, run_id: str) -> tuple[Trajectory, ...]:
        return self.documents[run_id].trajectories
