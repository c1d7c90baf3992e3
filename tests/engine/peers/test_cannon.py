"""cannon-es behind the protocol: SPOOK by another hand gives our answers. Skipped, with the reason, without it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    Ball,
    Box,
    ConstraintForce,
    Distance,
    Final,
    Hinge,
    Lock,
    Material,
    MaximumAbsolute,
    Particle,
    Plane,
    Position,
    RigidBody,
    Scene,
    Trace,
    Velocity,
    Violation,
    simulate,
)
from spook_tracker.engine.find import EngineMissing, find
from spook_tracker.engine.protocol import NotSupported

try:
    CANNON = find("cannon")
except EngineMissing as reason:
    pytest.skip(str(reason), allow_module_level=True)

STEP = 1.0 / 60.0  # s
GRAVITY = (0.0, 0.0, -9.81)


def chain(links: int) -> Scene:
    """Links of 1 m along x, let go; damped as cannon's relaxation over two steps does."""
    weights = [Particle(name=f"{k}", mass=1.0, position=(k + 1.0, 0.0, 0.0)) for k in range(links)]
    rods = [
        Distance(
            name=f"rod {k}",
            between=((0.0, 0.0, 0.0) if k == 0 else f"{k - 1}", f"{k}"),
            compliance=0.0,
            damping=2.0 * STEP,
        )
        for k in range(links)
    ]
    return Scene(bodies=tuple(weights), constraints=tuple(rods), gravity=GRAVITY)


def both(scene: Scene, seconds: float) -> tuple[Any, Any]:
    observe = {"path": Trace(quantity=Position()), "stretch": MaximumAbsolute(quantity=Violation())}
    ours = simulate(scene, time_step=STEP, duration=seconds, observe=observe)
    return ours, CANNON.simulate(scene, time_step=STEP, duration=seconds, observe=observe)


def test_a_pendulum_is_the_same_in_two_implementations_of_the_method() -> None:
    """Nothing is shared but the equations: 22 s apart by rounding. The stretch is that of the method, not none."""
    ours, theirs = both(chain(1), 22.0)

    assert np.abs(ours["path"] - theirs["path"]).max() < 1e-11
    assert float(theirs["stretch"][0]) == pytest.approx(6.71786e-3, rel=1e-5)


def test_a_short_chain_is_the_same_as_long_as_iterations_solve_it() -> None:
    ours, theirs = both(chain(3), 1.0)

    assert np.abs(ours["path"] - theirs["path"]).max() < 1e-9


def test_the_tension_of_a_rod_is_that_of_the_method() -> None:
    observe = {"tension": Trace(quantity=ConstraintForce("rod 0"), first=1)}
    ours, theirs = (
        run(chain(1), time_step=STEP, duration=4.0, observe=observe)["tension"]
        for run in (simulate, CANNON.simulate)
    )

    assert ours.max() > 2.9 * 9.81, "three times the weight at the bottom, less what the method loses"
    assert np.abs(ours - theirs).max() < 1e-8


def test_a_fall_has_the_error_of_the_symplectic_step() -> None:
    ball = Particle(name="ball", mass=2.0, position=(0.0, 0.0, 0.0), velocity=(1.0, 0.0, 0.0))
    scene = Scene(bodies=(ball,), gravity=GRAVITY)
    observe = {"place": Final(quantity=Position("ball")), "speed": Final(quantity=Velocity("ball"))}
    run = CANNON.simulate(scene, time_step=STEP, steps=120, observe=observe)

    assert run["place"][2] == pytest.approx(-0.5 * 9.81 * 2.0 * (2.0 + STEP), rel=1e-12)
    assert run["place"][0] == pytest.approx(2.0, rel=1e-12)
    assert run["speed"][2] == pytest.approx(-9.81 * 2.0, rel=1e-12)


@pytest.mark.parametrize("kind", [Ball, Hinge, Lock])
def test_a_joint_holds_a_hanging_box(kind: Any) -> None:
    box = RigidBody(name="box", mass=2.0, shape=Box((0.2, 0.2, 0.2)), position=(0.0, 0.0, -1.0))
    more = {"axis": (0.0, 1.0, 0.0)} if kind is Hinge else {}
    joint = kind(name="joint", between=("world", "box"), at=(0.0, 0.0, 0.0), **more)
    scene = Scene(bodies=(box,), constraints=(joint,), gravity=GRAVITY)
    run = CANNON.simulate(
        scene, time_step=STEP, duration=2.0, observe={"path": Trace(quantity=Position("box"))}
    )

    assert np.abs(run["path"] - [0.0, 0.0, -1.0]).max() < 1e-6


def test_a_box_rests_on_a_plane_and_equal_runs_are_equal() -> None:
    rough = Material(friction=0.5)
    ground = RigidBody(
        name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=rough
    )
    box = RigidBody(
        name="box", mass=1.0, shape=Box((1.0, 1.0, 1.0)), position=(0.0, 0.0, 0.5), material=rough
    )
    scene = Scene(bodies=(ground, box), gravity=(1.0, 0.0, -9.81))
    observe = {"place": Final(quantity=Position("box"))}
    one, two = (CANNON.simulate(scene, time_step=STEP, duration=2.0, observe=observe) for _ in range(2))

    assert one["place"][2] == pytest.approx(0.5, abs=1e-2)
    assert abs(one["place"][0]) < 1e-2, "friction holds a pull of a tenth of the weight"
    assert one.state_hash == two.state_hash


def test_what_it_lacks_is_not_supported_by_name_before_anything_runs() -> None:
    box = RigidBody(
        name="box",
        mass=1.0,
        shape=Box((1.0, 1.0, 1.0)),
        material=Material(restitution=0.5),
        position=(0, 0, 2),
    )
    ground = RigidBody(name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0))
    with pytest.raises(NotSupported, match="restitution"):
        CANNON.simulate(Scene(bodies=(box, ground), gravity=GRAVITY), time_step=STEP, steps=1)
    rod = Distance(
        name="rod", between=((0.0, 0.0, 3.0), "box"), anchors=((0, 0, 0), (0.5, 0.0, 0.0)), compliance=0.0
    )
    with pytest.raises(NotSupported, match="beside a centre of mass"):
        CANNON.simulate(Scene(bodies=(box,), constraints=(rod,), gravity=GRAVITY), time_step=STEP, steps=1)


@pytest.mark.parametrize(("kept_apart", "moves"), [((), True), ((("b", "a"),), False)])
def test_pairs_that_must_not_touch_do_not(kept_apart: Any, moves: bool) -> None:
    """Two boxes that overlap by half: pushed apart, unless they must not touch, whichever is named first."""
    boxes = [
        RigidBody(name=name, mass=1.0, shape=Box((1.0, 1.0, 1.0)), position=(0.5 * k, 0.0, 0.0))
        for k, name in enumerate("ab")
    ]
    scene = Scene(bodies=tuple(boxes), no_contact=kept_apart)
    run = CANNON.simulate(scene, time_step=STEP, steps=5, observe={"end": Final(quantity=Position("a"))})

    assert (abs(float(run["end"][0])) > 1e-3) is moves
