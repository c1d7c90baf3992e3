"""A native SPOOK physics engine: describe a scene, run it, read what you asked for.

A scene is bodies, constraints and forces in SI units and world axes; it knows no time step. `simulate` compiles
it for a time step, leaves out what the scene does not need, and runs the loop in native code.

    >>> from spook_tracker.engine import Distance, Energy, Final, MaximumAbsolute, Particle, Position, Scene, Violation, simulate
    >>> weight = Particle(name="weight", mass=2.0, position=(1.0, 0.0, 0.0))
    >>> rod = Distance(name="rod", between=((0.0, 0.0, 0.0), "weight"), compliance=1e-12)
    >>> pendulum = Scene(bodies=(weight,), constraints=(rod,), gravity=(0.0, 0.0, -9.81))
    >>> result = simulate(
    ...     pendulum,
    ...     time_step=1 / 240,
    ...     duration=10.0,
    ...     observe={
    ...         "end": Final(quantity=Position("weight")),
    ...         "stretch": MaximumAbsolute(quantity=Violation("rod")),
    ...         "energy": MaximumAbsolute(quantity=Energy(), from_start=True),
    ...     },
    ... )
    >>> result.status, result.steps
    ('completed', 2400)
    >>> bool(result["stretch"] < 1e-3)  # m
    True

What is observed is reduced in the loop, so nothing is stored that was not asked for. `explain` says which stages
the scene keeps, and why:

    >>> from spook_tracker.engine import explain
    >>> [choice.stage for choice in explain(pendulum, time_step=1 / 240) if choice.kept]
    ['apply_gravity', 'assemble_rows', 'solve_path', 'integrate_positions']

A scene of your own: add bodies and tie them. Here a second weight hangs from the first, with a better method:

    >>> from spook_tracker.engine import Method
    >>> second = Particle(name="second", mass=1.0, position=(2.0, 0.0, 0.0))
    >>> link = Distance(name="link", between=("weight", "second"), compliance=1e-12)
    >>> double = Scene(bodies=(weight, second), constraints=(rod, link), gravity=(0.0, 0.0, -9.81))
    >>> curved = Method(corrections=2, half_step_velocities=True)
    >>> stretch = {"stretch": MaximumAbsolute(quantity=Violation())}
    >>> better = simulate(double, time_step=1 / 240, duration=2.0, method=curved, observe=stretch)
    >>> better["stretch"].shape  # one number per constraint
    (2,)
    >>> bool(better["stretch"].max() < 1e-6)  # m
    True

What cannot be simulated is refused with one sentence, and a run that goes wrong is a result that says so:

    >>> Particle(name="ghost", mass=0.0, position=(0.0, 0.0, 0.0))
    Traceback (most recent call last):
    spook_tracker.engine.errors.SceneError: particle 'ghost': mass must be positive, not 0
"""

from spook_tracker.misuse import explain_misuse

from .bodies import WORLD, Body, Material, PairFriction, Particle, RigidBody
from .build_info import BuildInfo, build_info
from .compiler import compile, explain
from .couplings import Relation, Wire
from .errors import EngineError, MethodError, SceneError
from .forces import CentralGravity, Fluid, Load, Spring
from .helpers import axis_angle, bar, gear_pair
from .joints import (
    Ball,
    Cylindrical,
    Distance,
    Hinge,
    JointSpring,
    Limit,
    Lock,
    Motor,
    Planar,
    PointOnLine,
    Prismatic,
    Universal,
)
from .meshes import HeightField, TriangleMesh
from .method import PLAIN, Method
from .observe import (
    AngularMomentum,
    AngularVelocity,
    ConstraintForce,
    ContactCount,
    ContactForce,
    ContactPoints,
    Energy,
    Final,
    JointCoordinate,
    KineticEnergy,
    Maximum,
    MaximumAbsolute,
    Mean,
    Minimum,
    Momentum,
    Orientation,
    Penetration,
    Position,
    PotentialEnergy,
    Trace,
    Velocity,
    Violation,
)
from .program import Program, StageChoice
from .result import Books, Broken, Result, SimulationFailed
from .run import Run, start
from .scene import Scene
from .shapes import (
    Box,
    Capsule,
    Compound,
    Cone,
    ConvexHull,
    Cylinder,
    Part,
    PlacedHull,
    Plane,
    Shape,
    Sphere,
)
from .simulation import Prepared, prepare, simulate
from .snapshot import Snapshot
from .time_functions import Ramp, Sinusoid, Table, TimeFunction
from .tyres import Tyre

__all__ = [
    "PLAIN",
    "WORLD",
    "AngularMomentum",
    "AngularVelocity",
    "Ball",
    "Body",
    "Books",
    "Box",
    "Broken",
    "BuildInfo",
    "Capsule",
    "CentralGravity",
    "Compound",
    "Cone",
    "ConstraintForce",
    "ContactCount",
    "ContactForce",
    "ContactPoints",
    "ConvexHull",
    "Cylinder",
    "Cylindrical",
    "Distance",
    "Energy",
    "EngineError",
    "Final",
    "Fluid",
    "HeightField",
    "Hinge",
    "JointCoordinate",
    "JointSpring",
    "KineticEnergy",
    "Limit",
    "Load",
    "Lock",
    "Material",
    "Maximum",
    "MaximumAbsolute",
    "Mean",
    "Method",
    "MethodError",
    "Minimum",
    "Momentum",
    "Motor",
    "Orientation",
    "PairFriction",
    "Part",
    "Particle",
    "Penetration",
    "PlacedHull",
    "Planar",
    "Plane",
    "PointOnLine",
    "Position",
    "PotentialEnergy",
    "Prepared",
    "Prismatic",
    "Program",
    "Ramp",
    "Relation",
    "Result",
    "RigidBody",
    "Run",
    "Scene",
    "SceneError",
    "Shape",
    "SimulationFailed",
    "Sinusoid",
    "Snapshot",
    "Sphere",
    "Spring",
    "StageChoice",
    "Table",
    "TimeFunction",
    "Trace",
    "TriangleMesh",
    "Tyre",
    "Universal",
    "Velocity",
    "Violation",
    "Wire",
    "axis_angle",
    "bar",
    "build_info",
    "compile",
    "explain",
    "gear_pair",
    "prepare",
    "simulate",
    "start",
]

explain_misuse(globals()[name] for name in __all__)
