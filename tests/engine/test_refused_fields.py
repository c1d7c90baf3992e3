"""What one part of a scene cannot be: refused when it is made, in one sentence that names it and what is wrong."""

from __future__ import annotations

import math
import re
from typing import Any

import pytest

from spook_tracker import engine
from spook_tracker.engine import WORLD, Material, Plane, SceneError, Sinusoid
from tests.engine.test_hostile_values import WHOLE

ORIGIN, X, Y, Z = (0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)
NAN, INF = math.nan, math.inf
WAVE = Sinusoid(amplitude=1.0, frequency=1.0)
SQUARE = (ORIGIN, X, (1, 1, 0), Y)
CUBE = tuple((x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5))
NINE_SIDED = tuple(
    (math.cos(k * math.pi / 9), math.sin(k * math.pi / 9), z) for k in range(18) for z in (0, 1)
)
FLAT = ((0, 0), (0, 0))
LED: dict[str, Any] = {"motion": "kinematic", "mass": None, "inertia": None, "position": (0, 1, 2)}
BELT: dict[str, Any] = {
    "motion": "static",
    "mass": None,
    "inertia": None,
    "shape": Plane(),
    "material": Material(friction=0.5),
    "surface_velocity": X,
}
TILTED = ((2.0, 0.5, 0.0), (0.5, 2.0, 0.0), (0.0, 0.0, 3.0))
BASES: dict[str, dict[str, Any]] = {
    **WHOLE,
    "Material": {"friction": 0.5},
    "PairFriction": {"between": ("box", "ground")},
    "Wire": {"name": "w", "through": (("a", ORIGIN), (WORLD, (0, 0, 5)), ("b", X))},
}  # fmt: skip
JOINT: list[tuple[dict[str, Any], str]] = [
    ({"axis": ORIGIN}, "axis"),
    ({"axis": (NAN, 0, 1)}, "axis"),
    ({"axis": (INF, 0, 1)}, "axis"),
    ({"axis": (0, 1)}, "axis"),
    ({"between": ("a", "a")}, "itself"),
    ({"between": (ORIGIN, "a")}, "names"),
    ({"at": (0, 0)}, "at"),
    ({"at": (0, 0, NAN)}, "at"),
    ({"compliance": -1e-9}, "compliance"),
    ({"compliance": (0.0,) * 6}, "compliance"),
    ({"damping": NAN}, "damping"),
    ({"strength": 0.0}, "strength"),
    ({"name": ""}, "name"),
]
SIZES = (0.0, -1.0, NAN, INF, "tall")
REFUSED: dict[str, list[tuple[dict[str, Any], str]]] = {
    "PointOnLine": JOINT,
    "Cylindrical": JOINT,
    "Planar": JOINT,
    "Lock": [({"strength": 0.0}, "strength must be positive")],
    "JointSpring": [({"max_force": -1.0}, "max_force must not be negative")],
    "Motor": [({"speed": math.sin}, "native loop")],
    "Relation": [
        ({"terms": (("a", 0.0), ("b", 1.0))}, "coefficient of 'a' is 0"),
        ({"terms": (("a", NAN), ("b", 1.0))}, "finite"),
        ({"terms": (("a", 1.0),)}, "at least two"),
        ({"terms": (("a", 1.0), ("a", 2.0))}, "twice"),
        ({"terms": ("ab", 1.0)}, "pairs"),
    ],
    "Wire": [
        ({"through": ((WORLD, X),)}, "two points"),
        ({"through": ((WORLD, Z), ("a", X), ("a", Y), (WORLD, X))}, "on 'a', so that part"),
        ({"through": ((WORLD, X), ("a", X))}, "coincide"),
        ({"length": 0.0}, "length"),
        ({"restitution": 1.5}, "between 0 and 1"),
        ({"strength": NAN}, "strength must be finite"),
        ({"friction": -0.1}, "friction must not be negative"),
        ({"friction": (NAN,)}, "friction must be finite"),
        ({"friction": (0.1, 0.2)}, "friction needs one number or 1"),
        ({"through": (("a", ORIGIN), ("b", X)), "friction": 0.1}, "no point between its ends"),
        ({"turns": "2"}, "turns must be a number"),
        ({"friction": 0.1, "strength": 5.0}, "no one tension"),
        ({"wound": (("axle", 0.0),)}, "radius of drum 'axle' is 0"),
        ({"wound": (("axle", 1.0), ("axle", 2.0))}, "named twice"),
        ({"wound": ("axle",)}, "pairs of a hinge and a radius"),
    ],
    "Tyre": [
        ({"between": ("wheel", WORLD)}, "turn them round"),
        ({"between": ("wheel", "wheel")}, "cannot roll on itself"),
        ({"between": "wheel"}, "a road and a wheel"),
        ({"axis": Z}, "lies flat"),
        ({"axis": ORIGIN}, "zero vector"),
        ({"radius": 0.0}, "radius must be positive"),
        ({"cornering": INF}, "cornering must be finite"),
        ({"friction": (1.0, 1.0, 1.0)}, "one number or two"),
        ({"friction": (0.5, -1.0)}, "not be negative"),
        ({"damping": "soft"}, "damping must be a number"),
    ],
    "Load": [({"factor": 2.0}, "factor must be")],
    "Fluid": [
        ({"density": 0.0}, "density must be positive"),
        ({"level": NAN}, "level must be finite"),
        ({"level": -INF}, "level"),
        ({"drag_coefficient": -1.0}, "drag_coefficient"),
    ],
    "Table": [
        ({"values": (0.0, None)}, "values[1] must be a number"),
        ({"values": (0.0, NAN)}, "values[1] must be finite"),
        ({"times": (0.0, NAN)}, "times[1] must be finite"),
        ({"times": (0.0, 1.0, 1.0), "values": (0.0, 1.0, 2.0)}, "times must rise"),
        ({"values": (0.0,)}, "2 times but 1 values"),
        ({"times": (), "values": ()}, "at least one"),
        ({"times": 3.0, "values": 4.0}, "sequence"),
    ],
    "Ramp": [({"start": 1.0, "end": 1.0}, "must come after")],
    "Sinusoid": [({"amplitude": INF}, "amplitude")],
    "Material": [
        *(
            ({field: value}, field)
            for field in ("rolling_friction", "torsional_friction")
            for value in (-1e-3, NAN, INF, "soft")
        ),
        *(({"tangential_restitution": share}, "tangential_restitution") for share in (-0.1, 1.1, NAN)),
        ({"friction_direction": X}, "friction_direction says nothing without friction_across"),
        ({"friction_across": 0.2}, "friction_across says nothing without friction_direction"),
        ({"friction_direction": ORIGIN, "friction_across": 0.2}, "friction_direction"),
        ({"friction_direction": (NAN, 0, 0), "friction_across": 0.2}, "friction_direction"),
        ({"friction_direction": "x", "friction_across": 0.2}, "friction_direction"),
        ({"friction_direction": X, "friction_across": 0.0}, "friction_across"),
        ({"friction_direction": X, "friction_across": INF}, "friction_across"),
        ({"friction_direction": X, "friction_across": -0.1}, "friction_across"),
        ({"friction_direction": X, "friction_across": 4.9e-4}, "too far apart"),
        ({"friction": 0.0, "friction_direction": X, "friction_across": 0.2}, "too far apart"),
    ],
    "PairFriction": [
        ({"between": ("box", "box")}, "does not rub on itself"),
        *(({"between": told}, "is not a pair of names") for told in ("ab", ("box",), ("box", ["ground"]), 3)),
        ({"friction": -0.1}, "friction must"),
    ],
    "RigidBody": [
        ({"pace": WAVE}, "only a kinematic body"),
        ({"path": ORIGIN}, "only a kinematic body has a path"),
        ({"spin_pace": WAVE}, "only a kinematic body has a spin_pace"),
        ({**LED, "path": (0.5, 1.0, 2.0)}, "begins at x = 0.5 m, but it stands at 0 m"),
        ({**LED, "path": (0.0, 1.0)}, "three numbers or functions"),
        ({**LED, "path": (0.0, 1.0, NAN)}, "finite"),
        ({**LED, "path": (0.0, 1.0, lambda t: t)}, "must be a number, Sinusoid"),
        ({**LED, "path": (0.0, 1.0, 2.0), "velocity": X}, "leave its velocity"),
        ({**LED, "angle": Sinusoid(amplitude=1.0, frequency=1.0, phase=1.0)}, "instead of 0"),
        ({**LED, "angle": WAVE, "angular_velocity": X}, "leave its angular velocity"),
        ({**LED, "angle": WAVE, "angle_axis": ORIGIN}, "angle_axis"),
        ({**BELT, "surface_velocity": (NAN, 0, 0)}, "surface_velocity"),
        ({**BELT, "surface_velocity": 1.0}, "surface_velocity"),
        ({**BELT, "material": Material()}, "only a surface with friction takes things along"),
        ({**BELT, "shape": None}, "only a surface with friction takes things along"),
        (
            {"inertia": ((2.0, 0.5, 0.0), (0.4, 2.0, 0.0), (0.0, 0.0, 3.0))},
            "not symmetric: 0.5 in row 0, column 1, but 0.4",
        ),
        ({"inertia": ((1.0, 2.0, 0.0), (2.0, 1.0, 0.0), (0.0, 0.0, 3.0))}, "not positive"),
        ({"inertia": ((1.0, 0.1, 0.0), (0.1, 1.0, 0.0), (0.0, 0.0, 9.0))}, "triangle rule"),
        ({"inertia": ((1.0, 0.1, 0.0), (0.1, 1.0, NAN), (0.0, 0.0, 1.0))}, "finite"),
        ({"inertia": ((1.0, 0.1), (0.1, 1.0), (0.0, 0.0))}, "three"),
        ({"inertia": TILTED, "inertia_axes": (0.0, 1.0, 0.0, 0.0)}, "leave inertia_axes out"),
    ],
    "Cylinder": [({field: value}, field) for field in ("radius", "length") for value in SIZES],
    "Cone": [({field: value}, field) for field in ("radius", "height") for value in SIZES],
    "TriangleMesh": [
        ({"corners": SQUARE, "faces": ()}, "at least one triangle"),
        ({"corners": SQUARE, "faces": ((0, 1, 2), (0, 1, 3))}, "from corner 0 to 1"),
        ({"corners": SQUARE, "faces": ((0, 1, 1),)}, "triangle 0 has no area"),
        ({"corners": (*SQUARE, (2, 0, 0)), "faces": ((0, 1, 4),)}, "triangle 0 has no area"),
        ({"corners": SQUARE, "faces": ((0, 1, 4),)}, "three indices of its 4 corners"),
        ({"corners": SQUARE, "faces": ((0, 1),)}, "three indices"),
        ({"corners": SQUARE, "faces": ((0, 1.5, 2),)}, "three indices"),
        ({"corners": SQUARE, "faces": ((0, 1, INF),)}, "three indices"),
        ({"corners": ((0, 0, NAN), *SQUARE)}, "corners"),
        ({"corners": "corners"}, "must be a list"),
    ],
    "HeightField": [
        ({"heights": ((0, 0),)}, "two rows"),
        ({"heights": ((0, 0), (0, 0, 0))}, "two rows"),
        ({"spacing": (0, 1)}, "spacing"),
        ({"spacing": 1.0}, "two numbers"),
        ({"heights": ((0, INF), (0, 0))}, "heights"),
        ({"spacing": (1e-200, 1e-200)}, "row 0, column 0 has no area"),
        ({"spacing": (1e-12, 1)}, "row 0, column 0 has no area"),
        ({"heights": ((0, 0, 0), (0, 0, 1e12))}, "row 0, column 1 has no area"),
    ],
    "ConvexHull": [
        ({"corners": ()}, "lie in one plane"),
        ({"corners": CUBE[:3]}, "lie in one plane"),
        ({"corners": (ORIGIN, X, Y, (1, 1, 0))}, "lie in one plane"),
        ({"corners": (ORIGIN, X, (2, 0, 0), (3, 0, 0))}, "lie in one plane"),
        ({"corners": (ORIGIN,) * 9}, "lie in one plane"),
        ({"corners": (*CUBE, (NAN, 0, 0))}, "finite"),
        ({"corners": (*CUBE, (INF, 0, 0))}, "finite"),
        ({"corners": (*CUBE, (1, 2))}, "corners"),
        ({"corners": "cube"}, "corners must be points"),
        ({"corners": 3}, "corners must be points"),
        ({"corners": tuple((math.cos(k), math.sin(k), k / 70) for k in range(70))}, "at most 64"),
        ({"corners": NINE_SIDED}, "at most 16"),
    ],
}
CULPRITS = {"Cylinder": "cylinder", "Cone": "cone", "ConvexHull": "convex hull: ", "Material": "material"}


@pytest.mark.parametrize(
    ("name", "changes", "words"),
    [(name, changes, words) for name, rows in REFUSED.items() for changes, words in rows],
)
def test_what_cannot_be_is_refused_in_one_sentence(name: str, changes: dict[str, Any], words: str) -> None:
    kind = getattr(engine, name)
    given = BASES[name] | changes
    with pytest.raises(SceneError, match=re.escape(words)) as caught:
        kind(**given)
    sentence = str(caught.value)

    assert "\n" not in sentence and CULPRITS.get(name, "") in sentence
    if given.get("name"):
        assert f"'{given['name']}'" in sentence
    if REFUSED[name] is JOINT and given["name"]:
        assert kind.kind in sentence
