"""Library problem A03: is Andrews' squeezing mechanism where it should be after 0.03 s?"""

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
from ..heavier import heavier
from .library import HIGH, LOW, PLAIN_CONFIGURATION, SECOND_ORDER, error_metric, ladders, library_error

DURATION = 0.03  # s
LONGEST = DURATION / 212.5  # s, between 213 steps and 212
COMPLIANCE = 1e-13  # m/N and rad/(N m): 1e-8 is a part in a hundred of what these millimetres bear
TORQUE, STIFFNESS, REST = 0.033, 4530.0, 0.07785  # N m, N/m, m
A, B, C = np.array([-0.06934, -0.00227]), np.array([-0.03635, 0.03273]), np.array([0.014, 0.072])  # m
START = {  # rad
    "crank": -0.0617138900142764,
    "triangle": 0.455279819163070,
    "lower": 0.487364979543843,
    "upper": 1.23054744454982,
}
END = {  # rad, the initial value problems' test set
    "crank": 15.81077119629904,
    "triangle": 0.04082224013073101,
    "lower": 0.5244099658805304,
    "upper": 1.048080741042263,
}
HINGES = {"crank": "O", "triangle": "B", "lower": "A lower", "upper": "A upper"}
F_EARLY = np.array([-0.0038905524, 0.0058192441])  # m, the crank's end F after 0.01 s


def _turn(angle: float) -> np.ndarray:
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


def _along(start: np.ndarray, end: np.ndarray, distance: float) -> np.ndarray:
    return np.asarray(start + distance * (end - start) / np.linalg.norm(end - start))


def _place(point: Any) -> tuple[float, float, float]:
    return (float(point[0]), float(point[1]), 0.0)


def scene(time_step: float) -> engine.Scene:
    """Seven bodies, ten hinges, a spring from C to D; no gravity, at rest, a torque on the crank."""
    fixed = np.zeros(2)
    crank_end = _turn(START["crank"]) @ [0.007, 0.0]  # F
    joint = B + _turn(START["triangle"]) @ [0.0, -0.035]  # E
    hook = B + _turn(START["triangle"]) @ [0.02, -0.018]  # D
    lower = A + _turn(START["lower"]) @ [0.04, 0.0]  # G
    upper = A + _turn(START["upper"]) @ [0.0, -0.04]  # H

    def body(name: str, mass: float, inertia: float, centre: np.ndarray) -> engine.RigidBody:
        return engine.RigidBody(
            name=name, mass=mass, inertia=(inertia, inertia, inertia), position=_place(centre)
        )

    bodies = (
        body("K1", 0.04325, 2.194e-6, _along(fixed, crank_end, 0.00092)),
        body("K2", 0.00365, 4.410e-7, _along(crank_end, joint, 0.0115)),
        body("K3", 0.02373, 5.255e-6, B + _turn(START["triangle"]) @ [0.01043, -0.01874]),
        body("K4", 0.00706, 5.667e-7, _along(lower, joint, 0.00579)),
        body("K5", 0.0705, 1.169e-5, A + _turn(START["lower"]) @ [0.02308, 0.00916]),
        body("K6", 0.00706, 5.667e-7, _along(upper, joint, 0.00579)),
        body("K7", 0.05498, 1.912e-5, A + _turn(START["upper"]) @ [0.01228, -0.00449]),
    )

    def hinge(name: str, first: str, second: str, at: np.ndarray) -> engine.Hinge:
        damping = 2.0 * time_step
        return engine.Hinge(
            name=name, between=(first, second), at=_place(at), compliance=COMPLIANCE, damping=damping
        )

    spring = engine.Distance(
        name="spring",
        between=(_place(C), "K3"),
        anchors=((0.0, 0.0, 0.0), _place(hook - bodies[2].position[:2])),
        rest_length=REST,
        compliance=1.0 / STIFFNESS,
        damping=0.0,
    )
    hinges = (
        hinge("O", engine.WORLD, "K1", fixed),
        hinge("F", "K1", "K2", crank_end),
        hinge("E", "K2", "K3", joint),
        hinge("E lower", "K2", "K4", joint),
        hinge("E upper", "K2", "K6", joint),
        hinge("B", engine.WORLD, "K3", B),
        hinge("A lower", engine.WORLD, "K5", A),
        hinge("G", "K5", "K4", lower),
        hinge("A upper", engine.WORLD, "K7", A),
        hinge("H", "K7", "K6", upper),
    )
    torque = engine.Load(name="torque", body="K1", torque=(0.0, 0.0, TORQUE))
    return engine.Scene(
        bodies=bodies,
        constraints=(*hinges, spring),
        forces=(torque,),
        gravity=(0.0, 0.0, 0.0),
        contacts=False,
    )


def answers(
    simulate: case.Simulate, time_step: float, method: engine.Method = engine.PLAIN
) -> dict[str, float]:
    """The library's error of the four angles at the ground, and how far F is off after 0.01 s."""
    observe: dict[str, Observable] = {
        name: engine.Trace(quantity=engine.JointCoordinate(hinge)) for name, hinge in HINGES.items()
    }
    result = simulate(
        scene(time_step), time_step=time_step, duration=DURATION, method=method, observe=observe
    )
    angles = {name: START[name] + result[name] for name in HINGES}
    early = _turn(float(angles["crank"][round(0.01 / time_step)])) @ [0.007, 0.0]
    return {
        "library_error": library_error([angles[name][-1] for name in END], list(END.values())),
        "place_of_f": float(np.hypot(*(early - F_EARLY))),
    }


def fine(simulate: case.Simulate) -> dict[str, float]:
    """In steps of 1e-5 s."""
    return answers(simulate, 1e-5)


def coarse(simulate: case.Simulate) -> dict[str, float]:
    """In steps of 1e-4 s, two hundred to a turn of the crank."""
    return answers(simulate, 1e-4)


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Of the four angles after 0.03 s."""
    return answers(simulate, time_step, method)["library_error"]


def in_class(simulate: case.Simulate, time_step: float) -> bool:
    """Whether the low class is kept, 0.03 s being divided into the number of steps nearest to that one [s]."""
    return answers(simulate, DURATION / round(DURATION / time_step))["library_error"] < LOW


def longest_step(simulate: case.Simulate) -> case.BreakPoint:
    """The longest step [s] that keeps the low class."""
    return break_point(functools.partial(in_class, simulate), 5e-5, 5e-4, resolution=2e-3, walk=6)


def scales(simulate: case.Simulate, times: float) -> bool:
    """Whether a mechanism so many times as heavy, driven and stiff keeps the low class in steps of 1e-4 s."""

    def stronger(scene: engine.Scene, **options: Any) -> engine.Result:
        rows = tuple(
            replace(
                row, compliance=(COMPLIANCE if isinstance(row, engine.Hinge) else 1.0 / STIFFNESS) / times
            )
            for row in scene.constraints
            if isinstance(row, engine.Hinge | engine.Distance)
        )
        loads = tuple(
            replace(load, torque=(0.0, 0.0, times * load.torque[2]))
            for load in scene.forces
            if isinstance(load, engine.Load)
        )
        return simulate(replace(heavier(scene, times), constraints=rows, forces=loads), **options)

    return answers(stronger, 1e-4)["library_error"] < LOW


CURVED = replace(SECOND_ORDER, expected_order=None)  # not yet in its range
OUTPUTS = "the angles of crank, triangle and both rockers after 0.03 s"

TEST = case.ScalarTest(
    title="Multibody library A03: Andrews' squeezing mechanism",
    question="Is Andrews' squeezing mechanism where it should be after 0.03 s?",
    why="Millimetres, grams and 1200 rad/s: a mechanism whose compliances and time steps fit no engine's defaults.",
    model="Seven plane bodies on ten hinges, a spring, and a motor's torque of 0.033 N m on the crank; from rest.",
    parameters=(
        ("time step", "1e-5 s and 1e-4 s; ladder 2e-4 to 2.5e-6 s"),
        ("torque", "0.033 N m"),
        ("spring", "4530 N/m, rest length 0.07785 m, as an undamped row"),
        ("hinges", "compliance 1e-13, damping two time steps"),
        ("duration", "0.03 s"),
    ),
    theory=(
        "E = F − 0.028 (cos(β + Θ), sin(β + Θ)) = B + 0.035 (sin γ, −cos γ), G = A + 0.04 (cos δ, sin δ), "
        "H = A + 0.04 (sin ε, −cos ε).",
        "β(0.03) = 15.81077119629904, γ = 0.04082224013073101, δ = 0.5244099658805304, ε = 1.048080741042263.",
    ),
    reference="Test set for initial value problem solvers, Andrews' squeezing mechanism: all digits of the end.",
    conclusion="Green: rigid joints are rigid at every scale. Red: a default meant for metres and kilograms is in the way.",
    source="Library for computational benchmarking of multibody dynamics, problem A03",
    measurements=(
        case.Measurement(
            configuration="plain",
            time_step=1e-5,
            metrics=(
                error_metric("gate", HIGH, OUTPUTS),
                case.Metric(
                    name="place_of_f",
                    description="distance of the crank's end from its place after 0.01 s",
                    unit="m",
                    role="reported",
                    reference=0.0,
                    relative_tolerance=1e-5,
                ),
            ),
            measure=fine,
            note="the SPOOK step as it stands",
        ),
        case.Measurement(
            configuration="plain",
            time_step=1e-4,
            metrics=(error_metric("companion", LOW, OUTPUTS),),
            measure=coarse,
            note="the SPOOK step as it stands",
        ),
    ),
    example=lambda: case.Example(scene=scene(1e-5), time_step=1e-5),
    ladders=ladders(
        "four angles after 0.03 s",
        {
            "low": ((2e-4, 1e-4, 5e-5, 2.5e-5), (PLAIN_CONFIGURATION, CURVED)),
            "high": (
                (2.5e-5, 1e-5, 5e-6, 2.5e-6),
                (PLAIN_CONFIGURATION, replace(CURVED, time_steps=(1e-4, 5e-5, 2.5e-5, 1e-5))),
            ),
        },
        ladder_error,
    ),
    stability=(
        case.StabilityStudy(
            name="longest-step",
            title="Longest step that keeps the low precision class",
            configuration="plain",
            definition="the library's error of the four angles below 0.1 after 0.03 s",
            study=longest_step,
            unit="s",
            expected=(0.997 * LONGEST, LONGEST),
            expected_source="213 steps keep it and 212 do not: the same rows in the mechanism's plane, stepped by the prototype "
            "tests/oracles/squeezer.py; to the resolution of the search",
        ),
        unbroken(
            scales,
            1.0,
            1e12,
            name="heaviest",
            title="How many times as heavy and as strongly driven the mechanism may be",
            definition="the library's error below 0.1 after 0.03 s in steps of 1e-4 s, all that gives way as much stiffer",
            source="the unit of mass scales out of every equation",
            unit="1",
            walk=4,
        ),
    ),
)
