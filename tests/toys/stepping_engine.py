"""Another team's engine behind the protocol: falling bodies by the symplectic step, a page long."""

from __future__ import annotations

import os

import numpy as np

from spook_tracker.engine.build_info import BuildInfo
from spook_tracker.engine.protocol import Capabilities, Configuration, Task
from spook_tracker.engine.recording import Recording


class Stepping:
    """The adapter."""

    name = "stepping"
    gating = os.environ.get("STEPPING_GATES") == "1"
    capabilities = Capabilities()
    configurations = (
        Configuration(name="late", reason="velocity first", expected_order=1.0),
        Configuration(name="middle", reason="half a kick first", options={"kick": 0.5}),
    )

    def build_info(self) -> BuildInfo:
        return BuildInfo(self.name, "1.2.3", "", False, "", (), "none", "")

    def record(self, task: Task) -> Recording:
        steps, h, scene = task.steps, task.time_step, task.scene
        samples = np.arange(steps + 1) if task.every_step else np.array([0, steps])
        n, gravity = len(scene.bodies), np.array(scene.gravity)
        where = np.array([body.position for body in scene.bodies])
        speed = np.array([body.velocity for body in scene.bodies])
        late = task.configuration.options.get("kick", 1.0) * h * gravity
        t = samples[:, None, None] * h
        return Recording(
            samples=samples,
            positions=where + t * speed + 0.5 * t * (t - h) * gravity + t * late,
            velocities=np.broadcast_to(speed + t * gravity, (len(samples), n, 3)),
            orientations=np.tile([1.0, 0.0, 0.0, 0.0], (len(samples), n, 1)),
            angular_velocities=np.zeros((len(samples), n, 3)),
            steps=steps,
            seconds=1e-9 * steps,
        )


ENGINE = Stepping()
