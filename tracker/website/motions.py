"""Which recorded motions the website keeps: decided once, so that nothing is offered whose file is not there.

A motion that is the same on several nights is one file.
"""

from __future__ import annotations

import base64
import json
import math
import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

from spook_tracker.tracker.document.json_form import encode
from spook_tracker.tracker.document.run_document import Trajectory
from spook_tracker.tracker.document.wording import slug

from .folder import digest

if TYPE_CHECKING:
    from spook_tracker.tracker.document.json_form import Writable

if TYPE_CHECKING:  # they ask for what is kept
    from .nights import Night, TestHistory

MOST_NIGHTS = 8  # of one test
SITE_BYTES = 12_000_000  # of all motions: older nights are left out beyond, newest first, tonight never


@dataclass(frozen=True)
class Motion:
    """How a test's scene moved in a night, and the file it is loaded from."""

    night: Night
    recorded: Trajectory
    key: str  # the same for the same motion, whatever night it is of
    script: bytes  # a page opened from a file may not fetch, so data come as a script

    @property
    def address(self) -> str:
        """Below the root of the website."""
        return f"replay/{self.key}.js"


def kept_motions(tests: Iterable[TestHistory]) -> dict[str, tuple[Motion, ...]]:
    """The motions within the budget of a site, by test, newest first: the newest of each test is always there."""
    found: dict[str, list[Motion]] = {test.name: [] for test in tests}
    written: dict[str, bytes] = {}
    spent = 0
    for age in range(MOST_NIGHTS):
        for test in tests:
            if age >= len(test.motions):
                continue
            night, recorded = test.motions[age]
            key = f"{slug(recorded.test)}-{digest(encode(recorded))[:10]}"
            if key not in written:
                script = motion_script(key, recorded)
                if age > 0 and spent + len(script) > SITE_BYTES:
                    continue
                written[key] = script
                spent += len(script)
            found[test.name].append(Motion(night, recorded, key, written[key]))
    return {name: tuple(motions) for name, motions in found.items()}


SEEN = 0.05  # of half the picture: what an eye sees (as replay.js has it)
WORLD = -1  # among the bodies of a link


@dataclass(frozen=True)
class Parting:
    """How two motions of a scene part: the body that gets furthest from where it was."""

    body: int
    time: float  # s, from when on it is a tenth of its largest distance away, or as far as an eye sees
    furthest: float  # m
    end: float  # m, in the last sample
    share: float  # of half the diagonal of what the first shows


@lru_cache(maxsize=256)  # causes share nights, and stand on three pages
def parting(one: Trajectory, other: Trajectory) -> Parting | None:
    """Where two motions part, by straight distance; None if they are of different scenes, or nowhere."""
    if (one.count, one.step, one.bodies) != (other.count, other.step, other.bodies) or not one.bodies:
        return None
    mine, theirs = (_values(motion, "position") for motion in (one, other))
    away = [
        [
            math.dist(mine[at : at + 3], theirs[at : at + 3])
            for at in range(3 * body, len(mine), 3 * one.bodies)
        ]
        for body in range(one.bodies)
    ]
    away = [[far if math.isfinite(far) else 0.0 for far in of_body] for of_body in away]
    body = max(range(one.bodies), key=lambda place: max(away[place], default=0.0))
    furthest, size = max(away[body], default=0.0), _half_picture(one, mine)
    if furthest <= 0.0 or size <= 0.0:
        return None
    seen = min(SEEN * size, 0.1 * furthest)
    first = next(sample for sample, far in enumerate(away[body]) if far >= seen)
    return Parting(body, first * one.step, furthest, away[body][-1], furthest / size)


def _half_picture(motion: Trajectory, positions: list[float]) -> float:
    """Half the diagonal of what a motion shows: its bodies, and the places in the world they hang from."""
    fixed = [link.anchors[end] for link in motion.links for end in (0, 1) if link.bodies[end] == WORLD]
    ends = [
        [place[axis] for place in fixed] + list(filter(math.isfinite, positions[axis::3]))
        for axis in range(3)
    ]
    return math.hypot(*(max(along, default=0.0) - min(along, default=0.0) for along in ends)) / 2.0


def apart(one: Trajectory, other: Trajectory) -> float:
    """The largest distance between two motions as a share of half the picture; 0 if they are of different scenes."""
    found = parting(one, other)
    return 0.0 if found is None else found.share


def _values(motion: Trajectory, name: str) -> list[float]:
    """The numbers of a channel (tracker.document.run_document.Channel says how they are packed)."""
    channel = next(channel for channel in motion.channels if channel.name == name)
    packed = zlib.decompress(channel.data)
    half, codes, found = len(packed) // 2, [0] * channel.width, []
    for place in range(half):
        column = place % channel.width
        codes[column] = (codes[column] + packed[place] + 256 * packed[half + place]) % 65536
        code = codes[column]
        found.append(math.nan if code == 65535 else channel.low + channel.step * code)
    return found


def motion_script(key: str, motion: Trajectory) -> bytes:
    """What hands a motion to replay.js under its key."""
    solids: list[Writable] = [
        {
            "kind": solid.kind,
            "size": solid.size,
            "fixed": solid.fixed,
            "driven": solid.driven,
            "position": solid.position,
            "orientation": solid.orientation,
            "body": body,
        }
        for solid, body in zip(motion.solids, motion.body_of_solid, strict=True)
    ]
    links: list[Writable] = [
        {"kind": link.kind, "bodies": link.bodies, "anchors": link.anchors, "row": link.row}
        for link in motion.links
    ]
    channels: list[Writable] = [
        {
            "name": channel.name,
            "unit": channel.unit,
            "low": channel.low,
            "step": channel.step,
            "data": base64.b64encode(channel.data).decode("ascii"),
        }
        for channel in motion.channels
    ]
    data: dict[str, Writable] = {
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
