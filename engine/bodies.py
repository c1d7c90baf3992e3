"""What moves: particles, and rigid bodies with a shape."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from . import check, polytope
from .check import Rotation, Vector
from .errors import SceneError
from .shapes import Plane, Shape
from .time_functions import TimeFunction, at_start, number_or_function

WIDEST_FRICTION = 1000.0  # times, between friction along a direction and across it: thirty for a pair
WORLD = "world"  # the name that stands for the fixed world at one end of a constraint


@dataclass(frozen=True, slots=True, kw_only=True)
class Particle:
    """A point mass: `mass` [kg], `position` [m] and `velocity` [m/s] in world axes; no rotation, no contacts."""

    name: str
    position: Vector  # m
    mass: float  # kg
    velocity: Vector = (0.0, 0.0, 0.0)  # m/s

    def __post_init__(self) -> None:
        check.name("particle", self.name)
        owner = f"particle {self.name!r}"
        object.__setattr__(self, "position", check.vector(owner, "position", self.position))
        object.__setattr__(self, "velocity", check.vector(owner, "velocity", self.velocity))
        object.__setattr__(self, "mass", check.positive(owner, "mass", self.mass))
        if self.name == WORLD:
            raise SceneError(f"{owner}: the name {WORLD!r} is taken by the fixed world; choose another")


@dataclass(frozen=True, slots=True, kw_only=True)
class PairFriction:
    """How two bodies rub on each other, whatever their materials say: Coulomb's µ, rolling and torsional friction [m]."""

    between: tuple[str, str]
    friction: float = 0.0  # Coulomb's mu, 1
    rolling_friction: float = 0.0  # m
    torsional_friction: float = 0.0  # m

    def __post_init__(self) -> None:
        pair = self.between
        if (
            isinstance(pair, str)
            or not isinstance(pair, Sequence)
            or len(pair) != 2
            or not all(isinstance(name, str) for name in pair)
        ):
            raise SceneError(f"pair friction: {pair!r} is not a pair of names")
        object.__setattr__(self, "between", tuple(pair))
        one, two = self.between
        if one == two:
            raise SceneError(f"pair friction: {one!r} does not rub on itself; name two bodies")
        for name in ("friction", "rolling_friction", "torsional_friction"):
            object.__setattr__(self, name, check.not_negative("pair friction", name, getattr(self, name)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """How a surface behaves in contact: `friction` is Coulomb's µ, `restitution` e the speed after an impact over that before
    (0 plastic, 1 elastic), `compliance` [m/N] and `damping` [s] those of the contact, `slip_compliance` [m/(N s)],
    `rolling_friction` and `torsional_friction` levers [m]. By default a surface is smooth, plastic and rigid.

    Two surfaces combine: friction by the geometric mean, both restitutions, rolling and torsional friction by the larger,
    compliance by the sum. Viscous friction, a force c times the slip, is a slip_compliance of 1/c under a friction that
    is never reached. Rolling and torsional friction act in every contact that carries load, but not in the instant of
    an impact that returns.

    An impact at the relative speed u of approach and v along the surface leaves -psi u and, where friction holds, -psi_t v;
    where that asks for more than mu times the normal impulse the surfaces slide through the impact. One contact with both
    at most 1 loses energy or keeps it: with the inverse mass A of the point the impulse is -A^-1 (1 + psi) v, the work
    half of that times (1 - psi) v, and Coulomb's bound only shortens what opposes the slip. What several contacts at
    once, or a point whose A couples both directions, would add is taken back towards the plastic answer, which cannot
    gain. psi_t acts in impacts that return, where psi > 0; a ball of rubber that grips has one of nearly psi.

    Friction may differ with the direction, as it does along a grain, on a blade or on a board with grooves: then
    `friction` is along `friction_direction`, a direction of the body, and `friction_across` across it; both are
    multiplied with the other surface's as usual, and only one of two surfaces that touch may have a direction. With the
    normal force N, the slip v and its part v_d along the direction, friction takes the power
    N √(µ_d² v_d² + µ_a² (v² − v_d²)) from what slips, the most that any force does whose parts along and across obey
    (f_d/µ_d)² + (f_a/µ_a)² <= N²; while nothing slips the force is any inside that ellipse. So it lies on the ellipse,
    normal to it along −v: not opposite to the slip, but it never does positive work. The same holds where the
    direction leaves the surface; where it is normal to it, friction is `friction_across` all round. The friction models
    box and scaled_box take the ellipse's rectangle. Iterations settle the slower the farther both are apart. A
    slip_compliance is that of the direction of lower friction; in the other one it is less, by the square of the ratio
    of both.
    """

    friction: float = 0.0  # Coulomb's mu, 1
    restitution: float = 0.0  # psi, between 0 and 1
    tangential_restitution: float = (
        0.0  # psi_t, between 0 and 1: of the slip that an impact which grips turns round
    )
    compliance: float = 0.0  # m/N per contact point
    damping: float | None = None  # s; None means 4.5 time steps
    slip_compliance: float = 0.0  # gamma, m/(N s): creep speed per tangential force
    rolling_friction: float = 0.0  # m: largest torque against rolling, over the normal force
    torsional_friction: float = 0.0  # m: largest torque against turning on the spot, over the normal force
    friction_direction: Vector | None = None  # body axes; None: the same friction in all directions
    friction_across: float | None = None  # Coulomb's mu across friction_direction, 1

    def __post_init__(self) -> None:
        for name in ("friction", "compliance", "slip_compliance", "rolling_friction", "torsional_friction"):
            object.__setattr__(self, name, check.not_negative("material", name, getattr(self, name)))
        for name in ("restitution", "tangential_restitution"):
            share = check.not_negative("material", name, getattr(self, name))
            if share > 1.0:
                raise SceneError(f"material: {name} must lie between 0 and 1, not {share:g}")
            object.__setattr__(self, name, share)
        if self.damping is not None:
            object.__setattr__(self, "damping", check.not_negative("material", "damping", self.damping))
        if self.friction_direction is not None or self.friction_across is not None:
            self._check_direction()

    def _check_direction(self) -> None:
        if self.friction_direction is None or self.friction_across is None:
            given, other = (
                ("friction_across", "friction_direction")
                if self.friction_direction is None
                else ("friction_direction", "friction_across")
            )
            raise SceneError(f"material: {given} says nothing without {other}; give both")
        direction = check.direction("material", "friction_direction", self.friction_direction)
        across = check.positive("material", "friction_across", self.friction_across)
        if max(across, self.friction) > WIDEST_FRICTION * min(across, self.friction):
            raise SceneError(
                f"material: friction {self.friction:g} along and {across:g} across are too far apart; neither may be "
                f"more than {WIDEST_FRICTION:g} times the other"
            )
        object.__setattr__(self, "friction_direction", direction)
        object.__setattr__(self, "friction_across", across)

    @property
    def oriented(self) -> bool:
        """Whether friction differs with the direction."""
        return self.friction_across is not None and self.friction_across != self.friction


@dataclass(frozen=True, slots=True, kw_only=True)
class RigidBody:
    """A body with orientation. Mass and inertia of a dynamic body must be positive.

    `position` [m] is that of its centre of mass, `orientation` the unit quaternion (w, x, y, z) from its axes to the world's;
    `velocity` [m/s] and `angular_velocity` [rad/s] are in world axes, `mass` in kg. `motion` is dynamic, static or kinematic.
    `inertia` holds the moments [kg m²] about the body axes, or is a symmetric 3×3 tensor along them, whose principal
    moments and axes are then found (Jacobi's rotations, to rounding): `inertia` and `inertia_axes` keep them. None takes
    that of the shape, of uniform density. A static body never moves; a kinematic one moves with its given velocities whatever
    pushes it, times its `pace` if that is given (a `spin_pace` is that of the angular velocity alone); or along its
    `path`, the three coordinates of its place, and by its `angle` about the fixed `angle_axis`: its velocity is that
    which leads to where they say that the step ends. Neither needs a mass. `shape` None means the body has no surface and touches nothing.
    A surface may move along itself as a conveyor's belt does: `surface_velocity` of whatever lies on it.
    """

    name: str
    position: Vector  # centre of mass, m
    mass: float | None = None  # kg
    shape: Shape | None = None
    inertia: Any = None  # kg m²: a Vector or a Tensor given, a Vector kept
    inertia_axes: Rotation = (1.0, 0.0, 0.0, 0.0)  # the axes of `inertia` in the body's, a unit quaternion
    orientation: Rotation = (1.0, 0.0, 0.0, 0.0)  # unit quaternion (w, x, y, z), body to world
    velocity: Vector = (0.0, 0.0, 0.0)  # m/s
    angular_velocity: Vector = (0.0, 0.0, 0.0)  # world frame, rad/s
    motion: Literal["dynamic", "static", "kinematic"] = "dynamic"
    material: Material = field(default_factory=Material)
    pace: TimeFunction | None = None  # of a kinematic body: what both velocities are times
    spin_pace: TimeFunction | None = None  # what its angular velocity is times instead
    path: tuple[float | TimeFunction, ...] | None = None  # x, y, z, m
    angle: TimeFunction | None = None  # rad, zero at the start
    angle_axis: Vector = (0.0, 0.0, 1.0)  # world direction
    surface_velocity: Vector = (0.0, 0.0, 0.0)  # body axes, m/s; only its part along the surface counts

    def __post_init__(self) -> None:
        check.name("rigid body", self.name)
        owner = f"rigid body {self.name!r}"
        if self.name == WORLD:
            raise SceneError(f"{owner}: the name {WORLD!r} is taken by the fixed world; choose another")
        if not check.one_of(self.motion, ("dynamic", "static", "kinematic")):
            raise SceneError(f"{owner}: motion must be dynamic, static or kinematic, not {self.motion!r}")
        if self.shape is not None and not isinstance(self.shape, Shape):
            raise SceneError(f"{owner}: shape must be one of engine's shapes, not {self.shape!r}")
        if not isinstance(self.material, Material):
            raise SceneError(f"{owner}: material must be a Material, not {self.material!r}")
        for name in ("position", "velocity", "angular_velocity", "surface_velocity"):
            object.__setattr__(self, name, check.vector(owner, name, getattr(self, name)))
        if any(self.surface_velocity) and (self.shape is None or self.material.friction == 0.0):
            raise SceneError(
                f"{owner}: only a surface with friction takes things along; give it a shape and friction"
            )
        for name in ("orientation", "inertia_axes"):
            object.__setattr__(self, name, check.rotation(owner, name, getattr(self, name)))
        self._check_motion(owner)
        if self.motion == "static" and (any(self.velocity) or any(self.angular_velocity)):
            raise SceneError(f"{owner}: a static body cannot have a velocity; make it kinematic")
        if self.motion != "static" and self.shape is not None and self.shape.fixed_only:
            raise SceneError(f"{owner}: a mesh stays where it is; make the body static")
        if self.motion != "dynamic":
            return
        if self.mass is None:
            raise SceneError(f"{owner}: a dynamic body needs a mass; give one or make it static")
        object.__setattr__(self, "mass", check.positive(owner, "mass", self.mass))
        if isinstance(self.shape, Plane):
            raise SceneError(f"{owner}: a plane has no inertia; make the body static or kinematic")
        inertia = self.inertia
        if inertia is None:
            if self.shape is None:
                raise SceneError(f"{owner}: a body without a shape needs an inertia; or use a Particle")
            try:
                inertia = self.shape.inertia(self.mass)
            except (OverflowError, ZeroDivisionError):
                raise SceneError(
                    f"{owner}: the inertia of its shape is no number of arithmetic; mind the units"
                ) from None
        moments, found = _principal(owner, inertia)
        x, y, z = (check.positive(owner, "inertia", moment) for moment in moments)
        largest = max(x, y, z)
        if largest > (x + y + z - largest) * (1.0 + 1e-12):
            raise SceneError(
                f"{owner}: inertia {(x, y, z)} breaks the triangle rule; no mass distribution has it"
            )
        object.__setattr__(self, "inertia", (x, y, z))
        if found is None:
            return
        if self.inertia_axes != (1.0, 0.0, 0.0, 0.0):
            raise SceneError(f"{owner}: a tensor has its own axes; leave inertia_axes out")
        object.__setattr__(self, "inertia_axes", found)

    @property
    def follows_time(self) -> bool:
        """Whether it is a kinematic body with a motion given as a function of time."""
        return any(given is not None for given in (self.pace, self.spin_pace, self.path, self.angle))

    def _check_motion(self, owner: str) -> None:
        for name in ("pace", "spin_pace", "angle"):
            given = getattr(self, name)
            if given is not None and not isinstance(given, TimeFunction):
                raise SceneError(f"{owner}: {name} must be a Sinusoid, Ramp or Table, not {given!r}")
        for name in ("pace", "spin_pace", "path", "angle"):
            if getattr(self, name) is not None and self.motion != "kinematic":
                raise SceneError(f"{owner}: only a kinematic body has a {name}; forces move a dynamic one")
        object.__setattr__(self, "angle_axis", check.direction(owner, "angle_axis", self.angle_axis))
        if self.angle is not None:
            if any(self.angular_velocity) or self.spin_pace is not None:
                raise SceneError(
                    f"{owner}: its angle says how it turns; leave its angular velocity and its pace out"
                )
            if abs(at_start(self.angle)) > 1e-12:
                raise SceneError(
                    f"{owner}: its angle begins at {at_start(self.angle):g} rad instead of 0; turn its orientation"
                )
        if self.path is None:
            return
        given = tuple(self.path) if isinstance(self.path, Sequence) and not isinstance(self.path, str) else ()
        if len(given) != 3:
            raise SceneError(f"{owner}: path must be three numbers or functions of time, not {self.path!r}")
        path = tuple(number_or_function(owner, "path", place) for place in given)
        object.__setattr__(self, "path", path)
        if any(self.velocity) or (self.pace is not None and not any(self.angular_velocity)):
            raise SceneError(f"{owner}: its path says how it moves; leave its velocity and its pace out")
        for axis, here, place in zip("xyz", self.position, path, strict=True):
            if abs(at_start(place) - here) > 1e-9 * max(1.0, abs(here)):
                raise SceneError(
                    f"{owner}: its path begins at {axis} = {at_start(place):g} m, but it stands at {here:g} m"
                )


def _principal(owner: str, inertia: Any) -> tuple[Vector, Rotation | None]:
    """Principal moments, and their axes if they are given as a tensor that is not diagonal."""
    rows = check.entries(inertia) or []
    if len(rows) != 3 or not all(isinstance(row, Iterable) and not isinstance(row, str) for row in rows):
        return check.vector(owner, "inertia", inertia), None
    tensor = tuple(check.vector(owner, "inertia", row) for row in rows)
    size = max(abs(entry) for row in tensor for entry in row)
    for i, j in ((0, 1), (0, 2), (1, 2)):
        if abs(tensor[i][j] - tensor[j][i]) > 1e-12 * size:
            raise SceneError(
                f"{owner}: inertia is not symmetric: {tensor[i][j]:g} in row {i}, column {j}, but {tensor[j][i]:g} in "
                f"row {j}, column {i}"
            )
    if not any(tensor[i][j] for i, j in ((0, 1), (0, 2), (1, 2))):
        return (tensor[0][0], tensor[1][1], tensor[2][2]), None
    axes = polytope.principal_axes(tensor)  # type: ignore[arg-type]
    columns = tuple(zip(*axes, strict=True))
    moments = tuple(
        math.fsum(column[i] * tensor[i][j] * column[j] for i in range(3) for j in range(3))
        for column in columns
    )
    if min(moments) <= 1e-14 * size:
        raise SceneError(f"{owner}: inertia is not positive: its principal moments are {moments}")
    return moments, check.rotation(owner, "inertia", polytope.quaternion(axes))  # type: ignore[return-value]


Body = Particle | RigidBody
