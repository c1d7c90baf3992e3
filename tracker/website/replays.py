"""Recorded motion for the page of a test: one file per motion, loaded when its figure is seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from spook_tracker.tracker.document.wording import day, number, short_hash, version

from .motions import Motion


@dataclass(frozen=True)
class Replay:
    """What the page of a test needs to replay it."""

    sources: list[dict[str, str]]  # tonight first: key, address below the root, label
    note: str
    against: str = ""  # the key of the one that tonight is laid over at first


def replay(motions: Sequence[Motion], *, over_another_version: bool = False) -> Replay | None:
    """The motions of a test, newest first, each once; None if none was recorded.

    `over_another_version`: at first over what the newest version before did otherwise.
    """
    if not motions:
        return None
    sources = {motions[0].key: {"key": motions[0].key, "address": motions[0].address, "label": ""}}
    for motion in motions:
        engine = motion.night.engine
        label = f"{day(motion.night.started)}, {short_hash(engine) or version(engine)}"
        if motion.key != motions[0].key:  # tonight's needs none, and would be another every night
            sources.setdefault(motion.key, {"key": motion.key, "address": motion.address, "label": label})
    tonight, now = motions[0].recorded, version(motions[0].night.engine)
    before = (m.key for m in motions if m.key != motions[0].key and version(m.night.engine) != now)
    against = next(before, "") if over_another_version else ""
    place = next((c for c in tonight.channels if c.name == "position"), None)
    note = (
        f"{tonight.count} samples, {number(tonight.step, 3)} s apart; h = {number(tonight.time_step, 6)} s."
    )
    if place is not None and place.step > 0.0:
        note += f" Places are stored within {number(place.step / 2.0, 2)} m."
    if tonight.failure:
        note += f" It ends early: {tonight.failure}."
    return Replay(list(sources.values()), note, against)


def replay_files(motions: Mapping[str, Sequence[Motion]]) -> dict[str, bytes]:
    """Address and content of every file of the replays."""
    return {motion.address: motion.script for of_test in motions.values() for motion in of_test}
