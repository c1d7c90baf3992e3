"""The run times of a run: taken test by test by one watched process, while nothing else is at work.

An engine that answers and then dies, hangs or takes too much memory while it is timed has failed there: the rung it
was at is recorded with the class of how, and what is read off the clock says why it is not there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

from spook_tracker.scalar_tests.case import ScalarTest

from . import ladder as ladders
from . import workers as crew
from .questions import Questions
from .step_cost import LeavingOut, step_costs
from .timing import Repeats

Timed = tuple[
    list[ladders.Pair], Mapping[str, LeavingOut]
]  # series, and by test what leaving stages out saves


@dataclass(frozen=True)
class TimingPiece:
    """Run times of the ladders of one test, or what a step of its example costs."""

    test: str
    kind: Literal["ladders", "stages"]
    errors: ladders.Errors
    repeats: int | Repeats


def perform_timing(source: Questions, piece: TimingPiece) -> Timed:
    """Take the times of one piece in this process."""
    tests = {piece.test: source.tests()[piece.test]}
    simulate = replace(source, patience=None).simulate()  # what gave a value is worth its time
    module = source.module()
    prepare = getattr(module, "prepare", None) if simulate is module.simulate else None
    if piece.kind == "ladders":
        return ladders.timed_series(tests, piece.errors, simulate, piece.repeats, prepare), {}
    found, out = step_costs(piece.test, tests[piece.test], simulate, getattr(module, "start", None), prepare)
    return found, {} if out is None else {piece.test: out}


def run_times(
    source: Questions,
    tests: Mapping[str, ScalarTest],
    errors: ladders.Errors,
    repeats: int | Repeats,
    limits: crew.Limits | None,
    timed: Callable[[str], None],
) -> Timed:
    """Run times of every ladder, and what steps cost; `timed` is told of each test that is done.

    `limits` are those of one ladder; None: in this process, where nothing can be ended. What steps cost is left
    out where its process is lost.
    """
    stages_can_be_forced = not hasattr(source.module(), "configurations")  # ours only
    pieces = []
    for name in tests:
        known = {place: found for place, found in errors.items() if place[0] == name}
        pieces += [TimingPiece(name, "stages", {}, 0)] if stages_can_be_forced else []
        pieces += [TimingPiece(name, "ladders", known, repeats)]
    answers: Iterator[tuple[TimingPiece, Timed | crew.Lost]] = (
        (piece, perform_timing(source, piece)) for piece in pieces
    )
    if limits is not None:
        most = max([1, *(len(test.ladders) for test in tests.values())])
        answers = crew.answers(
            partial(perform_timing, source), pieces, 1, replace(limits, seconds=limits.seconds * most)
        )
    series: list[ladders.Pair] = []
    saved: dict[str, LeavingOut] = {}
    for piece, answer in answers:
        if piece.kind == "stages":
            if not isinstance(answer, crew.Lost):
                series += answer[0]
                saved |= answer[1]
            continue
        if isinstance(answer, crew.Lost):
            series += ladders.untimed_series({piece.test: tests[piece.test]}, piece.errors, answer)
        else:
            series += answer[0]
        timed(piece.test)
    return series, saved
