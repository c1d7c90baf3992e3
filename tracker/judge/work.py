"""Exact work as series of their own: what a configuration of a test cost in operations and in iterations.

Work is the one measure of cost without noise: the same program does the same work on every machine, so one
more block operation is more work, tonight. How many rounds an iteration takes may change by a hair where the
data does, and gets a tolerance. Work is compared where the answers are the same and the build flags are.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from functools import lru_cache

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
    }
)
GROUPS = {"operations": (EXACT, 0.0), "iterations": (ITERATIONS, 0.1)}  # counters, relative tolerance
FAMILIES = {
    "scalar": "values",
    "ladder": "sweep",
    "order": "sweep",
    "time": "sweep",
    "break_point": "stability",
    "work": "work",
}

Samples = Mapping[str, tuple[SeriesDefinition, Sample]]


def with_work(samples: Samples, engine: EngineVersion) -> dict[str, tuple[SeriesDefinition, Sample]]:
    """The samples of a run, and the sums of its counters as samples more.

    The definition's hash stands for the series summed over and for the build: other sums are not comparable.
    """
    grouped: dict[tuple[str, str, str], list[tuple[SeriesDefinition, Sample]]] = {}
    for definition, sample in samples.values():
        if sample.counters:
            place = (definition.test, definition.configuration, FAMILIES[definition.kind])
            grouped.setdefault(place, []).append((definition, sample))
    found = dict(samples)
    for (test, configuration, family), members in grouped.items():
        facts = tuple(sorted([f"{d.key} {d.test_version}" for d, _ in members]))
        answers = _hash(*sorted([f"{d.key} {s.value!r} {s.state_hash}" for d, s in members]))
        for group, (counters, _) in GROUPS.items():
            done = sum([n for _, s in members for name, n in s.counters.items() if name in counters])
            if not done:
                continue
            asked = (test, configuration, family, group)
            definition = _definition(asked, members[0][0].title, facts, engine.compiler, engine.flags)
            found[definition.key] = (
                definition,
                Sample(
                    series=definition.key, value=Number(done), outcome="value", passed=True, set_point_held=True,
                    state_hash=answers,
                ),
            )  # fmt: skip
    return found


@lru_cache(maxsize=4096)
def _definition(
    place: tuple[str, str, str, str], title: str, facts: tuple[str, ...], compiler: str, flags: str
) -> SeriesDefinition:
    """The series of a sum; from night to night it is mostly the same."""
    test, configuration, family, group = place
    return SeriesDefinition(
        key=f"{test}/{configuration}/work:{family}:{group}", test=test, title=title, configuration=configuration,
        metric=f"work:{family}:{group}", description=f"{group} counted in the {family}", unit="1",
        role="reported", better="smaller", kind="work", time_step=None, parameters={}, limit=None,
        limit_source="", set_point=None, set_point_source="", reference=None, tolerance=0.0,
        relative_tolerance=GROUPS[group][1], test_version=_hash(*facts, compiler, flags),
    )  # fmt: skip


def _hash(*parts: str) -> str:
    return hashlib.sha256("\n".join(parts).encode("utf-8", "replace")).hexdigest()[:16]
