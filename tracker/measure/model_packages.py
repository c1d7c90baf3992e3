"""The model files of an installed package or of a folder: which are models, and which an engine loads and steps.

Each file is loaded in a process that is watched: what hangs, dies or takes too much memory costs its own line.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib.metadata import PackageNotFoundError, distribution, packages_distributions
from pathlib import Path
from typing import Literal

from spook_tracker.engine.errors import EngineError
from spook_tracker.engine.find import find
from spook_tracker.engine.model_bodies import ModelError
from spook_tracker.engine.model_file import ModelFile, ModelRun
from spook_tracker.engine.model_reading import Reading, read
from spook_tracker.engine.protocol import NotSupported

from . import workers as crew
from .model_agreement import (
    ALIKE,
    BUDGET,
    Agreement,
    OutOfTime,
    agreement,
)
from .model_files import SUFFIXES, ModelFileError
from .model_standing import Standing, standing

LookedWord = Literal["model", "part", "refused", "runs", "fails"]
PARTS = ("no model by itself", "part of other models", "nothing in", "begins with <")
STEPS = 10  # that a model must take to be said to run
LONGEST = 20.0  # s that those steps may take
MEMORY = (
    6 << 30
)  # bytes of a worker: MuJoCo's reader asks for 3.4e9 for one public model, and those before it leave some behind
LIMITS = crew.Limits(seconds=60.0, memory=MEMORY)
LONG = crew.Limits(seconds=300.0, memory=MEMORY)
AGREE = crew.Limits(seconds=10.0 * BUDGET, memory=MEMORY)  # of a busy machine: a swing has its own budget


@dataclass(frozen=True, slots=True)
class Looked:
    """One file and what it is."""

    path: Path
    word: LookedWord
    sentence: str = ""
    format: str = ""
    bodies: int = 0
    files: int = 0
    agreement: Agreement | None = None
    out_of_time: bool = False  # its swing was not compared for this reason

    @property
    def agrees(self) -> bool:
        """Whether it swings as in MuJoCo."""
        return self.agreement is not None and self.agreement.apart <= ALIKE


def files_of(name: str) -> list[Path]:
    """Every file that could be a model: itself, of a folder, or of an installed package by its own or its import name."""
    if Path(name).is_file():
        return [Path(name)]
    if Path(name).is_dir():
        return sorted(path for path in Path(name).rglob("*") if path.suffix.lower() in SUFFIXES)
    try:
        found = distribution(name)
    except (PackageNotFoundError, ValueError):
        names = packages_distributions().get(name, ())
        if not names:
            raise ModelFileError(
                f"no package {name!r} is installed here, and there is no such folder; install it with: pip install {name}"
            ) from None
        found = distribution(names[0])
    files = [Path(str(found.locate_file(file))).resolve() for file in found.files or ()]
    return sorted({path for path in files if path.suffix.lower() in SUFFIXES and path.is_file()})


def looked_at(path: Path) -> Looked:
    """What a file is, without an engine."""
    try:
        return _said(path, read(path), "model")
    except ModelError as error:
        part = any(words in str(error) for words in PARTS)
        return Looked(path, "part" if part else "refused", str(error))


def loaded(paths: Sequence[Path], engine: str, workers: int = 2, agree: bool = False) -> Iterator[Looked]:
    """The same, each model also loaded and stepped by an engine, and its swing compared with MuJoCo's."""
    look = partial(_compared if agree else _stepped, engine)
    for path, answer in crew.answers(look, list(paths), workers, AGREE if agree else LIMITS):
        yield Looked(path, "fails", answer.failure) if isinstance(answer, crew.Lost) else answer


def stood(
    paths: Sequence[Path], engines: Sequence[str], workers: int = 2
) -> Iterator[tuple[Path, Standing | str]]:
    """Of every model where these engines take it, or one sentence; what is no model by itself is left out."""
    for path, answer in crew.answers(partial(_stood, tuple(engines)), list(paths), workers, LONG):
        if isinstance(answer, crew.Lost):
            yield path, answer.failure
        elif answer is not None:
            yield path, answer


def _stood(engines: tuple[str, ...], path: Path) -> Standing | str | None:
    looked = looked_at(path)
    if looked.word != "model":
        return looked.sentence if looked.word == "refused" else None
    return standing(_model(path, read(path)), engines)


def _said(path: Path, reading: Reading, word: LookedWord, sentence: str = "") -> Looked:
    return Looked(path, word, sentence, reading.format, reading.bodies, len(reading.files))


def _model(path: Path, reading: Reading) -> ModelFile:
    return ModelFile(
        path=str(path.resolve()),  # DART takes no other
        format=reading.format,
        digest=reading.digest,
        time_step=reading.time_step,
        gravity=reading.gravity,
        watched=reading.watched,
        assets={name: str(file) for name, file in reading.assets.items()},
    )


def _compared(engine: str, path: Path) -> Looked:
    """Stepped, and its swing compared: also of a model that is refused for what does not take part in a swing."""
    looked = _stepped(engine, path)
    if not looked.format:
        return looked
    try:
        return replace(looked, agreement=agreement(_model(path, read(path)), engine))
    except OutOfTime as error:
        return replace(looked, sentence=looked.sentence or str(error), out_of_time=True)
    except EngineError as error:
        return replace(looked, sentence=looked.sentence or str(error))


def _stepped(engine: str, path: Path) -> Looked:
    looked = looked_at(path)
    if looked.word != "model":
        return looked
    reading = read(path)
    asked = ModelRun(model=_model(path, reading))
    try:
        done = find(engine).simulate(
            asked, time_step=reading.time_step, duration=STEPS * reading.time_step, time_limit=LONGEST
        )
    except NotSupported as lack:
        return _said(path, reading, "refused", str(lack))
    except EngineError as error:
        return _said(path, reading, "fails", str(error))
    except Exception as error:
        return _said(path, reading, "fails", f"{type(error).__name__}: {' '.join(str(error).split())[:200]}")
    return _said(path, reading, "runs" if done.completed else "fails", done.failure)
