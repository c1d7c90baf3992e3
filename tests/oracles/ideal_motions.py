"""How particles and mechanisms move by the laws they are asked about: closed forms, and tight integrations of what they leave.

A form is given a scene and times [s], and gives what a `Recording` holds of them; states that it leaves out are at rest.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import solveh_banded
from scipy.special import ellipj, ellipk

from spook_tracker.engine import CentralGravity, Distance, RigidBody, Scene
from spook_tracker.engine.recorded_joints import product

Found = dict[str, Any]
Places = tuple[np.ndarray, np.ndarray]  # m and m/s
Y, Z = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])


def particle(motion: Callable[[Scene, np.ndarray], Places]) -> Callable[[Scene, np.ndarray], Found]:
    """The form of one particle, with what a rod pulls: it turns the particle, and holds its weight."""

    def form(scene: Scene, times: np.ndarray) -> Found:
        places, velocities = motion(scene, times)
        tension = {}
        for rod in scene.constraints:
            assert isinstance(rod, Distance)
            reach = places - np.array(rod.between[0])
            length = float(rod.rest_length or np.linalg.norm(reach[0]))
            tension[rod.name] = scene.bodies[0].mass * (
                np.square(velocities).sum(axis=1) / length + reach @ np.array(scene.gravity) / length
            )
        return {"positions": places[:, None], "velocities": velocities[:, None], "constraint_forces": tension}

    return form


def falling(scene: Scene, times: np.ndarray) -> Places:
    """A parabola."""
    body, g, t = scene.bodies[0], np.array(scene.gravity), times[:, None]
    v = np.array(body.velocity)
    return np.array(body.position) + v * t + 0.5 * g * t**2, v + g * t


def on_an_ellipse(scene: Scene, times: np.ndarray) -> Places:
    """By Lagrange's f and g of the change of the eccentric anomaly, found by Newton's method."""
    (field,) = (force for force in scene.forces if isinstance(force, CentralGravity))
    mu, body = field.strength, scene.bodies[0]
    r, v = np.array(body.position), np.array(body.velocity)
    distance = float(np.linalg.norm(r))
    a = 1.0 / (2.0 / distance - float(v @ v) / mu)
    rate = math.sqrt(mu / a**3)
    c, s = 1.0 - distance / a, float(r @ v) / math.sqrt(mu * a)  # e cos E, e sin E at the start
    turned = rate * times
    for _ in range(8):
        left = turned - c * np.sin(turned) + s * (1.0 - np.cos(turned)) - rate * times
        turned = turned - left / (1.0 - c * np.cos(turned) + s * np.sin(turned))
    sine, less = np.sin(turned), 1.0 - np.cos(turned)
    now = a * (1.0 - c * np.cos(turned) + s * sine)
    f, g = 1.0 - a / distance * less, times - (turned - sine) / rate
    df, dg = -math.sqrt(mu * a) / (distance * now) * sine, 1.0 - a / now * less
    return np.outer(f, r) + np.outer(g, v), np.outer(df, r) + np.outer(dg, v)


def swinging(scene: Scene, times: np.ndarray) -> Places:
    """From rest at φ₀: the sine of half its angle is k sn(K − ω t), k = sin φ₀/2, by Jacobi's elliptic functions."""
    (rod,) = (row for row in scene.constraints if isinstance(row, Distance))
    start = np.array(scene.bodies[0].position) - np.array(rod.between[0])
    length = float(rod.rest_length or np.linalg.norm(start))
    angle, rate = swing(math.atan2(start[0], -start[2]), math.sqrt(-scene.gravity[2] / length), times)
    sine, cosine, level = np.sin(angle), np.cos(angle), np.zeros_like(angle)
    along, across = np.stack([sine, level, -cosine], axis=1), np.stack([cosine, level, sine], axis=1)
    return np.array(rod.between[0]) + length * along, length * rate[:, None] * across


def swing(start: float, pace: float, times: np.ndarray) -> Places:
    """Angle [rad] and rate [rad/s] of a pendulum let go at `start`; `pace` [rad/s] is that of small swings."""
    modulus = math.sin(0.5 * start)
    sn, cn, _, _ = ellipj(float(ellipk(modulus**2)) - pace * times, modulus**2)
    return 2.0 * np.arcsin(modulus * sn), -2.0 * modulus * pace * cn


def about(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """(s, 4): turns by `angle` [rad] about an axis."""
    return np.concatenate([np.cos(0.5 * angle)[:, None], np.sin(0.5 * angle)[:, None] * axis], axis=1)


def bar_that_swings(scene: Scene, times: np.ndarray) -> Found:
    """A rigid pendulum about the y axis through the origin."""
    bar = scene.bodies[0]
    assert isinstance(bar, RigidBody)
    arm = np.array(bar.position)
    reach = float(np.linalg.norm(arm))
    inertia = float(bar.shape.inertia(bar.mass)[1]) + bar.mass * reach**2
    pace = math.sqrt(bar.mass * -scene.gravity[2] * reach / inertia)
    angle, rate = swing(math.atan2(-arm[0], -arm[2]), pace, times)
    nothing = np.zeros_like(angle)
    place = reach * np.stack([-np.sin(angle), nothing, -np.cos(angle)], axis=1)
    speed = reach * rate[:, None] * np.stack([-np.cos(angle), nothing, np.sin(angle)], axis=1)
    return {
        "positions": place[:, None],
        "velocities": speed[:, None],
        "orientations": about(Y, angle)[:, None],
        "angular_velocities": (rate[:, None] * Y)[:, None],
    }


def turning(scene: Scene, times: np.ndarray) -> Found:
    """All turns as one about z through the origin, at the rate of the first body."""
    rate = scene.bodies[0].angular_velocity[2]
    starts = np.array([complex(*body.position[:2]) for body in scene.bodies])
    at = np.exp(1j * rate * times)[:, None] * starts
    level = np.zeros_like(at.real)
    return {
        "positions": np.stack([at.real, at.imag, level], axis=2),
        "velocities": rate * np.stack([-at.imag, at.real, level], axis=2),
        "orientations": np.tile(about(Z, rate * times)[:, None], (1, len(starts), 1)),
        "angular_velocities": np.tile(rate * Z, (*at.shape, 1)),
    }


@functools.lru_cache(maxsize=2)
def _chain(count: int, gravity: float, duration: float) -> Callable[[np.ndarray], np.ndarray]:
    """From level, links of 1 m: their pulls over the mass keep |aᵢ − aᵢ₋₁| along each link what their turning asks for."""

    def slope(_: float, state: np.ndarray) -> np.ndarray:
        x, v = state.reshape(2, count, 2)
        link, turn = np.diff(x, axis=0, prepend=0.0), np.diff(v, axis=0, prepend=0.0)
        # row i: −d(i−1)·d(i) T(i−1) + 2 T(i) − d(i)·d(i+1) T(i+1) = |turn|², and once for the pivot, which pulls back at no mass
        bands = np.zeros((2, count))
        bands[1] = 2.0 * (link**2).sum(axis=1)
        bands[1, 0] *= 0.5
        bands[0, 1:] = -(link[1:] * link[:-1]).sum(axis=1)
        asked = (turn**2).sum(axis=1)
        asked[0] -= gravity * link[0, 1]
        pull = solveh_banded(bands, asked, check_finite=False)[:, None] * link
        change = np.diff(pull, axis=0, append=0.0)
        change[:, 1] -= gravity
        return np.concatenate([v.ravel(), change.ravel()])

    start = np.zeros((2, count, 2))
    start[0, :, 0] = np.arange(1, count + 1)
    found = solve_ivp(
        slope, (0.0, duration), start.ravel(), "DOP853", rtol=1e-7, atol=1e-7, dense_output=True
    )
    assert found.success, found.message
    return found.sol  # type: ignore[no-any-return]


def chain(scene: Scene, times: np.ndarray) -> Found:
    """Spheres of 1 kg on links of 1 m, let go from the level."""
    count = len(scene.bodies)
    assert [body.position for body in scene.bodies] == [(k + 1.0, 0.0, 0.0) for k in range(count)]
    flat = _chain(count, -scene.gravity[2], float(times[-1]))(times).T.reshape(len(times), 2, count, 2)
    states = np.insert(flat, 1, 0.0, axis=3)
    return {"positions": states[:, 0], "velocities": states[:, 1]}


def parallel_rods(scene: Scene, times: np.ndarray) -> Found:
    """Linkages pushed over from upright: θ̈ = c g/l sin θ, whose half angle is Jacobi's amplitude beyond the top."""
    sides = [body for body in scene.bodies if body.name.startswith("side")]
    count, side = len(sides) - 1, sides[0]
    assert isinstance(side, RigidBody)
    length, start = 2.0 * side.position[1], -side.angular_velocity[2]
    inertia = (count + 1) * (side.inertia[2] + side.mass * length**2 / 4.0) + count * side.mass * length**2
    pull = side.mass * -scene.gravity[1] * length * (0.5 * (count + 1) + count) / inertia
    fastest = 0.25 * start**2 + pull
    part = pull / fastest
    angle = 2.0 * ellipj(math.sqrt(fastest) * times - ellipk(part), part)[3] + math.pi
    rate = 2.0 * np.sqrt(fastest - pull * np.cos(0.5 * angle) ** 2)
    nothing = np.zeros_like(angle)
    end = length * np.stack([np.sin(angle), np.cos(angle), nothing], axis=1)
    speed = length * rate[:, None] * np.stack([np.cos(angle), -np.sin(angle), nothing], axis=1)
    unturned, still = np.tile([1.0, 0.0, 0.0, 0.0], (len(times), 1)), np.zeros_like(end)
    told: dict[str, list[np.ndarray]] = {
        "positions": [],
        "velocities": [],
        "orientations": [],
        "angular_velocities": [],
    }
    for body in scene.bodies:
        share, foot = (0.5, body.position[0]) if body in sides else (1.0, body.position[0])
        told["positions"].append(share * end + np.array([foot, 0.0, 0.0]))
        told["velocities"].append(share * speed)
        told["orientations"].append(about(Z, -angle) if body in sides else unturned)
        told["angular_velocities"].append(-rate[:, None] * Z if body in sides else still)
    return {name: np.stack(parts, axis=1) for name, parts in told.items()}


def flyballs(scene: Scene, times: np.ndarray) -> Found:
    """A governor by Lagrange's equations of the rods' lean φ and the slider's height z; the shaft's rate is L_z over I(φ).

    The springs are stiff, so Radau; shaft and slider first, then the rods, as the scene has them.
    """
    shaft, slider, right, _ = scene.bodies
    spring = next(row for row in scene.constraints if isinstance(row, Distance))
    hinge = next(row for row in scene.constraints if row.name == "right hinge")
    stiffness, rest = 1.0 / spring.compliance, float(spring.rest_length)
    viscosity = spring.damping * stiffness
    out, _, top = hinge.at
    g, mass, (along, across, _) = -scene.gravity[2], right.mass, right.inertia
    arm = math.hypot(right.position[0] - out, right.position[2] - top)
    held = arm + spring.anchors[1][0]  # of the spring from the hinge
    leans = math.atan2(top - right.position[2], right.position[0] - out)

    def inertia(lean: Any) -> Any:
        sine, cosine = np.sin(lean), np.cos(lean)
        rods = mass * (out + arm * cosine) ** 2 + across * cosine**2 + along * sine**2
        return shaft.inertia[2] + slider.inertia[2] + 2.0 * rods

    turn = inertia(leans) * shaft.angular_velocity[2]

    def slope(_: float, state: np.ndarray) -> list[float]:
        lean, z, lean_rate, z_rate, _ = state
        sine, cosine, rate = math.sin(lean), math.cos(lean), turn / inertia(lean)
        wide, high = held * cosine, top - held * sine - z  # out is the slider's anchor's, too
        length = math.hypot(wide, high)
        by_lean, by_z = (-held * sine * wide - held * cosine * high) / length, -high / length
        force = stiffness * (length - rest) + viscosity * (by_lean * lean_rate + by_z * z_rate)
        widening = 2.0 * (
            -2.0 * mass * (out + arm * cosine) * arm * sine - 2.0 * (across - along) * sine * cosine
        )
        push = 0.5 * rate**2 * widening + 2.0 * mass * g * arm * cosine - 2.0 * force * by_lean
        return [
            lean_rate,
            z_rate,
            push / (2.0 * (across + mass * arm**2)),
            -g - 2.0 * force * by_z / slider.mass,
            rate,
        ]

    start = [leans, slider.position[2], 0.0, 0.0, 0.0]
    with np.errstate(over="ignore"):  # of the angle's scale in the Jacobian: nothing depends on it
        found = solve_ivp(slope, (0.0, times[-1]), start, "Radau", rtol=1e-8, atol=1e-10, dense_output=True)
    assert found.success, found.message
    lean, z, lean_rate, z_rate, angle = found.sol(times)
    rate = turn / inertia(lean)
    shaft_turn, nothing = about(Z, angle), np.zeros_like(z)
    spin = rate[:, None] * Z
    one, aside = (
        np.stack(pair, axis=1)
        for pair in ((np.cos(angle), np.sin(angle), nothing), (-np.sin(angle), np.cos(angle), nothing))
    )
    still = np.tile(shaft.position, (len(times), 1))
    told = [[still, 0.0 * still, shaft_turn, spin], [z[:, None] * Z, z_rate[:, None] * Z, shaft_turn, spin]]
    for sign in (1.0, -1.0):
        wide, drop = (out + arm * np.cos(lean))[:, None], (arm * np.sin(lean))[:, None]
        speed = sign * (rate[:, None] * wide * aside - lean_rate[:, None] * drop * one)
        speed = speed - (lean_rate * arm * np.cos(lean))[:, None] * Z
        told.append([
            sign * wide * one + (top - drop) * Z,
            speed,
            product(shaft_turn, about(sign * Y, lean)),
            spin + sign * lean_rate[:, None] * aside,
        ])  # fmt: skip
    names = ("positions", "velocities", "orientations", "angular_velocities")
    return {name: np.stack(parts, axis=1) for name, parts in zip(names, zip(*told, strict=True), strict=True)}
