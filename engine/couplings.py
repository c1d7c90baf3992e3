"""Constraints between more than two ends: linear relations between joint coordinates, and wires.

Each is one row. A relation is what gears, racks, screws, belts and differentials have in common; a wire runs through
points of bodies or of the world, with or without friction, may be wound on drums and may go slack.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from . import check
from .bodies import WORLD
from .check import Vector
from .errors import SceneError

COMPLIANCE = (
    1e-8  # m/N and rad/(N m) of every constraint, where none is given: docs/explanation/compliance.md
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Relation:
    """Keeps Σ coefficient × coordinate at zero, one row; coordinates are those of hinges (turns counted, rad) and
    prismatic joints (m), zero at the start.

        gear          (("wheel", teeth), ("pinion", teeth))       outside each other: they turn in opposite ways
        inner gear    (("ring", teeth), ("planet", -teeth))       or a belt, with radii
        rack          (("slide", 1.0), ("pinion", radius))
        screw         (("nut", 1.0), ("screw", -pitch / (2 * pi)))
        differential  (("left", 1.0), ("right", 1.0), ("cage", -2.0))

    The force that is observed is λ/h: the joint of coefficient c feels c times it along its coordinate [N or N m].
    Reactions go where the joints' other ends are, so a casing feels the difference of the torques. In an epicyclic
    gear take the planet's hinge on the carrier, and the sun's too: what meshes is what turns relative to the carrier.
    Costs one row.
    """

    rows: ClassVar[int] = 1
    kind: ClassVar[str] = "relation"
    name: str
    terms: tuple[tuple[str, float], ...]
    compliance: float = COMPLIANCE  # of the sum per λ/h
    damping: float | None = None  # s

    def __post_init__(self) -> None:
        check.name("relation", self.name)
        owner = f"relation {self.name!r}"
        given: Any = self.terms
        try:
            terms = [(str(check.name("term", joint)), factor) for joint, factor in given]
        except (TypeError, ValueError):
            raise SceneError(f"{owner}: terms must be pairs of a joint and a number, not {given!r}") from None
        clean = tuple((joint, check.number(owner, "coefficient", factor)) for joint, factor in terms)
        for joint, factor in clean:
            if factor == 0.0:
                raise SceneError(f"{owner}: the coefficient of {joint!r} is 0; leave that joint out")
        if len({joint for joint, _ in clean}) != len(clean):
            raise SceneError(f"{owner}: a joint is named twice; add up its coefficients")
        if len(clean) < 2:
            raise SceneError(f"{owner}: needs at least two joints; a Limit or a Lock holds one")
        object.__setattr__(self, "terms", clean)
        _check_row(self, owner)

    @property
    def between(self) -> tuple[str, str]:
        """A relation has no place of its own: its joints have."""
        return (WORLD, WORLD)


@dataclass(frozen=True, slots=True, kw_only=True)
class Wire:
    """Keeps Σ |p_(i+1) − p_i| at most `length` [m] (or, not `slack`, equal to it): one row.

    `through` lists where the wire runs: a body's name, or WORLD, and a world point at the start [m]. It slides
    through the points between its ends without friction, which is the ideal pulley of no size. When it snaps taut
    the impact is plastic, or returns `restitution` of the speed. A length of None is the one at the start. A rope is a
    wire through two points. The force that is observed is its tension [N].

    With `friction` µ, one number or one for each point between the ends, it rubs where it bends: the pulls before and
    behind differ by at most e^(µφ), φ the angle of the bend and of `turns` whole turns more, as on a bollard. Then the
    tension is that of its first part. Where surfaces touch, friction follows the pull of the step before.

    `wound` are drums at its last end, each a hinge and a radius [m]: a radian of the hinge winds in the radius, less
    than zero lets out. A motor of the hinge makes it a winch. Costs one row, and a distance for each part of it.
    """

    rows: ClassVar[int] = 1
    kind: ClassVar[str] = "wire"
    name: str
    through: tuple[tuple[str, Vector], ...]
    length: float | None = None  # m
    slack: bool = True
    restitution: float = 0.0  # 0 … 1
    compliance: float = COMPLIANCE  # m/N
    damping: float | None = None  # s
    strength: float | None = None  # N, of its tension: it breaks under more; None never does
    friction: float | tuple[float, ...] = 0.0
    turns: float | tuple[float, ...] = 0.0
    wound: tuple[tuple[str, float], ...] = ()  # hinge, m

    def __post_init__(self) -> None:
        check.name("wire", self.name)
        owner = f"wire {self.name!r}"
        given: Any = self.through
        try:
            pairs = [(check.name("end", end), point) for end, point in given]
        except (TypeError, ValueError):
            raise SceneError(f"{owner}: through must be pairs of a body and a point, not {given!r}") from None
        clean = tuple((end, check.vector(owner, "through", point)) for end, point in pairs)
        if len(clean) < 2:
            raise SceneError(f"{owner}: needs at least two points to run through")
        for (end, here), (other, there) in itertools.pairwise(clean):
            if end == other != WORLD:
                raise SceneError(
                    f"{owner}: two points in turn are on {end!r}, so that part of it never changes; leave one out"
                )
            if here == there:
                raise SceneError(
                    f"{owner}: two points in turn coincide at {here}, so it has no direction there"
                )
        object.__setattr__(self, "through", clean)
        if self.length is not None:
            object.__setattr__(self, "length", check.positive(owner, "length", self.length))
        if not isinstance(self.slack, bool):
            raise SceneError(f"{owner}: slack must be True or False, not {self.slack!r}")
        restitution = check.not_negative(owner, "restitution", self.restitution)
        if restitution > 1.0:
            raise SceneError(f"{owner}: restitution must lie between 0 and 1, not {restitution:g}")
        object.__setattr__(self, "restitution", restitution)
        if self.strength is not None:
            object.__setattr__(self, "strength", check.positive(owner, "strength", self.strength))
        for field in ("friction", "turns"):
            object.__setattr__(self, field, _per_eye(owner, field, getattr(self, field), len(clean) - 2))
        if self.strength is not None and self.rubs:
            raise SceneError(
                f"{owner}: with friction it has no one tension to break at; leave one of both out"
            )
        object.__setattr__(self, "wound", _drums(owner, self.wound))
        _check_row(self, owner)

    @property
    def between(self) -> tuple[str, str]:
        """Its two ends."""
        return (self.through[0][0], self.through[-1][0])

    @property
    def eyes(self) -> tuple[tuple[int, float, float], ...]:
        """The points it rubs on: place in `through`, friction, turns."""
        given: Any = (self.friction, self.turns)
        places = range(1, len(self.through) - 1)
        count = len(places)
        friction, turns = (value if isinstance(value, tuple) else (value,) * count for value in given)
        rough = zip(places, friction, turns, strict=True)
        return tuple((place, mu, turn) for place, mu, turn in rough if mu > 0.0)

    @property
    def rubs(self) -> bool:
        """Whether it has friction anywhere."""
        return bool(self.eyes)


def _per_eye(owner: str, field: str, value: Any, count: int) -> float | tuple[float, ...]:
    if not isinstance(value, Sequence) or isinstance(value, str):
        clean = check.not_negative(owner, field, value)
        if clean > 0.0 and count == 0:
            raise SceneError(
                f"{owner}: {field} acts where it bends, and it runs through no point between its ends"
            )
        return clean
    if len(value) != count:
        raise SceneError(
            f"{owner}: {field} needs one number or {count}, one a point between, not {len(value)}"
        )
    return tuple(check.not_negative(owner, field, entry) for entry in value)


def _drums(owner: str, given: Any) -> tuple[tuple[str, float], ...]:
    try:
        pairs = [(str(check.name("drum", hinge)), radius) for hinge, radius in given]
    except (TypeError, ValueError):
        raise SceneError(f"{owner}: wound must be pairs of a hinge and a radius, not {given!r}") from None
    clean = tuple((hinge, check.number(owner, "radius", radius)) for hinge, radius in pairs)
    for hinge, radius in clean:
        if radius == 0.0:
            raise SceneError(f"{owner}: the radius of drum {hinge!r} is 0, so it winds nothing; leave it out")
    if len({hinge for hinge, _ in clean}) != len(clean):
        raise SceneError(f"{owner}: a drum is named twice; add up its radii")
    return clean


def _check_row(row: Relation | Wire, owner: str) -> None:
    object.__setattr__(row, "compliance", check.not_negative(owner, "compliance", row.compliance))
    if row.damping is not None:
        object.__setattr__(row, "damping", check.not_negative(owner, "damping", row.damping))
