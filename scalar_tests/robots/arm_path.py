"""Do torques computed from a path lead a six-joint arm along it, and do drives at their limits let it fall as they must?"""

from __future__ import annotations

import functools
import math
from dataclasses import replace
from typing import Any

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable

from .. import case
from ..bracket import break_point, unbroken
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import line, told
from .robot_arm import POSES, inverse_dynamics, kinematics
from .robot_arm import scene as driven

JOINTS = range(6)
AMPLITUDE = np.array((0.5, 0.4, -0.6, 0.7, 0.5, -0.9))  # rad
RATE = 3.0  # rad/s
DURATION = 0.5  # s
KNOTS = 120  # of the tables of torques
TIME_STEP = 1.0 / 60.0  # s
FINE = 1e-3  # s, of the driven arm
READ = (0.2, 0.4)  # s, when its torques are read
WEAK = {1: 40.0, 2: 10.0}  # N m, bounds of the drives of the second and the third joint
FALL = 15  # steps
STILL = np.zeros(6)
NUDGE = 1e-6  # rad, of every joint
SWINGS = 16  # steps
FASTEST = 2.0 * (math.sqrt(2.0) - 1.0) / TIME_STEP  # rad/s, of a critical correction once a step


def path(time: float) -> tuple[Any, Any, Any]:
    """Angles, speeds and accelerations wanted at a time."""
    return (
        AMPLITUDE * (1.0 - math.cos(RATE * time)),
        AMPLITUDE * RATE * math.sin(RATE * time),
        AMPLITUDE * RATE**2 * math.cos(RATE * time),
    )


def drives(motors: list[engine.Motor | None], pose: Any = POSES[0], speeds: Any = STILL) -> engine.Scene:
    """The arm of the other question in a pose, its joints turning at these speeds, with these drives."""
    still = driven(pose, speeds)
    joints = (joint for joint in still.constraints if isinstance(joint, engine.Hinge))
    return replace(
        still,
        constraints=tuple(replace(joint, motor=one) for joint, one in zip(joints, motors, strict=True)),
    )


@functools.cache
def led() -> engine.Scene:
    """No drives: the torques of inverse dynamics along the path as loads; what drives a joint pushes back the link before."""
    times = [DURATION * k / KNOTS for k in range(KNOTS + 1)]
    pushes = np.zeros((len(times), 6, 3))
    for row, time in zip(pushes, times, strict=True):
        torques, _, _ = inverse_dynamics(*path(time))
        for k, (_, axis, _, _) in enumerate(kinematics(path(time)[0])):
            row[k] += torques[k] * axis
            if k > 0:
                row[k - 1] -= torques[k] * axis
    loads = tuple(
        engine.Load(
            name=f"torque {k + 1} {'xyz'[c]}",
            body=f"link {k + 1}",
            torque=(float(c == 0), float(c == 1), float(c == 2)),
            factor=engine.Table(tuple(times), tuple(pushes[:, k, c])),
        )
        for k in JOINTS
        for c in range(3)
    )
    return replace(drives([None] * 6), forces=loads)


@functools.cache
def guided() -> engine.Scene:
    """Drives that follow the speeds of the path."""
    return drives(
        [
            engine.Motor(speed=engine.Sinusoid(amplitude=a * RATE, frequency=RATE / (2.0 * math.pi)))
            for a in AMPLITUDE
        ]
    )


@functools.cache
def falling(share: float = 1.0) -> engine.Scene:
    """Held in the second pose by drives of which two are too weak, and may carry `share` of their bounds."""
    bounds = {k: share * bound for k, bound in WEAK.items()}
    return drives([engine.Motor(speed=0.0, max_force=bounds.get(k)) for k in JOINTS], POSES[1])


ANGLES: dict[str, Observable] = {
    f"q{k}": engine.Trace(quantity=engine.JointCoordinate(f"joint {k + 1}")) for k in JOINTS
}


def angles(result: engine.Result) -> Any:
    """Of the joints, at every sample [rad]."""
    return np.stack([result[f"q{k}"] for k in JOINTS], axis=1)


def strays(simulate: case.Simulate, time_step: float, method: engine.Method = engine.PLAIN) -> Any:
    """How far every joint is from the path, at every step [rad]."""
    result = simulate(led(), time_step=time_step, duration=DURATION, method=method, observe=ANGLES)
    return angles(result) - np.array([path(time)[0] for time in result.sample_times["q0"]])


def lead(simulate: case.Simulate) -> dict[str, float]:
    """Half a second along the path by torques alone."""
    return {"path_error": float(np.abs(strays(simulate, TIME_STEP)).max())}


def guide(simulate: case.Simulate) -> dict[str, float]:
    """The drives' torques on the path, which speeds up and slows down."""
    observe: dict[str, Observable] = {
        f"{k}": engine.Trace(quantity=engine.ConstraintForce(f"joint {k + 1}")) for k in JOINTS
    }
    result = simulate(guided(), time_step=FINE, duration=max(READ), observe=observe)
    worst = 0.0
    for time in READ:
        right, _, _ = inverse_dynamics(*path(time))
        axes = [axis for _, axis, _, _ in kinematics(path(time)[0])]
        found = [axes[k] @ result[f"{k}"][round(time / FINE), 3:] for k in JOINTS]
        worst = max(worst, float(np.abs(found - right).max() / np.abs(right).max()))
    return {"torque_error": worst}


def late() -> float:
    """Two steps' change of the torques on the path, over the largest torque."""
    worst = 0.0
    for time in READ:
        now, before = (inverse_dynamics(*path(t))[0] for t in (time, time - 2.0 * FINE))
        worst = max(worst, float(np.abs(now - before).max() / np.abs(now).max()))
    return worst


def released(simulate: case.Simulate, share: float = 1.0) -> tuple[Any, float]:
    """Angles in a quarter of a second with two drives at so much of their bounds, and how far their torques are from that,
    relative to it."""
    observe = ANGLES | {f"{k}": engine.Trace(quantity=engine.ConstraintForce(f"joint {k + 1}")) for k in WEAK}
    result = simulate(falling(share), time_step=TIME_STEP, steps=FALL, observe=observe)
    turned, worst = angles(result), 0.0
    for step in range(1, FALL + 1):
        arm = kinematics(np.asarray(POSES[1]) + turned[step - 1])
        for k, bound in WEAK.items():
            torque = float(arm[k][1] @ result[f"{k}"][step, 3:])
            worst = max(worst, abs(abs(torque) / (share * bound) - 1.0))
    return turned, worst


def fall(simulate: case.Simulate) -> dict[str, float]:
    """The drives' torques, and how far their joints and the others have turned."""
    turned, worst = released(simulate)
    held = [k for k in JOINTS if k not in WEAK]
    return {
        "bound_error": worst,
        "fall_error": float(np.abs(turned[-1, list(WEAK)] - fallen()[0]).max()),
        "held_error": float(np.abs(turned[:, held]).max()),
    }


def gained(turned: Any, speeds: Any) -> Any:
    """Accelerations [rad/s²] of the weak joints under their bounds, the others held: inverse dynamics' columns, solved."""
    free = list(WEAK)
    pose, moving = np.array(POSES[1]), np.zeros(6)
    pose[free] += turned
    moving[free] = speeds
    bias = inverse_dynamics(pose, moving, STILL)[0][free]
    rest = inverse_dynamics(pose, STILL, STILL)[0][free]
    units = [inverse_dynamics(pose, STILL, np.eye(6)[k])[0][free] - rest for k in free]
    return np.linalg.solve(np.array(units).T, np.array([-bound for bound in WEAK.values()]) - bias)


@functools.cache
def fallen() -> tuple[Any, Any]:
    """How far the weak joints have turned at the end [rad] and how fast they turn, by Runge and Kutta."""
    q, v, h = np.zeros(2), np.zeros(2), 0.2 * FALL * TIME_STEP
    for _ in range(5):
        a1 = gained(q, v)
        a2 = gained(q + 0.5 * h * v, v + 0.5 * h * a1)
        a3 = gained(q + 0.5 * h * v + 0.25 * h * h * a1, v + 0.5 * h * a2)
        a4 = gained(q + h * v + 0.5 * h * h * a2, v + h * a3)
        q, v = q + h * v + h * h / 6.0 * (a1 + a2 + a3), v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
    return q, v


def held_limit() -> float:
    """Rows of hinges between links that turn lag by (1 + 2 τ/h)/4 (h ω)² [rad], τ = 2 h."""
    return 1.25 * (TIME_STEP * float(np.abs(fallen()[1]).sum())) ** 2


def corrected(pose: Any, speeds: Any, rate: float) -> engine.Scene:
    """The arm on its way back to the second pose: torques that inverse dynamics gives for e'' = −ω² e − 2 ω e'."""
    torques, _, _ = inverse_dynamics(pose, speeds, -(rate**2) * (pose - POSES[1]) - 2.0 * rate * speeds)
    pushes = [*(t * axis for t, (_, axis, _, _) in zip(torques, kinematics(pose), strict=True)), np.zeros(3)]
    loads = tuple(
        engine.Load(name=f"torque {k + 1}", body=f"link {k + 1}", torque=tuple(pushes[k] - pushes[k + 1]))
        for k in JOINTS
    )
    return replace(drives([None] * 6, pose, speeds), forces=loads)


def comes_back(simulate: case.Simulate, rate: float) -> bool:
    """Whether no joint is further from the second pose after some steps, each with the torques of the angles at its start and
    of how far they came in the step before; begun on the swing from side to side that breaks first."""
    observe: dict[str, Observable] = {
        f"{k}": engine.Final(quantity=engine.JointCoordinate(f"joint {k + 1}")) for k in JOINTS
    }
    off, turned = np.full(6, NUDGE), np.full(6, 2.0 * NUDGE)
    for _ in range(SWINGS):
        asked = corrected(POSES[1] + off, turned / TIME_STEP, rate)
        result = simulate(asked, time_step=TIME_STEP, steps=1, observe=observe)
        if not result.completed:
            return False
        turned = np.array([float(result[f"{k}"]) for k in JOINTS])
        off = off + turned
    return float(np.abs(off).max()) <= NUDGE


def stiffest(simulate: case.Simulate) -> case.BreakPoint:
    """The fastest correction that leads the arm back."""
    return break_point(
        functools.partial(comes_back, simulate), 0.3 * FASTEST, 3.0 * FASTEST, resolution=1e-3, walk=4
    )


def bounded(simulate: case.Simulate, share: float) -> bool:
    """Whether drives of so small a share of their bounds carry that, to 1e-9, while the arm falls."""
    return released(simulate, share)[1] < 1e-9


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest distance of a joint from the path [rad]."""
    return float(np.abs(strays(simulate, time_step, method)).max())


def draw(simulate: case.Simulate) -> case.Drawing:
    """Every joint's distance from the path at 1/60 s."""
    off = strays(simulate, TIME_STEP)
    times = TIME_STEP * np.arange(len(off))
    return case.Drawing(
        curves=tuple(line(f"joint {k + 1}", times, off[:, k]) for k in JOINTS),
        x_label="time [s]",
        y_label="angle less that of the path [rad]",
        note=f"By torques alone no joint is further than {told(float(np.abs(off).max()))} rad from its path of up to "
        f"{told(2.0 * float(np.abs(AMPLITUDE).max()))} rad.",
    )


PATH_LIMIT, FALL_LIMIT = 0.1055, 0.0295  # rad, by the steps of joint coordinates; the test finds them again

TEST = case.ScalarTest(
    title="Robot arm along a path",
    question="Do torques computed from a path lead a six-joint arm along it, as far as its drives reach?",
    why="Computed torque is how robots are controlled: the model's torques are sent to the arm. An engine whose arm answers "
    "otherwise than Newton and Euler trains controllers for another machine.",
    model="The six-joint arm: led without drives by loads that are its inverse dynamics along a path; its drives following the "
    "speeds of the path; and held by drives of which two have less than half of what that takes.",
    parameters=(
        ("path", "amplitudes of 0.4 to 0.9 rad times 1 − cos 3t, for 0.5 s"),
        ("weak drives", "40 N m on the second joint, 10 N m on the third, for 0.25 s"),
        (
            "time step",
            f"1/60 s; 1 ms for the torques of drives, two steps of which are {told(100.0 * late())} % of them: at 1/60 s "
            f"{told(100.0 * late() * TIME_STEP / FINE)} %",
        ),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "τ = M(q) q'' + c(q, q') + g(q), by recursive Newton–Euler; sent to the arm, it moves along q.",
        "A step takes torques at its start: it leads by h/2, and an arm without feedback leaves its path with what that grows "
        "to. Rows know how joints move a step late, two at most.",
        "A drive at its bound carries the bound; the joint falls with M⁻¹ of what is left.",
        "Without feedback only the arm itself can run away. With torques for e'' = −ω² e − 2 ω e', once a step, it does beyond "
        "h ω = 2 (√2 − 1).",
    ),
    reference="Recursive Newton–Euler; the fall by Runge and Kutta with its columns for a mass matrix.",
    conclusion="Green: the arm answers torques as its model says. Red: loads, drives' bounds or inertias act wrongly.",
    source="ours; robots are asked for in the thesis, section 5.4",
    measurements=(
        ask(
            lead,
            (
                error(
                    "path_error",
                    "largest distance of a joint from the path in half a second",
                    "rad",
                    PATH_LIMIT,
                    "steps of joint coordinates v₊ = v + h M⁻¹(τ − c − g), q₊ = q + h v₊ stray by 0.074, and by 0.031 more "
                    "or less with c of two steps before",
                ),
            ),
            "led by torques",
            TIME_STEP,
        ),
        ask(
            guide,
            (
                error(
                    "torque_error",
                    "largest error of a drive's torque on the path, over the largest torque",
                    "1",
                    late(),
                    "rows learn of the motion a step late: two steps of the torques' change",
                ),
            ),
            "drives that follow the path",
            FINE,
            "driven",
        ),
        ask(
            fall,
            (
                error(
                    "bound_error",
                    "largest relative difference of a weak drive's torque from its bound, two joints, 15 steps",
                    "1",
                    1e-9,
                    "a multiplier at its bound is the bound",
                ),
                error(
                    "fall_error",
                    "how far a weak joint is from where integration takes it after 0.25 s",
                    "rad",
                    FALL_LIMIT,
                    "the same steps of joint coordinates, and what c of two steps before makes of them",
                ),
                error(
                    "held_error",
                    "how far the joints turn whose drives are strong enough",
                    "rad",
                    held_limit(),
                    "rows of hinges lag by (1 + 2 τ/h)/4 (h ω)²",
                    "companion",
                ),
            ),
            "two weak drives",
            TIME_STEP,
            "weak",
        ),
    ),
    example=lambda: case.Example(scene=led(), time_step=TIME_STEP, duration=DURATION),
    figures=(case.Figure(name="path", title="Distance from the path", draw=draw),),
    stability=(
        case.StabilityStudy(
            name="stiffest",
            title="Fastest critical correction that computed torque may ask for at 1/60 s",
            configuration="plain",
            definition="a microradian off the second pose, to the other side with every step, no joint is further off after 16",
            study=stiffest,
            unit="rad/s",
            expected=(0.998 * FASTEST, 1.001 * FASTEST),
            expected_source="e'' = −ω² e − 2 ω e' once a step is z² − (2 − 2 h ω − (h ω)²) z + 1 − 2 h ω: a root is −1 at "
            "h ω = 2 (√2 − 1); the search ends within a thousandth",
        ),
        unbroken(
            bounded,
            1.0,
            1e-6,
            name="weakest",
            title="Least share of their bounds that two drives carry while the arm falls",
            definition="their torques are the bounds to 1e-9 in 15 steps",
            source="a multiplier at its bound is the bound",
            unit="1",
            configuration="weak",
            walk=4,
        ),
    ),
    ladders=(
        case.Ladder(
            name="path",
            description="largest distance of a joint from the path in half a second",
            unit="rad",
            time_steps=tuple(1.0 / n for n in (60, 120, 240, 480)),
            configurations=configured({"plain": 1.0, "half-step": None}, (1 / 480, 1 / 120)),
            error=ladder_error,
            target_error=0.02,
            target_seconds=0.01,
        ),
    ),
)
