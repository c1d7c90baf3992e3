"""Relations, wires and the joints that hold less: against dense NumPy steps, closed forms and statics."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    AngularVelocity,
    Ball,
    Box,
    ConstraintForce,
    Cylindrical,
    Energy,
    Final,
    Hinge,
    JointCoordinate,
    Limit,
    Load,
    Lock,
    MaximumAbsolute,
    Method,
    MethodError,
    Momentum,
    Motor,
    Orientation,
    Particle,
    Planar,
    PointOnLine,
    Position,
    Prismatic,
    Ramp,
    Relation,
    RigidBody,
    Scene,
    SceneError,
    Sphere,
    Trace,
    Velocity,
    Violation,
    Wire,
    recorded_joints,
    simulate,
    start,
)
from spook_tracker.engine.protocol import Capabilities, unsupported

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
H = 0.01


def rotor(name: str, inertia: float, x: float = 0.0, mass: float = 1.0) -> RigidBody:
    return RigidBody(name=name, mass=mass, inertia=(inertia, inertia, inertia), position=(x, 0.0, 0.0))


def axle(name: str, first: str = WORLD, **changes: Any) -> Hinge:
    return Hinge(name=f"{name} axle", between=(first, name), axis=Z, compliance=0.0, **changes)


def pair(
    first: float = 3.0, second: float = 2.0, compliance: float = 0.0, torque: float = 1.0, **drive: Any
) -> Scene:
    """Two wheels of 1 and 4 kg m² that mesh with `first` and `second` teeth; a torque on the first."""
    return Scene(
        bodies=(rotor("a", 1.0), rotor("b", 4.0, 2.0)),
        constraints=(
            axle("a", **drive),
            axle("b"),
            Relation(name="mesh", terms=(("a axle", first), ("b axle", second)), compliance=compliance),
        ),
        forces=(Load(name="torque", body="a", torque=(0.0, 0.0, torque)),),
    )


@pytest.mark.parametrize(
    "method", [Method(), Method(solver="iterative", iterations=2000), Method(corrections=1)]
)
def test_gears_share_a_torque_as_their_teeth_say(method: Method) -> None:
    # a = T/(J_a + J_b (z_a/z_b)²) is steady: exact in the velocities of small turns.
    scene = pair(torque=1e-3)
    observe = {"mesh": Final(quantity=ConstraintForce("mesh"))}
    result = simulate(scene, time_step=H, steps=100, method=method, observe=observe)
    ratio, a = 1.5, 1e-3 / (1.0 + 4.0 * 1.5**2)
    w = result.final_state["a"][12], result.final_state["b"][12]

    assert w[0] == pytest.approx(a, rel=1e-8)
    assert w[1] == pytest.approx(-ratio * a, rel=1e-8)
    assert 2.0 * float(result["mesh"]) == pytest.approx(-4.0 * ratio * a, rel=1e-7)


def test_a_compliant_relation_is_the_row_of_the_method() -> None:
    """The discrete step of M, G = (3, 2) by hand, in the angles a hinge of tiny turns has."""
    eps, theta, mass = 2e-3, 2.0, np.diag([1.0, 4.0])
    ups = 1.0 / (1.0 + 4.0 * theta)
    sig = 4.0 * eps * ups / H**2
    g = np.array([[3.0, 2.0]])
    q, v = np.zeros(2), np.zeros(2)
    turned = [q.copy()]
    for _ in range(80):
        kkt = np.block([[mass, -g.T], [g, np.array([[sig]])]])
        right = np.concatenate([mass @ v + H * np.array([1e-4, 0.0]), -4.0 / H * ups * g @ q + ups * g @ v])
        v = np.linalg.solve(kkt, right)[:2]
        q = q + H * v
        turned.append(q.copy())
    observe = {k: Trace(quantity=JointCoordinate(f"{k} axle")) for k in "ab"}
    result = simulate(pair(compliance=eps, torque=1e-4), time_step=H, steps=80, observe=observe)

    np.testing.assert_allclose(np.stack([result["a"], result["b"]], axis=1), turned, rtol=0, atol=1e-13)


def test_ratios_hold_over_many_turns_and_turns_are_counted() -> None:
    scene = pair(torque=0.0, motor=Motor(speed=20.0))
    observe = {
        "a": Final(quantity=JointCoordinate("a axle")),
        "b": Final(quantity=JointCoordinate("b axle")),
        "off": MaximumAbsolute(quantity=Violation("mesh")),
    }
    result = simulate(scene, time_step=1e-3, steps=10_000, observe=observe)

    # A step turns by φ with sin φ = h ω, which is (h ω)³/6 more than h ω: the row meets Σ c (h ω)³/6 in every step
    # and stands off by θ = 2 times that, for ever: 1e-5 rad of mesh after 32 turns.
    standing = 2.0 * (2.0 * 0.03**3 - 3.0 * 0.02**3) / 6.0
    assert float(result["a"]) > 190.0
    assert 3.0 * float(result["a"]) + 2.0 * float(result["b"]) == pytest.approx(-standing, rel=1e-3)
    assert float(result["off"]) == pytest.approx(standing, rel=1e-3)


def test_a_rack_and_a_screw_turn_a_push_into_a_turn() -> None:
    for coefficient in (0.25, -0.05 / (2.0 * math.pi)):  # radius; pitch
        slide = Prismatic(name="slide", between=(WORLD, "rack"), axis=X, compliance=0.0)
        relation = Relation(name="mesh", terms=(("slide", 1.0), ("pinion axle", coefficient)), compliance=0.0)
        scene = Scene(
            bodies=(rotor("rack", 1.0, mass=3.0), rotor("pinion", 0.2, 5.0)),
            constraints=(slide, axle("pinion"), relation),
            forces=(Load(name="push", body="rack", force=(1e-3, 0.0, 0.0)),),
        )
        state = simulate(scene, time_step=H, steps=100).final_state
        a = 1e-3 / (3.0 + 0.2 / coefficient**2)

        assert state["rack"][7] == pytest.approx(a, rel=1e-8)
        assert state["pinion"][12] == pytest.approx(-a / coefficient, rel=1e-8)


def test_a_differential_gives_both_sides_half_the_torque() -> None:
    wheels = (rotor("left", 1.0), rotor("right", 2.0, 1.0), rotor("cage", 0.5, 2.0))
    relation = Relation(
        name="differential",
        terms=(("left axle", 1.0), ("right axle", 1.0), ("cage axle", -2.0)),
        compliance=0.0,
    )
    scene = Scene(
        bodies=wheels,
        constraints=(*(axle(wheel.name) for wheel in wheels), relation),
        forces=(Load(name="engine", body="cage", torque=(0.0, 0.0, 1e-3)),),
    )
    result = simulate(scene, time_step=H, steps=100)
    w = {name: state[12] for name, state in result.final_state.items()}

    assert w["left"] + w["right"] == pytest.approx(2.0 * w["cage"], rel=1e-9)
    assert 1.0 * w["left"] == pytest.approx(2.0 * w["right"], rel=1e-9)  # equal torques
    # T = J_c w_c' + 2 S, S = J_l w_l' = J_r w_r'
    assert 0.5 * w["cage"] + 2.0 * w["left"] == pytest.approx(1e-3, rel=1e-9)


def test_the_casing_feels_what_the_gears_do_not_balance() -> None:
    """Held still by two torques in the ratio of the teeth, the axles' bearings carry the sum."""
    gears = pair(torque=3.0)
    back = Load(name="back", body="b", torque=(0.0, 0.0, 2.0))
    scene = Scene(bodies=gears.bodies, constraints=gears.constraints, forces=(*gears.forces, back))
    observe = {"mesh": Final(quantity=ConstraintForce("mesh")), "w": MaximumAbsolute(quantity=Velocity())}
    result = simulate(scene, time_step=H, steps=50, observe=observe)

    assert float(result["mesh"]) == pytest.approx(-1.0, rel=1e-12)
    assert abs(result.final_state["a"][12]) < 1e-15


def test_bounded_rows_and_contacts_go_with_relations_of_two_bodies() -> None:
    scene = pair(torque=5.0, limit=Limit(lower=-1.0, upper=0.3))
    observe = {"b": Trace(quantity=JointCoordinate("b axle"))}
    turned = simulate(scene, time_step=H, steps=600, observe=observe)["b"]

    assert float(turned[-1]) == pytest.approx(-0.45, abs=1e-6)


# --- wires ------------------------------------------------------------------------------------------------


def masses(one: float = 3.0, two: float = 1.0) -> Scene:
    """Two weights on a wire over two eyes."""
    return Scene(
        bodies=(
            Particle(name="one", mass=one, position=(-1.0, 0.0, 0.0)),
            Particle(name="two", mass=two, position=(1.0, 0.0, -1.0)),
        ),
        constraints=(
            Wire(
                name="wire",
                through=(
                    ("one", (-1.0, 0.0, 0.0)),
                    (WORLD, (-1.0, 0.0, 5.0)),
                    (WORLD, (1.0, 0.0, 5.0)),
                    ("two", (1.0, 0.0, -1.0)),
                ),
                compliance=0.0,
            ),
        ),
        gravity=(0.0, 0.0, -10.0),
    )


@pytest.mark.parametrize("solver", ["direct", "iterative"])
def test_atwood(solver: Any) -> None:
    observe = {"pull": Trace(quantity=ConstraintForce("wire")), "v": Trace(quantity=Velocity())}
    result = simulate(
        masses(), time_step=H, steps=60, method=Method(solver=solver, iterations=500), observe=observe
    )
    times = H * np.arange(61)

    np.testing.assert_allclose(result["v"][:, 0, 2], -5.0 * times, rtol=0, atol=1e-10)
    np.testing.assert_allclose(result["v"][:, 1, 2], 5.0 * times, rtol=0, atol=1e-10)
    np.testing.assert_allclose(result["pull"][1:], 15.0, rtol=1e-10)


def test_a_tackle_holds_n_times_its_pull() -> None:
    """Four strands carry the block: 40 kg against 10 kg."""
    block = RigidBody(name="block", mass=40.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.0))
    weight = Particle(name="weight", mass=10.0, position=(4.0, 0.0, 0.0))
    eyes = ((-0.3, 0.0), (-0.1, 0.1), (0.1, 0.2), (0.3, 0.3))
    through: list[tuple[str, tuple[float, float, float]]] = [(WORLD, (-0.3, 0.0, 3.0))]
    for (down, _), up in zip(eyes[::2], (0.1, 4.0), strict=True):
        through += [("block", (down, 0.0, 0.0)), (WORLD, (down + 0.0, 0.0, 3.5))]
        if up < 4.0:
            continue
        through += [(WORLD, (4.0, 0.0, 3.5))]
    wire = Wire(name="wire", through=(*through, ("weight", (4.0, 0.0, 0.0))), compliance=0.0)
    guide = Prismatic(name="guide", between=(WORLD, "block"), axis=Z, compliance=0.0)
    scene = Scene(bodies=(block, weight), constraints=(wire, guide), gravity=(0.0, 0.0, -10.0))
    # As many strands as end on the block, each all but vertical: the force is the sum of their slopes.
    points = [np.array(point) for _, point in wire.through]
    slope = sum(
        abs(b[2] - a[2]) / np.linalg.norm(b - a)
        for (first, _), (second, _), a, b in zip(
            wire.through, wire.through[1:], points, points[1:], strict=False
        )
        if "block" in (first, second)
    )
    observe = {"pull": Final(quantity=ConstraintForce("wire"))}
    result = simulate(scene, time_step=1e-4, steps=1, observe=observe)
    # M a = n S − M g, m n a = m g − S: one degree of freedom.
    a = (slope * 10.0 * 10.0 - 40.0 * 10.0) / (40.0 + 10.0 * slope**2)

    assert float(result["pull"]) == pytest.approx(40.0 * (a + 10.0) / slope, rel=1e-6)


def test_a_slack_rope_is_not_there() -> None:
    scene = Scene(
        bodies=(Particle(name="stone", mass=2.0, position=(0.0, 0.0, 0.0)),),
        constraints=(
            Wire(name="rope", through=((WORLD, (0.0, 0.0, 1.0)), ("stone", (0.0, 0.0, 0.0))), length=9.0),
        ),
        gravity=(0.0, 0.0, -10.0),
    )
    free = Scene(bodies=scene.bodies, gravity=scene.gravity)
    seen = [
        simulate(s, time_step=H, steps=100, observe={"x": Trace(quantity=Position("stone"))})["x"]
        for s in (scene, free)
    ]

    np.testing.assert_allclose(seen[0], seen[1], rtol=0, atol=1e-12)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("phase", [0.0, 0.25, 0.7])
def test_a_rope_that_snaps_taut_is_a_blow(restitution: float, phase: float) -> None:
    """Momentum stays, the parting speed u becomes −e u, ½ µ u² (1 − e²) is lost."""
    one, two, u = 3.0, 2.0, 4.0
    scene = Scene(
        bodies=(
            Particle(name="one", mass=one, position=(0.0, 0.0, 0.0)),
            Particle(name="two", mass=two, position=(1.0, 0.0, 0.0), velocity=(u, 0.0, 0.0)),
        ),
        constraints=(
            Wire(
                name="rope",
                through=(("one", (0.0, 0.0, 0.0)), ("two", (1.0, 0.0, 0.0))),
                length=2.0 + phase * u * H,
                restitution=restitution,
                compliance=0.0,
            ),
        ),
    )
    observe = {
        "v": Trace(quantity=Velocity()),
        "p": Trace(quantity=Momentum()),
        "E": Trace(quantity=Energy()),
        "g": Trace(quantity=Violation("rope")),
    }
    result = simulate(scene, time_step=H, steps=30, observe=observe)
    v, reduced = result["v"], one * two / (one + two)
    apart = v[:, 1, 0] - v[:, 0, 0]

    assert apart[-1] == pytest.approx(-restitution * u, abs=1e-9)
    np.testing.assert_allclose(result["p"][:, 0], two * u, rtol=1e-12)
    assert result["E"][0] - result["E"][-1] == pytest.approx(
        0.5 * reduced * u**2 * (1 - restitution**2), abs=1e-9
    )
    assert result["g"].max() <= u * H + 1e-9
    assert np.all(np.diff(result["E"]) <= 1e-12)


def test_a_wire_that_may_not_go_slack_is_a_row_of_its_length() -> None:
    bodies = (Particle(name="one", mass=1.0, position=(0.0, 0.0, 0.0), velocity=(0.0, 1.0, 0.0)),)
    wire = Wire(
        name="rod", through=((WORLD, (1.0, 0.0, 0.0)), ("one", (0.0, 0.0, 0.0))), slack=False, compliance=0.0
    )
    observe = {"g": MaximumAbsolute(quantity=Violation("rod")), "T": Final(quantity=ConstraintForce("rod"))}
    result = simulate(Scene(bodies=bodies, constraints=(wire,)), time_step=1e-3, steps=500, observe=observe)

    assert float(result["g"]) < 1e-5
    assert float(result["T"]) == pytest.approx(1.0, rel=5e-3)  # m v²/r


# --- joints that hold less ----------------------------------------------------------------------------------


FREE: dict[
    type, tuple[tuple[int, ...], tuple[int, ...]]
] = {  # translations, rotations along x, y, z that are free
    PointOnLine: ((2,), (0, 1, 2)),
    Cylindrical: ((2,), (2,)),
    Planar: ((0, 1), (2,)),
}


@pytest.mark.parametrize("kind", FREE)
def test_each_holds_what_it_says_and_leaves_the_rest_free(kind: Any) -> None:
    body = RigidBody(name="body", mass=2.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.0))
    joint = kind(name="joint", between=(WORLD, "body"), axis=Z, compliance=0.0)
    for k in range(3):
        push = tuple(1e-3 * float(i == k) for i in range(3))
        for field, free, at, inertia in (
            ("force", FREE[kind][0], 7, 2.0),
            ("torque", FREE[kind][1], 10, 1.0),
        ):
            load = Load(name="push", body="body", **{field: push})
            scene = Scene(bodies=(body,), constraints=(joint,), forces=(load,))
            observe = {"f": Final(quantity=ConstraintForce("joint")), "g": Final(quantity=Violation("joint"))}
            result = simulate(scene, time_step=H, steps=50, observe=observe)
            speed = result.final_state["body"][at + k]
            held = result["f"][k + (0 if field == "force" else 3)]

            assert result["g"].shape == (kind.rows,)
            if k in free:
                assert speed == pytest.approx(1e-3 * 0.5 / inertia, rel=1e-9)
                assert abs(held) < 1e-15
            else:
                assert abs(speed) < 1e-15
                assert held == pytest.approx(-1e-3, rel=1e-9)


@pytest.mark.parametrize("kind", FREE)
@pytest.mark.parametrize("method", [Method(), Method(corrections=1), Method(composition="order4")])
def test_energy_is_kept_while_they_move(kind: Any, method: Method) -> None:
    """A spinning body with three different moments on a joint at its side; order 4 keeps its energy to 1e-6."""
    body = RigidBody(
        name="body",
        mass=2.0,
        inertia=(1.0, 1.5, 2.0),
        position=(0.3, 0.1, 0.0),
        velocity=(0.2, 0.1, 0.0),
        angular_velocity=(0.0, 0.0, 1.0),
    )
    joint = kind(name="joint", between=(WORLD, "body"), at=(0.3, 0.1, 0.0), axis=Z, compliance=0.0)
    if kind is not Planar:
        body = RigidBody(
            name="body",
            mass=2.0,
            inertia=(1.0, 1.5, 2.0),
            position=(0.3, 0.1, 0.0),
            velocity=(0.0, 0.0, 0.3),
            angular_velocity=(0.0, 0.0, 1.0) if kind is Cylindrical else (0.4, -0.2, 1.0),
        )
    observe = {
        "E": Trace(quantity=Energy()),
        "g": MaximumAbsolute(quantity=Violation("joint")),
    }
    result = simulate(
        Scene(bodies=(body,), constraints=(joint,)), time_step=H, steps=200, method=method, observe=observe
    )
    rest = result["E"][0]

    assert np.abs(result["g"]).max() < 1e-6
    assert np.abs(result["E"] - rest).max() < 1e-4 * rest


@pytest.mark.parametrize("kind", FREE)
def test_a_recording_reads_the_same_violations(kind: Any) -> None:
    """Two bodies on a soft joint, both moving: the rows of the engine and those found from places and turns."""
    bodies = tuple(
        RigidBody(
            name=name,
            mass=mass,
            inertia=(1.0, 1.5, 2.0),
            position=(x, 0.2, 0.0),
            velocity=(0.1, x, -0.2),
            angular_velocity=(0.3, -x, 0.4),
        )
        for name, mass, x in (("one", 1.0, 0.0), ("two", 2.0, 1.0))
    )
    joint = kind(
        name="joint", between=("one", "two"), at=(0.4, 0.1, 0.3), axis=(1.0, 2.0, 2.0), compliance=0.1
    )
    scene = Scene(bodies=bodies, constraints=(joint,))
    observe = {
        "g": Trace(quantity=Violation("joint")),
        "x": Trace(quantity=Position()),
        "q": Trace(quantity=Orientation()),
    }
    result = simulate(scene, time_step=H, steps=100, observe=observe)

    assert np.abs(result["g"][-1]).min() > 1e-4
    np.testing.assert_allclose(
        recorded_joints.violation(scene, joint, result["x"], result["q"]), result["g"], rtol=0, atol=1e-13
    )


def test_other_engines_are_not_asked_for_what_they_lack() -> None:
    able = Capabilities(
        particles=True,
        rigid_bodies=True,
        joints=frozenset({Lock, Hinge}),
        forces=frozenset({Load}),
        motors=True,
        compliance=True,
    )
    assert unsupported(able, masses(), {}) == ("the joint wire",)
    assert "the joint relation" in unsupported(able, pair(), {})
    assert unsupported(able, hung(strength=1.0), {}) == ("a joint that breaks", "functions of time")


# --- joints that break, and that rub ------------------------------------------------------------------------


def hung(**strength: Any) -> Scene:
    """2 kg on a lock, pulled down by a force that grows by 10 N a second."""
    body = RigidBody(name="body", mass=2.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.0))
    lock = Lock(name="lock", between=(WORLD, "body"), compliance=0.0, **strength)
    pull = Load(
        name="pull",
        body="body",
        force=(0.0, 0.0, -1.0),
        torque=(1.0, 0.0, 0.0),
        factor=Ramp(end=10.0, end_value=100.0),
    )
    return Scene(bodies=(body,), constraints=(lock,), forces=(pull,), gravity=(0.0, 0.0, -10.0))


@pytest.mark.parametrize(
    ("strength", "breaks_at"), [({"strength": 30.0}, 1.0), ({"torque_strength": 5.0}, 0.5), ({}, None)]
)
@pytest.mark.parametrize("solver", ["direct", "iterative"])
def test_a_joint_breaks_under_more_than_its_strength_and_holds_nothing_then(
    strength: Any, breaks_at: float | None, solver: Any
) -> None:
    observe = {"f": Trace(quantity=ConstraintForce("lock")), "v": Trace(quantity=Velocity("body"))}
    method = Method(solver=solver, iterations=200, residual_tolerance=1e-14)
    result = simulate(hung(**strength), time_step=H, steps=150, method=method, observe=observe)
    held = 20.0 + 10.0 * H * np.arange(150)  # N, in each step: the load is taken at its beginning
    if breaks_at is None:
        np.testing.assert_allclose(result["f"][1:, 2], held, rtol=1e-9)
        return
    last = int(np.flatnonzero(result["f"][:, 2])[-1])  # the load it broke at is the last it shows
    np.testing.assert_allclose(result["f"][1 : last + 1, 2], held[:last], rtol=1e-9)
    assert (last - 1) * H == pytest.approx(breaks_at + H, abs=1e-9)
    assert not result["f"][last + 1 :].any()
    falls = np.diff(result["v"][last:, 2])
    np.testing.assert_allclose(falls, -H * held[last:] / 2.0, rtol=1e-9)


def test_a_wire_breaks_and_what_is_saved_before_is_whole_again() -> None:
    stone = Particle(name="stone", mass=2.0, position=(0.0, 0.0, 0.0))
    wire = Wire(name="wire", through=((WORLD, (0.0, 0.0, 1.0)), ("stone", (0.0, 0.0, 0.0))), strength=25.0)
    more = Load(name="more", body="stone")
    scene = Scene(bodies=(stone,), constraints=(wire,), forces=(more,), gravity=(0.0, 0.0, -10.0))
    with start(scene, time_step=H, observe={"pull": ConstraintForce("wire")}) as run:
        run.step(10)
        saved = run.save()
        run.set_load("more", force=(0.0, 0.0, -6.0))
        run.step(2)
        assert float(run["pull"]) == 0.0
        run.restore(saved)
        run.step(100)
        assert float(run["pull"]) == pytest.approx(20.0, rel=1e-6)


def test_a_motor_that_wants_to_stand_is_dry_friction() -> None:
    """3 rad/s against 0.5 N m on 2 kg m²: 12 s of even slowing down, then rest; no more torque than what acts."""
    wheel = RigidBody(
        name="wheel",
        mass=1.0,
        inertia=(2.0, 2.0, 2.0),
        position=(0.0, 0.0, 0.0),
        angular_velocity=(0.0, 0.0, 3.0),
    )
    rubbing = Hinge(name="axle", between=(WORLD, "wheel"), axis=Z, motor=Motor(speed=0.0, max_force=0.5))
    push = Load(name="push", body="wheel", torque=(0.0, 0.0, 0.1))
    observe = {"w": Trace(quantity=AngularVelocity("wheel")), "f": Final(quantity=ConstraintForce("axle"))}
    result = simulate(
        Scene(bodies=(wheel,), constraints=(rubbing,), forces=(push,)),
        time_step=H,
        steps=1600,
        observe=observe,
    )
    times = H * np.arange(1601)

    np.testing.assert_allclose(result["w"][:, 2], np.maximum(0.0, 3.0 - 0.2 * times), rtol=0, atol=1e-10)
    assert result["f"][5] == pytest.approx(-0.1, rel=1e-9)


def three() -> Scene:
    wheels = (rotor("a", 1.0), rotor("b", 1.0, 1.0), rotor("c", 1.0, 2.0))
    terms = tuple((f"{wheel.name} axle", 1.0) for wheel in wheels)
    return Scene(
        bodies=wheels, constraints=(*(axle(w.name) for w in wheels), Relation(name="sum", terms=terms))
    )


def solid(scene: Scene) -> Scene:
    extra = tuple(
        RigidBody(name=f"ball {k}", mass=1.0, shape=Sphere(0.1), position=(9.0, k, 0.0)) for k in range(2)
    )
    return Scene(bodies=(*scene.bodies, *extra), constraints=scene.constraints)


def limited() -> Scene:
    scene = three()
    held = Hinge(name="d", between=(WORLD, "a"), axis=Z, limit=Limit(lower=-1.0, upper=1.0))
    return Scene(bodies=scene.bodies, constraints=(*scene.constraints, held))


def run(scene: Scene, **method: Any) -> Any:
    return simulate(scene, time_step=H, steps=1, method=Method(**method))


HOSTILE: dict[str, tuple[Any, type, str]] = {
    "ratio 0": (
        lambda: Relation(name="r", terms=(("a", 0.0), ("b", 1.0))),
        SceneError,
        "coefficient of 'a' is 0",
    ),
    "NaN": (lambda: Relation(name="r", terms=(("a", math.nan), ("b", 1.0))), SceneError, "finite"),
    "one joint": (lambda: Relation(name="r", terms=(("a", 1.0),)), SceneError, "at least two"),
    "twice": (lambda: Relation(name="r", terms=(("a", 1.0), ("a", 2.0))), SceneError, "twice"),
    "no pairs": (lambda: Relation(name="r", terms=("ab", 1.0)), SceneError, "pairs"),  # type: ignore[arg-type]
    "stranger": (
        lambda: Scene(
            bodies=(rotor("a", 1.0),),
            constraints=(axle("a"), Relation(name="r", terms=(("a axle", 1.0), ("ghost", 1.0)))),
        ),
        SceneError,
        "'ghost'",
    ),
    "no coordinate": (
        lambda: Scene(
            bodies=(rotor("a", 1.0),),
            constraints=(
                axle("a"),
                Ball(name="ball", between=(WORLD, "a")),
                Relation(name="r", terms=(("a axle", 1.0), ("ball", 1.0))),
            ),
        ),
        SceneError,
        "'ball'",
    ),
    "three bodies that touch": (
        lambda: run(solid(three())),
        MethodError,
        "relation 'sum' ties more than two",
    ),
    "three bodies and a limit": (lambda: run(limited()), MethodError, "a limit in 'd'"),
    "three bodies by sweeps": (lambda: run(three(), solver="iterative"), MethodError, "plain direct"),
    "three bodies curved": (lambda: run(three(), corrections=1), MethodError, "plain direct"),
    "short wire": (lambda: Wire(name="w", through=((WORLD, X),)), SceneError, "two points"),
    "through itself": (
        lambda: Wire(name="w", through=((WORLD, Z), ("a", X), ("a", Y), (WORLD, X))),
        SceneError,
        "on 'a', so that part",
    ),
    "no way": (lambda: Wire(name="w", through=((WORLD, X), ("a", X))), SceneError, "coincide"),
    "no length": (lambda: Wire(name="w", through=((WORLD, X), ("a", Y)), length=0.0), SceneError, "length"),
    "restitution": (
        lambda: Wire(name="w", through=((WORLD, X), ("a", Y)), restitution=1.5),
        SceneError,
        "between 0 and 1",
    ),
    "nowhere": (
        lambda: Scene(
            bodies=(rotor("a", 1.0),), constraints=(Wire(name="w", through=(("ghost", X), ("a", Y))),)
        ),
        SceneError,
        "'ghost'",
    ),
    "off a particle": (
        lambda: Scene(
            bodies=(Particle(name="p", mass=1.0, position=X),),
            constraints=(Wire(name="w", through=((WORLD, Z), ("p", Y))),),
        ),
        SceneError,
        "only its centre",
    ),
    "nothing moves": (
        lambda: Scene(
            bodies=(
                RigidBody(name="wall", motion="static", shape=Box((1, 1, 1)), position=X),
                rotor("a", 1.0),
            ),
            constraints=(Wire(name="w", through=((WORLD, Z), ("wall", Y))),),
        ),
        SceneError,
        "nothing it runs through can move",
    ),
    "strength": (
        lambda: Lock(name="l", between=(WORLD, "a"), strength=0.0),
        SceneError,
        "strength must be positive",
    ),
    "strength of NaN": (
        lambda: Wire(name="w", through=((WORLD, X), ("a", Y)), strength=math.nan),
        SceneError,
        "strength must be finite",
    ),
    "composition of what breaks": (
        lambda: simulate(hung(strength=1.0), time_step=H, steps=1, method=Method(half_step_velocities=True)),
        MethodError,
        "a strength at which it breaks",
    ),
    "composition with a slack wire": (
        lambda: run(masses(), composition="order4"),
        MethodError,
        "may go slack",
    ),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_input_is_refused_with_one_sentence(name: str) -> None:
    act, kind, words = HOSTILE[name]
    with pytest.raises(kind, match=words) as caught:
        act()
    assert "\n" not in str(caught.value)
