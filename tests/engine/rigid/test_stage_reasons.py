"""Each stage is kept where a scene has what it is for, and left out with its reason where not."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from spook_tracker.engine import (
    WORLD,
    Box,
    Fluid,
    Hinge,
    Limit,
    Load,
    Lock,
    Material,
    Method,
    Motor,
    Particle,
    Plane,
    Relation,
    RigidBody,
    Scene,
    Sinusoid,
    Sphere,
    TriangleMesh,
    Tyre,
    Wire,
    compile,
    explain,
)

TIME_STEP = 1.0 / 60.0
ROUGH = Material(friction=0.5)
WAVE = Sinusoid(amplitude=1.0, frequency=1.0)
SHEET = TriangleMesh(corners=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), faces=((0, 1, 2),))
SEA = Fluid(name="sea", density=1000.0)
POINT = Particle(name="body", mass=1.0, position=(0.0, 0.0, 1.0))
AXLE = Hinge(name="axle", between=(WORLD, "body"))
DRUM = Hinge(name="drum axle", between=(WORLD, "drum"))
ROPE = Wire(name="rope", through=((WORLD, (0.0, 1.0, 5.0)), ("body", (0.0, 1.0, 0.0))))
BENT = Wire(
    name="bent", through=((WORLD, (1.0, 0.0, 0.0)), (WORLD, (0.0, 0.0, 5.0)), ("body", (0.0, 1.0, 0.0)))
)
TYRE = Tyre(
    name="tyre",
    between=(WORLD, "body"),
    axis=(0.0, 1.0, 0.0),
    radius=1.0,
    stiffness=1e5,
    longitudinal=1e4,
    cornering=1e4,
    friction=0.8,
)


def body(name: str = "body", **changes: Any) -> RigidBody:
    given: dict[str, Any] = {"mass": 1.0, "inertia": (1.0, 1.5, 2.0), "position": (0.0, 0.0, 1.0)}
    return RigidBody(name=name, **(given | changes))


def joined(*constraints: Any, forces: Any = (), bodies: Any = None) -> Scene:
    bodies = (body(), body("drum", position=(0.0, 0.0, 3.0))) if bodies is None else bodies
    return Scene(bodies=bodies, constraints=constraints, forces=forces, gravity=(0.0, 0.0, -9.81))


def on_floor(material: Material = ROUGH, floor: Material = ROUGH, **ground: Any) -> Scene:
    given: dict[str, Any] = {"shape": Plane(), "position": (0.0, 0.0, 0.0)}
    ground = {"name": "floor", "motion": "static", "material": floor} | given | ground
    return joined(bodies=(RigidBody(**ground), body(shape=Box((1.0, 1.0, 1.0)), material=material)))


def grained(across: float) -> Material:
    return Material(friction=0.5, friction_direction=(1.0, 0.0, 0.0), friction_across=across)


PLAIN = joined(AXLE, DRUM)
CONTACT = ("collision", "impact", "pivot", "friction", "tangents")
APART = (
    joined(bodies=(body(shape=Sphere(1.0)),)),
    joined(bodies=(*on_floor().bodies[:1], body())),
    replace(on_floor(), contacts=False),
    replace(on_floor(), no_contact=(("body", "floor"),)),
    replace(on_floor(), constraints=(Lock(name="lock", between=("floor", "body")),)),
)
STAGES: list[tuple[str, Scene, bool, str]] = [
    ("couple_joints", PLAIN, False, "there are no relations between joints"),
    ("couple_joints", joined(AXLE, DRUM, Relation(name="gear", terms=(("axle", 1.0), ("drum axle", 2.0)))), True, ""),
    ("hold_wires", PLAIN, False, "there are no wires"),
    ("hold_wires", joined(AXLE, DRUM, ROPE), True, ""),
    ("wind_wires", PLAIN, False, "there are no wires"),
    ("wind_wires", joined(AXLE, DRUM, ROPE), False, "no wire is wound on a drum"),
    ("wind_wires", joined(AXLE, DRUM, replace(ROPE, wound=(("drum axle", 0.1),))), True, ""),
    ("rub_wires", joined(AXLE, DRUM, BENT), False, "no wire has friction"),
    ("rub_wires", joined(AXLE, DRUM, replace(BENT, friction=0.1)), True, ""),
    ("rub_wires", joined(TYRE), False, ""),
    ("break_joints", PLAIN, False, "no joint has a strength"),
    ("break_joints", joined(replace(AXLE, strength=100.0)), True, ""),
    ("rub_joints", PLAIN, False, "no joint has friction"),
    ("rub_joints", joined(replace(AXLE, friction=1.0)), True, ""),
    ("pivot", joined(replace(AXLE, friction=1.0)), True, ""),
    ("solve_block", joined(replace(AXLE, friction=1.0)), False, ""),
    ("solve_block", PLAIN, True, ""),
    *((stage, scene, False, "") for stage in CONTACT for scene in APART),
    *((stage, on_floor(), True, "") for stage in CONTACT),
    *((stage, on_floor(Material(), Material()), stage in CONTACT[:3], "") for stage in CONTACT),
    *(
        (stage, joined(replace(AXLE, **drive)), (stage == "pivot") == bounded, "") for stage in ("pivot", "solve_block")
        for drive, bounded in (
            ({"motor": Motor(speed=1.0)}, False), ({"motor": Motor(speed=1.0, max_force=2.0)}, True),
            ({"limit": Limit(lower=-1.0, upper=1.0)}, True),
        )
    ),
    ("roll_tyres", PLAIN, False, "there are no tyres"),
    ("roll_tyres", joined(TYRE), True, ""),
    ("follow_time", joined(replace(AXLE, motor=Motor(speed=1.0))), False, ""),
    ("follow_time", joined(replace(AXLE, motor=Motor(speed=WAVE))), True, ""),
    ("follow_time", joined(bodies=(POINT,), forces=(Load(name="push", body="body", force=(1.0, 0.0, 0.0)),)), False, ""),
    ("apply_fluids", joined(bodies=(body(shape=Sphere(1.0)),)), False, "there is no fluid"),
    ("apply_fluids", joined(bodies=(body(shape=Sphere(1.0)),), forces=(SEA,)), True, ""),
    ("apply_fluids", joined(bodies=(POINT,), forces=(SEA,)), False, ""),
    ("meet_meshes", PLAIN, False, "fewer than two bodies have a surface"),
    ("meet_meshes", on_floor(), False, "no surface is a mesh or a height field"),
    ("meet_meshes", on_floor(shape=SHEET), True, "surfaces meet triangles: of their edges only what sticks out"),
    ("roll", on_floor(), False, "no surface resists rolling"),
    ("roll", on_floor(Material(friction=0.5, rolling_friction=0.01)), True, "meets friction"),
    ("roll", on_floor(Material(friction=0.5, torsional_friction=0.01)), True, "meets friction"),
    ("move_surfaces", on_floor(surface_velocity=(1.0, 0.0, 0.0)), True, "takes along"),
    ("move_surfaces", on_floor(surface_velocity=(0.0, 0.0, 0.0)), False, "no surface moves along itself"),
    ("move_surfaces", on_floor(Material(), surface_velocity=(1.0, 0.0, 0.0)), False, "no two surfaces have friction"),
    ("move_surfaces", joined(bodies=(POINT,)), False, "no surface"),
    ("orient_friction", on_floor(floor=grained(0.2)), True, "than across"),
    ("orient_friction", on_floor(floor=grained(0.5)), False, "same friction in all directions"),
    ("orient_friction", on_floor(Material(), grained(0.2)), False, "no two surfaces have friction"),
    ("orient_friction", joined(bodies=(POINT,)), False, "no surface"),
]  # fmt: skip


@pytest.mark.parametrize(("stage", "scene", "kept", "reason"), STAGES)
def test_a_stage_is_kept_where_it_is_needed(stage: str, scene: Scene, kept: bool, reason: str) -> None:
    (choice,) = [choice for choice in explain(scene, time_step=TIME_STEP) if choice.stage == stage]

    assert choice.kept == kept and choice.reason and reason in choice.reason
    assert not kept or choice.reason not in {why for name, _, met, why in STAGES if name == stage and not met}
    assert (stage in compile(scene, time_step=TIME_STEP).stages) == kept


LOCK = Lock(name="lock", between=(WORLD, "body"))
SOLVERS = [
    (joined(LOCK), Method(), "link by link", []),
    (joined(LOCK, replace(LOCK, name="twice")), Method(), "one sparse", ["links: locks close a loop", "plane: some body"]),
    (joined(LOCK), Method(corrections=1), "one sparse", ["links: the method asks for more", "plane: some body"]),
    (PLAIN, Method(), "one sparse", ["links: some joint is no lock", "plane: places, speeds or forces lead out of it"]),
    (replace(PLAIN, gravity=(0.0, 0.0, 0.0)), Method(), "in the plane across z", ["links: some joint is no lock"]),
    (PLAIN, Method(composition="order4"), "joint coordinates", []),
    (joined(AXLE, TYRE), Method(), "some joint row has a bound", []),
    (
        joined(AXLE, bodies=(body(inertia=((1.0, 0.1, 0.0), (0.1, 1.5, 0.0), (0.0, 0.0, 2.0))),)),
        Method(composition="order4"),
        "Newton's method",
        ["joint_tree: axes of some body are not those of its inertia"],
    ),
]  # fmt: skip


@pytest.mark.parametrize(("scene", "method", "solver", "refusals"), SOLVERS)
def test_the_first_solver_that_takes_a_scene_solves_it_and_those_before_it_say_why_not(
    scene: Scene, method: Method, solver: str, refusals: list[str]
) -> None:
    reasons = {c.stage: c.reason for c in explain(scene, time_step=TIME_STEP, method=method)}
    solves, _, others = reasons["solve_block"].partition(" (not ")

    assert solver in solves
    named = others.removesuffix(")").split("; not ") if others else []
    assert len(named) == len(refusals) and all(map(str.startswith, named, refusals)), named


def test_none_of_them_brings_another() -> None:
    """What is beside joints alone, each on its own; a drum's wire is a wire."""
    named = {
        "couple_joints",
        "hold_wires",
        "wind_wires",
        "rub_wires",
        "break_joints",
        "rub_joints",
        "roll_tyres",
    }
    for stage, scene, kept, _ in STAGES:
        if kept and stage in named:
            also = {"wind_wires": {"hold_wires"}, "rub_wires": {"hold_wires"}}.get(stage, set())
            assert named & set(compile(scene, time_step=TIME_STEP).stages) == {stage} | also
