"""Half-step velocities with contacts: of order 2 as long as they last, against closed forms and tight integrations."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from spook_tracker.engine import (
    PLAIN,
    Box,
    Final,
    Hinge,
    Load,
    Material,
    MaximumAbsolute,
    Method,
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

HALF = Method(half_step_velocities=True)
GRAVITY, FRICTION, RADIUS = 10.0, 0.2, 0.5
STEPS = (40, 80, 160, 320)  # in a second


def ground(friction: float = FRICTION) -> RigidBody:
    rough = Material(friction=friction)
    return RigidBody(name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=rough)


def on_a_slope(slope: float, body: RigidBody, method: Method, n: int) -> tuple[float, float]:
    """Way [m] and speed [m/s] down the slope after a second in n steps."""
    tilt = math.atan(slope)
    scene = Scene(bodies=(ground(), body), gravity=(GRAVITY * math.sin(tilt), 0.0, -GRAVITY * math.cos(tilt)))
    seen = {
        "x": Final(quantity=Position("body"), from_start=True),
        "v": Final(quantity=Velocity("body")),
        "z": MaximumAbsolute(quantity=Position("body"), from_start=True),
    }
    end = simulate(scene, time_step=1.0 / n, steps=n, method=method, observe=seen)
    assert end["z"][2] < 1e-12  # it stays on the ground
    return float(end["x"][0]), float(end["v"][0])


def ball(speed: float) -> RigidBody:
    return RigidBody(
        name="body", mass=1.0, shape=Sphere(RADIUS), position=(0.0, 0.0, RADIUS), velocity=(speed, 0.0, 0.0),
        material=Material(friction=FRICTION),
    )  # fmt: skip


def block(velocity: tuple[float, float, float]) -> RigidBody:
    """It cannot tip: it turns hardly at all."""
    return RigidBody(
        name="body", mass=1.0, shape=Box((1.0, 1.0, 0.2)), position=(0.0, 0.0, 0.1), velocity=velocity,
        inertia=(1e6, 1e6, 1e6), material=Material(friction=FRICTION),
    )  # fmt: skip


def order(errors: list[float]) -> float:
    """Slope of the errors over the steps of STEPS, fitted."""
    return float(-np.polyfit(np.log(STEPS), np.log(np.abs(errors)), 1)[0])


def test_what_rolls_or_slides_in_a_line_is_exact_where_plain_steps_are_of_order_1() -> None:
    tilt = math.atan(0.4)
    rolling = 5.0 / 14.0 * GRAVITY * math.sin(tilt)
    sliding = 1.0 + 0.5 * GRAVITY * (math.sin(tilt) - FRICTION * math.cos(tilt))
    for body, way in ((ball(0.0), rolling), (block((1.0, 0.0, 0.0)), sliding)):
        half = [on_a_slope(0.4, body, HALF, n)[0] - way for n in STEPS]
        plain = [on_a_slope(0.4, body, PLAIN, n)[0] - way for n in STEPS]

        assert max(map(abs, half)) < 1e-12
        assert order(plain) == pytest.approx(1.0, abs=0.01)


def test_a_ball_that_slips_and_then_grips_is_of_order_2() -> None:
    tilt, v = math.atan(0.4), 1.0
    pull, rub = GRAVITY * math.sin(tilt), FRICTION * GRAVITY * math.cos(tilt)
    slips = v / (3.5 * rub - pull)  # s, until v = r w
    speed = v + (pull - rub) * slips
    rolls = 1.0 - slips
    way = 0.5 * (v + speed) * slips + speed * rolls + 5.0 / 14.0 * pull * rolls**2
    ends = [on_a_slope(0.4, ball(v), HALF, n) for n in STEPS]
    errors = [x - way for x, _ in ends]

    assert 0.2 < slips < 0.8
    assert all(end == pytest.approx(speed + 5.0 / 7.0 * pull * rolls, abs=1e-12) for _, end in ends)
    # Where in its step the grip falls changes the size of the error, by half a step's square at most.
    assert all(abs(e) <= 3.5 * rub / n**2 for e, n in zip(errors, STEPS, strict=True))


def test_a_slide_that_turns_is_of_order_1() -> None:
    """Friction is turned as the speed at the step's end is: stated, and no better than plain."""

    def end(n: int) -> float:
        scene = Scene(bodies=(ground(), block((0.0, 1.0, 0.0))), gravity=(5.0, 0.0, -GRAVITY))
        seen = {"x": Final(quantity=Position("body"))}
        return float(simulate(scene, time_step=1.0 / n, steps=n, method=HALF, observe=seen)["x"][0])

    def pace(_: float, y: np.ndarray) -> list[float]:
        rub = FRICTION * GRAVITY / math.hypot(y[2], y[3])
        return [y[2], y[3], 5.0 - rub * y[2], -rub * y[3]]

    exact = solve_ivp(pace, (0.0, 1.0), [0.0, 0.0, 0.0, 1.0], rtol=1e-11, atol=1e-12).y[0, -1]

    assert order([end(n) - exact for n in STEPS]) == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize("rebounds", [False, True])
def test_a_ball_that_slides_down_a_dome_without_friction_is_of_order_2(rebounds: bool) -> None:
    """It leaves the dome and meets it again in each step, without a rebound, whatever rebounds elsewhere."""
    start, duration = 0.2, 0.5
    far = 2.0 + RADIUS
    dome = RigidBody(name="dome", motion="static", shape=Sphere(2.0), position=(0.0, 0.0, 0.0))
    body = solid("body", Sphere(RADIUS), (far * math.sin(start), 0.0, far * math.cos(start)))
    far_off = solid("far off", Sphere(RADIUS), (50.0, 0.0, 0.0), material=Material(restitution=0.5))
    scene = Scene(bodies=(dome, body, *(far_off,) * rebounds), gravity=(0.0, 0.0, -GRAVITY))

    def angle(method: Method, n: int) -> float:
        seen = {"x": Final(quantity=Position("body"))}
        end = simulate(scene, time_step=duration / n, steps=n, method=method, observe=seen)["x"]
        return math.atan2(end[0], end[2])

    exact = solve_ivp(
        lambda _, y: [y[1], GRAVITY / far * math.sin(y[0])],
        (0.0, duration),
        [start, 0.0],
        rtol=1e-12,
        atol=1e-13,
    ).y[0, -1]

    assert order([angle(PLAIN, n) - exact for n in STEPS]) == pytest.approx(1.0, abs=0.05)
    assert order([angle(HALF, n) - exact for n in STEPS]) == pytest.approx(2.0, abs=0.05)


def test_a_pendulum_on_a_cart_that_slides_over_the_ground_is_of_order_2() -> None:
    """Rows of a joint and of contacts in one solve; the reference is Lagrange's, in two coordinates."""
    cart_mass, bob_mass, arm, first, duration = 3.0, 1.0, 1.0, 0.7, 0.5
    inertia = 0.01
    cart = RigidBody(name="cart", mass=cart_mass, shape=Box((1.0, 1.0, 0.4)), position=(0.0, 0.0, 0.2))
    bob = RigidBody(
        name="bob", mass=bob_mass, inertia=(inertia,) * 3,
        position=(arm * math.sin(first), 0.0, 0.2 + arm * math.cos(first)),
    )  # fmt: skip
    hinge = Hinge(
        name="hinge", between=("cart", "bob"), at=(0.0, 0.0, 0.2), axis=(0.0, 1.0, 0.0), compliance=0.0
    )
    scene = Scene(
        bodies=(ground(0.0), cart, bob), constraints=(hinge,), gravity=(0.0, 0.0, -GRAVITY),
        no_contact=(("cart", "bob"),),
    )  # fmt: skip

    def pace(_: float, y: np.ndarray) -> list[float]:
        _, a, dx, da = y
        m, whole = bob_mass * arm, bob_mass * arm * arm + inertia
        matrix = [[cart_mass + bob_mass, m * math.cos(a)], [m * math.cos(a), whole]]
        ddx, dda = np.linalg.solve(matrix, [m * math.sin(a) * da * da, m * GRAVITY * math.sin(a)])
        return [dx, da, ddx, dda]

    exact = solve_ivp(pace, (0.0, duration), [0.0, first, 0.0, 0.0], rtol=1e-11, atol=1e-12).y[0, -1]

    def place(method: Method, n: int) -> float:
        seen = {"x": Final(quantity=Position("cart"))}
        return float(simulate(scene, time_step=duration / n, steps=n, method=method, observe=seen)["x"][0])

    half = [place(HALF, n) - exact for n in STEPS]
    assert order(half) == pytest.approx(2.0, abs=0.05)
    assert abs(place(PLAIN, STEPS[-1]) - exact) > 5.0 * abs(half[-1])


def test_what_rests_rests_and_what_falls_lands() -> None:
    boxes = tuple(
        RigidBody(name=f"box {k}", mass=1.0, shape=Box((1.0, 1.0, 1.0)), position=(0.0, 0.0, 0.5 + k), material=Material(friction=0.5))
        for k in range(3)
    )  # fmt: skip
    seen = {"x": MaximumAbsolute(quantity=Position(), from_start=True)}
    scene = Scene(bodies=(ground(0.5), *boxes), gravity=(0.0, 0.0, -GRAVITY))

    assert simulate(scene, time_step=1 / 60, steps=60, method=HALF, observe=seen)["x"].max() < 1e-20

    falling = RigidBody(name="body", mass=1.0, shape=Sphere(RADIUS), position=(0.0, 0.0, 2.0))
    end = simulate(
        Scene(bodies=(ground(0.5), falling), gravity=(0.0, 0.0, -GRAVITY)), time_step=1 / 60, steps=120, method=HALF,
        observe={"z": Final(quantity=Position("body")), "v": Final(quantity=Velocity("body"))},
    )  # fmt: skip
    assert end["z"][2] == pytest.approx(RADIUS, abs=1e-6)
    assert abs(end["v"][2]) < 1e-9


def test_a_block_of_steps_taken_back_behind_a_look_ahead_goes_the_same_way_again() -> None:
    """Two balls strike in the step after a sample whose velocities were looked ahead for; behind it a body runs
    away, and the steps since the last check are taken one by one again to find where."""
    h = 0.01

    def ball(name: str, x: float, v: float) -> RigidBody:
        return solid(name, Sphere(0.1), (x, 0.0, 0.0), velocity=(v, 0.0, 0.0))

    pushed = RigidBody(name="pushed", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 9.0, 0.0))
    observe = {"x": Trace(quantity=Position("left")), "v": Trace(quantity=Velocity("left"))}
    struck = set()
    for meets in np.arange(28.5, 36.0):  # steps; checks lie 1, 2, 4, 8 ... steps apart
        scene = Scene(
            bodies=(ball("left", -0.1 - meets * h, 1.0), ball("right", 0.1 + 0.5 * meets * h, -0.5), pushed),
            forces=(Load(name="drive", body="pushed", force=(1e100 / h / 39.5, 0.0, 0.0)),),
        )
        undisturbed = simulate(scene, time_step=h, steps=38, method=HALF, observe=observe)
        failed = simulate(scene, time_step=h, steps=80, method=HALF, observe=observe)

        assert (undisturbed.status, failed.status) == ("completed", "diverged")
        for name in observe:
            assert np.array_equal(failed.partial[name][:39], undisturbed[name]), (name, meets)
        struck.add(int(np.argmax(undisturbed["v"][:, 0] < 0.9)))
    assert len(struck) == 8  # steps, the first of the block among them
