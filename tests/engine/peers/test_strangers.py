"""Three numbers of three engines again, each by a stranger's own few lines: the engine's interface without our adapter.

A ball of 2 kg falls for 2 s, a pendulum of 1 m and 1 kg let go level swings for 1 s, a cube of 1 kg that .7 of its weight
pulls sideways slides for 2 s on a friction of .5; 1/60 s. Equal to the last digit that a page prints, and three further.
"""

from __future__ import annotations

import numpy as np
import pytest

from spook_tracker.engine import Final, Particle, Position, Scene
from spook_tracker.engine.find import find
from tests.scenes import peer as peer_scenes

DIGITS = 6  # pages print three
SINGLE = 4  # of what sums masses in single precision, given here by shapes
FALL = Scene(bodies=(Particle(name="ball", mass=2.0, position=(0.0, 0.0, 0.0)),), gravity=peer_scenes.GRAVITY)
SCENES = {
    "fall": (FALL, "ball", 2, 120),
    "swing": (peer_scenes.pendulum(), "weight", 0, 60),
    "slide": (peer_scenes.box_on_ground(0.7), "box", 0, 120),
}


def through_the_adapter(engine: str, scene: str, setting: str) -> str:
    world, body, axis, steps = SCENES[scene]
    end = {"end": Final(quantity=Position(body))}
    run = find(engine).simulate(world, time_step=1 / 60, steps=steps, observe=end, configuration=setting)
    return f"{run['end'][axis]:.{DIGITS}g}"


BODIES = {
    "fall": '<body><freejoint/><geom type="sphere" size=".1" mass="2"/></body>',
    "swing": '<body><joint type="hinge" axis="0 1 0"/><inertial pos="1 0 0" mass="1" diaginertia="1e-9 1e-9 1e-9"/></body>',
    "slide": '<geom type="plane" size="0 0 1" friction=".5"/><body pos="0 0 .5"><freejoint/>'
    '<geom type="box" size=".5 .5 .5" mass="1" friction=".5"/></body>',
}


@pytest.mark.parametrize("scene", SCENES)
def test_mujoco(scene: str) -> None:
    mujoco = pytest.importorskip("mujoco", reason="the extra mujoco is not installed")
    pull = 0.7 * 9.81 if scene == "slide" else 0.0
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{1 / 60!r}" gravity="{pull!r} 0 -9.81" integrator="Euler"/>'
        f'<compiler boundmass="0"/><worldbody>{BODIES[scene]}</worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    for _ in range(SCENES[scene][3]):
        mujoco.mj_step(model, data)
    mujoco.mj_kinematics(model, data)

    assert f"{data.xipos[1][SCENES[scene][2]]:.{DIGITS}g}" == through_the_adapter("mujoco", scene, "defaults")


@pytest.mark.parametrize("scene", SCENES)
def test_pybullet(scene: str) -> None:
    pytest.importorskip("pybullet", reason="the extra pybullet is not installed")
    import pybullet as p

    p.connect(p.DIRECT)
    p.setPhysicsEngineParameter(fixedTimeStep=1 / 60, numSolverIterations=500, solverResidualThreshold=0)
    p.setGravity(0.7 * 9.81 if scene == "slide" else 0.0, 0.0, -9.81)
    if scene == "swing":
        ball = p.createCollisionShape(p.GEOM_SPHERE, radius=1e-3)
        made = p.createMultiBody(0, linkMasses=[1], linkCollisionShapeIndices=[ball], linkVisualShapeIndices=[-1],
            linkPositions=[(0, 0, 0)], linkOrientations=[(0, 0, 0, 1)], linkInertialFramePositions=[(1, 0, 0)],
            linkInertialFrameOrientations=[(0, 0, 0, 1)], linkParentIndices=[0], linkJointTypes=[p.JOINT_REVOLUTE],
            linkJointAxis=[(0, 1, 0)])  # fmt: skip
        p.setJointMotorControl2(made, 0, p.VELOCITY_CONTROL, force=0)
        p.changeDynamics(made, 0, localInertiaDiagonal=(1e-9, 1e-9, 1e-9))
    else:
        half, mass, height = (0.5, 1, 0.5) if scene == "slide" else (0.1, 2, 0.0)
        if scene == "slide":
            p.changeDynamics(
                p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE)), -1, lateralFriction=0.5
            )
        box = p.createCollisionShape(p.GEOM_BOX, halfExtents=(half,) * 3)
        made = p.createMultiBody(mass, box, basePosition=(0, 0, height))
    for link in range(-1, p.getNumJoints(made)):
        p.changeDynamics(
            made, link, linearDamping=0, angularDamping=0, jointDamping=0, lateralFriction=1
        )  # Bullet multiplies the two
    for _ in range(SCENES[scene][3]):
        p.stepSimulation()
    told = (
        p.getLinkState(made, 0, computeForwardKinematics=1)[0]
        if scene == "swing"
        else p.getBasePositionAndOrientation(made)[0]
    )
    p.disconnect()

    assert f"{told[SCENES[scene][2]]:.{DIGITS}g}" == through_the_adapter("pybullet", scene, "joints")


@pytest.mark.parametrize("scene", SCENES)
def test_motrixsim(scene: str) -> None:
    """It reads the file that MuJoCo reads, and is stepped in single precision."""
    motrixsim = pytest.importorskip("motrixsim", reason="the extra motrixsim is not installed")
    pull = 0.7 * 9.81 if scene == "slide" else 0.0
    model = motrixsim.load_mjcf_str(
        f'<mujoco><option timestep="{1 / 60!r}" gravity="{pull!r} 0 -9.81"/><worldbody>{BODIES[scene]}</worldbody></mujoco>'
    )
    data = motrixsim.SceneData(model)
    model.step_n(data, SCENES[scene][3])
    model.forward_kinematic(data)
    link = list(model.links)[-1]
    place = link.get_pose(data)[:3]
    if scene == "swing":  # of a body whose place is its joint and whose centre is a metre beside
        turn = np.array(link.get_pose(data)[3:], dtype=float)
        place = [1.0 - 2.0 * float(turn[1:3] @ turn[1:3]), 0.0, 0.0]

    told = float(through_the_adapter("motrixsim", scene, "defaults"))
    assert f"{place[SCENES[scene][2]]:.{SINGLE}g}" == f"{told:.{SINGLE}g}"


@pytest.mark.parametrize("scene", SCENES)
def test_simbody(scene: str) -> None:
    """By OpenSim's own classes, to 1e-6 a step: the slide by the springs of the cube's corners."""
    osim = pytest.importorskip("opensim", reason="the extra simbody is not installed")
    osim.Logger.setLevelString("Off")
    world, mass, inertia = osim.Model(), 2.0 if scene == "fall" else 1.0, 1 / 6 if scene == "slide" else 1e-9
    world.setGravity(osim.Vec3(0.7 * 9.81 if scene == "slide" else 0.0, 0.0, -9.81))
    body = osim.Body("body", mass, osim.Vec3(0.0), osim.Inertia(inertia, inertia, inertia))
    world.addBody(body)
    level, at = osim.Vec3(-np.pi / 2.0, 0.0, 0.0), osim.Vec3(-1.0 if scene == "swing" else 0.0, 0.0, 0.0)
    kind = osim.PinJoint if scene == "swing" else osim.FreeJoint
    joint = kind("joint", world.getGround(), osim.Vec3(0.0), level, body, at, level)
    world.addJoint(joint)
    corners = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, 8).T if scene == "slide" else ()
    for number, (x, y, z) in enumerate(corners):
        low = osim.Transform(osim.Vec3(0.0, 0.0, -0.5))  # the cube begins at the origin of its joint
        spring = osim.ExponentialContactForce(low, body, osim.Vec3(float(x), float(y), float(z)))
        spring.setName(f"corner {number}".replace(" ", ""))
        pull = float(np.hypot(0.7, 1.0)) * 9.81 / 4.0
        spring.setExponentialShapeParameters(osim.Vec3(0.0, pull, 1e4))
        spring.setNormalViscosity(20.0)
        spring.setFrictionElasticity(1e5)
        spring.setFrictionViscosity(1e5**0.5)
        spring.setInitialMuStatic(0.5)
        spring.setInitialMuKinetic(0.5)
        world.addForce(spring)
    state = world.initSystem()
    run = osim.Manager(world)
    run.setIntegratorAccuracy(1e-6)
    run.setIntegratorMaximumStepSize(1 / 60)
    run.setWriteToStorage(False)
    run.initialize(state)
    state = run.integrate(SCENES[scene][3] / 60)
    told = body.getPositionInGround(state).get(SCENES[scene][2])

    assert f"{told:.{DIGITS}g}" == through_the_adapter("simbody", scene, "merson")


@pytest.mark.parametrize("scene", SCENES)
def test_sapien(scene: str) -> None:
    pytest.importorskip("sapien", reason="the extra sapien is not installed")
    import sapien
    from sapien import physx

    setting = physx.PhysxSceneConfig()
    setting.gravity, setting.enable_tgs = (0.7 * 9.81 if scene == "slide" else 0.0, 0.0, -9.81), True
    physx.set_scene_config(setting)
    still = physx.PhysxBodyConfig()
    still.sleep_threshold, still.solver_position_iterations = 0.0, 10
    physx.set_body_config(still)
    world = physx.PhysxCpuSystem()
    world.timestep = 1 / 60
    place = sapien.Scene([world])
    rough = physx.PhysxMaterial(0.5, 0.5, 0.0)
    body = physx.PhysxRigidDynamicComponent()
    if scene == "slide":
        ground, under = physx.PhysxRigidStaticComponent(), sapien.Entity()
        ground.attach(physx.PhysxCollisionShapePlane(rough))
        under.add_component(ground)
        under.set_pose(sapien.Pose((0, 0, 0), (0.7071068, 0, -0.7071068, 0)))
        place.add_entity(under)
        body.attach(physx.PhysxCollisionShapeBox((0.5, 0.5, 0.5), rough))
    body.mass, body.inertia = (
        2.0 if scene == "fall" else 1.0,
        (1 / 6,) * 3 if scene == "slide" else (1e-6,) * 3,
    )
    body.cmass_local_pose = sapien.Pose()
    body.linear_damping = body.angular_damping = 0.0
    body.max_angular_velocity = 1e7
    made = sapien.Entity()
    made.add_component(body)
    made.set_pose(sapien.Pose({"fall": (0, 0, 0), "swing": (1, 0, 0), "slide": (0, 0, 0.5)}[scene]))
    place.add_entity(made)
    if scene == "swing":
        rod = physx.PhysxDistanceJointComponent(body)
        rod.set_limit(1.0, 1.0)
        rod.pose_in_parent, rod.pose_in_child = sapien.Pose((0, 0, 0)), sapien.Pose()
        made.add_component(rod)
    for _ in range(SCENES[scene][3]):
        world.step()

    assert f"{made.pose.p[SCENES[scene][2]]:.{DIGITS}g}" == through_the_adapter("sapien", scene, "defaults")
