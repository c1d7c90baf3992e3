"""A red night to look at: real measurements, three planted faults, a history of eight nights, and the website.

    python bench/red_night.py --db sqlite:///red.db --out public-red

Every number is measured. The engine is ours behind a fault in what it is given: rods that correct half of each
violation (tonight), friction 0.03 % too strong (five nights ago, still red), a restitution 3 % too small (three
nights, mended). Commits, dates, subjects and authors are made up, as these faults were never committed.
"""

from __future__ import annotations

import argparse
import hashlib
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec

sys.path.insert(0, str(Path(__file__).parent.parent))

import spook_tracker.engine as engine
import spook_tracker.tracker as tracker
from spook_tracker.engine.joints import Distance
from spook_tracker.tracker.document.json_form import decode, encode
from spook_tracker.tracker.document.run_document import EngineVersion, RunDocument
from tests.toys.broken_engines import off_by

FIRST = datetime(2026, 11, 15, 3, 17, tzinfo=UTC)
OLD = ("friction", "slip_angle", "force_ratio", "rolling_sphere")  # tests the friction fault is put to
MENDED = ("bouncing_ball",)


def slack(scene: Any, *, time_step: float, **options: Any) -> Any:
    """Rods correct half of each violation: 1 + 4 d, d in time steps, is twice what it should be."""

    def slackened(row: Any) -> Any:
        if not isinstance(row, Distance):
            return row
        damping = 2.0 * time_step if row.damping is None else row.damping
        return replace(row, damping=2.0 * damping + 0.25 * time_step)

    changed = replace(scene, constraints=tuple(map(slackened, scene.constraints)))
    return engine.simulate(changed, time_step=time_step, **options)


def planted(simulate: Callable[..., Any]) -> Any:
    """An engine with the face of ours."""
    return SimpleNamespace(simulate=simulate, build_info=engine.build_info, explain=engine.explain)


SLACK = planted(slack)
STICKY = planted(off_by(1.0003, "friction"))
DULL = planted(off_by(0.97, "restitution"))
COMMITS = (  # subject, author, whose answers: the rest of the tests is the sound engine's
    ("Keep the order of rows when blocks are merged", "Ada Example", ()),
    ("Say in the log which solver was chosen", "Bo Example", ()),
    ("Cache the support point between steps", "Ada Example", ("DULL",)),
    ("Take the friction bound from the contact's own normal force", "Cy Example", ("DULL", "STICKY")),
    ("Spell the names of stages as the thesis does", "Bo Example", ("DULL", "STICKY")),
    ("Ask the impact stage for the restitution of the pair", "Ada Example", ("STICKY",)),
    ("Build with the newer compiler of the image", "Cy Example", ("STICKY",)),
    (
        "Fold the damping of rods into one coefficient",
        "Dee Example",
        ("SLACK", "STICKY"),
    ),  # a later one overrules
)


def merged(sound: RunDocument, faulty: RunDocument) -> RunDocument:
    """The sound run with all that a faulty one says about its tests."""
    tests = {card.name for card in faulty.tests}

    def both(part: str, name: Callable[[Any], str]) -> tuple[Any, ...]:
        kept = [item for item in getattr(sound, part) if name(item) not in tests]
        return (*kept, *getattr(faulty, part))

    parts: dict[str, Any] = {
        part: both(part, lambda item: str(item.test))
        for part in ("series", "figures", "maps", "trajectories")
    }
    quick = {sample.series: sample for sample in sound.samples}
    times = {definition.key for definition in sound.series if definition.kind == "time"}

    def timed(sample: Any) -> Any:
        """Run times stay those of the sound engine: the nights differ in their answers alone."""
        own = quick.get(sample.series)
        if own is None:
            return sample
        return own if sample.series in times else msgspec.structs.replace(sample, timing=own.timing)

    answers = both("samples", lambda item: str(item.series.partition("/")[0]))
    parts["samples"] = tuple(timed(sample) for sample in answers)
    order = {card.name: place for place, card in enumerate(sound.tests)}
    parts["series"] = tuple(sorted(parts["series"], key=lambda d: order[d.test]))
    return msgspec.structs.replace(sound, **parts)


def version(night: int, flags: EngineVersion) -> EngineVersion:
    """The made-up commit of a night."""
    own, before = (hashlib.sha1(f"red {n}".encode()).hexdigest() for n in (night, night - 1))
    subject, author, _ = COMMITS[night]
    return msgspec.structs.replace(
        flags, version=f"1.4.0.post{night + 1}+g{own[:9]}", git_hash=own, dirty=False, parents=(before,) if night else (),
        commit_time=(FIRST + timedelta(days=night, hours=-9)).isoformat(), subject=subject, author=author,
    )  # fmt: skip


def nights(answers: dict[str, RunDocument]) -> Iterable[RunDocument]:
    """The history, oldest first."""
    for night, (_, _, faults) in enumerate(COMMITS):
        document = answers["SOUND"]
        for fault in faults:
            document = merged(document, answers[fault])
        started = FIRST + timedelta(days=night)
        yield msgspec.structs.replace(
            document, id=f"red-night-{night}", idempotency_key=f"red-night-{night}", started=started.isoformat(),
            finished=(started + timedelta(minutes=4)).isoformat(), trigger="nightly",
            engine=version(night, document.engine),
        )  # fmt: skip


def measured(keep: Path | None, names: Sequence[str], **asked: Any) -> dict[str, RunDocument]:
    """The sound engine on everything asked for, each fault on the tests it touches."""

    def answers(fault: str, tests: Sequence[str], source: str) -> RunDocument:
        kept = None if keep is None else keep / f"{fault}.json"
        if kept is not None and kept.exists():
            return decode(kept.read_bytes(), RunDocument)
        found = tracker.run(tests, engine=source, **asked)
        if kept is not None:
            kept.parent.mkdir(parents=True, exist_ok=True)
            kept.write_bytes(encode(found))
        return found

    told = {"SOUND": answers("SOUND", names, "spook")}
    chosen = [card.name for card in told["SOUND"].tests]
    for fault, touched in (("STICKY", OLD), ("DULL", MENDED), ("SLACK", chosen)):
        if tests := [name for name in chosen if name in touched]:
            told[fault] = answers(fault, tests, f"bench.red_night:{fault}")
    return told


def main() -> None:
    reader = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    reader.add_argument("tests", nargs="*", help="tests to measure; all if none is named")
    reader.add_argument("--db", default="sqlite:///red.db")
    reader.add_argument("--out", type=Path, default=Path("public-red"))
    reader.add_argument("--repeats", type=int, default=3, help="of each timing")
    reader.add_argument("--keep", type=Path, help="folder for what was measured, read again the next time")
    asked = reader.parse_args()
    what = {"figures": True, "sweep": True, "stability": True, "repeats": asked.repeats}
    for document in nights(measured(asked.keep, asked.tests, **what)):
        tracker.record(document, asked.db)
    with tracker.History.open(asked.db) as history:
        tracker.publish(history, asked.out)
    print(f"{asked.out}/index.html")


if __name__ == "__main__":
    main()
