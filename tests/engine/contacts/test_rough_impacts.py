"""Blows: friction while bodies rebound, no load no friction, no touch no change, and an answer not found says so."""

from __future__ import annotations

import dataclasses
import math
from itertools import pairwise

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularMomentum,
    AngularVelocity,
    Box,
    Capsule,
    ContactForce,
    KineticEnergy,
    Material,
    Method,
    Penetration,
    Plane,
    Position,
    RigidBody,
    Scene,
    Sphere,
    Trace,
    Velocity,
    simulate,
)
from tests.scenes.corpus import solid
from tests.scenes.seen import finals, maxima, traces

H = 1 / 60  # s
GRAVITY = (0.0, 0.0, -9.81)
STEPS = [1 / 60, 1 / 240, 1e-3]
SOLVERS = ["direct", "iterative"]


def floor(material: Material) -> RigidBody:
    return RigidBody(name="floor", motion="static", shape=Plane(), position=(0, 0, 0), material=material)


def ball(
    name: str, position: tuple[float, float, float], velocity: tuple[float, float, float], **fields: object
) -> RigidBody:
    given = {"mass": 1.0, "shape": Sphere(0.1)} | fields
    return RigidBody(name=name, position=position, velocity=velocity, **given)  # type: ignore[arg-type]


# Friction at a blow -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("model", ["cone", "box", "scaled_box"])
@pytest.mark.parametrize(
    ("h", "mu", "returned"),
    [
        *((h, mu, 0.0) for h in STEPS for mu in (0.2, 5.0)),  # sliding and gripping
        *((H, mu, returned) for mu, returned in ((5.0, 1.0), (5.0, 0.6), (0.2, 1.0), (0.0, 1.0))),
    ],
)
def test_a_ball_rubs_while_it_rebounds_and_turns_its_slip_round_as_far_as_friction_holds(
    solver: str, model: str, h: float, mu: float, returned: float
) -> None:
    """Half a ball's mass over 7/2 takes up the slip: the impulse is (1 + psi_t) 2/7 of it, at most mu (1 + psi) u, u = 2."""
    rubber = Material(friction=mu, restitution=0.8, tangential_restitution=returned)
    thrown = solid("ball", Sphere(0.1), (0, 0, 0.15), 2.0, (3.0, 0, -2.0), (0, -10.0, 0), material=rubber)
    end = simulate(
        Scene(bodies=(floor(rubber), thrown)),
        time_step=h,
        steps=round(0.1 / h),
        method=Method(solver=solver, friction=model),  # type: ignore[arg-type]
        observe=finals(v=Velocity("ball"), w=AngularVelocity("ball")),
    )

    slip = 3.0 + 10.0 * 0.1
    taken = min((1.0 + returned) * slip * 2.0 / 7.0, mu * 1.8 * 2.0)
    assert end["v"] == pytest.approx((3.0 - taken, 0.0, 1.6), abs=1e-9)
    assert end["w"] == pytest.approx((0.0, -10.0 + 2.5 * taken / 0.1, 0.0), abs=1e-7)


@pytest.mark.parametrize("h", STEPS)
@pytest.mark.parametrize("solver", SOLVERS)
def test_balls_that_rebound_are_where_both_their_speeds_lead(h: float, solver: str) -> None:
    """They meet .37 of a step after a step begins, off centre and rough, one of them or none fixed: until then they go
    with the velocity before, from then with that after. Sweeps led them with the latter for the whole step."""
    rough, meeting = Material(restitution=0.8, friction=0.3), 3.37 * h
    along, speed = np.array((0.8, 0.6, 0.0)), np.array((3.0, 0.0, 0.0))  # of the centres; of the first ball
    places = np.array((-0.3 * along - meeting * speed, (0.0, 0.0, 0.0)))
    for fixed in (False, True):
        struck = ball("struck", (0, 0, 0), (0, 0, 0), shape=Sphere(0.2), mass=2.0, material=rough)
        bodies = (
            ball("ball", tuple(places[0]), tuple(speed), material=rough),
            dataclasses.replace(struck, motion="static") if fixed else struck,
        )
        result = simulate(
            Scene(bodies=bodies),
            time_step=h,
            steps=6,
            method=Method(solver=solver),  # type: ignore[arg-type]
            observe=finals(x=Position("ball"), v=Velocity("ball")),
        )
        expected = -0.3 * along + (6 * h - meeting) * result["v"]

        assert result["v"] @ along < 0.0
        np.testing.assert_allclose(result["x"], expected, rtol=0, atol=1e-9)


def falling_rod(tilt: float, slip: float, moment: float, material: Material) -> RigidBody:
    """A metre long, .1 m over the ground, its lower end to the right; it falls at 1 m/s."""
    turn = 0.5 * (math.pi / 2 + tilt)
    return solid(
        "rod",
        Capsule(0.02, 1.0),
        (0.0, 0.0, 0.5 * math.sin(tilt) + 0.12),
        velocity=(slip, 0.0, -1.0),
        inertia=(moment,) * 3,
        orientation=(math.cos(turn), 0.0, math.sin(turn), 0.0),
        material=material,
    )


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("tilt", [0.4, 0.6, 1.0])
@pytest.mark.parametrize("slip", [0.0, 0.5, 1.0])
def test_the_end_of_a_rod_grips_where_it_rebounds(solver: str, tilt: float, slip: float) -> None:
    """A slender rod falls on its end: P = W⁻¹ (u₊ − u₋) with W = J M⁻¹ Jᵀ and u₊ = (0, −psi u₋), inside its cone of
    friction; what pushes it up turns it, too. Sweeps went in circles, and left it with a tenth of a m/s less."""
    psi, mu, moment = 0.8, 3.0, 0.01
    rough = Material(restitution=psi, friction=mu)
    rod = falling_rod(tilt, slip, moment, rough)
    jacobian = np.array(((1.0, 0.0, -0.5 * math.sin(tilt) - 0.02), (0.0, 1.0, -0.5 * math.cos(tilt))))
    yields = np.diag((1.0, 1.0, 1.0 / moment)) @ jacobian.T
    before, after = np.array((slip, -1.0)), np.array((0.0, psi))
    impulse = np.linalg.solve(jacobian @ yields, after - before)
    expected = np.array((slip, -1.0, 0.0)) + yields @ impulse
    result = simulate(
        Scene(bodies=(floor(rough), rod)),
        time_step=0.01,
        steps=12,
        method=Method(solver=solver),  # type: ignore[arg-type]
        observe=traces(v=Velocity("rod"), w=AngularVelocity("rod")),
    )
    hit = int(np.argmax(np.abs(result["v"][:, 2] + 1.0) > 1e-6))
    found = (result["v"][hit, 0], result["v"][hit, 2], result["w"][hit, 1])

    assert (
        abs(impulse[0]) < mu * impulse[1] and impulse @ (before + after) < 0.0
    )  # it grips, and gains nothing
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(("tilt", "slip", "mu"), [(0.8, -0.5, 2.0), (1.2, -1.0, 1.0)])
def test_an_impact_elsewhere_is_none_of_its_business(
    solver: str, tilt: float, slip: float, mu: float
) -> None:
    """Newton's law would raise this rod's energy, and is tempered; what a ball 30 m away loses in the same step is not
    there to be won."""
    rough = Material(restitution=0.8, friction=mu)
    far = ball("far", (30, 0, 0.2), (0, 0, -1), material=rough)
    ends = []
    for others in ((), (far,)):
        result = simulate(
            Scene(bodies=(floor(rough), falling_rod(tilt, slip, 0.01, rough), *others)),
            time_step=0.01,
            steps=12,
            method=Method(solver=solver),  # type: ignore[arg-type]
            observe=finals(v=Velocity("rod")) | traces(e=KineticEnergy()),
        )
        ends.append(result["v"].tolist())
        assert np.diff(result["e"]).max() <= 1e-12

    assert ends[0] == ends[1]


# No load, no friction -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("model", ["cone", "scaled_box"])
def test_no_load_no_friction(solver: str, model: str) -> None:
    """Plastic throws from whole numbers of steps away: in every step |J_t| <= mu J_n, whatever acted before."""
    mu = 0.5
    rough = Material(friction=mu)
    for k in range(1, 26):
        thrown = ball("ball", (0, 0, 0.1 + 3.0 * k * H / 5), (2.0, 0.3, -3.0), material=rough)
        result = simulate(
            Scene(bodies=(floor(rough), thrown)),
            time_step=H,
            steps=12,
            method=Method(solver=solver, friction=model),  # type: ignore[arg-type]
            observe={"f": Trace(quantity=ContactForce("ball"), first=1)},
        )
        force = result["f"]
        tangential = (
            np.hypot(force[:, 0], force[:, 1]) if model == "cone" else np.abs(force[:, :2]).max(axis=1)
        )
        assert (tangential <= mu * force[:, 2] * (1.0 + 1e-9) + 1e-9).all(), k


# No touch, no change ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("speed", "gap"), [(3.0, 0.01), (100.0, 0.4), (1000.0, 1e-4)])
@pytest.mark.parametrize(
    "shape", [Sphere(0.05), Box((0.1, 0.1, 0.1)), Capsule(0.05, 0.05)], ids=["ball", "box", "capsule"]
)
def test_what_passes_without_touching_is_not_touched(
    speed: float, gap: float, shape: Sphere | Box | Capsule
) -> None:
    half = 0.075 if isinstance(shape, Capsule) else 0.05
    going = ball("going", (-0.5, 0.01, 0.0), (speed, 0, 0), shape=shape)
    coming = ball("coming", (0.5, 0.0, 2 * half + gap), (-speed, 0, 0), shape=shape)
    result = simulate(Scene(bodies=(going, coming)), time_step=H, steps=30, observe=finals(v=Velocity()))

    assert result["v"].tolist() == [[speed, 0.0, 0.0], [-speed, 0.0, 0.0]]


@pytest.mark.parametrize("h", STEPS)
def test_an_off_centre_hit_goes_along_the_line_of_centres(h: float) -> None:
    """One ball at 3 m/s meets another at rest, half a radius off: normal at 30°, elastic, whatever the step."""
    elastic = Material(restitution=1.0)
    small = {"shape": Sphere(0.05), "material": elastic}
    bodies = (ball("cue", (-0.5, 0, 0), (3, 0, 0), **small), ball("other", (0, 0.05, 0), (0, 0, 0), **small))
    observe = finals(v=Velocity(), x=Position()) | traces(l=AngularMomentum())
    result = simulate(Scene(bodies=bodies), time_step=h, duration=0.4, observe=observe)
    normal = np.array((math.sqrt(0.75), 0.5, 0.0))
    given = 3.0 * normal[0] * normal

    np.testing.assert_allclose(result["v"][1], given, rtol=0, atol=1e-7)
    np.testing.assert_allclose(result["v"][0], np.array((3.0, 0, 0)) - given, rtol=0, atol=1e-7)
    assert np.abs(result["l"] - result["l"][0]).max() < 1e-13
    after = 0.4 - (0.5 - 0.1 * math.sqrt(0.75)) / 3.0  # s since the hit
    np.testing.assert_allclose(result["x"][1], np.array((0, 0.05, 0)) + after * given, rtol=0, atol=1e-7)


@pytest.mark.parametrize("h", [1 / 60, 1 / 240, 1 / 960])
@pytest.mark.parametrize("shape", [Sphere(0.05), Box((0.1, 0.1, 0.1))], ids=["ball", "box"])
def test_a_seam_of_two_faces_is_no_obstacle(h: float, shape: Sphere | Box) -> None:
    """A frictionless slide at 5 m/s from one box to the next, their tops in one plane."""
    tiles = [
        RigidBody(name=f"tile{k}", motion="static", shape=Box((2, 2, 1)), position=(2.0 * k, 0, -0.5))
        for k in range(2)
    ]
    slider = ball("slider", (0.013, 0, 0.05), (5, 0, 0), shape=shape)
    result = simulate(
        Scene(bodies=(*tiles, slider), gravity=GRAVITY),
        time_step=h,
        duration=0.4,
        observe=traces(v=Velocity("slider"), z=Position("slider")),
    )

    assert np.abs(result["v"] - (5.0, 0.0, 0.0)).max() < 1e-12
    assert np.abs(result["z"][:, 2] - 0.05).max() < 1e-12


@pytest.mark.parametrize(
    ("sweeps", "seed"),
    [(50, seed) for seed in (0, 5, 10, 11, 12, 18, 36, 106, 113)]
    + [(5, seed) for seed in (24, 58, 121, 128, 189)],
)
def test_iterations_see_no_step_where_tiles_go_on(sweeps: int, seed: int) -> None:
    """Tiles of random lengths in one plane, leaning so that nothing is exact: before its sweeps have settled a box sinks a
    little, and met the side of the next tile with that speed. Two slides in five ended so. Five sweeps leave a speed that
    the next step sank by: one slide in nine was thrown up."""
    rng = np.random.default_rng(seed)
    edges = np.concatenate(((-3.0,), np.sort(rng.uniform(-1.0, 8.0, 8)), (12.0,)))
    turn = rng.normal(size=4)
    w, x, y, z = turn = turn / np.linalg.norm(turn)
    frame = np.array(
        (
            (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        )
    )
    leaning = {"orientation": tuple(turn)}
    tiles = [
        RigidBody(
            name=f"tile{k}",
            motion="static",
            shape=Box((b - a, 6, 1)),
            position=tuple(frame @ (0.5 * (a + b), 0, -0.5)),
            **leaning,  # type: ignore[arg-type]
        )
        for k, (a, b) in enumerate(pairwise(edges))
    ]
    speed = frame @ (float(rng.uniform(3, 15)), 0.3, 0.0)
    place = tuple(frame @ (0.013, 0.1, 0.05))
    slider = ball("slider", place, tuple(speed), shape=Box((0.2, 0.15, 0.1)), **leaning)
    h = float(rng.choice((1 / 60, 1 / 240)))
    scene = Scene(bodies=(*tiles, slider), gravity=tuple(frame @ GRAVITY))
    method = Method(solver="iterative", iterations=sweeps)
    result = simulate(scene, time_step=h, duration=0.35, method=method, observe=traces(v=Velocity("slider")))

    off = 1e-6 if sweeps == 50 else method.residual_of("unsettled_residual", scene)
    assert np.abs(result["v"] - speed).max() < off


# Blows that follow from blows -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [Sphere(0.1), Box((0.2, 0.2, 0.2))], ids=["balls", "boxes"])
@pytest.mark.parametrize("solver", SOLVERS)
def test_what_is_set_in_motion_by_a_plastic_impact_rebounds_in_the_same_step(
    solver: str, shape: Sphere | Box
) -> None:
    """One hits a second and stays with it, 1/2 v; both hit a third, psi = 1/2: with 2 u + w = v and w - u = v/4 they go
    on with v/4 and it leaves with v/2. The second blow was left to the next step, and they ran into each other."""
    speed, bounces = 12.0, Material(restitution=0.5)
    bodies = (
        RigidBody(name="a", mass=1.0, shape=shape, position=(0.0, 0.0, 0.0), velocity=(speed, 0.0, 0.0)),
        RigidBody(name="b", mass=1.0, shape=shape, position=(0.23, 0.0, 0.0)),
        RigidBody(name="c", mass=1.0, shape=shape, position=(0.46, 0.0, 0.0), material=bounces),
    )
    run = simulate(
        Scene(bodies=bodies),
        time_step=H,
        steps=3,
        method=Method(solver=solver),
        observe=traces(v=Velocity()) | maxima(deep=Penetration()),
    )

    assert run["v"][-1, :, 0] == pytest.approx([speed / 4, speed / 4, speed / 2], rel=1e-9)
    assert float(run["deep"]) < 1e-9


# Answers that were not found ----------------------------------------------------------------------------------


def test_an_impact_that_iterations_leave_unsettled_is_said() -> None:
    """Two sweeps do not share a blow among forty balls in a row; where they rest, afterwards, no row is off."""
    elastic = Material(restitution=1.0)
    row = [ball(f"b{k}", (0.2 * k, 0, 0), (0, 0, 0), material=elastic) for k in range(1, 41)]
    scene = Scene(bodies=(ball("b0", (-0.3, 0, 0), (3, 0, 0), material=elastic), *row))
    few = simulate(scene, time_step=H, steps=20, method=Method(solver="iterative", iterations=2))
    many = simulate(scene, time_step=H, steps=20, method=Method(solver="iterative", iterations=20_000))

    assert few.status == "unsettled" and few.residual > 0.1
    assert many.completed and many.residual < 1e-9
