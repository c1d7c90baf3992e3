"""Run documents for the storage tests: small, complete, every field off its default."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np

import spook_tracker.tracker.measure.trajectory as motion
from spook_tracker.tracker.document.json_form import Number
from spook_tracker.tracker.document.run_document import (
    Curve,
    DrawnSolid,
    EngineVersion,
    FigureData,
    Machine,
    MapData,
    RunDocument,
    Sample,
    SeriesDefinition,
    StageChoice,
    TestCard,
    Timing,
    Trajectory,
)

KEY = "pendulum/plain/length_deviation/h=0.0166667"
_numbers = itertools.count(1)


def engine(git_hash: str = "a" * 40, **changes: Any) -> EngineVersion:
    fields = {
        "name": "spook",
        "version": "1.2.1.dev3+g1a2b3c4",
        "git_hash": git_hash,
        "dirty": False,
        "commit_time": "2026-11-20T10:00:00+00:00",
        "parents": ("f" * 40, "e" * 40),
        "compiler": "gcc 12.2.0",
        "flags": "-O3 -ffp-contract=off",
    }
    return EngineVersion(**fields | changes)


def machine(**changes: Any) -> Machine:
    fields = {
        "fingerprint": "c0ffee",
        "processor": "Example 9000",
        "cores": 2,
        "operating_system": "Linux 6.1",
        "float_environment": "0123abcd",
    }
    return Machine(**fields | changes)


def gate(key: str = "t/c/m", **changes: Any) -> SeriesDefinition:
    """A gate of errors that says nothing else."""
    test, configuration, metric = key.split("/")[:3]
    fields = {
        "key": key, "test": test, "title": "T", "configuration": configuration, "metric": metric, "description": "d",
        "unit": "m", "role": "gate", "better": "smaller_magnitude", "kind": "scalar", "time_step": None,
        "parameters": {}, "limit": None, "limit_source": "", "set_point": None, "set_point_source": "",
        "reference": None, "tolerance": 0.0, "relative_tolerance": 1e-9, "test_version": "1",
    }  # fmt: skip
    return SeriesDefinition(**fields | changes)


def definition(key: str = KEY, **changes: Any) -> SeriesDefinition:
    fields = {
        "key": key,
        "test": "pendulum",
        "title": "Pendulum",
        "configuration": "plain",
        "metric": "length_deviation",
        "description": "Largest deviation of the length.",
        "unit": "%",
        "role": "gate",
        "better": "smaller_magnitude",
        "kind": "scalar",
        "time_step": 1 / 60,
        "parameters": {"mass": 1.0, "length": 0.1 + 0.2},
        "limit": 0.5,
        "limit_source": "thesis, section 3.6",
        "set_point": (0.40703, 0.40704),
        "set_point_source": "closed form",
        "reference": 0.0,
        "tolerance": 1e-12,
        "relative_tolerance": 1e-9,
        "test_version": "v1",
        "aliases": (),
    }
    return SeriesDefinition(**fields | changes)


def sample(series: str = KEY, value: Any = 0.407038, **changes: Any) -> Sample:
    fields: dict[str, Any] = {
        "series": series,
        "value": Number(value),
        "outcome": "value",
        "passed": True,
        "set_point_held": True,
        "failure": "",
        "counters": {"steps": 600, "block_operations": 3 * 600},
        "state_hash": "9f" * 16,
        "timing": Timing(
            seconds=(0.1, 0.30000000000000004),
            runs_per_repeat=4,
            instructions=2**40,
            stage_seconds={"observe": 1e-9},
            cpu_seconds=(0.09, 0.1),
            calibration=(0.002, 0.0021),
        ),
    }
    if not math.isfinite(Number(value)):
        fields |= {"outcome": "not_finite", "passed": False, "set_point_held": False}
    return Sample(**fields | changes)


def card(**changes: Any) -> TestCard:
    fields = {
        "name": "pendulum",
        "title": "Pendulum",
        "question": "How long does the rod stay?",
        "why": "It is the simplest constraint.",
        "model": "A mass on a rod.",
        "parameters": (("mass", "1 kg"),),
        "theory": ("g(q) = |q| − l",),
        "reference": "0",
        "conclusion": "Green: it holds.",
        "source": "thesis, section 3.6",
        "misprints": ("a sign",),
        "seven": True,
        "stages": (
            StageChoice(stage="collision", kept=False, reason="no shapes", saved_seconds_per_step=1e-8),
        ),
    }
    return TestCard(**fields | changes)


def figure(name: str = "length", **changes: Any) -> FigureData:
    fields = {
        "test": "pendulum",
        "name": name,
        "title": "Length over time",
        "thesis": "Fig 3.20",
        "x_label": "time, s",
        "y_label": "length, m",
        "x_scale": "linear",
        "y_scale": "log",
        "note": "note",
        "curves": (
            Curve(name="plain", x=(0.0, 1.0, 2.0), y=tuple(map(Number, (1.0, "nan", -0.0))), style="line"),
        ),
    }
    return FigureData(**fields | changes)


def stability_map(name: str = "tau-eps", **changes: Any) -> MapData:
    fields = {
        "test": "pendulum",
        "name": name,
        "title": "Damping and compliance",
        "configuration": "plain",
        "definition": "energy stays bounded",
        "x_label": "tau/h",
        "y_label": "eps",
        "x": (0.0, 1.0),
        "y": (1e-9,),
        "cells": (("growing", "settled"),),
        "prediction": ((Number(1.5), Number("inf")),),
        "note": "note",
    }
    return MapData(**fields | changes)


def trajectory(name: str = "example", **changes: Any) -> Trajectory:
    fields = {
        "test": "pendulum",
        "name": name,
        "time_step": 0.01,
        "step": 0.02,
        "count": 3,
        "bodies": 1,
        "solids": (DrawnSolid(kind="particle", position=(0.0, 0.0, 1.0)),),
        "body_of_solid": (0,),
        "channels": (
            motion.channel("position", "m", np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 0.5], [np.nan, 0.0, 0.0]])),
        ),
    }
    return Trajectory(**fields | changes)


def run(**changes: Any) -> RunDocument:
    """A complete document with a new id; `changes` replaces whole fields."""
    number = next(_numbers)
    fields = {
        "schema_version": 1,
        "id": f"{number:08x}-0000-7000-8000-000000000000",
        "idempotency_key": f"key {number}",
        "started": f"2026-11-21T03:{number // 60 % 60:02}:{number % 60:02}.123456+00:00",
        "finished": "2026-11-21T04:00:00Z",
        "trigger": "test",
        "tracker_version": "0.1",
        "ci_address": "https://ci.example/1",
        "engine": engine(),
        "machine": machine(),
        "tests": (card(),),
        "series": (definition(),),
        "samples": (sample(),),
        "figures": (figure(),),
        "maps": (stability_map(),),
        "trajectories": (trajectory(),),
    }
    return RunDocument(**fields | changes)


def run_of(values: dict[str, Any], **changes: Any) -> RunDocument:
    """A run with one gate series for each key."""
    return run(
        series=tuple(definition(key) for key in values),
        samples=tuple(sample(key, value) for key, value in values.items()),
        **changes,
    )
