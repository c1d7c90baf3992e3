"""Model files as a catalogue: a file is a test, and the [[model]] tables of a tracker.toml are several.

    robot.xml, arm=robots/arm.urdf      a file, by its own name or another
    tracker.toml                        every [[model]] in it

    [[model]]
    file = "assets/scene.xml"           # all else may be left out
    name = "bowl"                       # of the test; else the file's
    keyframe = "home"                   # or its number; else the state the file describes
    control = "hold"                    # zero, hold, a CSV file, module:function, or { amplitude = 0.1, frequency = 2.0 }
    push = 0.01                         # sizes a second: random changes of velocity in every step
    seed = 1                            # of those
    duration = 5.0                      # s
    watch = ["bowl", "ramekin"]         # bodies; else what is free and the ends of chains
    tolerance = 0.001                   # m and rad: what moves further is red
    folder = "."                        # nothing outside it is read

Paths are relative to the tracker.toml.
"""

from __future__ import annotations

import csv
import hashlib
import importlib.util
import itertools
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Required, TypedDict, cast

from spook_tracker.engine.model_bodies import ModelError
from spook_tracker.engine.model_file import Drive, ModelFile, Watched
from spook_tracker.engine.model_reading import Reading, read, shown
from spook_tracker.scalar_tests.case import ScalarTest
from spook_tracker.scalar_tests.catalogue import QUESTIONS
from spook_tracker.scalar_tests.model_file.question import test_of
from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.document.toml_file import Toml, read_toml

SUFFIXES = (".xml", ".mjcf", ".urdf", ".sdf", ".world")
KINDS: Mapping[str, tuple[type, ...]] = {
    "file": (str,),
    "name": (str,),
    "keyframe": (str, int),
    "control": (str, dict),
    "push": (float, int),
    "seed": (int,),
    "duration": (float, int),
    "watch": (list,),
    "tolerance": (float, int),
    "folder": (str,),
}
LONGEST = 60.0  # s
MOST_ROWS = 100_000


class ModelFileError(TrackerError):
    """A model cannot be asked about; one sentence that names it and the way out."""


def is_model(name: str) -> bool:
    """Whether a catalogue's name is a model file or a file that lists some."""
    return Path(name).suffix.lower() in (*SUFFIXES, ".toml")


def catalogue(name: str) -> dict[str, ScalarTest]:
    """The tests of NAME=FILE, FILE or a tracker.toml. ModelFileError says what is wrong with it."""
    if Path(name).suffix.lower() == ".toml":
        return _of_toml(Path(name))
    label, _, file = name.rpartition("=")
    return _added({}, {"file": file, **({"name": label} if label else {})}, Path(), name)


def _of_toml(file: Path) -> dict[str, ScalarTest]:
    try:
        tables = read_toml(file).get("model", [])
    except (OSError, ValueError) as error:
        raise ModelFileError(f"{file} cannot be read: {error}") from None
    found: dict[str, ScalarTest] = {}
    for place, table in enumerate(tables if isinstance(tables, list) else [tables], start=1):
        _added(found, table, file.parent, f"{file}, [[model]] {place}")
    return found


class ModelTable(TypedDict, total=False):
    """A table [[model]] of tracker.toml, once it is understood."""

    file: Required[str]
    name: str
    folder: str
    duration: float  # s
    tolerance: float
    watch: list[Toml]
    keyframe: str | int
    control: str | dict[str, Toml]
    push: float
    seed: int


def _added(found: dict[str, ScalarTest], table: Toml, folder: Path, origin: str) -> dict[str, ScalarTest]:
    said = _understood(table, origin)
    name = _test_name(said.get("name") or Path(said["file"]).stem)
    if name in found:
        raise ModelFileError(f'{origin}: a model {name!r} is there already; give this one another name = "…"')
    try:
        reading = read(folder / said["file"], folder / said["folder"] if "folder" in said else None)
    except ModelError as error:
        raise ModelFileError(str(error)) from None
    found[name] = _test(name, said, reading, folder, origin)
    return found


def _understood(said: Toml, origin: str) -> ModelTable:
    if not isinstance(said, dict) or not said.get("file"):
        raise ModelFileError(f'{origin} names no file; say file = "robot.xml"')
    for key, value in said.items():
        if key not in KINDS:
            raise ModelFileError(f"{origin}: there is no setting {key!r}; a model knows {', '.join(KINDS)}")
        if not isinstance(value, KINDS[key]) or isinstance(value, bool):
            raise ModelFileError(f"{origin}: {key} cannot be {value!r}")
    table = cast(ModelTable, said)  # each value is of a kind that its name may have
    if table.get("seed", 0) < 0:
        raise ModelFileError(f"{origin}: seed must not be negative")
    for key, most in (("duration", LONGEST), ("tolerance", math.inf), ("push", math.inf)):
        given = said.get(key)
        if isinstance(given, int | float) and not 0.0 < given <= most:
            raise ModelFileError(
                f"{origin}: {key} must be positive{'' if most == math.inf else f' and {most:g} s at most'}"
            )
    return table


def _test_name(text: str) -> str:
    """A word that can be typed; one that no question of ours has."""
    name = re.sub(r"[^A-Za-z0-9_.-]+", "_", text).strip("_.") or "model"
    return f"{name}_model" if name in QUESTIONS else name


def _test(name: str, said: ModelTable, reading: Reading, folder: Path, origin: str) -> ScalarTest:
    model = ModelFile(
        path=str(reading.path),
        format=reading.format,
        digest=reading.digest,
        time_step=reading.time_step,
        gravity=reading.gravity,
        watched=_watched(said.get("watch"), reading, origin),
        keyframe=_keyframe(said.get("keyframe", ""), reading, origin),
        drive=_drive(said.get("control", "zero"), folder, origin),
        push=float(said.get("push", 0.0)),
        seed=int(said.get("seed", 0)),
        assets={key: str(path) for key, path in reading.assets.items()},
    )
    return test_of(
        name,
        model,
        file=shown(reading.path),
        duration=float(said.get("duration", 5.0)),
        stands_free=reading.stands_free,
        tolerance=float(said.get("tolerance", 0.0)),
        files=len(reading.files),
        bodies=reading.bodies,
        driven=reading.driven,
    )


def _watched(names: Sequence[Toml] | None, reading: Reading, origin: str) -> tuple[Watched, ...]:
    if names is None:
        return reading.watched
    texts = [name for name in names if isinstance(name, str) and name]
    if not texts or len({*texts}) < len(names):
        raise ModelFileError(f"{origin}: watch must name bodies, each once")
    return tuple(Watched(label=name.replace("/", "."), name=name) for name in texts)


def _keyframe(wanted: str | int, reading: Reading, origin: str) -> str:
    if wanted == "":
        return ""
    known = [*reading.keyframes, *map(str, range(len(reading.keyframes)))]
    if str(wanted) not in known:
        raise ModelFileError(
            f"{origin}: the file has no keyframe {wanted!r}; it has {', '.join(reading.keyframes) or 'none'}"
        )
    return str(wanted)


def _drive(said: str | Mapping[str, Toml], folder: Path, origin: str) -> Drive:
    if isinstance(said, Mapping):
        numbers = {k: float(v) for k, v in said.items() if isinstance(v, float | int) and math.isfinite(v)}
        if set(said) != {"amplitude", "frequency"} or len(numbers) < 2:
            raise ModelFileError(f"{origin}: a sinusoid is {{ amplitude = 0.1, frequency = 2.0 }}, in Hz")
        return Drive(kind="sinusoid", amplitude=numbers["amplitude"], frequency=numbers["frequency"])
    if said == "zero" or said == "hold":
        return Drive(kind="zero" if said == "zero" else "hold")
    if said.endswith(".csv"):
        return Drive(kind="table", rows=_table(folder / said, origin))
    module, _, name = said.partition(":")
    if name:
        try:
            spec = importlib.util.find_spec(module)
        except (ImportError, ValueError):  # of a package that is not there
            spec = None
        if spec is None or spec.origin is None:
            raise ModelFileError(f"{origin}: there is no module {module!r} with a function {name!r}")
        digest = hashlib.sha256(Path(spec.origin).read_bytes()).hexdigest()[:16]
        return Drive(kind="function", function=said, digest=digest)
    raise ModelFileError(
        f"{origin}: control cannot be {said!r}; it is zero, hold, a CSV file, module:function, or a sinusoid"
    )


def _table(file: Path, origin: str) -> tuple[tuple[float, ...], ...]:
    """Rows of time [s] and controls; a first line of words is passed over."""
    try:
        with file.open(encoding="utf-8-sig", newline="") as lines:
            rows = [row for row in csv.reader(lines) if row]
        if rows and not _numbers(rows[0]):
            rows = rows[1:]
        table = tuple(tuple(map(float, row)) for row in rows[:MOST_ROWS])
    except (OSError, UnicodeDecodeError, ValueError, csv.Error) as error:
        raise ModelFileError(f"{origin}: {file} is no table of controls: {error}") from None
    if not table or len({*map(len, table)}) > 1 or len(table[0]) < 2 or len(rows) > MOST_ROWS:
        raise ModelFileError(f"{origin}: {file} must have rows of one length: time [s], then a control each")
    if not all(math.isfinite(number) for row in table for number in row):
        raise ModelFileError(f"{origin}: {file} holds a number that is not finite")
    if any(a[0] >= b[0] for a, b in itertools.pairwise(table)):
        raise ModelFileError(f"{origin}: the times in {file} must grow")
    return table


def _numbers(row: Sequence[str]) -> bool:
    try:
        return all(math.isfinite(float(text)) for text in row)
    except ValueError:
        return False
