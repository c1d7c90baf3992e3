"""Rows over more than two moving bodies beyond plain steps: every method has the order it claims, also there."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from spook_tracker.engine import (
    WORLD,
    Energy,
    Final,
    Hinge,
    JointCoordinate,
    MaximumAbsolute,
    Method,
    MethodError,
    Position,
    Relation,
    RigidBody,
    Scene,
    Sinusoid,
    Violation,
    Wire,
    compile,
    simulate,
)

G = 9.81  # m/s²
TIME = 1.0  # s
COUPLED = (1.0, 1.5, -0.8)  # of the relation
ARMS = (0.5, 0.8, 1.1)  # m, of its pendulums
MASSES = (1.0, 2.0, 1.5)  # kg
MOMENTS = (0.1, 0.3, 0.2)  # kg m², about their centres
EYES = ((-1.0, 0.0, 2.0), (1.0, 0.0, 2.0))  # m, of the wire
HUNG = {"a": (-1.4, 0.0, 1.0), "b": (0.1, 0.0, 1.2), "c": (1.3, 0.0, 0.7)}  # m


def pendulums() -> Scene:
    """Three on one axis, level at the start, and a relation between their angles: a differential."""
    bodies = [
        RigidBody(name=name, mass=mass, inertia=(0.4, moment, 0.35), position=(arm, float(k), 0.0))
        for k, (name, mass, moment, arm) in enumerate(zip("abc", MASSES, MOMENTS, ARMS, strict=True))
    ]
    hinges = [
        Hinge(
            name=body.name,
            between=(WORLD, body.name),
            at=(0.0, body.position[1], 0.0),
            axis=(0.0, 1.0, 0.0),
            compliance=0.0,
        )
        for body in bodies
    ]
    tied = Relation(name="tied", terms=tuple(zip("abc", COUPLED, strict=True)), compliance=0.0)
    return Scene(bodies=tuple(bodies), constraints=(*hinges, tied), gravity=(0.0, 0.0, -G), contacts=False)


@functools.cache
def pendulums_at(time: float) -> np.ndarray:
    """Their angles, downwards: J q'' = m g l cos q + c λ with Σ c q = 0."""
    c, inertia = np.array(COUPLED), np.array(MOMENTS) + np.array(MASSES) * np.array(ARMS) ** 2
    weight = G * np.array(MASSES) * np.array(ARMS)

    def slope(_: float, y: np.ndarray) -> np.ndarray:
        free = weight * np.cos(y[:3]) / inertia
        return np.concatenate((y[3:], free - c / inertia * (c @ free) / (c @ (c / inertia))))

    return np.asarray(solve_ivp(slope, (0.0, time), np.zeros(6), "DOP853", rtol=1e-13, atol=1e-14).y[:3, -1])


def pendulums_error(h: float, method: Method) -> float:
    observe = {name: Final(quantity=JointCoordinate(name)) for name in "abc"}
    run = simulate(pendulums(), time_step=h, duration=TIME, method=method, observe=observe)
    return float(np.abs([float(run[name]) for name in "abc"] - pendulums_at(TIME)).max())


def weights() -> Scene:
    """Three on one taut wire: it ends at the outer ones and runs over two fixed eyes and through the middle one."""
    bodies = tuple(
        RigidBody(name=name, mass=mass, inertia=(1.0, 1.0, 1.0), position=at)
        for (name, at), mass in zip(HUNG.items(), MASSES, strict=True)
    )
    through = (("a", HUNG["a"]), (WORLD, EYES[0]), ("b", HUNG["b"]), (WORLD, EYES[1]), ("c", HUNG["c"]))
    wire = Wire(name="tied", through=through, slack=False, compliance=0.0)
    return Scene(bodies=bodies, constraints=(wire,), gravity=(0.0, 0.0, -G), contacts=False)


@functools.cache
def weights_at(time: float) -> np.ndarray:
    """Newton's equations with the pull that keeps the length's second derivative at zero."""
    mass, (left, right) = np.array(MASSES)[:, None], np.array(EYES)

    def slope(_: float, y: np.ndarray) -> np.ndarray:
        x, v = y[:9].reshape(3, 3), y[9:].reshape(3, 3)
        pulls, bend = np.zeros((3, 3)), 0.0
        for k, eye in ((0, left), (1, left), (1, right), (2, right)):
            d = x[k] - eye
            length = math.sqrt(d @ d)
            pulls[k] += d / length
            bend += (v[k] @ v[k] - (d @ v[k] / length) ** 2) / length
        free = np.tile((0.0, 0.0, -G), (3, 1))
        pull = -((pulls * free).sum() + bend) / (pulls**2 / mass).sum()
        return np.concatenate((v.ravel(), (free + pull * pulls / mass).ravel()))

    start = np.concatenate([*HUNG.values(), np.zeros(9)])
    return np.asarray(solve_ivp(slope, (0.0, time), start, "DOP853", rtol=1e-13, atol=1e-14).y[:9, -1])


def weights_error(h: float, method: Method) -> float:
    observe = {"x": Final(quantity=Position())}
    run = simulate(weights(), time_step=h, duration=TIME, method=method, observe=observe)
    return float(np.abs(run["x"].ravel() - weights_at(TIME)).max())


LIFT = Sinusoid(amplitude=0.3, frequency=0.5, offset=2.0)  # m, of a kinematic eye
ASIDE = {"a": (-0.7, 0.0, 0.9), "b": (0.9, 0.0, 1.1)}  # m


def started() -> list[tuple[float, float, float]]:
    """The least speeds of both [m/s] with which the wire keeps its length while its eye sets off."""
    ways = np.array(list(ASIDE.values())) - (0.0, 0.0, 2.0)
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    rate = 2.0 * math.pi * LIFT.frequency * LIFT.amplitude * ways[:, 2].sum()
    over = np.array(MASSES[:2])[:, None]
    return [tuple(v) for v in rate / (ways**2 / over).sum() * ways / over]


STARTED = started()


def lifted() -> Scene:
    """Two weights on a taut wire over an eye that is moved up and down."""
    bodies = tuple(
        RigidBody(name=name, mass=mass, inertia=(1.0, 1.0, 1.0), position=at, velocity=speed)
        for (name, at), mass, speed in zip(ASIDE.items(), MASSES, STARTED, strict=False)
    )
    eye = RigidBody(name="eye", motion="kinematic", position=(0.0, 0.0, 2.0), path=(0.0, 0.0, LIFT))
    through = (("a", ASIDE["a"]), ("eye", (0.0, 0.0, 2.0)), ("b", ASIDE["b"]))
    wire = Wire(name="tied", through=through, slack=False, compliance=0.0)
    return Scene(bodies=(*bodies, eye), constraints=(wire,), gravity=(0.0, 0.0, -G), contacts=False)


@functools.cache
def lifted_at(time: float) -> np.ndarray:
    """Newton's equations as of weights(), with the eye's own speed and acceleration."""
    mass, turn = np.array(MASSES[:2])[:, None], 2.0 * math.pi * LIFT.frequency

    def ways(t: float, x: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, float]:
        pulls, bend = np.zeros((2, 3)), 0.0
        speed = np.array((0.0, 0.0, LIFT.amplitude * turn * math.cos(turn * t)))
        pace = np.array((0.0, 0.0, -LIFT.amplitude * turn**2 * math.sin(turn * t)))
        for k in range(2):
            d, u = x[k] - (0.0, 0.0, LIFT(t)), v[k] - speed
            length = math.sqrt(d @ d)
            pulls[k] = d / length
            bend += (u @ u - (d @ u / length) ** 2) / length - d @ pace / length
        return pulls, bend

    def slope(t: float, y: np.ndarray) -> np.ndarray:
        x, v = y[:6].reshape(2, 3), y[6:].reshape(2, 3)
        pulls, bend = ways(t, x, v)
        free = np.tile((0.0, 0.0, -G), (2, 1))
        pull = -((pulls * free).sum() + bend) / (pulls**2 / mass).sum()
        return np.concatenate((v.ravel(), (free + pull * pulls / mass).ravel()))

    start = np.concatenate([*ASIDE.values(), *STARTED])
    return np.asarray(solve_ivp(slope, (0.0, time), start, "DOP853", rtol=1e-13, atol=1e-14).y[:6, -1])


def lifted_error(h: float, method: Method) -> float:
    observe = {name: Final(quantity=Position(name)) for name in ASIDE}
    run = simulate(lifted(), time_step=h, duration=TIME, method=method, observe=observe)
    return float(np.abs(np.concatenate([run[name] for name in ASIDE]) - lifted_at(TIME)).max())


SCENES: dict[str, tuple[Callable[[], Scene], Callable[[float, Method], float]]] = {
    "differential": (pendulums, pendulums_error),
    "wire": (weights, weights_error),
    "moving eye": (lifted, lifted_error),
}
METHODS = {  # order, and the numbers of steps: the wire's outer weights swing up fast
    "half": (
        Method(half_step_velocities=True),
        2,
        {"differential": (64, 128, 256), "wire": (256, 512, 1024), "moving eye": (128, 256, 512)},
    ),
    "curved": (
        Method(half_step_velocities=True, corrections=2),
        2,
        {"differential": (64, 128, 256), "wire": (64, 128, 256), "moving eye": (64, 128, 256)},
    ),
    "order4": (Method(composition="order4"), 4, {"differential": (16, 32, 64), "wire": (96, 192, 384)}),
    "order6": (Method(composition="order6"), 6, {"differential": (12, 16, 24), "wire": (96, 144, 192)}),
}


@pytest.mark.parametrize(
    ("scene", "method"), [(s, m) for m, (_, _, counts) in METHODS.items() for s in counts]
)
def test_every_method_has_its_order(scene: str, method: str) -> None:
    """Each pair of steps by itself, so that no part of the ladder hides another."""
    how, order, counts = METHODS[method]
    errors = [SCENES[scene][1](TIME / n, how) for n in counts[scene]]
    slopes = [
        math.log(a / b) / math.log(n / m)
        for (a, m), (b, n) in itertools.pairwise(zip(errors, counts[scene], strict=True))
    ]

    assert all(abs(slope - order) < 0.1 * order for slope in slopes), (errors, slopes)


@pytest.mark.parametrize("scene", ["differential", "wire"])
def test_corrections_keep_its_curvature(scene: str) -> None:
    """Each takes two orders of the violation, which the plain step leaves of the second; a relation of angles has none, since
    turns are exact."""
    observe = {"g": MaximumAbsolute(quantity=Violation("tied"))}
    left = [
        float(
            simulate(SCENES[scene][0](), time_step=0.005, duration=TIME, method=method, observe=observe)["g"]
        )
        for method in (Method(), Method(corrections=1), Method(corrections=2))
    ]

    if scene == "differential":
        assert max(left) < 1e-14
    else:
        assert left[1] < 0.1 * left[0] and left[2] < 0.1 * left[1]


@pytest.mark.parametrize("scene", ["differential", "wire"])
def test_a_composition_keeps_its_energy(scene: str) -> None:
    """But for an error of order 4 that comes and goes."""
    observe = {"e": MaximumAbsolute(quantity=Energy(), from_start=True)}
    method = Method(composition="order4")
    coarse, fine = (
        float(simulate(SCENES[scene][0](), time_step=h, duration=2.0, method=method, observe=observe)["e"])
        for h in (1 / 200, 1 / 400)
    )

    assert 13.0 < coarse / fine < 19.0


def test_strings_of_them_are_not_stiffened() -> None:
    with pytest.raises(
        MethodError, match="'tied' ties more than two moving bodies, which string_stiffness cannot"
    ):
        compile(pendulums(), time_step=0.01, method=Method(string_stiffness=True))
