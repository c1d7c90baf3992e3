"""What to keep of a run: a quantity, reduced inside the native loop. Only what is asked for is computed.

Quantities (per sample)                         shape            unit
  Position, Velocity (body or all)              (3,) or (n, 3)   m, m/s; of the centre of mass, or of `point` [m] of
                                                                 one rigid body, in its axes from that centre
  Orientation (body or all)                     (4,) or (n, 4)   1, quaternion (w, x, y, z)
  AngularVelocity (body or all)                 (3,) or (n, 3)   rad/s, world axes
  KineticEnergy, PotentialEnergy, Energy        ()               J; gravity −m g·x, central −m k/r,
                                                                 springs, those of joints too, ½ k d²; compliant
                                                                 rows count nothing
  Violation (constraint or all distances)       (), (n,), (rows,)  m or rad; of a distance |d| − rest_length, of
                                                                 a wire its length beyond, of a relation its sum
  ConstraintForce (constraint or all distances) (), (n,) or (6,) N, positive where the rod or wire pulls (tension);
                                                                 joints: force [N], torque [N m] on the second;
                                                                 relations: what a coordinate of coefficient 1 feels
  Momentum, AngularMomentum(about)              (3,)             N s, kg m²/s
  ContactForce (body, other or all)             (3,)             N, on `body`, sum over the contact points
  ContactCount, Penetration                     ()               1; largest penetration depth, m
  ContactPoints (most)                          (most, 10)       place [m], normal onto the first body of the pair,
                                                                 force [N] on that body, coefficient of friction [1],
                                                                 along its direction if it has one; in order of
                                                                 bodies, NaN where there are fewer points
  JointCoordinate (joint)                       ()               m or rad, free coordinate of an axial joint;
                                                                 a hinge counts its turns

Sample k is the state after k steps, sample 0 the start; forces and contact forces belong to the step that
ended there and are zero at sample 0. With half-step velocities, velocities and energies are those at the
sample's time, the mean of the half steps before and after.
"""

from __future__ import annotations

from dataclasses import dataclass

from spook_tracker.engine.check import Vector, vector
from spook_tracker.engine.errors import MethodError, SceneError

MOST_POINTS = 100_000  # of one observation: 8 MB a sample


def _point(field: str, value: object) -> Vector:
    try:
        return vector("observe", field, value)
    except SceneError as error:
        raise MethodError(str(error)) from None


@dataclass(frozen=True, slots=True)
class Quantity:
    """Base of what can be observed."""


def _point_of_one(quantity: Position | Velocity) -> None:
    object.__setattr__(quantity, "point", _point("point", quantity.point))
    if quantity.body is None and any(quantity.point):
        raise MethodError(f"observe: {quantity!r} asks for a point of all bodies; name the one it belongs to")


@dataclass(frozen=True, slots=True)
class Position(Quantity):
    body: str | None = None
    point: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        _point_of_one(self)


@dataclass(frozen=True, slots=True)
class Velocity(Quantity):
    body: str | None = None
    point: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        _point_of_one(self)


@dataclass(frozen=True, slots=True)
class Orientation(Quantity):
    body: str | None = None


@dataclass(frozen=True, slots=True)
class AngularVelocity(Quantity):
    body: str | None = None


@dataclass(frozen=True, slots=True)
class KineticEnergy(Quantity):
    pass


@dataclass(frozen=True, slots=True)
class PotentialEnergy(Quantity):
    pass


@dataclass(frozen=True, slots=True)
class Energy(Quantity):
    pass


@dataclass(frozen=True, slots=True)
class Violation(Quantity):
    constraint: str | None = None


@dataclass(frozen=True, slots=True)
class ConstraintForce(Quantity):
    constraint: str | None = None


@dataclass(frozen=True, slots=True)
class Momentum(Quantity):
    pass


@dataclass(frozen=True, slots=True)
class AngularMomentum(Quantity):
    about: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "about", _point("about", self.about))


@dataclass(frozen=True, slots=True)
class ContactForce(Quantity):
    body: str
    other: str | None = None


@dataclass(frozen=True, slots=True)
class ContactCount(Quantity):
    pass


@dataclass(frozen=True, slots=True)
class Penetration(Quantity):
    pass


@dataclass(frozen=True, slots=True)
class ContactPoints(Quantity):
    most: int

    def __post_init__(self) -> None:
        if isinstance(self.most, bool) or not isinstance(self.most, int) or not 1 <= self.most <= MOST_POINTS:
            raise MethodError(
                f"observe: {self!r} must ask for a whole number of points, from 1 to {MOST_POINTS}"
            )


@dataclass(frozen=True, slots=True)
class JointCoordinate(Quantity):
    joint: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Observable:
    """A quantity and how to reduce it over samples first … last (None: the last step), both included.

    With `from_start` the quantity's value at sample 0 is subtracted from every sample first.
    """

    quantity: Quantity
    first: int = 0
    last: int | None = None
    from_start: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.quantity, Quantity):
            raise MethodError(f"observe: {self.quantity!r} is not a quantity")
        for bound in (self.first, 0 if self.last is None else self.last):
            if isinstance(bound, bool) or not isinstance(bound, int):
                raise MethodError(f"observe: samples are counted by whole numbers, not {bound!r}")
        if self.first < 0 or (self.last is not None and self.last < self.first):
            raise MethodError(f"observe: samples {self.first} to {self.last} are not a range")


@dataclass(frozen=True, slots=True, kw_only=True)
class Trace(Observable):
    """Every `every`-th sample from `first` on: shape (samples, *shape of the quantity)."""

    every: int = 1

    def __post_init__(self) -> None:
        Observable.__post_init__(self)
        if isinstance(self.every, bool) or not isinstance(self.every, int) or self.every < 1:
            raise MethodError(f"observe: every must be a whole number from 1, not {self.every!r}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Final(Observable):
    """The last sample of the range."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Maximum(Observable):
    """The largest value of each component; NaN if any sample was."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Minimum(Observable):
    """The smallest value of each component; NaN if any sample was."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MaximumAbsolute(Observable):
    """The largest magnitude of each component; NaN if any sample was."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mean(Observable):
    """The mean of each component, summed in sample order."""
