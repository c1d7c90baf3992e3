"""Tyres: what holds a wheel on a road, along and across its heading."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from . import check
from .bodies import WORLD
from .check import Vector
from .errors import SceneError


@dataclass(frozen=True, slots=True, kw_only=True)
class Tyre:
    """A wheel's tyre on a flat road; rows: load, force along the wheel's heading, force across [N].

    `between` is the road, a body or WORLD, and the wheel; `at` a point of the road and `normal` its upward direction,
    `axis` the wheel's spin axis, all in the world at the start. The hub is the wheel's centre.

        load      a spring of `stiffness` under a disc of `radius`, which only pushes
        along     F = −longitudinal × slip, the speed of the disc's lowest point over that of the wheel
        across    F = −cornering × slip angle (its tangent)
        sliding   (F_x/µ_x)² + (F_y/µ_y)² <= N², `friction` one µ or the two of them; beyond, both in the ratio they had

    There is no camber thrust, no aligning torque and no relaxation length. Below a millimetre a second it creeps. The
    force that is observed is that on the wheel at the footprint. Where surfaces touch, the bound of sliding is that of
    the step before.
    Costs three rows with bounds.
    """

    rows: ClassVar[int] = 3
    kind: ClassVar[str] = "tyre"
    name: str
    between: tuple[str, str]
    axis: Vector
    radius: float  # m
    stiffness: float  # N/m
    longitudinal: float  # N per unit of slip
    cornering: float  # N/rad
    friction: float | tuple[float, float]
    at: Vector = (0.0, 0.0, 0.0)  # m
    normal: Vector = (0.0, 0.0, 1.0)
    damping: float | None = None  # s, of the load; None is two time steps

    def __post_init__(self) -> None:
        check.name("tyre", self.name)
        owner = f"tyre {self.name!r}"
        given: Any = self.between
        if isinstance(given, str) or not isinstance(given, Sequence) or len(given) != 2:
            raise SceneError(f"{owner}: between must name a road and a wheel, not {given!r}")
        road, wheel = (str(check.name("end", end)) for end in given)
        if wheel == WORLD:
            raise SceneError(
                f"{owner}: the second of between is the wheel, and the world is none; turn them round"
            )
        if road == wheel:
            raise SceneError(f"{owner}: a wheel cannot roll on itself; name the road first")
        object.__setattr__(self, "between", (road, wheel))
        for field in ("axis", "normal"):
            object.__setattr__(self, field, check.direction(owner, field, getattr(self, field)))
        object.__setattr__(self, "at", check.vector(owner, "at", self.at))
        if abs(sum(a * n for a, n in zip(self.axis, self.normal, strict=True))) > 0.99:
            raise SceneError(f"{owner}: the wheel lies flat on its road; turn axis or normal")
        for field in ("radius", "stiffness", "longitudinal", "cornering"):
            object.__setattr__(self, field, check.positive(owner, field, getattr(self, field)))
        both: Any = self.friction
        if not isinstance(both, Sequence) or isinstance(both, str):
            both = (both, both)
        if len(both) != 2:
            raise SceneError(f"{owner}: friction needs one number or two, along and across, not {len(both)}")
        object.__setattr__(self, "friction", tuple(check.not_negative(owner, "friction", mu) for mu in both))
        if self.damping is not None:
            object.__setattr__(self, "damping", check.not_negative(owner, "damping", self.damping))

    @property
    def compliance(self) -> float:
        """Of its load [m/N]."""
        return 1.0 / self.stiffness
