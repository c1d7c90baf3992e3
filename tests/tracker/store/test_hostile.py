"""Documents that mean harm: each is refused in one sentence, or stored and read back as what it says; nothing else.

Valid documents are damaged at random, by structure and by bytes, and those that once went wrong are kept in
tests/data/hostile/. A few hundred here; `make hostile` plays ten thousand on each database.
"""

from __future__ import annotations

import json
import math
import os
import random
from copy import deepcopy
from typing import Any

import msgspec
import pytest
from sqlalchemy.orm import Session

from spook_tracker.tracker.document.errors import DatabaseError, DocumentError
from spook_tracker.tracker.document.json_form import encode
from spook_tracker.tracker.document.run_document import Channel, DrawnSolid, Trajectory
from spook_tracker.tracker.measure.other_tools import of_other_tools
from spook_tracker.tracker.measure.short_form import is_short, whole
from spook_tracker.tracker.store.border import checked, decoded
from spook_tracker.tracker.store.database import open_database
from spook_tracker.tracker.store.database_check import check
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.record import record
from tests.histories.documents import run
from tests.places import DATA
from tests.tracker.measure.test_other_tools import ACTION, ASV, GOOGLE, PYTEST

COUNT = int(os.environ.get("SPOOK_HOSTILE_DOCUMENTS", "150"))
KEPT = sorted((DATA / "hostile").glob("*"))
SHORT = {
    "engine": "ours", "version": "1", "results": [
        {"test": "fall", "metric": "error", "value": 0.5, "unit": "m", "time_step": 0.01, "limit": 1.0},
        {"test": "fall", "metric": "time", "seconds": [0.5, 0.6]},
    ],
}  # fmt: skip
NASTY: tuple[Any, ...] = (
    None, True, -1, 0, 2**53, 2**63, 2**64, 10**400, 1e308, -0.0, "nan", "inf", "", "x" * 70_000, "\0", "\ud800", "\u202e",
    "../../etc/passwd", "'; DROP TABLE run; --", "<script>alert(1)</script>", "::error::x", [], {}, [[]] * 3, {"": ""},
)  # fmt: skip


def damaged(chance: random.Random) -> bytes:
    """One of the kinds of documents there are, with something in it that does not belong."""
    said = (
        json.loads(encode(run()))
        if chance.random() < 0.6
        else chance.choice((SHORT, PYTEST, GOOGLE, ASV, ACTION))
    )
    said = json.loads(json.dumps(said))
    for _ in range(chance.randint(1, 4)):
        _damage(said, chance)
    text = json.dumps(said, ensure_ascii=chance.random() < 0.5).encode("utf-8", "surrogatepass")
    if chance.random() < 0.25:
        at = chance.randrange(len(text))
        text = (
            text[:at]
            + chance.choice((b"", b"\xff", b"}", b"[" * 5000, b"1e999", b"NaN"))
            + text[at + chance.randrange(9) :]
        )
    return text


def _damage(said: Any, chance: random.Random) -> None:
    place = said
    while isinstance(place, dict | list) and place:
        key = chance.choice(list(place)) if isinstance(place, dict) else chance.randrange(len(place))
        inner = place[key]
        if not isinstance(inner, dict | list) or not inner or chance.random() < 0.3:
            how = chance.random()
            if how < 0.6:
                place[key] = deepcopy(chance.choice(NASTY))
            elif how < 0.8:
                del place[key]
            elif isinstance(place, dict):
                place[chance.choice(("", "id", "value", "x" * 300))] = deepcopy(chance.choice(NASTY))
            else:
                place.append(inner)
            return
        place = inner


def documents(content: bytes) -> Any:
    """What `tracker import` makes of a file."""
    if is_short(content):
        return (whole(content, "file"),)
    found = of_other_tools(content, "file")
    return found if found is not None else (decoded(content, "file"),)


def taken(session: Session, content: bytes) -> int:
    """How many runs were stored; whatever is stored comes back as it went in."""
    count = 0
    try:
        for document in documents(content):
            if record(session, document):
                count += 1
                back = History(session).document(document.id)
                assert encode(back) == encode(checked(document))
                assert all(math.isfinite(float(s.value)) or not s.passed for s in back.samples)
    except (DocumentError, DatabaseError) as refused:
        assert len(str(refused)) < 1000, str(refused)[:200]
        assert "\n" not in str(refused).strip()
    return count


@pytest.mark.timeout(max(600, COUNT // 5))
def test_a_hostile_document_is_refused_or_stored_as_what_it_says(url: str) -> None:
    engine = open_database(url)
    with Session(engine) as session:
        good = run()
        record(session, good)
        stored = sum(taken(session, damaged(random.Random(number))) for number in range(COUNT))
        stored += sum(taken(session, file.read_bytes()) for file in KEPT)

        assert encode(History(session).document(good.id)) == encode(good)
    assert check(engine) == ()
    engine.dispose()
    assert 0 < stored < COUNT, "some harm nothing, most are refused"


@pytest.mark.parametrize("place", ["counters", "parameters", "stage_seconds"])
def test_keys_are_text_from_outside_like_any_other(place: str) -> None:
    said = json.loads(encode(run()))
    parts = {
        "counters": said["samples"][0],
        "parameters": said["series"][0],
        "stage_seconds": next(sample["timing"] for sample in said["samples"] if sample.get("timing")),
    }
    parts[place][place] = {"x" * 70_000: 1}

    with pytest.raises(DocumentError, match="a key: a text of 70000 characters; at most 65536 are stored"):
        decoded(json.dumps(said).encode())

    parts[place][place] = {"a\0": 1, "\ud800": 2}
    cleaned = json.loads(encode(decoded(json.dumps(said).encode())))
    assert "\\u0000" not in json.dumps(cleaned)
    assert "\\ud800" not in json.dumps(cleaned)


def test_a_motion_of_many_bodies_is_no_long_text() -> None:
    """A robot of 44 bodies could be measured and not be recorded: its motion was counted as text in JSON."""
    data = os.urandom(100_000)
    channel = Channel(name="position", unit="m", width=1, low=0.0, step=1e-4, data=data)
    motion = Trajectory(
        test="robot", name="example", time_step=0.01, step=0.01, count=2, bodies=1,
        solids=(DrawnSolid(kind="sphere", position=(0.0, 0.0, 0.0), orientation=(1.0, 0.0, 0.0, 0.0), size=(1.0,)),),
        body_of_solid=(0,), channels=(channel,),
    )  # fmt: skip
    document = msgspec.structs.replace(run(), trajectories=(motion,))
    assert checked(document) == decoded(encode(document)) == document
