"""Scenes of ours as MJCF: MuJoCo finds the same masses at the same places, and moves them alike while nothing touches."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from spook_tracker.engine.bodies import RigidBody
from spook_tracker.engine.method import Method
from spook_tracker.engine.protocol import NotSupported
from spook_tracker.engine.scene import Scene
from spook_tracker.engine.simulation import simulate
from spook_tracker.scalar_tests.catalogue import QUESTIONS
from spook_tracker.tracker.cli.main import main

mujoco: Any = pytest.importorskip(
    "mujoco", reason="the extra mujoco is not installed: pip install 'spook-tracker[mujoco]'"
)
from spook_tracker.engine.peers.mjcf import mjcf  # noqa: E402

LASTS, STEP = 0.05, 1e-4  # s
ORDER6 = Method(composition="order6")


def _example(name: str) -> Any:
    return import_module(f"spook_tracker.scalar_tests.{QUESTIONS[name]}").TEST.example()


def _sayable() -> dict[str, tuple[Scene, str]]:
    found = {}
    for name in QUESTIONS:
        example = _example(name)
        try:
            found[name] = (example.scene, mjcf(example.scene, example.time_step))
        except NotSupported:
            continue
    return found


def _moves(body: Any) -> bool:
    return not isinstance(body, RigidBody) or body.motion == "dynamic"


def test_every_scene_that_it_can_say_is_the_same_in_mujoco() -> None:
    sayable = _sayable()
    assert len(sayable) >= 37
    off: dict[str, float] = {}
    for name, (scene, text) in sayable.items():
        model = mujoco.MjModel.from_xml_string(text)
        number = {b.name: mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, b.name) for b in scene.bodies}
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS)
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
        model.opt.timestep = STEP
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_forward(model, data)
        for body in scene.bodies:
            assert data.xpos[number[body.name]] == pytest.approx(body.position, abs=1e-12), (name, body.name)
            if _moves(body):
                assert model.body_mass[number[body.name]] == pytest.approx(body.mass, rel=1e-15)
        smooth = replace(
            scene,
            contacts=False,
            constraints=tuple(
                replace(joint, limit=None) if getattr(joint, "limit", None) else joint
                for joint in scene.constraints
            ),
        )
        ours = simulate(smooth, time_step=STEP, duration=LASTS, method=ORDER6)
        mujoco.mj_step(model, data, round(LASTS / STEP))
        mujoco.mj_kinematics(model, data)
        apart = [np.abs(ours.final_state[b.name][:3] - data.xpos[number[b.name]]).max() for b in scene.bodies]
        allowed = 1e-5 if model.neq else 1e-9  # equality constraints yield
        if max(apart) > allowed:
            off[name] = float(max(apart))
    assert not off


def test_what_it_cannot_say_is_named() -> None:
    example = _example("gears")
    with pytest.raises(NotSupported, match="a motor in a joint, the joint relation, the force load"):
        mjcf(example.scene, example.time_step)


def test_the_command_prints_the_file_or_one_sentence() -> None:
    said = CliRunner().invoke(main, ["show", "double_pendulum", "--format", "mjcf"], prog_name="tracker")
    lack = CliRunner().invoke(main, ["show", "gears", "--format", "mjcf"], prog_name="tracker")

    assert said.exit_code == 0
    assert mujoco.MjModel.from_xml_string(said.output).nv == 2
    assert lack.exit_code == 2
    assert "has no place for a motor in a joint" in str(lack.exception) + lack.output
