"""What every engine behind the protocol is asked, with a row of what each owes: closed forms to its step and its rounding.

What an engine alone does, or lacks, is in a file of its own. An engine that is missing is skipped with the reason.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    Ball,
    Box,
    Capsule,
    Compound,
    ConstraintForce,
    ContactCount,
    ContactForce,
    ConvexHull,
    Cylinder,
    Final,
    Hinge,
    Lock,
    Part,
    Particle,
    Penetration,
    Prismatic,
    Scene,
    Sphere,
    TriangleMesh,
    Universal,
)
from spook_tracker.engine.find import EngineMissing, find
from tests.scenes import peer as peer_scenes

STEP = 1.0 / 60.0  # s
G = peer_scenes.G
Asked = tuple[str, str]  # engine, configuration
DART, BULLET = ("dart", "joints"), ("pybullet", "joints")
DART_LOOSE, BULLET_LOOSE = ("dart", "constraints"), ("pybullet", "constraints")  # joints as rows
SAP, RK3, DRAKE_LOOSE = ("drake", "sap"), ("drake", "rk3"), ("drake", "constraints")
JOLT, JOLT_AS_IT_COMES = ("jolt", "many-iterations"), ("jolt", "defaults")
RAPIER, RAPIER_MANY = ("rapier3d", "defaults"), ("rapier3d", "many-iterations")
TGS, PGS = ("sapien", "tgs"), ("sapien", "pgs")
MOTRIX, MOTRIX_MANY, MOTRIX_LOOSE = (
    ("motrixsim", name) for name in ("defaults", "many-iterations", "equalities")
)
MERSON, HELD_STEP = ("simbody", "merson"), ("simbody", "held-step")
P2, P2_AS_IT_COMES = ("p2", "accurate"), ("p2", "defaults")
CANNON, EXUDYN = ("cannon", "accurate"), ("exudyn", "trapezoidal")
BOX, BOX_AS_IT_COMES = ("box3d", "many-substeps"), ("box3d", "defaults")
MUJOCO, MUJOCO_IMPLICIT, MUJOCO_AS_IT_COMES, MUJOCO_LOOSE = (
    ("mujoco", name) for name in ("rk4", "implicit", "defaults", "equalities")
)
COULOMB = ("rapier3d", "coulomb")
WARP, FEATHERSTONE, XPBD, KAMINO, VBD = (
    ("newton", name) for name in ("mujoco", "featherstone", "xpbd", "kamino", "vbd")
)
RAPIER_JS, RAPIER_JS_AS_IT_COMES = ("rapier", "many-iterations"), ("rapier", "defaults")
JOINTS = (Ball, Hinge, Lock, Prismatic)
EVERY_JOINT = (*JOINTS, Universal)


def engine(asked: Asked) -> Callable[..., Any]:
    """Its `simulate`, in that configuration."""
    if asked == WARP:
        pytest.importorskip("mujoco_warp", reason="the extra newton lacks mujoco-warp")
    try:
        found = find(asked[0])
    except EngineMissing as missing:
        if "is not installed" not in str(missing):
            raise
        pytest.skip(str(missing))
    return functools.partial(found.simulate, configuration=asked[1]) if asked[1] else found.simulate


def rows(owed: Mapping[Any, Any]) -> Any:
    """A test for each row: an engine's configuration, or one and what else is asked of it, and what it owes."""
    table = [(*(key if isinstance(key[0], tuple) else (key,)), value) for key, value in owed.items()]
    names = [" ".join(getattr(part, "kind", part) for part in (*row[0], *row[1:-1]) if part) for row in table]
    return pytest.mark.parametrize(
        ("asked", "kind", "owed") if len(table[0]) == 3 else ("asked", "owed"), table, ids=names
    )


def by_joint(owed: Mapping[Asked, tuple[float, tuple[Any, ...]]]) -> Any:
    """The same for every kind of joint that a configuration has."""
    return rows({(asked, kind): bound for asked, (bound, kinds) in owed.items() for kind in kinds})


EULER = pytest.approx(G * STEP, rel=1e-12)  # g T h / 2 of a semi-implicit step, m


@rows(
    {
        **dict.fromkeys((DART, DART_LOOSE, BULLET, BULLET_LOOSE, SAP), EULER),
        **dict.fromkeys((CANNON, P2, MUJOCO_IMPLICIT, MUJOCO_AS_IT_COMES), EULER),
        **dict.fromkeys((RK3, MERSON, HELD_STEP, MUJOCO), pytest.approx(0.0, abs=1e-11)),
        **dict.fromkeys((TGS, PGS, JOLT, P2_AS_IT_COMES), pytest.approx(G * STEP, abs=1e-4)),
        **dict.fromkeys((MOTRIX, MOTRIX_MANY, MOTRIX_LOOSE), pytest.approx(G * STEP, rel=1e-4)),
        **dict.fromkeys((RAPIER, RAPIER_JS_AS_IT_COMES), pytest.approx(G * STEP / 4, abs=2e-3)),  # substeps
        BOX: pytest.approx(G * STEP / 20, abs=2e-3),
        RAPIER_MANY: pytest.approx(G * STEP / 100, abs=2e-3),
        WARP: pytest.approx(0.0, abs=2e-4),
        **{
            ("newton", name): pytest.approx(G * STEP / substeps, abs=2e-4)
            for name, substeps in (("featherstone", 20), ("xpbd", 10), ("semi-implicit", 16))
        },
    }
)
def test_a_fall_has_the_error_of_its_step(asked: Asked, owed: Any) -> None:
    assert peer_scenes.fall_error(engine(asked), STEP) == owed


@by_joint(
    {
        DART: (1e-8, JOINTS),
        DART_LOOSE: (1e-8, JOINTS[:3]),
        BULLET: (1e-9, JOINTS),
        BULLET_LOOSE: (1e-9, JOINTS[:3]),
        SAP: (1e-12, JOINTS),
        DRAKE_LOOSE: (1e-5, JOINTS[:3]),
        JOLT: (1e-5, JOINTS),
        **dict.fromkeys((RAPIER_MANY, RAPIER_JS, TGS, PGS), (1e-6, JOINTS)),
        BOX: (1e-5, JOINTS),
        MERSON: (1e-12, JOINTS),
        CANNON: (1e-9, JOINTS[:3]),
        P2: (1e-9, (Lock,)),
        **dict.fromkeys((WARP, FEATHERSTONE, XPBD), (1e-6, JOINTS)),
        KAMINO: (2e-6, JOINTS),
        ("newton", "semi-implicit"): (4e-3, JOINTS),
        VBD: (5e-4, JOINTS),
    }
)
def test_a_joint_holds_its_body(asked: Asked, kind: Any, owed: float) -> None:
    """Newton's bodies are held the other way round."""
    assert peer_scenes.left_its_place(engine(asked), kind, backwards=asked[0] == "newton") < owed


@by_joint(
    {
        DART: (0.02, EVERY_JOINT),
        DART_LOOSE: (0.02, JOINTS[:3]),
        BULLET: (0.02, JOINTS),
        BULLET_LOOSE: (0.02, JOINTS[:3]),
        RK3: (0.02, EVERY_JOINT),
        DRAKE_LOOSE: (0.02, JOINTS[:3]),
        JOLT: (0.02, JOINTS),
        RAPIER: (3e-3, JOINTS),
        RAPIER_JS: (3e-3, JOINTS),
        BOX: (0.02, JOINTS),
        TGS: (1e-3, JOINTS),
        PGS: (1e-3, JOINTS),
        MOTRIX: (2e-3, EVERY_JOINT),
        MOTRIX_LOOSE: (1e-3, JOINTS[:3]),
        MERSON: (3e-3, EVERY_JOINT),
        MUJOCO: (3e-3, EVERY_JOINT),
        MUJOCO_AS_IT_COMES: (3e-3, EVERY_JOINT),
        MUJOCO_LOOSE: (3e-3, JOINTS[:3]),
        **dict.fromkeys((WARP, FEATHERSTONE, KAMINO), (3e-3, JOINTS)),
        ("newton", "semi-implicit"): (8e-3, JOINTS),
        ("exudyn", "generalised-alpha"): (0.01, JOINTS),
    }
)
def test_joints_between_moving_bodies_move_as_in_our_engine(asked: Asked, kind: Any, owed: float) -> None:
    """Two bodies turned at random, from rest: both engines converge to one motion; impulses less well."""
    assert peer_scenes.parted_from_ours(engine(asked), kind.kind) < owed


@pytest.mark.parametrize("backwards", [False, True])
@by_joint(
    {
        DART: (1e-6, JOINTS[:3]),
        BULLET: (1e-6, JOINTS[:2]),
        BULLET_LOOSE: (1e-6, JOINTS[:2]),
        SAP: (1e-9, JOINTS[:3]),
        RK3: (1e-9, JOINTS[:3]),
        JOLT: (1e-4, JOINTS[:2]),
        BOX: (1e-3, JOINTS),
        MERSON: (1e-9, JOINTS[:3]),
    }
)
def test_the_force_of_a_joint_is_the_weight_it_holds(
    asked: Asked, kind: Any, owed: float, backwards: bool
) -> None:
    force = {"force": Final(quantity=ConstraintForce("joint"))}
    found = engine(asked)(peer_scenes.hung(kind, backwards), time_step=STEP, duration=1.0, observe=force)

    assert found["force"] == pytest.approx(peer_scenes.load_on_joint(kind, backwards), abs=owed)


@rows(
    dict.fromkeys((DART, BULLET, SAP, RK3, MERSON, MUJOCO, MUJOCO_AS_IT_COMES, MUJOCO_LOOSE), 1e-9)
    | {JOLT: 1e-6, BOX: 1e-3, EXUDYN: 1e-6}
)
def test_the_tension_of_a_rod_at_rest_is_all_that_hangs_on_it(asked: Asked, owed: float) -> None:
    weights = tuple(Particle(name=f"{k}", mass=1.0 + k, position=(0.0, 0.0, -1.0 - k)) for k in range(2))
    rods = peer_scenes.chain(2).constraints
    observe = {f"{k}": Final(quantity=ConstraintForce(f"rod {k}")) for k in range(2)}
    scene = Scene(bodies=weights, constraints=rods, gravity=peer_scenes.GRAVITY)
    found = engine(asked)(scene, time_step=STEP, duration=1.0, observe=observe)

    assert [float(found["0"]), float(found["1"])] == pytest.approx([29.43, 19.62], rel=owed)


@rows(
    dict.fromkeys((DART, DART_LOOSE, BULLET, BULLET_LOOSE, SAP, RK3, DRAKE_LOOSE, MERSON, HELD_STEP), 1e-12)
    | dict.fromkeys((MOTRIX, MOTRIX_MANY, MOTRIX_LOOSE), 1e-6)
)
def test_spins_at_the_start_are_those_of_the_scene(asked: Asked, owed: float) -> None:
    """Two bodies turned against the world on ball joints; each engine wants the spin of a joint in axes of its own."""
    assert peer_scenes.started(engine(asked)) == pytest.approx((0.0, 0.0), abs=owed)


@rows(dict.fromkeys((DART, DART_LOOSE, BULLET, BULLET_LOOSE), 5e-3))
def test_speeds_at_the_start_are_those_of_the_scene(asked: Asked, owed: float) -> None:
    """A hinged body and one on a slide, set going, are read back before any step, and hardly changed after it."""
    found = peer_scenes.set_going(engine(asked), slides=asked[1] == "joints")

    assert found[0] == pytest.approx(np.array([[0.0, 2.0, 0.0], [3.0, 0.0, 0.0]]), abs=1e-12)
    assert found[1] == pytest.approx(found[0], abs=owed)


@rows(
    {
        **dict.fromkeys((DART, DART_LOOSE, BULLET, BULLET_LOOSE, P2, CANNON), (1 / 1000, 1e-4)),
        **dict.fromkeys((RK3, MERSON, HELD_STEP), (1 / 240, 3e-5)),
        JOLT: (1 / 1000, 4e-3),  # of first order, and in single precision
        **dict.fromkeys((RAPIER, RAPIER_JS), (1 / 1000, 2e-4)),
        BOX: (1 / 1000, 5e-4),
        TGS: (1 / 1000, 5e-4),
        PGS: (1 / 1000, 5e-4),
    }
)
def test_a_hinged_body_swings_with_its_period(asked: Asked, owed: tuple[float, float]) -> None:
    assert peer_scenes.swings(engine(asked), owed[0]) == pytest.approx(1.0, abs=owed[1])


@rows({DART: 0.3, BULLET: 0.3})
def test_a_spinning_body_keeps_its_momentum_to_the_order_of_its_step(asked: Asked, owed: float) -> None:
    coarse, fine = (peer_scenes.momentum_lost(engine(asked), h) for h in (1 / 240, 1 / 960))

    assert coarse < 1e-3
    assert fine < owed * coarse


@rows({DART: 1e-12, BULLET: 1e-12})
def test_a_rod_is_a_hinge_in_joint_coordinates(asked: Asked, owed: float) -> None:
    """The length is exact; the energy is that of semi-implicit Euler, the same digits in every engine that has it."""
    length, energy = peer_scenes.swung(engine(asked), STEP)

    assert length < owed
    assert energy == pytest.approx(0.0233, abs=2e-4)
    assert peer_scenes.swung(engine(asked), 1 / 240)[1] == pytest.approx(0.0057, abs=1e-4)


UNSEEN = 0.5 * 0.2 * G * 2.0 * (2.0 + STEP)  # m, of a cube pulled by .7 of its weight, in symplectic steps


@rows(
    {
        DART: (1e-5, pytest.approx(UNSEEN, rel=1e-4)),  # friction on a box, solved exactly
        BULLET: (4e-3, pytest.approx(0.4 * G, rel=0.1)),  # few points: it creeps, and tilts where it slides
        SAP: (1e-3, pytest.approx(0.4 * G, rel=0.01)),
        JOLT: (1e-6, pytest.approx(0.4 * G, rel=0.02)),
        **dict.fromkeys((RAPIER_MANY, RAPIER_JS), (1e-3, pytest.approx(0.4 * G, rel=2e-3))),
        MERSON: (2e-4, pytest.approx(0.4 * G, rel=0.01)),  # springs that stick: it yields
        **dict.fromkeys((TGS, PGS), (1e-3, pytest.approx(0.4 * G, rel=0.01))),
        **dict.fromkeys((MOTRIX, MOTRIX_MANY, MOTRIX_LOOSE), (1e-3, pytest.approx(0.4 * G, rel=0.02))),
        WARP: (1e-3, pytest.approx(0.4 * G, abs=0.02)),
        FEATHERSTONE: (0.02, pytest.approx(0.4 * G, abs=5e-3)),
        XPBD: (5e-3, pytest.approx(0.4 * G, abs=0.01)),
        KAMINO: (3e-6, pytest.approx(0.4 * G, abs=1e-5)),
    }
)
def test_friction_holds_below_its_coefficient_and_not_above(asked: Asked, owed: tuple[float, Any]) -> None:
    assert abs(peer_scenes.slid(engine(asked), 0.3)) < owed[0]
    assert peer_scenes.slid(engine(asked), 0.7) == owed[1]


@rows(dict.fromkeys((DART, SAP, MERSON, TGS, PGS, JOLT, RAPIER_MANY, RAPIER_JS), 0.02))
def test_two_surfaces_rub_by_the_geometric_mean_of_their_frictions(asked: Asked, owed: float) -> None:
    """√(.5 · .08) = .2 of the weight against a pull of .4."""
    scene = peer_scenes.unlike(0.08, pull=0.4)
    assert peer_scenes.slid(engine(asked), 0.4, 1.0, scene) == pytest.approx(0.1 * G, rel=owed)


SOLIDS = {"box": None, "sphere": Sphere(0.5), "capsule": Capsule(0.25, 0.5)}
SLIM = {"box": None, "slim capsule": Capsule(0.2, 0.6)}
TALL = {**SLIM, "cylinder": Cylinder(0.2, 1.0)}

# Two halves of that cube, the lower one a corner of it aside and twice over: its centre of mass is not the body's.
HALVES = [Part(shape=Box((1.0, 1.0, 0.5)), position=(0.0, 0.0, z)) for z in (0.25, -0.25)]
ASIDE = Part(
    shape=Box((0.5, 0.5, 0.5)),
    position=(0.25, 0.25, -0.25),
    orientation=(math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)),
)
PAIR = {"compound": Compound((*HALVES, ASIDE))}


@rows(
    {
        (asked, name): (low, high, shape)
        for asked, low, high, shapes in (
            *((one, -1e-4, 1e-4, SOLIDS) for one in (DART, BULLET)),
            *((one, -1e-3, 1e-3, SOLIDS) for one in (SAP, JOLT)),
            (TGS, -1e-5, 1e-5, SLIM),
            (MERSON, -1e-4, 1e-12, {"box": None, "sphere": SOLIDS["sphere"]}),
            (RAPIER, -1e-3, 1e-3, {"cylinder": TALL["cylinder"]} | PAIR),
            (RAPIER_JS, -1e-3, 1e-3, SOLIDS | TALL | PAIR),
            (CANNON, -1e-9, 1e-9, {"box": None, "sphere": SOLIDS["sphere"]}),
            (JOLT, -1e-3, 1e-3, {"cylinder": TALL["cylinder"]} | PAIR),
            (BULLET, -1e-3, 1e-3, {"cylinder": TALL["cylinder"]}),
            (BOX, -6e-3, 1e-3, PAIR),
            (MUJOCO, -1e-3, 0.0, PAIR),
            *(
                (one, -deep, deep, TALL)
                for one, deep in (
                    (WARP, 1e-5),
                    (XPBD, 2e-5),
                    (KAMINO, 1e-6),
                    (FEATHERSTONE, 4e-3),
                    (VBD, 4e-3),
                )
            ),
            *((one, -1e-3, 0.0, SOLIDS | TALL) for one in (MOTRIX, MOTRIX_MANY, MOTRIX_LOOSE)),
        )
        for name, shape in shapes.items()
    }
)
def test_a_body_rests_where_it_touches(asked: Asked, kind: str, owed: tuple[float, float, Any]) -> None:
    """Along our axes: capsule and cylinder stand on their ends."""
    low, high, shape = owed
    assert low < peer_scenes.sunk(engine(asked), shape) < high


SHEET = TriangleMesh(((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)), ((0, 1, 2), (0, 2, 3)))
CUBE = ConvexHull(tuple(itertools.product((-0.5, 0.5), repeat=3)))


@rows(dict.fromkeys((RAPIER_MANY, RAPIER_JS, JOLT, BOX), 1e-3) | {BOX: 6e-3})
def test_hulls_and_balls_rest_on_meshes(asked: Asked, owed: float) -> None:
    for shape in (CUBE, Sphere(0.5)):
        assert abs(peer_scenes.sunk(engine(asked), shape, under=SHEET)) < owed


@rows(
    {
        DART: (1e-5, (4, 4)),
        BULLET: (1e-3, (3, 4)),
        SAP: (1e-2, None),
        MERSON: (2e-3, None),
        COULOMB: (1e-2, None),
    }
)
def test_the_ground_carries_the_weight_and_the_pull(
    asked: Asked, owed: tuple[float, tuple[int, int] | None]
) -> None:
    bound, points = owed
    observe: dict[str, Any] = {
        "force": Final(quantity=ContactForce("box")),
        "ground": Final(quantity=ContactForce("ground", "box")),
    }
    if points:
        observe |= {"depth": Final(quantity=Penetration()), "count": Final(quantity=ContactCount())}
    found = engine(asked)(peer_scenes.box_on_ground(0.3), time_step=STEP, duration=2.0, observe=observe)

    assert found["force"] == pytest.approx([-0.3 * G, 0.0, G], abs=bound)
    assert list(found["ground"]) == list(-found["force"])
    if points:
        assert 0.0 < float(found["depth"]) < 1e-4
        assert points[0] <= float(found["count"]) <= points[1]


@rows(dict.fromkeys((TGS, RAPIER_MANY), 1e-3))
def test_a_contact_without_friction_shows_the_weight_it_carries(asked: Asked, owed: float) -> None:
    force = {"f": Final(quantity=ContactForce("box"))}
    found = engine(asked)(peer_scenes.box_on_ground(0.0, 0.0), time_step=STEP, duration=1.0, observe=force)
    assert found["f"] == pytest.approx([0.0, 0.0, G], abs=owed)


@rows(
    {DART: (0.8, 0.01), JOLT: (0.8, 0.01), **dict.fromkeys((RAPIER, RAPIER_JS, TGS), (0.5, 2e-3))}
    | dict.fromkeys((BULLET, BULLET_LOOSE), (0.8, 0.02))
    | {XPBD: (0.5, 1e-3), KAMINO: (0.5, 0.03)}
)
def test_a_ball_comes_back_by_the_square_of_its_restitution(asked: Asked, owed: tuple[float, float]) -> None:
    """From ground of none: of two restitutions the larger counts."""
    restitution, bound = owed
    assert peer_scenes.bounced(engine(asked), restitution, 1e-3) == pytest.approx(restitution**2, abs=bound)


@by_joint(
    {(name, ""): (5e-3, (Hinge, Prismatic)) for name in ("dart", "pybullet", "jolt", "mujoco")}
    | dict.fromkeys((MOTRIX, BOX, RAPIER, RAPIER_JS_AS_IT_COMES, TGS), (3e-3, (Hinge, Prismatic)))
)
def test_dry_friction_in_a_joint_brakes_it_until_it_stands_and_holds_it_then(
    asked: Asked, kind: Any, owed: float
) -> None:
    assert peer_scenes.braked(engine(asked), kind) == pytest.approx(peer_scenes.BRAKED, abs=owed)


@pytest.mark.parametrize("backwards", [False, True])
@by_joint(
    dict.fromkeys((MUJOCO, MUJOCO_IMPLICIT, MUJOCO_AS_IT_COMES, DART, BULLET), (1e-9, (Hinge, Prismatic)))
    | dict.fromkeys((BOX, BOX_AS_IT_COMES, JOLT, RAPIER, RAPIER_JS, TGS), (1e-3, (Hinge, Prismatic)))
)
def test_a_motor_drives_with_its_largest_force_up_to_its_speed(
    asked: Asked, kind: Any, owed: float, backwards: bool
) -> None:
    assert peer_scenes.driven(engine(asked), kind, backwards) == pytest.approx([2.0, 10.0], rel=owed)


@rows(
    {
        **dict.fromkeys((MUJOCO, RK3, MERSON, EXUDYN), 1e-6),
        **dict.fromkeys((MUJOCO_IMPLICIT, DART, BULLET, SAP, JOLT, BOX, RAPIER_MANY, RAPIER_JS, TGS), 5e-3),
    }
)
def test_a_distance_that_gives_is_a_spring_with_a_damper(asked: Asked, owed: float) -> None:
    for damping in (0.0, 0.05):
        found, exact = peer_scenes.given_way(engine(asked), damping)
        assert found == pytest.approx(exact, abs=owed)


@rows(
    dict.fromkeys(
        (MUJOCO, SAP, RK3, EXUDYN, DART, BULLET, TGS, MERSON, JOLT, BOX, RAPIER_MANY, RAPIER_JS), 0.01
    )
)
def test_a_spring_beside_a_centre_turns_a_body(asked: Asked, owed: float) -> None:
    expected = np.array([[0.0, 0.0, 0.04], [0.0, -0.01, 0.0]])  # F t/m up; F r t/I about −y
    assert peer_scenes.pulled_aside(engine(asked)) == pytest.approx(expected, abs=owed * 0.04)


@rows({MUJOCO: 1e-6, JOLT: 2e-3})
def test_a_rack_and_its_pinion_share_what_pushes(asked: Asked, owed: float) -> None:
    assert peer_scenes.racked(engine(asked)) == pytest.approx(5.0 / 6.0, rel=owed)


@rows({MUJOCO: 1e-3, JOLT: 1e-3, BOX: 0.03, RAPIER: 1e-3, RAPIER_JS: 1e-3})
def test_a_turntable_takes_along_what_stands_on_it(asked: Asked, owed: float) -> None:
    expected = [0.3 * math.cos(1.0), 0.3 * math.sin(1.0), 1.0]
    assert peer_scenes.turned_along(engine(asked)) == pytest.approx(expected, abs=owed)


@rows(dict.fromkeys((MUJOCO_AS_IT_COMES, JOLT, BOX, RAPIER), 0.02))
def test_a_belt_takes_along_what_lies_on_it(asked: Asked, owed: float) -> None:
    assert peer_scenes.carried(engine(asked)) == pytest.approx([0.05 * G, 2.0], rel=owed)
