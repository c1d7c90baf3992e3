"""What engines behind the protocol lack, or our adapters cannot ask of them: refused by name before anything runs."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from spook_tracker.engine import (
    Ball,
    Box,
    CentralGravity,
    Cone,
    ConstraintForce,
    ContactForce,
    Cylinder,
    Distance,
    Final,
    Fluid,
    Hinge,
    Lock,
    Material,
    Particle,
    Plane,
    Prismatic,
    RigidBody,
    Scene,
    Shape,
    Sphere,
    Tyre,
)
from spook_tracker.engine.protocol import NotSupported
from tests.engine.peers.test_conformance import (
    BOX,
    BULLET,
    BULLET_LOOSE,
    CANNON,
    DART,
    DART_LOOSE,
    DRAKE_LOOSE,
    HELD_STEP,
    JOLT,
    MERSON,
    MOTRIX,
    MUJOCO_LOOSE,
    P2,
    RAPIER,
    RAPIER_JS,
    RK3,
    SAP,
    STEP,
    TGS,
    Asked,
    engine,
    rows,
)
from tests.scenes import peer as peer_scenes

GROUND = RigidBody(name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0))
CPODES = ("simbody", "cpodes")
Lack = (
    tuple[str, Callable[[], Scene]] | tuple[str, Callable[[], Scene], Any]
)  # words, scene, what is observed


def on_ground(*shapes: Shape, of: tuple[float, ...] = (0.0, 0.0)) -> Scene:
    """Bodies of these shapes beside each other, of these restitutions."""
    bodies = (
        RigidBody(name=f"{k}", mass=1.0, shape=shape, position=(2.0 * k, 0.0, 1.0), material=Material(restitution=e))
        for k, (shape, e) in enumerate(zip(shapes, of, strict=False))
    )  # fmt: skip
    return Scene(bodies=(GROUND, *bodies), gravity=peer_scenes.GRAVITY)


def on_a_tyre() -> Scene:
    wheel = RigidBody(name="wheel", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.3))
    tyre = Tyre(
        name="tyre", between=("world", "wheel"), axis=(0.0, 1.0, 0.0), radius=0.3, stiffness=1e4, longitudinal=1e4,
        cornering=1e4, friction=1.0,
    )  # fmt: skip
    return Scene(bodies=(wheel,), constraints=(tyre,))


def particles(
    *velocities: tuple[float, float, float], rods: tuple[Any, ...] = (), pull: bool = False
) -> Scene:
    """On a line along y, on rods from these points to the first, maybe drawn to a centre."""
    bodies = (
        Particle(name=f"{k}", mass=1.0, position=(1.0, 1.0 * k, 0.0), velocity=v) for k, v in enumerate(velocities)
    )  # fmt: skip
    lines = (Distance(name=f"rod {p}", between=(p, "0"), compliance=0.0) for p in rods)
    suns = (CentralGravity(name="sun", centre=(0.0, 0.0, 0.0), strength=1.0),) if pull else ()
    return Scene(bodies=tuple(bodies), constraints=tuple(lines), forces=suns, gravity=peer_scenes.GRAVITY)


def beside_its_centre() -> Scene:
    box = RigidBody(name="box", mass=1.0, shape=Box((1.0, 1.0, 1.0)), position=(0, 0, 2))
    ends = {"between": ((0.0, 0.0, 3.0), "box"), "anchors": ((0, 0, 0), (0.5, 0.0, 0.0))}
    return Scene(bodies=(box,), constraints=(Distance(name="rod", compliance=0.0, **ends),))  # type: ignore[arg-type]


def spinning() -> Scene:
    nods = peer_scenes.nodding()
    return replace(nods, bodies=nods.bodies[:1], constraints=nods.constraints[:1])


ON, LOG, CUBE = peer_scenes.box_on_ground, Cylinder(0.5, 1.0), Box((1.0, 1.0, 1.0))
BOX_FORCE = {"f": Final(quantity=ContactForce("box"))}
RUBBED = ("does not support a contact force with friction", lambda: ON(0.0), BOX_FORCE)
TENDON = (
    "motrixsim does not know site, spatial, tendon of MJCF",
    lambda: particles((0, 0, 0), rods=((0, 0, 0), (0, 1, 0))),
)
STILL, PUSHED = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)


def force_of(name: str) -> Any:
    return {"f": Final(quantity=ConstraintForce(name))}


ROUGH = tuple(
    ("friction in a joint", functools.partial(peer_scenes.rough, kind)) for kind in (Hinge, Prismatic)
)

UNLIKE = (r"cannot ask .* different friction", lambda: peer_scenes.unlike(0.1, 0.5))


@rows(
    {
        DART_LOOSE: (
            ("no constraint of distance", peer_scenes.pendulum),
            ("no constraint for the prismatic", lambda: peer_scenes.hung(Prismatic)),
            ("where contacts or loops act", lambda: peer_scenes.hung(Ball), force_of("joint")),
            *ROUGH,
        ),
        DRAKE_LOOSE: (("only those of joints", peer_scenes.pendulum, force_of("rod")),),
        BULLET_LOOSE: (
            ("no constraint of distance", peer_scenes.pendulum),
            ("a slide as a constraint", lambda: peer_scenes.hung(Prismatic)),
            *ROUGH,
        ),
        BULLET: (
            ("the force fluid", lambda: replace(ON(0.0), forces=(Fluid(name="sea", density=1.0),))),
            ("different restitution", lambda: on_ground(Sphere(0.5), Sphere(0.5), of=(0.2, 0.8))),
            (
                r"does not support the force of 'rod \d', which turns",
                lambda: peer_scenes.chain(2),
                force_of("rod 1"),
            ),
            ("wrong for a ball joint", spinning, force_of("ball 0")),
        ),
        **dict.fromkeys((DART, SAP), (UNLIKE,)),
        MUJOCO_LOOSE: ROUGH,
        RK3: (("the shape box", lambda: ON(0.0)),),
        HELD_STEP: (("does not support the shape plane, friction, the shape box", lambda: ON(0.0)),),
        MERSON: (
            UNLIKE,
            ("boxes touch planes alone", lambda: on_ground(CUBE, CUBE)),
            (r"simbody \(merson\) does not support restitution", lambda: on_ground(Sphere(0.5), of=(0.5,))),
            ("at most 200 bodies", lambda: peer_scenes.beam(201)),
        ),
        CPODES: (
            ("corner sticks to", lambda: ON(0.0)),
            ("where nothing can move", lambda: peer_scenes.hung(Lock)),
        ),
        TGS: (
            UNLIKE,
            RUBBED,
            ("does not support the shape cylinder", lambda: on_ground(LOG, LOG)),
            ("our adapter cannot ask sapien for the joint tyre", on_a_tyre),
        ),
        RAPIER: (
            ("^our adapter cannot ask rapier3d for the shape cone$", lambda: on_ground(Cone(0.5, 1.0))),
            ("does not support the joint distance", peer_scenes.pendulum),
            RUBBED,
        ),
        RAPIER_JS: (
            ("^our adapter cannot ask rapier for the shape cone$", lambda: on_ground(Cone(0.5, 1.0))),
            (r"many-iterations. does not support the joint distance", peer_scenes.pendulum),
            RUBBED,
        ),
        JOLT: (("the observable contact force", lambda: ON(0.0), BOX_FORCE),),
        CANNON: (
            ("restitution", lambda: on_ground(CUBE, of=(0.5,))),
            ("beside a centre of mass", beside_its_centre),
        ),
        P2: (("leave a plane", lambda: particles(PUSHED, STILL)), ("the shape plane", lambda: ON(0.0))),
        BOX: ((r"^box3d \(many-substeps\) does not support the shape cylinder$", lambda: on_ground(LOG)),),
        MOTRIX: (TENDON, ("restitution", lambda: on_ground(Sphere(0.5), of=(0.5,)))),
        ("newton", "kamino"): ((r"newton \(kamino\) leaves distances free", peer_scenes.pendulum),),
        ("newton", "featherstone"): (
            (r"newton \(featherstone\) does not show contacts", lambda: ON(0.0), BOX_FORCE),
        ),
        **{
            (name, "rk4"): (
                (
                    f"our adapter cannot ask {name} for the force central gravity",
                    lambda: particles(STILL, pull=True),
                ),
            )
            for name in ("mjx", "mujoco_warp")
        },
    }
)
def test_what_it_lacks_is_not_supported_by_name(asked: Asked, owed: tuple[Lack, ...]) -> None:
    simulate = engine(asked)
    for words, scene, *observed in owed:
        with pytest.raises(NotSupported, match=words):
            simulate(scene(), time_step=STEP, steps=1, observe=observed[0] if observed else {})
