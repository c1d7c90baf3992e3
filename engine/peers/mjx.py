"""MuJoCo XLA, by its Python package: MuJoCo's equations compiled by JAX, on the CPU, in double precision.

The model is the one our adapter of MuJoCo makes, without what MJX lacks (no-slip sweeps); all steps between two looks are
one compiled loop. Compilation counts as setting up: a scene of the same make at another step is compiled once.
"""

from __future__ import annotations

import time
from importlib.metadata import version
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from mujoco import mjx

from ..build_info import BuildInfo
from ..forces import Load
from ..joints import Ball, Distance, Hinge, Lock, Prismatic, Universal
from ..observe import ContactCount, Penetration
from ..protocol import Capabilities, Configuration, NotSupported, Task, Worlds
from ..recording import Recording
from ..shapes import Box, Capsule, Plane, Sphere
from . import mujoco as through_c
from .stepped import quiet, stepped

jax.config.update("jax_enable_x64", True)
CAREFUL = 'cone="elliptic" impratio="100" tolerance="1e-12" iterations="200"'


class MJX:
    """The adapter."""

    name = "mjx"
    capabilities = Capabilities(
        shapes=frozenset({Sphere, Box, Capsule, Plane}),
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
            reason="as of MuJoCo, without its no-slip sweeps, which MJX has not",
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
        installed = version("mujoco-mjx")
        made = f"wheel from the package index, float64, {jax.default_backend()} by JAX {jax.__version__}"
        return BuildInfo(self.name, installed, "", False, "", (), made, "")

    def record(self, task: Task) -> Recording:
        with quiet():
            began = time.perf_counter()
            run = _Run(task)
            return stepped(task, run.step, run._read, time.perf_counter() - began)

    def worlds(self, task: Task, count: int) -> Worlds:
        """Copies of the state, mapped over by JAX."""
        with quiet():
            began = time.perf_counter()
            run = _Run(task)
            state = jax.tree.map(lambda one: jnp.repeat(one[None], count, axis=0), run.state)
            jax.block_until_ready(_many(run.compiled, state, 0))
            setup, began = time.perf_counter() - began, time.perf_counter()
            state = jax.block_until_ready(_many(run.compiled, state, task.steps))
            took = time.perf_counter() - began
            places = jax.vmap(mjx.kinematics, in_axes=(None, 0))(run.compiled, state).xpos
            return Worlds(positions=np.array(places)[:, run.ids], seconds=took, setup_seconds=setup)


class _Run(through_c._Run):
    """MuJoCo's model, stepped by MJX and read where it came to."""

    def __init__(self, task: Task) -> None:
        super().__init__(task)
        try:
            state = mjx.put_data(self.model, self.data)
            if not np.any(np.asarray(state._impl.contact.dim) > 1):
                self.model.opt.cone = (
                    mujoco.mjtCone.mjCONE_PYRAMIDAL
                )  # MJX 3.17 breaks off at cones of no contact
            self.compiled = mjx.put_model(self.model)
            self.state = _as_steps_leave_it(self.compiled, state)
            self.state = _steps(self.compiled, self.state, 0)
        except NotImplementedError as error:
            raise NotSupported(f"mjx does not support {' '.join(str(error).split())[:200]}") from None

    def step(self, count: int) -> None:
        self.state = jax.block_until_ready(_steps(self.compiled, self.state, count))

    def _read(self, keep: Any, place: int, sample: int) -> None:
        self.data.qpos[:], self.data.qvel[:] = np.array(self.state.qpos), np.array(self.state.qvel)
        if self.task.contacts and sample:
            mujoco.mj_forward(self.model, self.data)  # contacts as they are where it came to
        super()._read(keep, place, sample)


def _as_steps_leave_it(model: Any, state: Any) -> Any:
    """Numbers of surfaces that touch are put as int32 and stepped to int64 where floats have 64 bits: no loop takes both."""
    after = jax.eval_shape(mjx.step, model, state)
    return jax.tree.map(lambda one, other: one.astype(other.dtype), state, after)


def _loop(model: Any, state: Any, count: int) -> Any:
    return jax.lax.fori_loop(0, count, lambda _, now: mjx.step(model, now), state)


_steps = jax.jit(_loop)
_many = jax.jit(jax.vmap(_loop, in_axes=(None, 0, None)))
ENGINE = MJX()
