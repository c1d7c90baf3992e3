"""Whatever is put into a field of a scene, a method or an observation: it is taken, or refused with one sentence of ours."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from spook_tracker import engine
from spook_tracker.engine import (
    Box,
    EngineError,
    MethodError,
    Motor,
    Part,
    Particle,
    Position,
    Scene,
    Sinusoid,
    Sphere,
)

ENDS: dict[str, Any] = {"name": "it", "between": ("a", "b")}
AXLE: dict[str, Any] = {
    "axis": (0, 1, 0),
    "radius": 1.0,
    "stiffness": 1.0,
    "longitudinal": 1.0,
    "cornering": 1.0,
    "friction": 1.0,
}
WHOLE: dict[str, dict[str, Any]] = {  # each with what it cannot do without
    "Particle": {"name": "p", "position": (0, 0, 0), "mass": 1.0},
    "RigidBody": {"name": "b", "position": (0, 0, 0), "mass": 1.0, "inertia": (1, 1, 1)},
    "Material": {},
    **dict.fromkeys(("Distance", "Ball", "Lock", "Hinge", "Prismatic", "Universal", "PointOnLine", "Cylindrical", "Planar"), ENDS),
    "Tyre": {**ENDS, **AXLE},
    "Motor": {"speed": 1.0},
    "Limit": {"lower": 0.0, "upper": 1.0},
    "JointSpring": {"stiffness": 1.0},
    "Relation": {"name": "r", "terms": (("a", 1.0), ("b", 2.0))},
    "Wire": {"name": "w", "through": (("world", (0, 0, 0)), ("a", (1, 0, 0)), ("b", (2, 0, 0)))},
    "Spring": {**ENDS, "stiffness": 1.0},
    "CentralGravity": {"name": "c", "strength": 1.0},
    "Load": {"name": "l", "body": "a"},
    "Fluid": {"name": "f", "density": 1.0},
    "Sinusoid": {"amplitude": 1.0, "frequency": 1.0},
    "Ramp": {"end": 1.0},
    "Table": {"times": (0.0, 1.0), "values": (0.0, 1.0)},
    "Sphere": {"radius": 1.0},
    "Box": {"size": (1, 1, 1)},
    "Capsule": {"radius": 1.0, "length": 1.0},
    "Cylinder": {"radius": 1.0, "length": 1.0},
    "Cone": {"radius": 1.0, "height": 1.0},
    "Plane": {},
    "ConvexHull": {"corners": ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))},
    "Part": {"shape": Sphere(1.0)},
    "Compound": {"parts": (Part(shape=Sphere(1.0)),)},
    "TriangleMesh": {"corners": ((0, 0, 0), (1, 0, 0), (0, 1, 0)), "faces": ((0, 1, 2),)},
    "HeightField": {"spacing": (1.0, 1.0), "heights": ((0.0, 0.0), (0.0, 0.0))},
    "Scene": {"bodies": (Particle(name="a", position=(0, 0, 0), mass=1.0),)},
    "Method": {},
    "Final": {"quantity": Position()},
    "Trace": {"quantity": Position()},
    "MaximumAbsolute": {"quantity": Position()},
}  # fmt: skip
VALUES: tuple[Any, ...] = (
    None, True, -1, 0, -0.0, math.nan, math.inf, -math.inf, 1e308, 5e-324, 10**400, 1 + 2j, np.float32(2), np.int64(3), np.array(1.5),
    np.array([1.0, 2.0]), np.datetime64("2020"), "", "x", "world", "a" * 5000, "\0", "new\nline", "\ud800", b"", (), [], {}, set(),
    (1, 2), (1, 2, 3), (math.nan, 0, 0), ("a",), ("a", "b"), ("world", "world"), (("a", 1.0), ("b", 2.0)), np.eye(3), range(3), object(),
    int, Ellipsis, lambda time: 0.0, Sinusoid(amplitude=1.0, frequency=1.0), Motor(speed=1.0), Box((1, 1, 1)),
)  # fmt: skip


@pytest.mark.parametrize("name", WHOLE)
def test_every_field_takes_a_value_or_refuses_it(name: str) -> None:
    kind = getattr(engine, name)
    kind(**WHOLE[name])

    for field in dataclasses.fields(kind):
        for value in VALUES if field.init else ():
            try:
                kind(**{**WHOLE[name], field.name: value})
            except EngineError as refused:
                assert "\n" not in str(refused), field.name


@pytest.mark.parametrize("field", ["time_step", "duration", "steps", "method", "observe", "time_limit"])
def test_so_does_a_run(field: str) -> None:
    asked: dict[str, Any] = {
        "time_step": 0.1,
        "duration" if field == "duration" else "steps": 2,
        "time_limit": 0.05,
    }
    scene = Scene(**WHOLE["Scene"])

    for value in VALUES:
        try:
            engine.simulate(scene, **{**asked, field: value})
        except EngineError as refused:
            assert "\n" not in str(refused)


def test_durations_may_be_of_any_kind_of_number() -> None:
    scene = Scene(**WHOLE["Scene"])

    assert [
        engine.simulate(scene, time_step=0.5, duration=d).steps for d in (1, 1.0, np.float32(1), np.int64(1))
    ] == [2] * 4  # type: ignore[arg-type]
    with pytest.raises(MethodError, match="number of seconds"):
        engine.simulate(scene, time_step=0.5, duration=int)  # type: ignore[arg-type]
