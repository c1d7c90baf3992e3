"""What fuzzing puts to the Python side: any bytes are taken, or refused in one sentence of ours; nothing else.

    documents   the bytes as a file given to `tracker import`
    scenes      the bytes as what a scene is built of, sense and nonsense mixed, then steps a little
    settings    the bytes as tracker.toml and as accepted.toml

`make fuzz` runs each under atheris, guided by what of our code it reaches (tests/fuzz/run.py).
What was found stays in tests/fuzz/NAME and is put again by tests/fuzz/test_corpus.py.
"""

from __future__ import annotations

import math
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from spook_tracker import engine as spook
from spook_tracker.engine.errors import EngineError
from spook_tracker.tracker.cli import settings as tracker_toml
from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.document.json_form import encode
from spook_tracker.tracker.judge.accepted import read_accepted
from spook_tracker.tracker.measure.other_tools import of_other_tools
from spook_tracker.tracker.measure.short_form import is_short, whole
from spook_tracker.tracker.store.border import checked, decoded

KEPT = Path(__file__).parent
LONGEST = 1000  # characters of a refusal
NASTY: tuple[Any, ...] = (
    math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324, 10**400, -1, 0, True, None, "", "x", (), {}, 1 + 2j, b"0",
)  # fmt: skip


def documents(content: bytes) -> None:
    """Either refused, or decoded to something that is valid, and the same after another round."""
    if is_short(content):
        found: tuple[Any, ...] = (whole(content, "file"),)
    else:
        other = of_other_tools(content, "file")
        found = other if other is not None else (decoded(content, "file"),)
    for document in found:
        text = encode(checked(document))
        assert encode(checked(decoded(text, "file"))) == text


def settings(content: bytes) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / tracker_toml.FILE).write_bytes(content)
        (folder / "accepted.toml").write_bytes(content)
        before = list(sys.path)
        refused: TrackerError | None = None
        try:
            said = tracker_toml.read(folder)
            said.limits_of("spook")
        except TrackerError as error:
            refused = error
        finally:
            sys.path[:] = before
        for entry in read_accepted(folder / "accepted.toml"):
            assert str(entry)
            entry.names("a/b/c/d")
        if refused is not None:
            raise refused


class Bytes:
    """Reads on and on; behind the end there are zeros."""

    def __init__(self, content: bytes) -> None:
        self._left = iter(content)

    def below(self, count: int) -> int:
        return next(self._left, 0) % count

    def number(self) -> Any:
        """Mostly between -4 and 4, on a grid where things coincide; one in 128 is no such thing."""
        kind = self.below(128)
        if kind == 127:
            return NASTY[self.below(len(NASTY))]
        if kind > 123:
            return 10.0 ** (self.below(256) - 128)
        return (self.below(256) - 128) / 32.0

    def among(self, sense: tuple[Any, ...], nonsense: Any) -> Any:
        chosen = self.below(128)
        return nonsense if chosen == 127 else sense[chosen % len(sense)]

    def size(self) -> Any:
        found = self.number()
        return abs(found) + 1 / 32 if isinstance(found, float) else found

    def vector(self) -> Any:
        length = self.among((3,), self.below(6))
        return tuple(self.number() for _ in range(length))

    def maybe(self, found: Callable[[], Any]) -> Any:
        return found() if self.below(4) == 0 else None


def _shape(said: Bytes) -> Any:
    kind = said.below(12)
    if kind == 0:
        return None
    if kind == 1:
        return spook.Sphere(said.size())
    if kind == 2:
        return spook.Capsule(said.size(), said.size())
    if kind == 3:
        return spook.Cylinder(said.size(), said.size())
    if kind == 4:
        return spook.Cone(said.size(), said.size())
    if kind == 5:
        return spook.Plane(said.vector())
    if kind == 6:
        return spook.ConvexHull.placed([said.vector() for _ in range(4 + said.below(7))]).shape
    if kind == 7:
        faces = tuple((said.below(5), said.below(5), said.below(5)) for _ in range(1 + said.below(3)))
        return spook.TriangleMesh(tuple(said.vector() for _ in range(4)), faces)
    if kind == 8:
        rows = tuple(tuple(said.number() for _ in range(2)) for _ in range(2 + said.below(2)))
        return spook.HeightField((said.size(), said.size()), rows)
    if kind == 9:
        parts = (spook.Part(shape=_shape(said), position=said.vector()) for _ in range(1 + said.below(2)))
        return spook.Compound(tuple(parts))
    return spook.Box((said.size(), said.size(), said.size()))


def _body(said: Bytes, name: str) -> Any:
    if said.below(6) == 0:
        return spook.Particle(name=name, position=said.vector(), mass=said.size(), velocity=said.vector())
    material = spook.Material(
        friction=said.size() if said.below(2) else 0.0,
        restitution=said.below(5) / 4,
        compliance=said.size() if said.below(4) == 0 else 0.0,
        rolling_friction=said.size() if said.below(8) == 0 else 0.0,
    )
    motion = said.among(("dynamic", "dynamic", "dynamic", "static", "kinematic"), "static?")
    shape = _shape(said)
    if shape is not None and (shape.fixed_only or isinstance(shape, spook.Plane)):
        motion = said.among(("static",), motion)
    return spook.RigidBody(
        name=name,
        position=said.vector(),
        mass=said.size(),
        shape=shape,
        inertia=(said.size(),) * 3 if shape is None or said.below(2) else None,
        orientation=(said.number(), *said.vector()) if said.below(4) == 0 else (1.0, 0.0, 0.0, 0.0),
        velocity=said.vector() if said.below(2) and motion != "static" else (0.0, 0.0, 0.0),
        motion=motion,
        material=material,
    )


def _constraint(said: Bytes, name: str, known: str) -> Any:
    ends = tuple(said.among((*known, spook.WORLD), "absent") for _ in range(2))
    common: Any = {"name": name, "compliance": said.size() if said.below(4) == 0 else 0.0}
    placed = common | {"between": ends, "at": said.maybe(said.vector), "strength": said.maybe(said.size)}
    kind = said.below(9)
    if kind == 0:
        return spook.Distance(**common, between=ends, rest_length=said.maybe(said.size))
    if kind == 1:
        return spook.Wire(**common, through=((ends[0], said.vector()), (ends[1], said.vector())))
    if kind == 2:
        return spook.Relation(**common, terms=(("j0", said.number()), ("j1", said.number())))
    if kind == 3:
        return spook.Universal(**placed, axis=said.vector(), cross_axis=said.vector())
    if kind == 4:
        return spook.Ball(**placed)
    if kind == 5:
        return spook.Lock(**placed)
    driven: dict[str, Any] = {
        "motor": said.maybe(lambda: spook.Motor(speed=said.number(), max_force=said.maybe(said.size))),
        "limit": said.maybe(lambda: spook.Limit(lower=said.number(), upper=said.number())),
        "spring": said.maybe(lambda: spook.JointSpring(stiffness=said.size(), rest=said.number())),
    }
    return (spook.Hinge if kind < 8 else spook.Prismatic)(**placed, axis=said.vector(), **driven)


def scenes(content: bytes) -> None:
    """Either refused, or run: finite numbers, or a failure that is said."""
    said = Bytes(content)
    names = "abcd"[: 1 + said.below(4)]
    bodies = tuple(_body(said, name) for name in names)
    constraints = tuple(_constraint(said, f"j{number}", names) for number in range(said.below(3)))
    forces: list[Any] = []
    if said.below(4) == 0:
        forces.append(spook.Spring(name="s", between=("a", said.vector()), stiffness=said.size()))
    if said.below(8) == 0:
        forces.append(spook.Fluid(name="f", density=said.size(), level=said.number()))
    if said.below(8) == 0:
        forces.append(spook.Load(name="l", body="a", force=said.vector(), torque=said.vector()))
    scene = spook.Scene(
        bodies=bodies, constraints=constraints, forces=tuple(forces), contacts=said.below(4) != 0,
        gravity=said.vector() if said.below(2) else (0.0, 0.0, -10.0),
    )  # fmt: skip
    solver = said.among(("direct", "iterative"), "none")
    composition = said.among(("none", "none", "none", "order4"), 4)
    method = spook.Method(
        solver=solver, composition=composition, corrections=said.among((0, 0, 1, 2), 3), substeps=1 + said.below(2),
        half_step_velocities=said.below(8) == 7, iterations=1 + said.below(50),
    )  # fmt: skip
    result = spook.simulate(
        scene, time_step=(1 / 60, 1 / 1000, 0.1, said.size())[said.below(4)], steps=4, method=method,
        observe={"energy": spook.Final(quantity=spook.Energy())}, time_limit=5.0,
    )  # fmt: skip
    assert result.status in ("completed", "unsettled") or result.failure
    assert result.status != "timed_out", result.failure
    if result.completed:
        assert all(math.isfinite(x) for state in result.final_state.values() for x in state)
    assert "\n" not in result.failure


def put(target: Callable[[bytes], None], content: bytes) -> str:
    """What the target says of the content: a refusal, or nothing if it is taken. Anything else is raised."""
    try:
        target(content)
    except (TrackerError, EngineError) as refused:
        sentence = str(refused)
        assert sentence.strip(), "a refusal without words"
        assert len(sentence) < LONGEST, f"{len(sentence)} characters of refusal"
        assert "\n" not in sentence.strip()
        return sentence
    return ""


TARGETS: dict[str, Callable[[bytes], None]] = {
    "documents": documents,
    "scenes": scenes,
    "settings": settings,
}
