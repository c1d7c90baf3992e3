"""MuJoCo Warp, by its Python package: MuJoCo's equations as kernels of Warp, in single precision, on its CPU device.

Its makers offer that device for development, and a GPU for speed. The model is the one our adapter of MuJoCo makes, without
what MuJoCo Warp lacks (no-slip sweeps); a step is replayed as a graph. Compilation counts as setting up.
"""

from __future__ import annotations

import time
from importlib.metadata import version
from typing import Any

import mujoco

from ..build_info import BuildInfo
from ..forces import Load
from ..joints import Ball, Distance, Hinge, Lock, Prismatic, Universal
from ..observe import ContactCount, Penetration
from ..protocol import Capabilities, Configuration, NotSupported, Task, Worlds
from ..recording import Recording
from ..shapes import Box, Capsule, Cylinder, Plane, Sphere
from . import mujoco as through_c
from .stepped import stepped
from .warp_graph import MADE, overflowed, replayed, room, silent

with silent():
    import mujoco_warp


CAREFUL = 'cone="elliptic" impratio="100" tolerance="1e-6" iterations="100"'


class MuJoCoWarp:
    """The adapter."""

    name = "mujoco_warp"
    capabilities = Capabilities(
        shapes=frozenset({Sphere, Box, Capsule, Cylinder, Plane}),
        joints=frozenset({Distance, Lock, Ball, Hinge, Prismatic, Universal}),
        forces=frozenset({Load}),
        shows=frozenset({ContactCount, Penetration}),
        friction=True,
        rolling_friction=True,
        joint_friction=True,
        absent=frozenset(
            {"restitution", "compliance of a surface", "the shape triangle mesh", "the force fluid"}
        ),
    )
    configurations = (
        Configuration(
            name="rk4",
            reason="as of MuJoCo, without its no-slip sweeps, which MuJoCo Warp has not, and to the tolerance that it says "
            "single precision can have",
            expected_order=4.0,
            options={"joints": True, "option": f'integrator="RK4" {CAREFUL}', "stiff": True},
        ),
        Configuration(
            name="defaults",
            reason="joint coordinates, semi-implicit Euler and soft contacts: what one gets without asking",
            expected_order=1.0,
            options={"joints": True, "option": 'integrator="Euler"', "stiff": False},
        ),
    )

    def build_info(self) -> BuildInfo:
        return BuildInfo(self.name, version("mujoco-warp"), "", False, "", (), MADE, "")

    def record(self, task: Task) -> Recording:
        with silent():
            began = time.perf_counter()
            run = _Run(task)
            return stepped(task, run.step, run._read, time.perf_counter() - began, run.health)

    def worlds(self, task: Task, count: int) -> Worlds:
        """Copies of the state beside one model."""
        with silent():
            began = time.perf_counter()
            run = _Run(task, count)
            setup, began = time.perf_counter() - began, time.perf_counter()
            run.step(task.steps)
            took = time.perf_counter() - began
            if told := run.health():
                raise NotSupported(told)
            mujoco_warp.kinematics(run.kernels, run.state)
            return Worlds(positions=run.state.xpos.numpy()[:, run.ids], seconds=took, setup_seconds=setup)


class _Run(through_c._Run):
    """MuJoCo's model, stepped by MuJoCo Warp and read where it came to."""

    def __init__(self, task: Task, count: int = 1) -> None:
        super().__init__(task)
        self.count = count
        try:
            self.kernels = mujoco_warp.put_model(self.model)
        except NotImplementedError as error:
            raise NotSupported(f"mujoco_warp does not support {' '.join(str(error).split())[:200]}") from None
        self.state = self._put()
        self.launch = replayed(lambda: mujoco_warp.step(self.kernels, self.state))

    def _put(self) -> Any:
        bodies = self.model.nbody if self.task.scene.contacts else 0
        sizes = room(bodies, self.model.nv, int(self.data.nefc))
        return mujoco_warp.put_data(self.model, self.data, nworld=self.count, **sizes)

    def health(self) -> str:
        """Nothing, or what it had no room for."""
        return overflowed(self.state)

    def step(self, count: int) -> None:
        for _ in range(count):
            self.launch()

    def _read(self, keep: Any, place: int, sample: int) -> None:
        self.data.qpos[:], self.data.qvel[:] = self.state.qpos.numpy()[0], self.state.qvel.numpy()[0]
        if self.task.contacts and sample:
            mujoco.mj_forward(self.model, self.data)  # contacts as they are where it came to
        super()._read(keep, place, sample)


ENGINE = MuJoCoWarp()
