"""A scene of ours as an MJCF file, where that can say it: to look at by hand, or in another engine."""

from __future__ import annotations

from dataclasses import replace
from xml.dom.minidom import parseString

import mujoco

from ..couplings import Relation, Wire
from ..forces import Spring
from ..protocol import NotSupported, is_spring, unsupported
from ..scene import Scene
from .mujoco import CAREFUL, ENGINE, STIFF, start_speeds
from .mujoco_model import model, numbers

CAN = replace(  # a file has no forces but of springs and actuators, and no servo that knows its step
    ENGINE.capabilities,
    joints=ENGINE.capabilities.joints - {Relation, Wire},
    forces=frozenset({Spring}),
    armature=True,
    motors=False,
    kinematic=False,
)
START = "start"


def mjcf(scene: Scene, time_step: float) -> str:
    """The file; its keyframe "start" has the speeds of the start. Raises NotSupported with all that it cannot say, by name.

    Runge-Kutta and the stiffest contacts and ties that MuJoCo takes at this step: what comes closest to rigid ones.
    """
    lacking = unsupported(CAN, scene, {})
    if any(is_spring(CAN, row) for row in scene.constraints):
        lacking = (*lacking, "compliance of a joint")
    if lacking:
        raise NotSupported(f"MJCF, as we write it, has no place for {', '.join(lacking)}")
    option = f'timestep="{time_step!r}" integrator="RK4" {CAREFUL}'
    made = model(scene, joint_coordinates=True, option=option, row=STIFF.format(h2=2.0 * time_step))
    compiled = mujoco.MjModel.from_xml_string(made.xml)
    data = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, data)
    speeds = start_speeds(scene, made, compiled, data)
    key = f'<keyframe><key name="{START}" qpos={numbers(data.qpos)} qvel={numbers(speeds)}/></keyframe>'
    whole = made.xml.replace("\n", "").replace("</mujoco>", f"{key}</mujoco>")
    return parseString(whole).toprettyxml(indent="  ")
