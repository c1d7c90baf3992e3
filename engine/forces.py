"""Forces that are not constraints: each is evaluated once per step, from positions and velocities."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from spook_tracker.engine import check
from spook_tracker.engine.check import Vector
from spook_tracker.engine.errors import SceneError

End = str | Vector  # a body's name, or a fixed point of the world [m]


def check_ends(owner: str, between: Any) -> tuple[End, End]:
    """Two ends, each a body's name or a world point; at least one must be a body."""
    if isinstance(between, str) or not hasattr(between, "__len__") or len(between) != 2:
        raise SceneError(f"{owner}: between must name two ends, not {between!r}")
    first, second = (end if isinstance(end, str) else check.vector(owner, "between", end) for end in between)
    if not isinstance(first, str) and not isinstance(second, str):
        raise SceneError(f"{owner}: at least one end must be a body")
    if first == second:
        raise SceneError(f"{owner}: both ends are {first!r}; a body cannot be tied to itself")
    return (first, second)


@dataclass(frozen=True, slots=True, kw_only=True)
class Spring:
    """A plain force −stiffness (|d| − rest_length) along d, between centres of mass; not a row.

    With rest_length 0 the force is −stiffness d exactly, with no normalisation.
    """

    name: str
    between: tuple[End, End]
    stiffness: float  # N/m
    rest_length: float = 0.0  # m
    viscosity: float = 0.0  # N s/m, along the spring

    def __post_init__(self) -> None:
        check.name("spring", self.name)
        owner = f"spring {self.name!r}"
        object.__setattr__(self, "between", check_ends(owner, self.between))
        for name in ("stiffness", "rest_length", "viscosity"):
            object.__setattr__(self, name, check.not_negative(owner, name, getattr(self, name)))


@dataclass(frozen=True, slots=True, kw_only=True)
class CentralGravity:
    """Every body accelerates by −strength (x − centre)/|x − centre|³."""

    name: str
    strength: float  # m³/s²
    centre: Vector = (0.0, 0.0, 0.0)  # m

    def __post_init__(self) -> None:
        check.name("central gravity", self.name)
        owner = f"central gravity {self.name!r}"
        object.__setattr__(self, "strength", check.not_negative(owner, "strength", self.strength))
        object.__setattr__(self, "centre", check.vector(owner, "centre", self.centre))


@dataclass(frozen=True, slots=True, kw_only=True)
class Load:
    """A constant force and torque on one body, in world axes, at its centre of mass."""

    name: str
    body: str
    force: Vector = (0.0, 0.0, 0.0)  # N
    torque: Vector = (0.0, 0.0, 0.0)  # N m

    def __post_init__(self) -> None:
        check.name("load", self.name)
        owner = f"load {self.name!r}"
        object.__setattr__(self, "body", check.name("load's body", self.body))
        object.__setattr__(self, "force", check.vector(owner, "force", self.force))
        object.__setattr__(self, "torque", check.vector(owner, "torque", self.torque))


Force = Spring | CentralGravity | Load
