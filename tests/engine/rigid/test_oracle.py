"""The rigid step is the dense solve of the SPOOK equations, for every joint, in trees and loops, with all extras."""

from __future__ import annotations

import numpy as np
import pytest

from spook_tracker.engine import (
    PLAIN,
    AngularVelocity,
    ConstraintForce,
    Distance,
    Hinge,
    JointCoordinate,
    Method,
    Orientation,
    Position,
    Prismatic,
    Scene,
    Trace,
    Velocity,
    Violation,
    simulate,
)
from spook_tracker.engine.observe import Observable
from tests.oracles.rigid import RigidOracle
from tests.scenes.rigid import JOINTS, TIME_STEP, everything, loop, one_joint, tree


def largest_differences(
    scene: Scene, steps: int, method: Method | None = None, oracle: RigidOracle | None = None
) -> dict[str, float]:
    """Largest difference of states, violations [m, rad] and forces (relative) over all samples."""
    observe: dict[str, Observable] = {
        "position": Trace(quantity=Position()),
        "orientation": Trace(quantity=Orientation()),
        "velocity": Trace(quantity=Velocity()),
        "spin": Trace(quantity=AngularVelocity()),
    }
    for c in scene.constraints:
        observe[f"violation of {c.name}"] = Trace(quantity=Violation(c.name))
        observe[f"force of {c.name}"] = Trace(quantity=ConstraintForce(c.name))
        if isinstance(c, Hinge | Prismatic):
            observe[f"coordinate of {c.name}"] = Trace(quantity=JointCoordinate(c.name))
    method = method or PLAIN
    run = simulate(scene, time_step=TIME_STEP, steps=steps, observe=observe, method=method)
    dense = oracle or RigidOracle(scene, TIME_STEP / method.substeps)
    worst: dict[str, float] = {}

    def note(name: str, difference: np.ndarray | float, scale: float = 1.0) -> None:
        worst[name] = max(worst.get(name, 0.0), float(np.max(np.abs(difference))) / scale)

    for k in range(1, steps + 1):
        for _ in range(method.substeps):
            dense.step()
        note("position", run["position"][k] - dense.x)
        sign = np.sign(np.sum(run["orientation"][k] * dense.q, axis=1))[:, None]
        note("orientation", sign * run["orientation"][k] - dense.q)
        note("velocity", run["velocity"][k] - dense.v)
        moving = dense.free & [hasattr(body, "orientation") for body in scene.bodies]
        note("spin", (run["spin"][k] - dense.angular_velocity())[moving])
        for joint, impulse, load in zip(dense.joints, dense.impulses, dense.loads, strict=True):
            name, scale = joint.constraint.name, 1.0 + float(np.abs(load).max())
            note("violation", run[f"violation of {name}"][k] - joint.violation(dense.x, dense.q, dense))
            tension = isinstance(joint.constraint, Distance)
            exact = -impulse[0] / dense.h if tension else load
            note("force", run[f"force of {name}"][k] - exact, scale)
            if f"coordinate of {name}" in observe:
                note(
                    "coordinate",
                    run[f"coordinate of {name}"][k] - joint.coordinate(dense.x, dense.q, dense)[0],
                )
    return worst


def assert_equal(scene: Scene, steps: int = 12, method: Method | None = None) -> None:
    worst = largest_differences(scene, steps, method)
    assert max(worst.values()) < 1e-10, worst


@pytest.mark.parametrize("bodies", [1, 2])
@pytest.mark.parametrize("kind", JOINTS)
def test_each_joint_alone(kind: str, bodies: int) -> None:
    assert_equal(one_joint(np.random.default_rng(1), kind, bodies), steps=25)


@pytest.mark.parametrize("kind", [kind for kind in JOINTS if kind != "distance"])
def test_a_joint_named_from_the_other_end(kind: str) -> None:
    """The world may stand second; then forces are those on the world."""
    assert_equal(one_joint(np.random.default_rng(2), kind, 1, backwards=True))


@pytest.mark.parametrize("seed", range(3))
def test_trees_of_mixed_joints(seed: int) -> None:
    assert_equal(tree(np.random.default_rng(seed)))


@pytest.mark.parametrize("seed", range(3))
def test_loops_of_mixed_joints(seed: int) -> None:
    assert_equal(loop(np.random.default_rng(seed)))


@pytest.mark.parametrize("seed", range(2))
def test_motors_springs_loads_particles_and_static_bodies(seed: int) -> None:
    assert_equal(everything(np.random.default_rng(seed)))


def test_substeps_are_smaller_steps() -> None:
    assert_equal(tree(np.random.default_rng(7)), steps=5, method=Method(substeps=3, turns="linear"))


def test_the_comparison_is_sharp() -> None:
    """A single degree of freedom of one joint a tenth more compliant is seen in one step."""
    scene = one_joint(np.random.default_rng(3), "lock", 2)
    wrong = RigidOracle(scene, TIME_STEP)
    lock = scene.constraints[0]
    softer = tuple(1.1 * eps if i == 4 else eps for i, eps in enumerate(lock.compliance))  # type: ignore[arg-type]
    wrong.joints[0].constraint = type(lock)(
        name=lock.name,
        between=lock.between,
        compliance=softer,
        damping=lock.damping,  # type: ignore[call-arg, arg-type]
    )

    assert max(largest_differences(scene, 1, oracle=wrong).values()) > 1e-8
