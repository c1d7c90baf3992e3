"""What to keep of a run: a quantity, reduced inside the native loop. Only what is asked for is computed.

Each quantity says its shape, unit, axes and sign, and what it costs: `help(Violation)`.
Sample k is the state after k steps, sample 0 the start; forces and contact forces belong to the step that
ended there and are zero at sample 0. With half-step velocities, velocities and energies are those at the
sample's time, the mean of the half steps before and after; so are, where there are rigid bodies, forces of joints and
contacts, at sample 0 too. Compositions show forces at the sample's time; of particles they are zero at sample 0.
"""

from __future__ import annotations

from dataclasses import dataclass

from .check import Vector, vector
from .errors import MethodError, SceneError

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
    """Where a body is: shape (3,) [m], world axes; of all bodies (None) (bodies, 3), in the scene's order.

    Of the centre of mass, or of a `point` [m] of one rigid body, in its axes from that centre. Costs a copy.
    """

    body: str | None = None
    point: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        _point_of_one(self)


@dataclass(frozen=True, slots=True)
class Velocity(Quantity):
    """How fast a body moves: shape (3,) [m/s], world axes; of all bodies (None) (bodies, 3).

    Of the centre of mass, or of a `point` [m] of one rigid body, in its axes from that centre. Costs a copy. With
    half-step velocities it is that at the sample's time, the mean of the half steps before and after.
    """

    body: str | None = None
    point: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        _point_of_one(self)


@dataclass(frozen=True, slots=True)
class Orientation(Quantity):
    """How a rigid body is turned: shape (4,) [1], the unit quaternion (w, x, y, z) from its axes to the world's; of all
    bodies (None) (bodies, 4), a particle's (1, 0, 0, 0). Costs a copy.
    """

    body: str | None = None


@dataclass(frozen=True, slots=True)
class AngularVelocity(Quantity):
    """How fast a rigid body turns: shape (3,) [rad/s], world axes, right-handed; of all bodies (None) (bodies, 3), a
    particle's 0. Costs a copy.
    """

    body: str | None = None


@dataclass(frozen=True, slots=True)
class KineticEnergy(Quantity):
    """½ m v² + ½ ω·I ω over all bodies that move dynamically: shape () [J]. Costs one pass over the bodies."""


@dataclass(frozen=True, slots=True)
class PotentialEnergy(Quantity):
    """Of gravity −m g·x, of central gravity −m k/r, of springs, those of joints too, ½ k d²: shape () [J].

    What compliant rows store counts nothing. Costs one pass over bodies and springs.
    """


@dataclass(frozen=True, slots=True)
class Energy(Quantity):
    """Kinetic and potential energy together: shape () [J]; a closed scene keeps it. Costs as both."""


@dataclass(frozen=True, slots=True)
class Violation(Quantity):
    """By how much a constraint is violated.

    Of a distance |d| − rest_length [m], positive where it is too long, of a wire its length beyond, of a relation its
    sum: shape (). Of a joint shape (rows,) [m, then rad], in the frame fixed to its first body. Of all distances (None)
    (distances,), in the scene's order; a scene that has other constraints alone must name one. Costs nothing that the
    step does not compute.
    """

    constraint: str | None = None


@dataclass(frozen=True, slots=True)
class ConstraintForce(Quantity):
    """What a constraint exerts in the step that ended here; zero at sample 0.

    Of a distance or a wire its tension [N], positive where it pulls, of a relation what a coordinate of coefficient 1
    feels: shape (). Of a joint force [N] and torque [N m] on its second body: shape (6,), world axes. Of all distances
    (None) (distances,). Costs one product for each joint that is asked.
    """

    constraint: str | None = None


@dataclass(frozen=True, slots=True)
class Momentum(Quantity):
    """Σ m v of what moves dynamically: shape (3,) [N s], world axes. Costs one pass over the bodies."""


@dataclass(frozen=True, slots=True)
class AngularMomentum(Quantity):
    """Σ m (x − about) × v + I ω: shape (3,) [kg m²/s], world axes, about a world point [m]. Costs one pass over the bodies."""

    about: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "about", _point("about", self.about))


@dataclass(frozen=True, slots=True)
class ContactForce(Quantity):
    """What contacts exert on `body` in the step that ended here, by `other` or by all (None): shape (3,) [N], world axes,
    the sum over the points; zero at sample 0. Costs one pass over the contact points.
    """

    body: str
    other: str | None = None


@dataclass(frozen=True, slots=True)
class ContactCount(Quantity):
    """How many contact points there are: shape () [1]. Costs nothing."""


@dataclass(frozen=True, slots=True)
class Penetration(Quantity):
    """The largest depth by which two bodies overlap, 0 where none do: shape () [m]. Costs one pass over the points."""


@dataclass(frozen=True, slots=True)
class ContactPoints(Quantity):
    """Every contact point, at most `most` of them: shape (most, 10), in order of bodies, NaN where there are fewer.

    Columns: place [m], normal onto the first body of the pair [1], force on that body [N], coefficient of friction [1],
    along its direction if it has one; world axes. Costs a copy.
    """

    most: int

    def __post_init__(self) -> None:
        if isinstance(self.most, bool) or not isinstance(self.most, int) or not 1 <= self.most <= MOST_POINTS:
            raise MethodError(
                f"observe: {self!r} must ask for a whole number of points, from 1 to {MOST_POINTS}"
            )


@dataclass(frozen=True, slots=True)
class JointCoordinate(Quantity):
    """The free coordinate of a hinge [rad, its turns counted] or of a prismatic joint [m]: shape (), positive along or
    about its axis, of the second body against the first. Costs one product.
    """

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
