"""Exact work as series of their own: what a configuration of a test cost in operations and in iterations.

Work is the one measure of cost without noise: the same program does the same work on every machine, so one
more block operation is more work, tonight. How many rounds an iteration takes may change by a hair where the
data does, and gets the tolerance that the test declares. Work is compared where the answers are the same and the
build flags are. Each counter is judged by itself: fewer of one hide no more of another. Points of contact, samples read
and evaluations of a search are not work of the engine's: the scene, what is observed and where a scene breaks decide
them, and with equal answers they are equal. A test may say of any counter whether it gates or explains
(`ScalarTest.counter_roles`).
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import chain

from spook_tracker.tracker.document.json_form import Number
from spook_tracker.tracker.document.run_document import EngineVersion, Sample, SeriesDefinition

EXACT = frozenset(
    {
        "block_operations",
        "factorisations",
        "back_substitutions",
        "force_evaluations",
        "rows_assembled",
        "steps",
        "substeps",
        "composition_stages",
    }
)
ITERATIONS = frozenset(
    {
        "sweeps",
        "pivots",
        "pivot_rounds",
        "newton_iterations",
        "friction_rounds",
        "corrections",
        "halved_steps",
        "redundancy_looks",
    }
)
JUDGED = EXACT | ITERATIONS
FAMILIES = {
    "scalar": "values",
    "ladder": "sweep",
    "order": "sweep",
    "time": "sweep",
    "break_point": "stability",
    "work": "work",
}

STEP_COSTS = tuple(  # of an example scene (tracker/measure/step_cost.py): configuration and metric; sweeps alone measure them
    ("example", name) for name in ("leaving_out", "real_time_factor", "worst_step_time", "memory")
)
OF_TIMES = ("values", "sweep")  # of a run that does not say what it was asked for, either may tell


def families_of(definition: SeriesDefinition) -> tuple[str, ...]:
    """With which families a series is asked for; none where it is not missed, as what is read off a ladder's clock."""
    if definition.kind != "time":
        return (FAMILIES[definition.kind],)
    if (definition.configuration, definition.metric) in STEP_COSTS:
        return ("sweep",)
    return () if is_read_off(definition) else OF_TIMES


def is_read_off(definition: SeriesDefinition) -> bool:
    """Whether a time is read off a ladder: time to an error, error in a time."""
    return definition.metric.endswith((":time-to-error", ":error-in-time"))


Samples = Mapping[str, tuple[SeriesDefinition, Sample]]


Pair = tuple[SeriesDefinition, Sample]


class Sums:
    """What was summed of earlier runs, by the objects it was summed from: those must not have gone."""

    def __init__(self) -> None:
        self.groups: dict[tuple[str, str, str, str, str, tuple[int, ...]], list[Pair]] = {}
        self._texts: dict[int, tuple[str, str]] = {}

    def texts(self, members: Sequence[tuple[str, Pair]]) -> tuple[tuple[str, ...], list[str]]:
        """The series, by the names they have now, and what they said, each in order."""
        texts = self._texts
        for key, pair in members:
            if id(pair) not in texts:
                d, s = pair
                texts[id(pair)] = f"{key} {d.test_version}", f"{key} {s.value!r} {s.state_hash}"
        both = [texts[id(pair)] for _, pair in members]
        return tuple(sorted([series for series, _ in both])), sorted([said for _, said in both])


def with_work(
    samples: Samples, engine: EngineVersion, known: Sums | None = None
) -> dict[str, tuple[SeriesDefinition, Sample]]:
    """The samples of a run, and each of its counters, summed over a configuration, as samples more.

    The definition's hash stands for the series summed over and for the build: other sums are not comparable. `known` has
    the sums of the runs before, whose samples must not have gone: what many runs share is summed once.
    """
    grouped: dict[tuple[str, str, str], list[tuple[str, Pair]]] = {}
    for key, pair in samples.items():
        definition, sample = pair
        if sample.counters:
            test, configuration = definition.test, definition.configuration
            if (
                key != definition.key and key.count("/") >= 2
            ):  # measured under an earlier name; a key may be any text
                test, configuration, *_ = key.split("/")
            grouped.setdefault((test, configuration, FAMILIES[definition.kind]), []).append((key, pair))
    found = dict(samples)
    known = known or Sums()
    for (test, configuration, family), members in grouped.items():
        group = (
            engine.compiler,
            engine.flags,
            test,
            configuration,
            family,
            tuple(id(pair) for _, pair in members),
        )
        if group in known.groups:
            found.update((pair[0].key, pair) for pair in known.groups[group])
            continue
        sums = known.groups[group] = []
        facts, said = known.texts(members)
        answers = _hash(*said)
        tolerance = max(d.iteration_tolerance for _, (d, _) in members)
        roles = dict(chain.from_iterable(d.counter_roles.items() for _, (d, _) in members))
        done: dict[str, int] = {}
        for _, (_, sample) in members:
            for name, count in sample.counters.items():
                if name in JUDGED or name in roles:
                    done[name] = done.get(name, 0) + count
        for counter, count in done.items():
            asked = (test, configuration, family, counter)
            allowed = tolerance if counter in ITERATIONS else 0.0
            explains = roles.get(counter) == "explaining"
            definition = _definition(
                asked, members[0][1][0].title, facts, allowed, engine.compiler, engine.flags, explains
            )
            sample = Sample(
                series=definition.key, value=Number(count), outcome="value", passed=True, set_point_held=True,
                state_hash=answers,
            )  # fmt: skip
            sums.append((definition, sample))
        found.update((pair[0].key, pair) for pair in sums)
    return found


@lru_cache(maxsize=16384)
def _definition(
    place: tuple[str, str, str, str],
    title: str,
    facts: tuple[str, ...],
    tolerance: float,
    compiler: str,
    flags: str,
    explains: bool,
) -> SeriesDefinition:
    """The series of a sum; from night to night it is mostly the same."""
    test, configuration, family, counter = place
    return SeriesDefinition(
        key=f"{test}/{configuration}/work:{family}:{counter}", test=test, title=title, configuration=configuration,
        metric=f"work:{family}:{counter}", description=f"{counter.replace('_', ' ')} counted in the {family}", unit="1",
        role="explaining" if explains else "reported", better="smaller", kind="work", time_step=None, parameters={}, limit=None,
        limit_source="", set_point=None, set_point_source="", reference=None, tolerance=0.0,
        relative_tolerance=tolerance, test_version=_hash(*facts, compiler, flags),
    )  # fmt: skip


def _hash(*parts: str) -> str:
    return hashlib.sha256("\n".join(parts).encode("utf-8", "replace")).hexdigest()[:16]
