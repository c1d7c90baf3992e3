"""How a test's scene moves, recorded for the replay: quantised, bounded in size, beside its exact motion.

The exact motion is the test's closed form where it has one, else the same engine with a sixteenth of the time
step (less of it where that is many steps), and the page says which.
"""

from __future__ import annotations

import itertools
import math
import zlib
from collections.abc import Callable, Mapping, Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt
from msgspec.structs import replace

from spook_tracker.engine.bodies import WORLD, RigidBody
from spook_tracker.engine.couplings import Wire
from spook_tracker.engine.forces import CentralGravity, Spring
from spook_tracker.engine.joints import Distance, Joint
from spook_tracker.engine.method import Method
from spook_tracker.engine.observe import (
    ContactForce,
    ContactPoints,
    Energy,
    Observable,
    Orientation,
    Penetration,
    Position,
    Quantity,
    Trace,
    Violation,
)
from spook_tracker.engine.protocol import NotSupported
from spook_tracker.engine.result import Result
from spook_tracker.engine.scene import Scene
from spook_tracker.scalar_tests.case import Example, ScalarTest, Simulate
from spook_tracker.tracker.document.quaternions import UPRIGHT, Vector, turned
from spook_tracker.tracker.document.run_document import Channel, TrackedLink, Trajectory

from .gear_drawing import acted_on
from .question import ask
from .scene_drawing import MOST_SOLIDS, drawn_bodies

SAMPLES = 241  # of a trajectory at most; between them the page interpolates
MOST_STEPS = 60_000
MOST_BYTES = 120_000  # of one trajectory, compressed; halving the samples gets it there
MOST_ROWS, MOST_CONTACTS = 120, 120  # constraints and bodies whose violations and forces are traced
MOST_POINTS = 60  # contact points whose friction cones are drawn
TIME_LIMIT = 20.0  # s of wall time; what is there until then is shown
FINER = (16, 8, 4, 2)
MOST_FINE_STEPS = 120_000
CODES = 65_534  # 65535 is no value
LinkKind = Literal["distance", "spring", "joint"]
Array = npt.NDArray[np.float64]


def trajectory(name: str, test: ScalarTest, simulate: Simulate) -> Trajectory | None:
    """The motion of the test's example scene; None where it cannot be simulated or there is nothing to see."""
    return ask(lambda: _recorded(name, test.example(), simulate)).value  # type: ignore[no-any-return]


def motion(
    scene: Scene, method: Method, time_step: float, steps: int, simulate: Simulate
) -> Trajectory | None:
    """A run of any scene, without an exact motion beside it; None where there is nothing to see."""
    example = Example(scene=scene, time_step=time_step, method=method, duration=steps * time_step)
    return _recorded("run", example, simulate, compared=False)


def at_rest(scene: Scene) -> Trajectory:
    """A scene at its start, as a motion in which nothing moves."""
    bodies = scene.bodies[:MOST_SOLIDS]
    turns = [[float(v) for v in getattr(body, "orientation", UPRIGHT)] for body in bodies]
    seen = {
        "position": np.array([[body.position for body in bodies]] * 2),
        "orientation": np.array([turns] * 2),
    }
    channels = [
        channel(name, unit, seen[name].reshape(2, -1))
        for name, unit in (("position", "m"), ("orientation", "1"))
    ]
    return _told("start", scene, 1.0, 1.0, 2, channels, rows=0)


def _recorded(name: str, example: Example, simulate: Simulate, compared: bool = True) -> Trajectory | None:
    scene = example.scene
    bodies = scene.bodies[:MOST_SOLIDS]
    steps = min(MOST_STEPS, max(1, round(example.duration / example.time_step)))
    every = max(1, math.ceil(steps / (SAMPLES - 1)))
    try:
        result = _run(simulate, example, scene, steps - steps % every, every, 1, cones=True)
    except NotSupported:  # by an engine that keeps its contact points to itself
        result = _run(simulate, example, scene, steps - steps % every, every, 1)
    positions = np.asarray(result.partial["position"])
    if len(positions) < 2:
        return None
    seen = dict(result.partial)
    exact = _exact(example, simulate, seen, every) if compared and result.completed else ""
    while True:
        channels = _channels(seen, scene, len(bodies))
        if sum(len(channel.data) for channel in channels) <= MOST_BYTES or len(seen["position"]) < 8:
            break
        seen = {key: values[::2] for key, values in seen.items()}
        every *= 2
    told = _told(name, scene, example.time_step, every * example.time_step, len(seen["position"]), channels)
    return replace(told, exact=exact, failure=result.failure)


def _told(
    name: str, scene: Scene, time_step: float, step: float, count: int, channels: Sequence[Channel],
    rows: int = MOST_ROWS,
) -> Trajectory:  # fmt: skip
    """What is drawn of the scene, with how it moves."""
    bodies = scene.bodies[:MOST_SOLIDS]
    solids = drawn_bodies(scene, bodies)
    return Trajectory(
        test=name,
        name="example",
        time_step=time_step,
        step=step,
        count=count,
        bodies=len(bodies),
        solids=tuple(solid for of_body in solids for solid in of_body),
        body_of_solid=tuple(i for i, of_body in enumerate(solids) for _ in of_body),
        links=tuple(_links(scene)),
        attractors=tuple(force.centre for force in scene.forces if isinstance(force, CentralGravity)),
        gravity=scene.gravity,
        rows=min(len(scene.constraints), rows),
        channels=tuple(channels),
    )


def _run(
    simulate: Simulate,
    example: Example,
    scene: Scene,
    steps: int,
    every: int,
    finer: int,
    cones: bool = False,
) -> Result:
    """The scene with everything a replay shows traced, at a time step `finer` times smaller."""
    quantities: dict[str, Quantity] = {"position": Position()}
    if any(isinstance(body, RigidBody) for body in scene.bodies):
        quantities["orientation"] = Orientation()
    if finer == 1:
        quantities["energy"] = Energy()
        for i, constraint in enumerate(scene.constraints[:MOST_ROWS]):
            quantities[f"violation {i}"] = Violation(constraint.name)
        if scene.contacts:
            touching = [
                b for b in scene.bodies[:MOST_SOLIDS] if isinstance(b, RigidBody) and b.shape is not None
            ]
            if touching:
                quantities["penetration"] = Penetration()
            moving = [b.name for b in touching if b.motion == "dynamic"]
            if cones and any(body.material.friction for body in touching):
                quantities["contacts"] = ContactPoints(MOST_POINTS)
            for body in moving[:MOST_CONTACTS]:
                quantities[f"force {body}"] = ContactForce(body)
    observe: dict[str, Observable] = {
        key: Trace(quantity=quantity, every=every * finer) for key, quantity in quantities.items()
    }
    return simulate(
        scene,
        time_step=example.time_step / finer,
        steps=steps * finer,
        method=example.method,
        observe=observe,
        time_limit=TIME_LIMIT,
    )


def _exact(example: Example, simulate: Simulate, seen: dict[str, Array], every: int) -> str:
    """Add the motion to compare with, and say what it is; an empty sentence if there is none."""
    count = len(seen["position"])
    if example.exact is not None:
        names = [body.name for body in example.scene.bodies[:MOST_SOLIDS]]
        places = np.array(seen["position"])[:, : len(names)].copy()
        for i in range(count):
            for body, place in example.exact(i * every * example.time_step).items():
                places[i, names.index(body)] = place
        seen["exact_position"] = places
        return "the exact solution"
    steps = (count - 1) * every
    finer = next((n for n in FINER if n * steps <= MOST_FINE_STEPS), FINER[-1])
    fine = ask(lambda: _run(simulate, example, example.scene, steps, every, finer)).value
    if fine is None or not fine.completed or len(fine.partial["position"]) != count:
        return ""
    seen["exact_position"] = fine.partial["position"]
    if "orientation" in seen:
        seen["exact_orientation"] = fine.partial["orientation"]
    return f"a time step of h/{finer}"


def _channels(seen: Mapping[str, Array], scene: Scene, bodies: int) -> list[Channel]:
    count = len(seen["position"])

    def of_bodies(key: str) -> Array:
        values: Array = np.asarray(seen[key], dtype=np.float64)[:, :bodies]
        return values.reshape(count, -1)

    found = [channel("position", "m", of_bodies("position"))]
    for key in ("orientation", "exact_orientation"):
        if key in seen:
            found.append(channel(key, "1", of_bodies(key)))
    if "exact_position" in seen:
        found.append(channel("exact_position", "m", of_bodies("exact_position")))
    found += [
        channel(key, unit, np.asarray(seen[key], dtype=np.float64).reshape(count, 1))
        for key, unit in (("energy", "J"), ("penetration", "m"))
        if key in seen
    ]
    rows = min(len(scene.constraints), MOST_ROWS)
    if rows:
        each = [
            np.abs(np.asarray(seen[f"violation {i}"]).reshape(count, -1)).max(axis=1) for i in range(rows)
        ]
        found.append(channel("violation", "m or rad", np.stack(each, axis=1)))
    forces = {key.removeprefix("force "): values for key, values in seen.items() if key.startswith("force ")}
    if any(np.any(values) for values in forces.values()):
        table = np.zeros((count, bodies, 3))
        for i, body in enumerate(scene.bodies[:bodies]):
            if body.name in forces:
                table[:, i] = forces[body.name]
        found.append(channel("contact_force", "N", table.reshape(count, -1)))
    if "contacts" in seen:
        found += _cones(np.asarray(seen["contacts"], dtype=np.float64), np.asarray(scene.gravity))
    return found


def _cones(points: Array, gravity: Array) -> list[Channel]:
    """Places, axes, forces and coefficients of the points with friction, if there is any: what the upper body feels.

    `points` has the shape (samples, points, 10), as the engine observes them.
    """
    points = np.where((points[..., 9:] > 0.0), points, np.nan)
    downward = (points[..., 3:6] @ gravity > 0.0)[..., None]
    points[..., 3:9] = np.where(downward, -points[..., 3:9], points[..., 3:9])
    used = np.flatnonzero(np.isfinite(points[..., 9]).any(axis=0))
    if not used.size:
        return []
    parts = (
        ("cone_point", "m", 0, 3),
        ("cone_axis", "1", 3, 6),
        ("cone_force", "N", 6, 9),
        ("cone_friction", "1", 9, 10),
    )
    return [
        channel(name, unit, points[:, : used[-1] + 1, first:end].reshape(len(points), -1))
        for name, unit, first, end in parts
    ]


def channel(name: str, unit: str, values: Array) -> Channel:
    """Values of shape (samples, width) in sixteen bits each."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    step = (high - low) / CODES  # 0 of what stays the same
    if not math.isfinite(step):  # a motion that exploded: what is off the scale is no value
        low, step = -1e300, 2e300 / CODES
    with np.errstate(invalid="ignore", over="ignore"):
        places = np.rint((values - low) / (step or 1.0))
    codes = np.where(np.isfinite(places) & (places >= 0) & (places <= CODES), places, CODES + 1).astype(
        np.uint16
    )
    changes = np.diff(codes, axis=0, prepend=np.zeros((1, codes.shape[1]), np.uint16)).astype("<u2").ravel()
    planes = np.concatenate([(changes & 255).astype(np.uint8), (changes >> 8).astype(np.uint8)])
    return Channel(
        name=name,
        unit=unit,
        width=values.shape[1],
        low=low,
        step=step,
        data=zlib.compress(planes.tobytes(), 9),
    )


def values_of(channel: Channel, count: int) -> Array:
    """The numbers of a channel, shape (count, width), within step / 2 of what was recorded; NaN where none."""
    planes = np.frombuffer(zlib.decompress(channel.data), dtype=np.uint8).astype(np.uint16)
    half = len(planes) // 2
    changes = (planes[:half] | (planes[half:] << 8)).reshape(count, channel.width)
    codes = np.cumsum(changes, axis=0, dtype=np.uint16)
    out: Array = np.where(codes == CODES + 1, np.nan, channel.low + channel.step * codes.astype(np.float64))
    return out


def _links(scene: Scene) -> Sequence[TrackedLink]:
    """Constraints and springs whose ends are among the bodies that are drawn."""
    bodies = {body.name: i for i, body in enumerate(scene.bodies[:MOST_SOLIDS])}
    bodies[WORLD] = -1
    found: list[TrackedLink] = []

    def add(kind: LinkKind, ends: Sequence[tuple[int, Vector]], row: int) -> None:
        (one, here), (other, there) = ends
        found.append(TrackedLink(kind=kind, bodies=(one, other), anchors=(here, there), row=row))

    ties = [*enumerate(scene.constraints), *((MOST_ROWS, force) for force in scene.forces)]
    for number, tie in ties:
        row = number if number < MOST_ROWS else -1
        if isinstance(tie, Distance | Spring):
            if any(isinstance(end, str) and end not in bodies for end in tie.between):
                continue
            anchors = getattr(tie, "anchors", ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
            ends = [
                (bodies[end], anchor) if isinstance(end, str) else (-1, (end[0], end[1], end[2]))
                for end, anchor in zip(tie.between, anchors, strict=True)
            ]
            add("spring" if isinstance(tie, Spring) else "distance", ends, row)
        elif isinstance(tie, Wire) and all(name in bodies for name, _ in tie.through):
            at = [(bodies[name], _seen_from(scene, name, point)) for name, point in tie.through]
            for piece in itertools.pairwise(at):
                add("distance", piece, row)
        elif isinstance(tie, Joint) and all(name in bodies for name in tie.between):
            place = _inverse_of(scene, tie)
            add("joint", [(bodies[name], place(name)) for name in tie.between], row)
    return found


def _inverse_of(scene: Scene, joint: Joint) -> Callable[[str], Vector]:
    """Where the joint is, in the axes of one of its bodies: at the second's centre if it has no place of its own."""
    place = scene.body(acted_on(joint)).position if joint.at is None else joint.at

    return lambda name: _seen_from(scene, name, place)


def _seen_from(scene: Scene, name: str, point: Vector) -> Vector:
    """A world point at the start in the axes of a body; of the world as it is."""
    if name == WORLD:
        return point
    body = scene.body(name)
    w, x, y, z = getattr(body, "orientation", UPRIGHT)
    p = body.position
    return turned((w, -x, -y, -z), (point[0] - p[0], point[1] - p[1], point[2] - p[2]))
