"""An engine that is ideal: bodies as they move by the laws they are asked about, question by question."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from spook_tracker.engine import (
    Box,
    Capsule,
    CentralGravity,
    ConstraintForce,
    ContactForce,
    ConvexHull,
    Cylinder,
    Distance,
    Hinge,
    Load,
    Lock,
    Penetration,
    Plane,
    Prismatic,
    Scene,
    Sphere,
)
from spook_tracker.engine.build_info import BuildInfo
from spook_tracker.engine.protocol import Capabilities, Configuration, Task
from spook_tracker.engine.recording import Recording
from spook_tracker.scalar_tests.robots import humanoid, quadruped
from tests.oracles import constrained
from tests.oracles import ideal_contacts as contacts
from tests.oracles import ideal_motions as motions

Form = Callable[[Scene, np.ndarray], dict[str, Any]]  # a scene and times [s]: states and forces

FORMS: dict[str, Form] = {  # of each question that has a physical limit
    "beam": contacts.at_rest,
    "door": contacts.at_rest,
    "falling_object": motions.particle(motions.falling),
    "friction": contacts.on_a_slope,
    "pendulum": motions.particle(motions.swinging),
    "n_pendulum": motions.chain,
    "planetarium": motions.particle(motions.on_an_ellipse),
    "slip_angle": contacts.on_a_slope,
    "slope_grid": contacts.on_a_slope,
    "bar_pendulum": motions.bar_that_swings,
    "seconds_pendulum": motions.particle(motions.swinging),
    "bounce_grid": contacts.bouncing,
    "oblique_impact": contacts.one_blow,
    "last_bounce": contacts.bouncing,
    "resting_grid": contacts.on_each_other,
    "masonry_arch": contacts.masonry,
    "stone_bridge": contacts.masonry,
    "sorting": contacts.on_a_turntable,
    "flywheel": motions.turning,
    "rolling_beats": contacts.rolling,
    "grasp": contacts.between_fingers,
    "quadruped": contacts.on_feet(quadruped.robot()),
    "humanoid": contacts.on_feet(humanoid.robot()),
    "rover": contacts.up_steps,
    "four_bars": motions.parallel_rods,
    "squeezer": constrained.moved,
    "bricard": constrained.moved,
    "governor": motions.flyballs,
}


class Ideal:
    """Moves as its form has it."""

    name = "ideal"
    capabilities = Capabilities(
        shapes=frozenset({Box, Capsule, ConvexHull, Cylinder, Plane, Sphere}),
        joints=frozenset({Distance, Hinge, Lock, Prismatic}), forces=frozenset({CentralGravity, Load}),
        shows=frozenset({ConstraintForce, ContactForce, Penetration}), compliance=True, friction=True, restitution=True,
        tangential_restitution=True, kinematic=True, motors=True, springs=True,
    )  # fmt: skip
    configurations: tuple[Configuration, ...] = (Configuration(name="exact", reason="closed forms"),)

    def __init__(self, form: Form) -> None:
        self.form = form

    def build_info(self) -> BuildInfo:
        """It has no build."""
        return BuildInfo(self.name, "", "", False, "", (), "closed forms", "")

    def record(self, task: Task) -> Recording:
        """Bodies whose velocities or turns the form leaves out have none."""
        found = self.form(task.scene, task.samples * task.time_step)
        still = np.zeros_like(found["positions"])
        unturned = np.tile([1.0, 0.0, 0.0, 0.0], (*still.shape[:2], 1))
        told = {"velocities": still, "angular_velocities": still, "orientations": unturned, **found}
        return Recording(samples=task.samples, steps=task.steps, seconds=0.0, **told)
