"""A simulation one can hold: step it, read it, set what drives it, go back.

>>> from spook_tracker.engine import Hinge, JointCoordinate, Motor, RigidBody, Scene, WORLD, start
>>> wheel = RigidBody(name="wheel", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.0))
>>> axle = Hinge(name="axle", between=(WORLD, "wheel"), motor=Motor(speed=0.0, max_force=2.0))
>>> with start(Scene(bodies=(wheel,), constraints=(axle,)), time_step=0.1,
...            observe={"angle": JointCoordinate("axle")}) as run:
...     before = run.save()
...     while run["angle"] < 0.45:
...         run.set_motor("axle", speed=1.0)
...         run.step()
...     reached = run.time
...     run.restore(before)
>>> round(reached, 9), float(run["angle"])
(0.7, 0.0)
"""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import MappingProxyType, TracebackType
from typing import Any

import numpy as np

from spook_tracker.misuse import explained

from . import check
from .bodies import RigidBody
from .check import Vector
from .compiler import compile
from .errors import MethodError, SceneError
from .forces import Load
from .joints import AxialJoint, Motor
from .method import DEFAULT, Method
from .observe import Final, Quantity
from .program import Program
from .result import Array, Result, SimulationFailed
from .scene import Scene
from .snapshot import Snapshot
from .time_functions import at_start

A_LITTLE = 0.04  # s: to read a run in whose time is over
ROUNDING = 1e-12  # of the length of a quaternion that came out of a run
NOTHING_READ: Mapping[str, Quantity] = MappingProxyType({})


@explained
def start(
    scene: Scene,
    *,
    time_step: float,
    method: Method = DEFAULT,
    observe: Mapping[str, Quantity] = NOTHING_READ,
    state: Mapping[str, Array] | None = None,
) -> Run:
    """Hold a scene at its start, or at `state`: bodies by name, (13,) each, as `Result.final_state` has them.

    `observe` names quantities that `run["name"]` reads whenever asked. Stepping in pieces gives the bits of one
    `simulate` over all steps. A run continued from a `state` gives them where the state says it all, as of particles
    whose rows are solved directly. Rigid bodies go on to rounding: they keep how far they moved, turned and what spins
    them. Turns of hinges count from the angle within ±π, contacts and iterative solvers start cold, and with mid-step
    velocities the start is made anew; `Run.save` and `Run.restore` keep every bit.
    """
    if not isinstance(observe, Mapping):
        raise MethodError(f"observe must map names to quantities, not {observe!r}")
    for name, what in observe.items():
        if not isinstance(what, Quantity):
            raise MethodError(
                f"observe {name!r}: a run one holds reads quantities as they are, not {what!r}; "
                "give the quantity itself"
            )
    finals = {name: Final(quantity=what) for name, what in observe.items()}
    program = compile(scene, time_step=time_step, method=method, observe=finals, held=True)
    return Run(scene, program, method, tuple(observe.items()), _flat(scene, state))


class Run:
    """A scene that is being simulated, made by `start`. One thread at a time steps or reads it."""

    def __init__(
        self,
        scene: Scene,
        program: Program,
        method: Method,
        observe: tuple[tuple[str, Quantity], ...],
        state: list[float],
    ) -> None:
        self.scene = scene
        self._program = program
        self._of = (scene, program.time_step, method, observe)
        self._native = program.native
        self._lock = threading.Lock()
        self._open = True
        self._steps = 0
        self._residual = 0.0
        self._seconds = self._cpu_seconds = 0.0
        self._failure: Result | None = None
        self._read: Result | None = None
        self._settings: dict[tuple[str, str], tuple[Any, ...]] = {}
        self._bodies = {body.name: index for index, body in enumerate(scene.bodies)}
        self._loads = {force.name: force for force in scene.forces if isinstance(force, Load)}
        self._loads_of: dict[str, list[Load]] = {}  # on each body, those that can be set
        for load in self._loads.values():
            if load.factor is None:
                self._loads_of.setdefault(load.body, []).append(load)
        self._native.start(state)

    # --- going on -----------------------------------------------------------------------------------------

    def step(self, steps: int = 1, *, time_limit: float | None = None) -> None:
        """So many steps on, natively. Raises SimulationFailed, with the run so far in `.result`, when a value is
        no longer finite or the time limit [s] is over; `restore` takes the run back to before."""
        steps, limit = check.step_count(steps), check.wall_time(time_limit)
        with self._held():
            if self._failure is not None:
                raise SimulationFailed(self._failure)
            report = self._native.advance(steps, limit)
            self._read = None
            self._steps += report["steps"]
            self._seconds += report["seconds"]
            self._cpu_seconds += report["cpu_seconds"]
            if report["status"] != "completed":
                failed = self._result(report, time_limit)
                if report["status"] != "timed_out":
                    self._failure = failed
                raise SimulationFailed(failed)

    @property
    def steps(self) -> int:
        """Steps done since the start."""
        return self._steps

    @property
    def time(self) -> float:
        """Simulated time since the start, s."""
        return self._steps * self._program.time_step

    # --- reading ------------------------------------------------------------------------------------------

    def result(self) -> Result:
        """The run as it is: state, counters, residual, and every observed quantity at this moment."""
        if self._failure is not None:
            return self._failure
        if self._read is None:
            with self._held():
                self._read = self._result(None, None)
        return self._read

    def __getitem__(self, name: str) -> Any:
        """A quantity of `observe`, as it is now; forces are those of the step that ended here."""
        return self.result()[name]

    @property
    def state(self) -> Mapping[str, Array]:
        """(13,) per body: position, orientation, velocity, angular velocity."""
        return self.result().final_state

    def _result(self, report: Mapping[str, Any] | None, time_limit: float | None) -> Result:
        over = report is not None and report["status"] == "timed_out"
        now = self._native.read(A_LITTLE if over else 0.0)
        times = {"seconds": self._seconds, "cpu_seconds": self._cpu_seconds}
        told = ("status", "failed_step", "failed_body", "failed_joints", "reason")
        ending = {k: report[k] for k in told} if report else {}
        return self._program.result({**now, **times, **ending}, time_limit)

    # --- setting ------------------------------------------------------------------------------------------

    def set_load(self, name: str, *, force: Vector | None = None, torque: Vector | None = None) -> None:
        """What a Load of the scene is from now on [N, N m]; what is not given stays."""
        owner = f"set_load {name!r}"
        load = self._load(owner, name)
        before = self._settings.get(("load", name), (load.force, load.torque))
        new = (
            before[0] if force is None else check.vector(owner, "force", force),
            before[1] if torque is None else check.vector(owner, "torque", torque),
        )
        if any(new[1]) and not isinstance(self.scene.body(load.body), RigidBody):
            raise SceneError(f"{owner}: {load.body!r} is a particle and cannot take a torque")
        self._set("load", name, new)

    def set_loads(self, forces: Mapping[str, Vector]) -> None:
        """The forces of several Loads from now on [N], as set_load sets each; their torques stay."""
        loads = [self._load(f"set_loads {name!r}", name) for name in forces]
        new = [check.vector(f"set_loads {name!r}", "force", force) for name, force in forces.items()]
        with self._held():
            self._read = None
            for load, force in zip(loads, new, strict=True):
                torque = self._settings.get(("load", load.name), (force, load.torque))[1]
                self._settings["load", load.name] = (force, torque)
            for body in dict.fromkeys(load.body for load in loads):
                self._apply_loads(body)

    def _load(self, owner: str, name: str) -> Load:
        """A Load that can be set."""
        load = self._loads.get(name)
        if load is None:
            raise SceneError(f"{owner}: the scene has no such Load; give it one, of zero if need be")
        _not_in_time(owner, load.factor)
        return load

    def set_motor(
        self,
        joint: str,
        *,
        speed: float | None = None,
        max_force: float | None = None,
        force: float | None = None,
    ) -> None:
        """The speed [m/s or rad/s] and the bound [N or N m] of a joint's motor from now on, or its force [N or N m]."""
        motor = getattr(self._joint(joint), "motor", None)
        if motor is None:
            raise SceneError(f"set_motor: {joint!r} has no motor")
        owner = f"set_motor {joint!r}"
        if motor.force is not None:
            if speed is not None or max_force is not None:
                raise SceneError(f"{owner}: in the scene it is a motor of given force; set its force")
            _not_in_time(owner, motor.force)
            if force is not None:
                self._set("motor", joint, (0.0, check.number(owner, "force", force)))
            return
        if force is not None:
            raise SceneError(
                f"{owner}: in the scene it is a motor of given speed; set its speed or its max_force"
            )
        if max_force is not None and motor.max_force is None:
            raise SceneError(f"{owner}: its force is unbounded in the scene; give it a max_force there")
        _not_in_time(owner, motor.speed)
        if max_force is not None:
            _not_in_time(owner, motor.max_force)
        before = self._settings.get(("motor", joint), _motor_at_start(motor))
        new = (
            before[0] if speed is None else check.number(owner, "speed", speed),
            before[1] if max_force is None else check.not_negative(owner, "max_force", max_force),
        )
        self._set("motor", joint, new)

    def set_rest(self, joint: str, rest: float) -> None:
        """Where the spring of a joint pulls from now on [m or rad]: a drive with a position for its target."""
        spring = getattr(self._joint(joint), "spring", None)
        if spring is None:
            raise SceneError(f"set_rest: {joint!r} has no spring")
        _not_in_time(f"set_rest {joint!r}", spring.rest)
        self._set("rest", joint, (check.number(f"set_rest {joint!r}", "rest", rest),))

    def set_velocity(
        self, body: str, *, velocity: Vector | None = None, angular_velocity: Vector | None = None
    ) -> None:
        """How a kinematic body moves from now on [m/s, rad/s]; what is not given stays."""
        known = self.scene.body(body)
        if not isinstance(known, RigidBody) or known.motion != "kinematic":
            raise SceneError(f"set_velocity: {body!r} is not kinematic, so forces move it; use a Load")
        owner = f"set_velocity {body!r}"
        for given in (known.pace, known.spin_pace, known.path, known.angle):
            _not_in_time(owner, given)
        before = self._settings.get(("velocity", body), (known.velocity, known.angular_velocity))
        new = (
            before[0] if velocity is None else check.vector(owner, "velocity", velocity),
            before[1]
            if angular_velocity is None
            else check.vector(owner, "angular_velocity", angular_velocity),
        )
        self._set("velocity", body, new)

    def _joint(self, name: str) -> AxialJoint | None:
        joint = self.scene.constraint(name)
        return joint if isinstance(joint, AxialJoint) else None

    def _set(self, kind: str, name: str, values: tuple[Any, ...]) -> None:
        with self._held():
            self._settings[kind, name] = values
            self._read = None
            self._apply(kind, name)

    def _apply(self, kind: str, name: str) -> None:
        if kind == "load":
            self._apply_loads(self._loads[name].body)
        elif kind == "velocity":
            self._native.set_velocity(self._bodies[name], *self._settings[kind, name])
        else:
            index = [constraint.name for constraint in self.scene.constraints].index(name)
            set_drive = self._native.set_motor if kind == "motor" else self._native.set_rest
            set_drive(index, *self._settings[kind, name])

    def _apply_loads(self, body: str) -> None:
        """The sum of those on one body."""
        sums = [0.0] * 6
        for load in self._loads_of[body]:
            force, torque = self._settings.get(("load", load.name), (load.force, load.torque))
            sums = [total + one for total, one in zip(sums, (*force, *torque), strict=True)]
        self._native.set_load(self._bodies[body], tuple(sums[:3]), tuple(sums[3:]))

    # --- going back ---------------------------------------------------------------------------------------

    def save(self) -> Snapshot:
        """All that the coming steps depend on; going on from it gives the same bits whenever it is restored."""
        with self._held():
            return Snapshot(self._of, self._native.keep(), dict(self._settings), self._failure)

    def restore(self, snapshot: Snapshot) -> None:
        """Go back, or over, to where a run of an equal scene was. Counters go on counting all work."""
        if not isinstance(snapshot, Snapshot):
            raise MethodError(f"restore needs what save() gave, not {snapshot!r}")
        if snapshot.of != self._of:
            raise MethodError(
                "restore: the snapshot is of another scene, time step, method or observation than this run"
            )
        with self._held():
            set_since = {*self._settings, *snapshot.settings}
            self._settings = {key: self._start_of(*key) for key in set_since} | dict(snapshot.settings)
            for kind, name in sorted(set_since):
                self._apply(kind, name)
            self._native.go_back(snapshot.native)  # then: what slept sleeps, whatever was set since
            self._steps = snapshot.native.steps
            self._failure = snapshot.failure
            self._read = None

    def _start_of(self, kind: str, name: str) -> tuple[Any, ...]:
        """What the scene says of something that was set."""
        if kind == "load":
            load = self._loads[name]
            return (load.force, load.torque)
        if kind == "velocity":
            body = self.scene.body(name)
            assert isinstance(body, RigidBody)
            return (body.velocity, body.angular_velocity)
        joint = self._joint(name)
        assert joint is not None
        if kind == "motor":
            assert joint.motor is not None
            return _motor_at_start(joint.motor)
        assert joint.spring is not None
        return (joint.spring.rest,)

    # --- holding ------------------------------------------------------------------------------------------

    def close(self) -> None:
        """Let go: what was read stays, nothing more can be asked of the run."""
        if self._open and self._failure is None:
            self.result()
        self._open = False

    def __enter__(self) -> Run:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        state = "failed" if self._failure else "open" if self._open else "closed"
        return f"<Run: {state}, {len(self._bodies)} bodies at {self.time:.6g} s after {self._steps} steps>"

    @contextmanager
    def _held(self) -> Iterator[None]:
        if not self._open:
            raise MethodError("this run is closed; start another")
        with self._lock:
            yield


def _motor_at_start(motor: Motor) -> tuple[float, float]:
    """What the native side calls its speed and its force."""
    force = motor.max_force if motor.force is None else motor.force
    return (
        0.0 if motor.speed is None else at_start(motor.speed),
        math.inf if force is None else at_start(force),
    )


def _not_in_time(owner: str, value: object) -> None:
    if value is not None and not isinstance(value, float):
        raise SceneError(
            f"{owner}: it follows the time in the scene, so it cannot be set; give a number there"
        )


def _flat(scene: Scene, state: Mapping[str, Array] | None) -> list[float]:
    """A state in the order of the scene's bodies; empty for the scene's own start."""
    if state is None:
        return []
    if not isinstance(state, Mapping):
        raise MethodError(f"state must map body names to 13 numbers, not {state!r}")
    for name in state:
        scene.body(name)
    flat: list[float] = []
    for body in scene.bodies:
        if body.name not in state:
            raise MethodError(f"state: body {body.name!r} is missing; give all bodies of the scene")
        given = check.entries(state[body.name])
        if given is None:
            raise MethodError(f"state of {body.name!r} needs 13 numbers, not {state[body.name]!r}")
        numbers = [check.number(f"state of {body.name!r}", "each entry", value) for value in given]
        if len(numbers) != 13:
            raise MethodError(f"state of {body.name!r} needs 13 numbers, not {len(numbers)}")
        turn = check.rotation(f"state of {body.name!r}", "orientation", numbers[3:7])
        if abs(math.hypot(*numbers[3:7]) - 1.0) > ROUNDING:  # else not a bit of it may change
            numbers[3:7] = turn
        if isinstance(body, RigidBody) and body.motion == "static":
            own = [*body.position, *body.orientation, *[0.0] * 6]
            if not np.allclose(numbers, own, rtol=1e-12, atol=1e-12):
                raise MethodError(f"state: {body.name!r} is static and cannot be elsewhere")
            numbers = own
        flat += numbers
    return flat
