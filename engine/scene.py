"""A scene: what is simulated. Frozen and validated; no numerics, no time step."""

from __future__ import annotations

import itertools
import math
import statistics
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from . import check
from .bodies import WORLD, Body, PairFriction, Particle, RigidBody
from .check import Vector, unknown
from .couplings import Relation, Wire
from .display import display, framed
from .errors import EngineError, SceneError
from .forces import CentralGravity, Fluid, Force, Load, Spring
from .joints import AxialJoint, Constraint, Distance, Hinge, Joint
from .time_functions import TimeFunction
from .tyres import Tyre


def _unique(kind: str, names: Iterable[str]) -> None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise SceneError(f"two {kind} are named {name!r}; give each its own name")
        seen.add(name)


def _gyration(body: RigidBody) -> float:
    assert body.mass is not None  # it is dynamic
    return math.sqrt(sum(body.inertia) / (2.0 * body.mass))


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """Bodies, constraints and forces, in SI units and world axes.

    Bodies with shapes touch each other unless `contacts` is False, a joint ties them, or `no_contact` lists
    the pair. Raises SceneError with one sentence naming the culprit.
    """

    bodies: tuple[Body, ...]
    constraints: tuple[Constraint, ...] = ()
    forces: tuple[Force, ...] = ()
    gravity: Vector = (0.0, 0.0, 0.0)  # m/s²
    contacts: bool = True
    no_contact: tuple[tuple[str, str], ...] = ()
    pair_frictions: tuple[
        PairFriction, ...
    ] = ()  # of two bodies, in place of what their materials make of it

    def __post_init__(self) -> None:
        for field in ("bodies", "constraints", "forces", "no_contact", "pair_frictions"):
            given = check.entries(getattr(self, field))
            if given is None:
                raise SceneError(f"scene: {field} must be a sequence, not {getattr(self, field)!r}")
            object.__setattr__(self, field, tuple(given))
        if not isinstance(self.contacts, bool):
            raise SceneError(f"scene: contacts must be True or False, not {self.contacts!r}")
        if not self.bodies:
            raise SceneError("a scene needs at least one body")
        for body in self.bodies:
            if not isinstance(body, Particle | RigidBody):
                raise SceneError(f"bodies: {body!r} is neither a Particle nor a RigidBody")
        for constraint in self.constraints:
            if not isinstance(constraint, Distance | Joint | Relation | Wire | Tyre):
                raise SceneError(f"constraints: {constraint!r} is not a constraint")
        for force in self.forces:
            if not isinstance(force, Spring | CentralGravity | Load | Fluid):
                raise SceneError(f"forces: {force!r} is not a force")
        object.__setattr__(self, "gravity", check.vector("scene", "gravity", self.gravity))
        _unique("bodies", (body.name for body in self.bodies))
        _unique("constraints", (constraint.name for constraint in self.constraints))
        _unique("forces", (force.name for force in self.forces))
        known = {body.name: body for body in self.bodies}
        joints = {constraint.name: constraint for constraint in self.constraints}
        for constraint in self.constraints:
            if isinstance(constraint, Relation):
                self._check_relation(constraint, joints)
            elif isinstance(constraint, Wire):
                self._check_wire(constraint, known, joints)
            elif isinstance(constraint, Tyre):
                self._check_tyre(constraint, known)
            else:
                self._check_constraint(constraint, known)
        for force in self.forces:
            self._check_force(force, known)
        object.__setattr__(self, "no_contact", tuple(self._pair(pair, known) for pair in self.no_contact))
        self._check_pair_frictions(known)
        self._check_directions()

    @property
    def typical_speed(self) -> float:
        """√(g r) [m/s], what the defaults of `Method`'s residuals are shares of; units of length, mass and time scale it.

        g is the scene's gravity, r the median radius of gyration √(tr I / 2 m) of the bodies that move; of particles alone, the
        median length of what ties them. Where there is no gravity, or no length, the largest speed that a body starts with, |v| + |ω| r, and 1
        where nothing moves or this is no finite number.
        """
        moving = [body for body in self.bodies if isinstance(body, Particle) or body.motion == "dynamic"]
        radii = {body.name: _gyration(body) for body in moving if isinstance(body, RigidBody)}
        lengths = list(radii.values())
        if not lengths:
            places = {body.name: body.position for body in self.bodies}
            ties = (tie for tie in (*self.constraints, *self.forces) if isinstance(tie, Distance | Spring))
            lengths = [
                math.dist(*(places[end] if isinstance(end, str) else end for end in tie.between))
                for tie in ties
            ]
        speed = math.sqrt(math.hypot(*self.gravity) * statistics.median_low(lengths or [0.0]))
        for body in self.bodies if not speed > 0.0 else ():
            turning = math.hypot(*body.angular_velocity) if isinstance(body, RigidBody) else 0.0
            speed = max(speed, math.hypot(*body.velocity) + turning * radii.get(body.name, 0.0))
        return speed if 0.0 < speed < math.inf else 1.0

    def _repr_html_(self) -> str | None:
        """The scene at its start, to be turned, for notebooks; None, so its text, where nothing draws it."""
        try:
            return framed(display().scene(self), height=420)
        except EngineError:
            return None

    def _check_pair_frictions(self, known: dict[str, Body]) -> None:
        seen: set[frozenset[str]] = set()
        for pair in self.pair_frictions:
            if not isinstance(pair, PairFriction):
                raise SceneError(f"pair_frictions: {pair!r} is not a PairFriction")
            for name in pair.between:
                body = known.get(name)
                if not isinstance(body, RigidBody):
                    rigid = (there for there, one in known.items() if isinstance(one, RigidBody))
                    raise SceneError(f"pair_frictions: {unknown('rigid body', name, rigid)}")
                if body.material.oriented:
                    raise SceneError(
                        f"pair_frictions: {name!r} has a friction that differs with the direction"
                    )
            if frozenset(pair.between) in seen:
                raise SceneError(
                    f"pair_frictions: {pair.between[0]!r} and {pair.between[1]!r} stand there twice"
                )
            seen.add(frozenset(pair.between))

    def _check_directions(self) -> None:
        """One ellipse of friction meets any surface; two that cross have no law that is generally agreed on."""
        oriented = [
            body
            for body in self.bodies
            if isinstance(body, RigidBody) and body.shape is not None and body.material.oriented
        ]
        if len(oriented) < 2 or not self.contacts:
            return
        apart = {frozenset(pair) for pair in self.no_contact}
        apart |= {
            frozenset(end for end in joint.between if isinstance(end, str))
            for joint in self.constraints
            if isinstance(joint, Distance | Joint)
        }
        for one, two in itertools.combinations(oriented, 2):
            if "dynamic" in (one.motion, two.motion) and frozenset((one.name, two.name)) not in apart:
                raise SceneError(
                    f"rigid bodies {one.name!r} and {two.name!r} may touch, and the friction of both has a direction; "
                    "leave it to one of them, or list them in no_contact"
                )

    @staticmethod
    def _check_relation(relation: Relation, joints: Mapping[str, Constraint]) -> None:
        for name, _ in relation.terms:
            if not isinstance(joints.get(name), AxialJoint):
                raise SceneError(
                    f"relation {relation.name!r}: only a hinge or a prismatic joint has a coordinate, and "
                    + unknown(
                        "such joint",
                        name,
                        (end for end, one in joints.items() if isinstance(one, AxialJoint)),
                    )
                )

    @staticmethod
    def _check_wire(wire: Wire, known: Mapping[str, Body], joints: Mapping[str, Constraint]) -> None:
        owner = f"wire {wire.name!r}"
        for name, _ in wire.wound:
            if not isinstance(joints.get(name), Hinge):
                hinges = (there for there, joint in joints.items() if isinstance(joint, Hinge))
                raise SceneError(f"{owner} winds on hinges, and {unknown('hinge', name, hinges)}")
        for end, point in wire.through:
            body = known.get(end)
            if body is None and end != WORLD:
                raise SceneError(f"{owner}: {unknown('body', end, known)}")
            if isinstance(body, Particle) and point != body.position:
                raise SceneError(
                    f"{owner}: particle {end!r} has only its centre, {body.position}; run through that"
                )
        bodies = [known[end] for end, _ in wire.through if end != WORLD]
        moves = any(isinstance(body, Particle) or body.motion == "dynamic" for body in bodies)
        if not moves and not wire.wound:
            raise SceneError(f"{owner}: nothing it runs through can move, so it constrains nothing")

    @staticmethod
    def _check_tyre(tyre: Tyre, known: Mapping[str, Body]) -> None:
        owner = f"tyre {tyre.name!r}"
        for end in tyre.between:
            if end not in known and end != WORLD:
                raise SceneError(f"{owner}: {unknown('body', end, known)}")
            if isinstance(known.get(end), Particle):
                raise SceneError(f"{owner}: {end!r} is a particle; wheels and roads need rigid bodies")
        wheel = known[tyre.between[1]]
        if isinstance(wheel, RigidBody) and wheel.motion != "dynamic":
            raise SceneError(f"{owner}: its wheel {wheel.name!r} cannot move, so it carries nothing")
        if sum((x - p) * n for x, p, n in zip(wheel.position, tyre.at, tyre.normal, strict=True)) <= 0.0:
            raise SceneError(
                f"{owner}: the hub of {wheel.name!r} is not above its road; turn normal round or move it"
            )

    def _check_constraint(self, constraint: Distance | Joint, known: dict[str, Body]) -> None:
        owner = f"constraint {constraint.name!r}"
        for end in constraint.between:
            if (
                isinstance(end, str)
                and end not in known
                and not (end == WORLD and isinstance(constraint, Joint))
            ):
                raise SceneError(f"{owner}: {unknown('body', end, known)}")
        tied = [known.get(end) if isinstance(end, str) else None for end in constraint.between]
        if not any(isinstance(body, Particle) or (body and body.motion == "dynamic") for body in tied):
            raise SceneError(f"{owner}: neither end can move, so it constrains nothing")
        if isinstance(constraint, Joint):
            for body in tied:
                if isinstance(body, Particle):
                    raise SceneError(
                        f"{owner}: {body.name!r} is a particle; joints need rigid bodies, use a Distance"
                    )
            return
        for body, anchor in zip(tied, constraint.anchors, strict=True):
            if isinstance(body, Particle) and any(anchor):
                raise SceneError(
                    f"{owner}: particle {body.name!r} has only its centre; leave its anchor at zero"
                )
        if self._length(constraint, known) == 0.0:
            raise SceneError(f"{owner}: its ends coincide, so it has no direction; move one of them")

    def _check_force(self, force: Force, known: dict[str, Body]) -> None:
        owner = f"force {force.name!r}"
        named = (
            force.between if isinstance(force, Spring) else (force.body,) if isinstance(force, Load) else ()
        )
        for end in named:
            if isinstance(end, str) and end not in known:
                raise SceneError(f"{owner}: {unknown('body', end, known)}")
        if isinstance(force, Load) and any(force.torque) and isinstance(known[force.body], Particle):
            raise SceneError(f"{owner}: {force.body!r} is a particle and cannot take a torque")
        if isinstance(force, Spring):
            for end, anchor in zip(force.between, force.anchors, strict=True):
                if isinstance(end, str) and any(anchor) and isinstance(known[end], Particle):
                    raise SceneError(
                        f"{owner}: particle {end!r} has only its centre; leave its anchor at zero"
                    )
        if isinstance(force, Spring) and force.rest_length > 0.0:
            first, second = (self._anchor(force, k, known) for k in (0, 1))
            if first == second:
                raise SceneError(f"{owner}: its ends coincide, so it has no direction; move one of them")
        if isinstance(force, Fluid) and not any(self.gravity):
            raise SceneError(f"{owner}: without gravity nothing floats or sinks; give the scene its gravity")
        if isinstance(force, CentralGravity):
            for body in known.values():
                if body.position == force.centre:
                    raise SceneError(f"{owner}: body {body.name!r} sits at its centre, where it is infinite")

    @staticmethod
    def _pair(pair: tuple[str, str], known: dict[str, Body]) -> tuple[str, str]:
        if isinstance(pair, str) or not isinstance(pair, Sequence) or len(pair) != 2:
            raise SceneError(f"no_contact: {pair!r} is not a pair of names")
        for name in pair:
            if name not in known:
                raise SceneError(f"no_contact: {unknown('body', name, known)}")
        if pair[0] == pair[1]:
            raise SceneError(f"no_contact: {pair[0]!r} cannot touch itself; name two bodies")
        return (pair[0], pair[1])

    def follows_time(self) -> bool:
        """Whether a load, a drive or a kinematic body is given as a function of time."""
        drives = [joint for joint in self.constraints if isinstance(joint, AxialJoint)]
        return (
            any(isinstance(force, Load) and force.factor is not None for force in self.forces)
            or any(isinstance(body, RigidBody) and body.follows_time for body in self.bodies)
            or any(
                isinstance(given, TimeFunction)
                for joint in drives
                if joint.motor is not None
                for given in (joint.motor.speed, joint.motor.max_force, joint.motor.force)
            )
            or any(joint.spring is not None and not isinstance(joint.spring.rest, float) for joint in drives)
        )

    def body(self, name: str) -> Body:
        """The body of that name."""
        for body in self.bodies if isinstance(name, str) else ():
            if body.name == name:
                return body
        raise SceneError(unknown("body", name, (body.name for body in self.bodies)))

    def constraint(self, name: str) -> Constraint:
        """The constraint of that name."""
        for constraint in self.constraints if isinstance(name, str) else ():
            if constraint.name == name:
                return constraint
        raise SceneError(unknown("constraint", name, (constraint.name for constraint in self.constraints)))

    def anchor(self, constraint: Distance | Spring, end: int) -> Vector:
        """World position [m] at the start of one end (0 or 1) of a distance constraint or a spring."""
        where = constraint.between[end]
        return self._anchor(constraint, end, {where: self.body(where)} if isinstance(where, str) else {})

    @staticmethod
    def _anchor(constraint: Distance | Spring, end: int, known: Mapping[str, Body]) -> Vector:
        where = constraint.between[end]
        if not isinstance(where, str):
            return where
        body, anchor = known[where], constraint.anchors[end]
        if isinstance(body, Particle) or not any(anchor):
            return body.position
        return _placed(body, anchor)

    def length(self, constraint: Distance, known: Mapping[str, Body] | None = None) -> float:
        """Distance [m] at the start between the two ends; `known`, bodies by name, saves looking them up."""
        if known is not None:
            return self._length(constraint, known)
        return math.dist(self.anchor(constraint, 0), self.anchor(constraint, 1))

    def _length(self, constraint: Distance, known: Mapping[str, Body]) -> float:
        # Looking names up one by one would make a scene of n rows cost n².
        return math.dist(self._anchor(constraint, 0, known), self._anchor(constraint, 1, known))


def wire_length(wire: Wire) -> float:
    """Length [m] of a wire at the start: what it is given, or that of its way."""
    if wire.length is not None:
        return wire.length
    points = [point for _, point in wire.through]
    return math.fsum(math.dist(a, b) for a, b in itertools.pairwise(points))


def _placed(body: RigidBody, point: Vector) -> Vector:
    """A point of the body's axes in world coordinates."""
    w, x, y, z = body.orientation
    px, py, pz = point
    tx, ty, tz = 2.0 * (y * pz - z * py), 2.0 * (z * px - x * pz), 2.0 * (x * py - y * px)
    bx, by, bz = body.position
    return (
        bx + px + w * tx + y * tz - z * ty,
        by + py + w * ty + z * tx - x * tz,
        bz + pz + w * tz + x * ty - y * tx,
    )
