"""Recorded motion for the page of a test: one file per motion, loaded when its figure is seen.

Files are scripts that hand over data, because a page opened from a file may not fetch. A motion that is the
same on several nights is one file.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from spook_tracker.tracker.document.json_form import encode
from spook_tracker.tracker.document.run_document import Trajectory
from spook_tracker.tracker.document.wording import day, number, short_hash, slug, version
from spook_tracker.tracker.website.folder import digest
from spook_tracker.tracker.website.nights import TestHistory

MOST_NIGHTS = 8  # of one test
SITE_BYTES = 12_000_000  # of all motions: older nights are left out beyond, newest first, tonight never


@dataclass(frozen=True)
class Replay:
    """What the page of a test needs to replay it."""

    sources: list[dict[str, str]]  # tonight first: key, address below the root, label
    note: str


def replay(test: TestHistory) -> Replay | None:
    """The motions of a test, newest first; None if none was recorded."""
    if not test.motions:
        return None
    sources: list[dict[str, str]] = []
    for night, motion in test.motions[:MOST_NIGHTS]:
        key = key_of(motion)
        name = short_hash(night.engine) or version(night.engine)
        same = sources and key == sources[0]["key"]
        if same:
            continue
        sources.append({"key": key, "address": f"replay/{key}.js", "label": f"{day(night.started)}, {name}"})
    tonight = test.motions[0][1]
    place = next((c for c in tonight.channels if c.name == "position"), None)
    note = (
        f"{tonight.count} samples, {number(tonight.step, 3)} s apart; h = {number(tonight.time_step, 6)} s."
    )
    if place is not None:
        note += f" Places are stored within {number(place.step / 2.0, 2)} m."
    if tonight.failure:
        note += f" It ends early: {tonight.failure}."
    return Replay(sources, note)


def replay_files(tests: Iterable[TestHistory]) -> Iterator[tuple[str, bytes]]:
    """Address and content of every file of the replays, within the budget of a site."""
    tests = list(tests)
    written: set[str] = set()
    spent = 0
    for age in range(MOST_NIGHTS):
        for test in tests:
            if age >= len(test.motions):
                continue
            motion = test.motions[age][1]
            key = key_of(motion)
            if key in written:
                continue
            content = _script(key, motion)
            if age > 0 and spent + len(content) > SITE_BYTES:
                continue
            written.add(key)
            spent += len(content)
            yield f"replay/{key}.js", content


def key_of(motion: Trajectory) -> str:
    """What a motion is called: the same for the same motion, whatever night it is of."""
    return f"{slug(motion.test)}-{digest(encode(motion))[:10]}"


def _script(key: str, motion: Trajectory) -> bytes:
    solids = [
        {
            "kind": solid.kind,
            "size": solid.size,
            "fixed": solid.fixed,
            "position": solid.position,
            "orientation": solid.orientation,
            "body": body,
        }
        for solid, body in zip(motion.solids, motion.body_of_solid, strict=True)
    ]
    links = [
        {"kind": link.kind, "bodies": link.bodies, "anchors": link.anchors, "row": link.row}
        for link in motion.links
    ]
    channels = [
        {
            "name": channel.name,
            "unit": channel.unit,
            "low": channel.low,
            "step": channel.step,
            "data": base64.b64encode(channel.data).decode("ascii"),
        }
        for channel in motion.channels
    ]
    data: dict[str, Any] = {
        "step": motion.step,
        "count": motion.count,
        "bodies": motion.bodies,
        "rows": motion.rows,
        "gravity": motion.gravity,
        "attractors": motion.attractors,
        "exact": motion.exact,
        "solids": solids,
        "links": links,
        "channels": channels,
    }
    return f"recorded({json.dumps(key)},{json.dumps(data, separators=(',', ':'))});\n".encode()
