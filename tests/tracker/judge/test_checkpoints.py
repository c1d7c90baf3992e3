"""Judged from a checkpoint on, a series is what it is judged from its first night: every verdict, whatever was asked first."""

from __future__ import annotations

import random
from dataclasses import replace as replaced

import pytest
from msgspec.structs import replace

from spook_tracker.tracker.document.json_form import NAN, Number
from spook_tracker.tracker.document.kept import Kept
from spook_tracker.tracker.document.run_document import Point, Sample, SeriesHistory
from spook_tracker.tracker.judge import checkpoints
from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.judge.checkpoints import Checkpoints
from spook_tracker.tracker.judge.repeats import Nights
from spook_tracker.tracker.judge.series_history import judge_all
from spook_tracker.tracker.website.nights import Night
from tests.tracker.judge.test_one_judge import night, one

KEY = next(iter(night(0, one(0.1)).series)).key
DEFINITION = night(0, one(0.1)).series[0]


def line(count: int) -> list[Night]:
    """Nights, of which one in eleven is of a release."""
    found = []
    for number in range(count):
        run = night(number, one(0.1))
        engine = run.engine if number % 11 else replace(run.engine, version=f"1.{number}.0")
        found.append(
            Night(
                number,
                run.id,
                run.started,
                run.finished,
                run.trigger,
                "",
                "",
                engine,
                run.machine,
                run.asked,
                f"c{number}",
            )
        )
    return found


def history(nights: list[Night], chance: random.Random, rough: float) -> SeriesHistory:
    """Values that mostly stand still; `rough` is how often something else becomes of them than another last digit."""
    points, value, outcome = [], 0.3, "value"
    for run in nights:
        if chance.random() < 0.2:
            value, outcome = chance.choice([0.3, 0.3 + 1e-13, 0.3 + 2e-13]), "value"
        if chance.random() < rough:
            value, outcome = chance.choice(
                [
                    (0.35, "value"),
                    (0.0, "value"),
                    (-0.0, "value"),
                    (3.0, "out_of_limit"),
                    (NAN, "crashed"),
                    (NAN, "not_supported"),
                ]
            )
        sample = Sample(
            series=KEY, value=Number(value), outcome=outcome, passed=outcome == "value",
            set_point_held=outcome == "value" and value < 0.33,
        )  # fmt: skip
        points.append(Point(run, sample, DEFINITION.test_version))
    return SeriesHistory(DEFINITION, tuple(points))


class Memory(Kept):
    """What is kept, without a file."""

    def __init__(self) -> None:
        self.parts: dict[str, object] = {}

    def get(self, name: str, kind: type) -> object:  # type: ignore[override]
        return self.parts.get(name)

    def put(self, name: str, part: object) -> None:
        self.parts[name] = part


@pytest.fixture(autouse=True)
def checkpoints_after_a_few_nights(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("spook_tracker.tracker.judge.lane.RECENT", 4)
    monkeypatch.setattr(checkpoints, "LATE", 24)
    monkeypatch.setattr(checkpoints, "STEP", 4)


@pytest.mark.parametrize("rough", [0.0, 0.005, 0.1])
def test_from_a_checkpoint_on_every_verdict_is_the_same(rough: float) -> None:
    chance, resumed = random.Random(7), 0
    for _ in range(5):
        nights = line(80)
        whole = history(nights, chance, rough)
        kept = Memory()
        for count in (50, 57, 80):
            now = {KEY: SeriesHistory(DEFINITION, whole.points[:count])}
            known = Checkpoints(kept, nights[:count])
            found = judge_all(now, (), known)[KEY].nights
            known.keep(kept)
            anew = judge_all(now)[KEY].nights
            assert isinstance(found, Nights) and isinstance(anew, Nights)
            resumed += found.resumed
            late = range(count - 20, count)
            assert [found[i] for i in late] == [anew[i] for i in late]
            assert [found.stands(i) for i in late] == [anew.stands(i) for i in late]
            assert found.states() == anew.states()
            assert [found.stands(i) for i in range(count)] == [anew.stands(i) for i in range(count)]
            assert list(found) == list(anew)
    assert (resumed > 4) == (rough < 0.1)  # of 10


def changed_value(points: list[Point]) -> list[Point]:
    sample = replace(points[5].sample, value=Number(0.3 + 9e-13))
    return [*points[:5], points[5]._replace(sample=sample), *points[6:]]


@pytest.mark.parametrize("what", ["definition", "accepted", "value", "run", "new definition"])
def test_what_was_read_before_a_checkpoint_and_is_other_now_is_judged_again(what: str) -> None:
    nights, kept = line(60), Memory()
    points = list(history(nights, random.Random(3), 0.0).points)
    definition, accepted = DEFINITION, ()
    known = Checkpoints(kept, nights)
    judge_all({KEY: SeriesHistory(definition, tuple(points))}, accepted, known)
    known.keep(kept)
    if what == "definition":
        definition = replace(definition, limit=0.2)
    elif what == "accepted":
        accepted = (Accepted(series=KEY, low=0.2, high=0.4, who="Ada Example", why="a trade", until=None),)
    elif what == "value":
        points = changed_value(points)
    elif what == "run":
        nights[5] = replaced(nights[5], content="another")
    else:
        points[-1] = points[-1]._replace(test_version="v2")

    known = Checkpoints(kept, nights)
    found = judge_all({KEY: SeriesHistory(definition, tuple(points))}, accepted, known)[KEY].nights

    assert isinstance(found, Nights) and not found.resumed
    assert list(found) == list(
        judge_all({KEY: SeriesHistory(definition, tuple(points))}, accepted)[KEY].nights
    )
