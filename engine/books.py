"""The books of a run: what energy came in, was dissipated, or is explained by neither; impacts stopped; the largest turn.

They are kept where asked, `simulate(books=True)`, since they trace every step: some 24 bytes for each body and step. From
sample to sample the change of T + V is work and a rest.

    work      Σ h F · (v + v₊)/2 of loads, and of what motors push along or about their axis; what they take is dissipated
    rest < 0  dissipated where something may take it: contacts that touch, limits, friction, viscosity, fluids, tyres, wires,
              what breaks or falls asleep; else unexplained
    rest > 0  came in where something without books of its own may give it: bodies and surfaces that are led, fluids, motors
              beside springs; else unexplained

So E − E₀ = energy_in − dissipated + unexplained. Unexplained is what the method errs by: a loss of joints whose rows are
linearised, what steps make that are too long. Of plain steps, whose places and velocities lie half a step apart, T + V of a
fall sinks by ½ m g² h² a step, and comes back where it turns round; for what is made out of nothing the mean of the last
two V is taken, which does not.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from .bodies import Particle, RigidBody
from .check import Vector
from .couplings import Wire
from .forces import Fluid, Load, Spring
from .joints import AxialJoint, Hinge, Joint, frictions
from .method import Method
from .observe import (
    AngularVelocity,
    ConstraintForce,
    ContactCount,
    JointCoordinate,
    KineticEnergy,
    Observable,
    Orientation,
    PotentialEnergy,
    Quantity,
    Trace,
    Velocity,
)
from .result import Books, Result
from .scene import Scene
from .tyres import Tyre

Array = npt.NDArray[np.float64]
MOST_MADE = 0.05  # of the largest kinetic energy, as energy_made.hpp has it
ROUNDING = 1e-9  # of the energy, which counts heights from anywhere
PREFIX = "books: "


def traces(scene: Scene) -> dict[str, Observable]:
    """What a run has to be asked for its books to be kept."""
    asked: dict[str, Quantity] = {"T": KineticEnergy(), "V": PotentialEnergy(), "touching": ContactCount()}
    if any(isinstance(body, RigidBody) for body in scene.bodies):
        asked["spin"] = AngularVelocity()
    for load in _loads(scene):
        asked[f"v {load.body}"] = Velocity(load.body)
        if any(load.torque):
            asked[f"w {load.body}"] = AngularVelocity(load.body)
    for joint in _driven(scene):
        asked[f"force {joint.name}"] = ConstraintForce(joint.name)
        asked[f"coordinate {joint.name}"] = JointCoordinate(joint.name)
        if joint.between[0] in _moving(scene):
            asked[f"turn {joint.name}"] = Orientation(str(joint.between[0]))
    return {PREFIX + name: Trace(quantity=quantity) for name, quantity in asked.items()}


def kept(scene: Scene, method: Method, result: Result) -> Result:
    """The result with its books, and without their traces. What made much out of nothing is unsettled."""
    seen = {name.removeprefix(PREFIX): values for name, values in result.observables.items() if _ours(name)}
    kinetic, potential = seen["T"].ravel(), seen["V"].ravel()
    steps = min(len(kinetic), len(potential), len(seen["touching"])) - 1
    kinetic, potential, h = kinetic[: steps + 1], potential[: steps + 1], result.time_step
    loads, motors = _work_of_loads(scene, method, seen, steps, h), _work_of_motors(scene, seen, steps, h)
    rest = np.diff(kinetic + potential) - loads - motors
    takes = (seen["touching"].ravel()[1 : steps + 1] > 0) | _takes(scene, method)
    gives = np.full(steps, _gives(scene))

    def neither(rest: Array) -> Array:
        return np.where(np.where(rest > 0.0, gives, takes), 0.0, rest)

    unexplained = neither(rest)
    spins = np.linalg.norm(seen["spin"], axis=-1) if "spin" in seen else np.zeros(1)
    books = Books(
        energy_in=float(loads.sum() + motors[motors > 0.0].sum() + rest[(rest > 0.0) & gives].sum()),
        dissipated=-float(motors[motors < 0.0].sum() + rest[(rest < 0.0) & takes].sum()),
        unexplained=float(unexplained.sum()),
        stopped_impacts=result.counters.get("stopped_impacts", 0),
        largest_turn=float(h * spins.max(initial=0.0)),
    )
    left = {name: values for name, values in result.observables.items() if not _ours(name)}
    times = {name: values for name, values in result.sample_times.items() if not _ours(name)}
    told = replace(result, books=books, observables=left, sample_times=times)
    between = method.composition == method.runge_kutta == "none" and not method.half_step_velocities
    if (
        between
    ):  # where something takes all the time, what a fall comes short of by half a step is not dissipated
        rest = rest - 0.5 * np.diff(np.diff(potential), prepend=potential[1] - potential[0])
    running = np.cumsum(neither(rest))
    return _judged(told, scene, running, kinetic, float(kinetic[0] + potential[0]))


def _judged(result: Result, scene: Scene, running: Array, kinetic: Array, begun: float) -> Result:
    """Unsettled where more was made, since the first step, than a share of the largest kinetic energy and a step's fall."""
    if result.status != "completed" or len(running) < 2:
        return result
    fall = result.time_step * float(np.linalg.norm(scene.gravity))
    least = ROUNDING * abs(begun) + fall**2 * sum(body.mass or 0.0 for body in _dynamic(scene))
    made = running - running[0]
    beyond = np.flatnonzero(made > MOST_MADE * kinetic.max() + least)
    if not len(beyond):
        return result
    step = int(beyond[0]) + 1
    return replace(
        result,
        status="unsettled",
        failed_step=step,
        failure=f"unsettled since step {step}: {made.max():.3g} J came out of nothing, of {kinetic.max():.3g} J at most; take smaller steps",
    )


def _work_of_loads(scene: Scene, method: Method, seen: Mapping[str, Array], steps: int, h: float) -> Array:
    """[J] a step. A load is that of where the step begins, but for a method that follows the time within it."""
    work, follows = np.zeros(steps), method.runge_kutta != "none"
    for load in _loads(scene):
        factors = np.array([load.factor(h * k) if load.factor else 1.0 for k in range(steps + 1)])

        def speeds(name: str, body: str = load.body) -> Array:
            told = seen[f"{name} {body}"][: steps + 1]
            return told if follows else _mean(told)

        power = speeds("v") @ np.array(load.force)
        if any(load.torque):
            power = power + speeds("w") @ np.array(load.torque)
        work += h * (_mean(factors * power) if follows else factors[:-1] * power)
    return work


def _work_of_motors(scene: Scene, seen: Mapping[str, Array], steps: int, h: float) -> Array:
    """[J] a step, by what a driven joint carries along or about its axis and how far it moved in this and the last step."""
    work = np.zeros(steps)
    for joint in _driven(scene):
        axis = np.array(joint.axis) / np.linalg.norm(joint.axis)
        force = seen[f"force {joint.name}"][1 : steps + 1]
        force = force[:, 3:] if isinstance(joint, Hinge) else force[:, :3]
        if f"turn {joint.name}" in seen:
            turns = seen[f"turn {joint.name}"][:steps]
            axes = _turned(turns, _turned(turns[:1] * [1.0, -1.0, -1.0, -1.0], axis[None])[0][None])
        else:
            axes = np.broadcast_to(axis, (steps, 3))
        moved = np.diff(seen[f"coordinate {joint.name}"].ravel()[: steps + 1])
        first = [_rate_at_start(scene, joint, axis) * h]
        work += np.einsum("sk,sk->s", force, axes) * _mean(np.concatenate([first, moved]))
    return work


def _rate_at_start(scene: Scene, joint: AxialJoint, axis: Array) -> float:
    """Of its coordinate [rad/s or m/s], but for what turning bodies add to a slide."""
    rates = []
    for end in joint.between:
        body = next((body for body in scene.bodies if body.name == end), None)
        speed: Vector = (0.0, 0.0, 0.0)
        if isinstance(body, RigidBody):
            speed = body.angular_velocity if isinstance(joint, Hinge) else body.velocity
        rates.append(float(axis @ np.array(speed)))
    return rates[1] - rates[0]


def _turned(turns: Array, vectors: Array) -> Array:
    """Vectors (s, 3) or (1, 3) turned by unit quaternions (s, 4)."""
    scalar, vector = turns[:, :1], turns[:, 1:]
    across = np.cross(vector, vectors)
    return np.asarray(vectors + 2.0 * (scalar * across + np.cross(vector, across)))


def _mean(values: Array) -> Array:
    return np.asarray(0.5 * (values[1:] + values[:-1]))


def _ours(name: str) -> bool:
    return name.startswith(PREFIX)


def _dynamic(scene: Scene) -> Iterator[Particle | RigidBody]:
    return (body for body in scene.bodies if isinstance(body, Particle) or body.motion == "dynamic")


def _moving(scene: Scene) -> set[str]:
    return {body.name for body in scene.bodies if isinstance(body, RigidBody) and body.motion != "static"}


def _loads(scene: Scene) -> list[Load]:
    return [force for force in scene.forces if isinstance(force, Load)]


def _driven(scene: Scene) -> list[AxialJoint]:
    """Joints whose axis carries what a motor pushes, and no spring."""
    axial = (joint for joint in scene.constraints if isinstance(joint, AxialJoint))
    return [joint for joint in axial if joint.motor is not None and joint.spring is None]


def _gives(scene: Scene) -> bool:
    """Whether something gives energy that has no book of its own."""
    led = any(
        any(body.surface_velocity)
        or (
            body.motion == "kinematic"
            and (body.follows_time or any((*body.velocity, *body.angular_velocity)))
        )
        for body in scene.bodies
        if isinstance(body, RigidBody)
    )
    sprung = any(
        joint.spring is not None
        and (
            joint.motor is not None
            or joint.spring.max_force is not None
            or not isinstance(joint.spring.rest, float)
        )
        for joint in scene.constraints
        if isinstance(joint, AxialJoint)
    )
    return led or sprung or any(isinstance(force, Fluid) for force in scene.forces)


def _takes(scene: Scene, method: Method) -> bool:
    """Whether something may dissipate energy at any time."""
    for joint in scene.constraints:
        if isinstance(joint, Wire | Tyre) or any(any(part) for part in frictions(joint)):
            return True
        if isinstance(joint, AxialJoint) and (joint.limit is not None or joint.spring is not None):
            return True
        if isinstance(joint, Joint) and (joint.strength or joint.torque_strength) is not None:
            return True
    viscous = any(isinstance(force, Spring) and force.viscosity > 0.0 for force in scene.forces)
    return viscous or method.sleep_speed > 0.0 or _gives(scene)
