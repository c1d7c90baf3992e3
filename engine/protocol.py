"""Other engines behind the same questions: what an adapter says of its engine, and how one is found by name.

An adapter is one module in `engine/peers/`, or anywhere else, with an object `ENGINE` of the type `Adapter`.
It says what its engine can do (`Capabilities`) and in which settings (`Configuration`), and records a
trajectory; every observable and reduction is computed from that (`engine.recording`). Whatever an engine lacks
is *not supported*, by name, decided from scene and observables before anything runs: never zero, never a crash.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from .bodies import Particle, RigidBody
from .build_info import BuildInfo
from .compiler import NOTHING
from .errors import EngineError, MethodError
from .forces import Force, Spring
from .joints import AxialJoint, Constraint, Distance, Joint, frictions
from .method import DEFAULT, Method
from .model_file import ModelRun
from .observe import (
    ConstraintForce,
    ContactCount,
    ContactForce,
    ContactPoints,
    JointCoordinate,
    Observable,
    Penetration,
    Quantity,
    Violation,
)
from .recording import (
    Recording,
    hinges_counted,
    needs_every_step,
    observed,
    wanted_samples,
)
from .result import Result
from .scene import Scene
from .shapes import Compound, Shape

RIGID = 1e-8  # m/N or rad/(N m): a softer row is a spring, which an engine must be able to hold as such
NOWHERE = frozenset({"restitution of the slip"})  # no engine here has it
_FROM_ENGINE: tuple[type[Quantity], ...] = (
    ConstraintForce,
    ContactForce,
    ContactCount,
    ContactPoints,
    Penetration,
)


class NotSupported(EngineError):
    """The engine cannot be asked this; the message names what it lacks."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Capabilities:
    """What an engine can be asked through its adapter. What is not listed is not supported.

    Most of that an engine may have and its adapter does not ask for; what it is known not to have is `absent`.
    """

    shapes: frozenset[type[Shape]] = frozenset()  # that can touch
    joints: frozenset[type[Constraint]] = frozenset()
    forces: frozenset[type[Force]] = frozenset()
    shows: frozenset[type[Quantity]] = (
        frozenset()
    )  # of ConstraintForce, ContactForce, ContactCount, Penetration
    shows_force_of: frozenset[type[Constraint]] | None = None  # None: of every joint, if of any
    compliance: bool = False  # rows of a stated stiffness
    soft: frozenset[type[Constraint]] = frozenset()  # joints alone that have one
    friction: bool = False
    rolling_friction: bool = False  # of rolling, and of turning on the spot
    joint_friction: bool = False  # constant; none has any that grows with a joint's load
    restitution: bool = False
    surface_velocity: bool = False  # of what moves along itself, as a belt does
    tangential_restitution: bool = False  # of the slip
    motors: bool = False
    limits: bool = False
    springs: bool = False  # in a joint
    springs_aside: bool = False  # the force, on points beside centres
    armature: bool = False
    loops: bool = True  # closed chains of joints
    kinematic: bool = False
    particles: bool = True
    rigid_bodies: bool = True
    absent: frozenset[str] = (
        frozenset()
    )  # as `unsupported` words it: the engine's own lack, not its adapter's


@dataclass(frozen=True, slots=True, kw_only=True)
class Configuration:
    """One natural and accurate way to run an engine, with the reason for it. The first one is its gate."""

    name: str
    reason: str
    expected_order: float | None = None  # of accuracy on smooth scenes
    options: Mapping[str, Any] = field(default_factory=dict)
    lacks: tuple[str, ...] = ()  # fields of Capabilities this configuration has not


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """What an adapter is asked to record."""

    scene: Scene
    time_step: float  # s
    steps: int
    every_step: bool  # else only the start and the end, and no turns to count
    samples: npt.NDArray[
        np.int64
    ]  # steps something is read at, with the start and the end: all that must be kept
    configuration: Configuration
    constraint_forces: bool  # whether they are wanted
    contacts: bool  # whether contact forces, counts or depths are wanted
    time_limit: float | None  # s, of the processor where the adapter can tell, else of wall time
    counted: tuple[str, ...] = ()  # hinges whose turns are counted where not all steps are kept


@dataclass(frozen=True, slots=True, kw_only=True)
class Worlds:
    """The same scene in many worlds at once: what an adapter's `worlds(task, count)` gives, where it has one."""

    positions: npt.NDArray[np.float64]  # (count, bodies, 3) m, at the end
    seconds: float  # of all steps of all of them, compiled before
    setup_seconds: float


@runtime_checkable
class Adapter(Protocol):
    """What a module behind the protocol offers as ENGINE."""

    name: str
    capabilities: Capabilities
    configurations: tuple[Configuration, ...]

    def build_info(self) -> BuildInfo:
        """Name and version of the engine that is installed."""
        ...

    def record(self, task: Task) -> Recording:
        """Run the task in the engine's own loop where it has one. May raise NotSupported."""
        ...


def unsupported(
    capabilities: Capabilities, scene: Scene, observe: Mapping[str, Observable]
) -> tuple[str, ...]:
    """What the engine lacks for this question, by name, each once; empty if it can be asked."""
    return tuple(
        dict.fromkeys((*_of_scene(capabilities, scene), *_of_observables(capabilities, scene, observe)))
    )


def _of_scene(can: Capabilities, scene: Scene) -> Iterator[str]:
    touching = scene.contacts and _may_touch(scene)
    for body in scene.bodies:
        if isinstance(body, Particle):
            if not can.particles:
                yield "particles"
            continue
        if not can.rigid_bodies:
            yield "rigid bodies"
        if body.motion == "kinematic" and not can.kinematic:
            yield "kinematic bodies"
        if body.motion == "dynamic" and body.inertia_axes != (1.0, 0.0, 0.0, 0.0):
            yield "principal axes of inertia beside those of the body"
        if touching and body.shape is not None:
            yield from _of_surface(can, body)
    for constraint in scene.constraints:
        yield from _of_constraint(can, constraint)
    if touching and scene.pair_frictions:
        yield "friction of a pair of bodies"
    if scene.follows_time():
        yield "functions of time"
    if not can.loops and _has_loop(scene):
        yield "closed loops of joints"
    for force in scene.forces:
        if type(force) not in can.forces:
            yield f"the force {_words(type(force))}"
        if isinstance(force, Spring) and force.aside and not can.springs_aside:
            yield "a spring beside a body's centre"


def _may_touch(scene: Scene) -> bool:
    solid = [b for b in scene.bodies if isinstance(b, RigidBody) and b.shape is not None]
    return len(solid) > 1 and any(b.motion == "dynamic" for b in solid)


def _of_surface(can: Capabilities, body: RigidBody) -> Iterator[str]:
    shapes = body.shape.parts if isinstance(body.shape, Compound) else (body.shape,)
    if isinstance(body.shape, Compound) and Compound not in can.shapes:
        yield "the shape compound"
    for part in shapes:
        kind = type(part) if isinstance(part, Shape) else type(part.shape)  # type: ignore[union-attr]
        if kind not in can.shapes:
            yield f"the shape {_words(kind)}"
    if body.material.friction and not can.friction:
        yield "friction"
    if body.material.restitution and not can.restitution:
        yield "restitution"
    if body.material.tangential_restitution and not can.tangential_restitution:
        yield "restitution of the slip"
    if (body.material.compliance > RIGID or body.material.slip_compliance) and not can.compliance:
        yield "compliance of a surface"
    rolls = body.material.rolling_friction or body.material.torsional_friction
    if rolls and not can.rolling_friction:
        yield "friction of rolling or turning"
    if body.material.oriented:
        yield "friction that differs with the direction"
    if any(body.surface_velocity) and not can.surface_velocity:
        yield "a surface that moves along itself"


def is_spring(can: Capabilities, constraint: Constraint) -> bool:
    """Whether a distance that gives is asked as the spring it is: of stiffness 1/compliance and viscosity
    damping/compliance, for engines that have springs and no compliant rows."""
    if not isinstance(constraint, Distance) or constraint.compliance <= RIGID:
        return False
    if can.compliance or Distance in can.soft:
        return False
    aside = any(any(anchor) for anchor in constraint.anchors)
    return Spring in can.forces and (can.springs_aside or not aside)


def sprung(can: Capabilities, scene: Scene) -> Scene:
    """The scene with such distances as springs."""
    rows = [row for row in scene.constraints if isinstance(row, Distance) and is_spring(can, row)]
    if not rows:
        return scene
    springs = tuple(
        Spring(
            name=f"{row.name} (row)",
            between=row.between,
            stiffness=1.0 / row.compliance,
            rest_length=scene.length(row) if row.rest_length is None else row.rest_length,
            viscosity=(row.damping or 0.0) / row.compliance,
            anchors=row.anchors,
        )
        for row in rows
    )
    kept = tuple(one for one in scene.constraints if one not in rows)
    return replace(scene, constraints=kept, forces=(*scene.forces, *springs))


def _of_constraint(can: Capabilities, constraint: Constraint) -> Iterator[str]:
    if is_spring(can, constraint):
        return
    if type(constraint) not in can.joints:
        yield f"the joint {_words(type(constraint))}"
    soft = constraint.compliance
    gives = max(soft if isinstance(soft, tuple) else (soft,)) > RIGID
    if gives and not can.compliance and type(constraint) not in can.soft:
        yield "compliance of a joint"
    if isinstance(constraint, Joint) and (constraint.strength or constraint.torque_strength) is not None:
        yield "a joint that breaks"
    if isinstance(constraint, AxialJoint):
        for name in ("motor", "limit", "spring"):
            if getattr(constraint, name) is not None and not getattr(can, f"{name}s"):
                yield f"a {name} in a joint"
        if constraint.armature and not can.armature:
            yield "armature of a joint"
        if constraint.spring is not None and constraint.spring.max_force is not None:
            yield "a spring of bounded force in a joint"
        if constraint.motor is not None and constraint.motor.force is not None:
            yield "a motor of given force in a joint"
    constant, by_load = frictions(constraint)
    if any(constant) and not can.joint_friction:
        yield "friction in a joint"
    if any(by_load):
        yield "friction in a joint that grows with its load"


def _has_loop(scene: Scene) -> bool:
    """Whether some body is reached from the world, or from another body, in two ways."""
    group: dict[str, str] = {}

    def root(name: str) -> str:
        while group.setdefault(name, name) != name:
            name = group[name]
        return name

    fixed = {body.name for body in scene.bodies if isinstance(body, RigidBody) and body.motion != "dynamic"}
    for constraint in scene.constraints:
        ends = [e if isinstance(e, str) and e not in fixed else "world" for e in constraint.between]
        first, second = root(ends[0]), root(ends[1])
        if first == second:
            return True
        group[first] = second
    return False


def _of_observables(can: Capabilities, scene: Scene, observe: Mapping[str, Observable]) -> Iterator[str]:
    for what in observe.values():
        asked = what.quantity
        if isinstance(asked, _FROM_ENGINE) and type(asked) not in can.shows:
            yield f"the observable {_words(type(asked))}"
        elif isinstance(asked, ConstraintForce) and any(
            is_spring(can, c) for c in scene.constraints if asked.constraint in (None, c.name)
        ):
            yield "the force of a distance that gives"
        elif isinstance(asked, ConstraintForce) and can.shows_force_of is not None:
            kinds = [type(c) for c in scene.constraints if asked.constraint in (None, c.name)]
            for kind in kinds:
                if kind not in can.shows_force_of and (asked.constraint or kind is Distance):
                    yield f"the force of the joint {_words(kind)}"
        # A name the scene has not is a mistake of the test, not a lack of the engine.
        if isinstance(asked, Violation | ConstraintForce) and asked.constraint is not None:
            named = scene.constraint(asked.constraint)
            if isinstance(asked, Violation) and not isinstance(named, Distance | Joint):
                yield f"the observable violation of a {_words(type(named))}"
        if isinstance(asked, JointCoordinate):
            scene.constraint(asked.joint)


def _words(kind: type) -> str:
    """JointCoordinate -> joint coordinate."""
    return "".join(f" {c.lower()}" if c.isupper() else c for c in kind.__name__).strip()


def run(
    adapter: Adapter,
    scene: Scene,
    *,
    time_step: float,
    duration: float | None = None,
    steps: int | None = None,
    configuration: str = "",
    method: Method = DEFAULT,
    observe: Mapping[str, Observable] = NOTHING,
    time_limit: float | None = None,
    time_stages: bool = False,
) -> Result:
    """Put one scene to another engine: `simulate` with a configuration of that engine ("" is its first).

    `method` is how SPOOK would do it and says nothing to another engine. Raises NotSupported before anything runs.
    """
    del method, time_stages
    if not (math.isfinite(time_step) and time_step > 0.0):
        raise MethodError(f"time_step must be positive and finite, not {time_step!r}")
    if isinstance(scene, ModelRun):
        return _of_model(adapter, scene, time_step, duration, time_limit)
    if (duration is None) == (steps is None):
        raise MethodError("give either a duration or a number of steps")
    count = round(duration / time_step) if duration is not None else int(steps or 0)
    chosen = configuration_of(adapter, configuration)
    refuse_unsupported(adapter, chosen, scene, observe)
    asked = [type(what.quantity) for what in observe.values()]
    counted = hinges_counted(scene, observe)
    task = Task(
        scene=sprung(adapter.capabilities, scene),
        time_step=float(time_step),
        steps=count,
        every_step=needs_every_step(observe, count) or bool(counted),
        samples=wanted_samples(observe, count),
        counted=counted,
        configuration=chosen,
        constraint_forces=ConstraintForce in asked,
        contacts=not {ContactForce, ContactCount, ContactPoints, Penetration}.isdisjoint(asked),
        time_limit=time_limit,
    )
    return _result(replace(task, scene=scene), adapter.record(task), observe)


def _of_model(
    adapter: Adapter, asked: ModelRun, time_step: float, duration: float | None, time_limit: float | None
) -> Result:
    """A model file, by an adapter that has `run_model` and lists the file's format in `reads`."""
    if asked.model.format not in getattr(adapter, "reads", ()):
        raise NotSupported(f"{adapter.name} reads no {asked.model.format} here")
    found: Result = adapter.run_model(asked, time_step, duration, time_limit)  # type: ignore[attr-defined]
    return found


def configuration_of(adapter: Adapter, name: str) -> Configuration:
    """The configuration of that name; "" is the first."""
    for configuration in adapter.configurations:
        if name in ("", configuration.name):
            return configuration
    known = ", ".join(configuration.name for configuration in adapter.configurations)
    raise MethodError(f"engine {adapter.name!r} has no configuration {name!r}; it has {known}")


def refuse_unsupported(
    adapter: Adapter, configuration: Configuration, scene: Scene, observe: Mapping[str, Observable]
) -> None:
    """Raise NotSupported, naming everything the engine lacks for this question."""
    absent: dict[str, Any] = {
        name: frozenset() if isinstance(getattr(adapter.capabilities, name), frozenset) else False
        for name in configuration.lacks
    }
    can = replace(adapter.capabilities, **absent) if absent else adapter.capabilities
    lacking = unsupported(can, scene, observe)
    if not lacking:
        return
    always = unsupported(adapter.capabilities, scene, observe)
    own = [
        one for one in lacking if one in can.absent | NOWHERE or one not in always
    ]  # the engine's, or this configuration's
    ours = [one for one in lacking if one not in own]
    said = [f"{adapter.name} ({configuration.name}) does not support {', '.join(own)}"] if own else []
    said += [f"our adapter cannot ask {adapter.name} for {', '.join(ours)}"] if ours else []
    raise NotSupported("; ".join(said))


def _result(task: Task, recording: Recording, observe: Mapping[str, Observable]) -> Result:
    values, times = observed(task.scene, recording, observe, task.time_step)
    final = np.concatenate(
        [
            recording.positions[-1],
            recording.orientations[-1],
            recording.velocities[-1],
            recording.angular_velocities[-1],
        ],
        axis=1,
    )
    status, failure = recording.status, recording.failure
    if status == "completed" and not np.isfinite(final).all():
        status, failure = "not_finite", f"a value is not finite after step {recording.steps}"
    return Result(
        status=status,
        failure=failure,
        failed_body=None,
        failed_step=None if status == "completed" else recording.steps,
        time_step=task.time_step,
        steps=recording.steps,
        seconds=recording.seconds,
        observables=values,
        sample_times=times,
        final_state={body.name: row for body, row in zip(task.scene.bodies, final, strict=True)},
        # How far a run came before a time limit is the machine's doing and no exact work.
        counters={} if status == "timed_out" else {"steps": recording.steps},
        state_hash=hashlib.sha256(np.ascontiguousarray(final).tobytes()).hexdigest()[:16],
        stages=(),
        stage_seconds={"setup": recording.setup_seconds},
        cpu_seconds=recording.cpu_seconds,
    )
