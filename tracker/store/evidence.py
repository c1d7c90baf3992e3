"""The samples of whole runs with all that stands behind them: equal ones are one object, and what has no run time is kept."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping, Sequence

import msgspec

from spook_tracker.tracker.document.kept import Kept
from spook_tracker.tracker.document.run_document import OutcomeClass, Sample, SeriesDefinition

from .lanes import Definitions
from .reader import Row
from .sample_rows import sample_of

EvidenceRow = tuple[
    int, int, float | None, str | None, OutcomeClass, bool | int, bool | int, str | None, str | None, str | None
]  # fmt: skip
Pair = tuple[SeriesDefinition, Sample]


class _Stored(msgspec.Struct, frozen=True, array_like=True):
    told: list[EvidenceRow]
    runs: dict[int, tuple[str, bytes]]


class Behind:
    """What is known of the runs of an engine: by key their content, and the place of each of their samples in `told`."""

    def __init__(self, name: str, kept: Kept) -> None:
        self.name = name
        stored = kept.get(f"evidence/{name}", _Stored) or _Stored([], {})
        self._known = stored.runs
        self._told: dict[EvidenceRow, int] = {told: code for code, told in enumerate(stored.told)}
        self._runs: dict[int, tuple[str, bytes]] = {}
        self._taken: dict[str, array[int]] = {}

    def take(self, run_id: str, run_key: int, content: str, read: Callable[[], Sequence[Row]]) -> bool:
        """Take up a run's samples in their order; False where it has run times, which are others every night."""
        found = self._known.get(run_key)
        if not content or found is None or found[0] != content:
            rows = read()
            if any(row[11] is not None for row in rows):
                return False
            told = self._told
            codes = array("i", [told.setdefault(tuple(row[1:11]), len(told)) for row in rows])
            found = content, codes.tobytes()
        self._runs[run_key] = found
        self._taken[run_id] = array("i", found[1])
        return True

    def samples(
        self, canonical: Mapping[int, str], read_definitions: Definitions
    ) -> dict[str, dict[str, Pair]]:
        """By run and by today's key of their series, the samples that were taken up."""
        used = {code for codes in self._taken.values() for code in codes}
        told = list(self._told)
        definitions = read_definitions({told[code][1] for code in used})
        pairs: dict[int, tuple[str, Pair]] = {}
        for code in used:
            definition = definitions[told[code][1]]
            key = canonical.get(told[code][0], definition.key)
            pairs[code] = key, (definition, sample_of(definition.key, (0, *told[code], None)))
        found = {}
        for run_id, codes in self._taken.items():
            samples = dict(map(pairs.__getitem__, codes))
            if len(samples) < len(codes):  # of two names today's wins over an earlier one
                samples = {}
                for key, pair in map(pairs.__getitem__, codes):
                    if key not in samples or pair[0].key == key:
                        samples[key] = pair
            found[run_id] = samples
        return found

    def keep(self, kept: Kept) -> None:
        """What was asked for, for the next time."""
        told = list(self._told)
        used: dict[int, int] = {}
        runs = {}
        for key, (content, codes) in self._runs.items():
            again = array("i", [used.setdefault(code, len(used)) for code in array("i", codes)])
            runs[key] = content, again.tobytes()
        kept.put(f"evidence/{self.name}", _Stored([told[code] for code in used], runs))
