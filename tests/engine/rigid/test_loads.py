"""Loaded chains, redundant loops and singular positions of rigid bodies: right, or refused with the cure."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from spook_tracker.engine import (
    WORLD,
    Ball,
    ConstraintForce,
    Distance,
    Energy,
    Final,
    Hinge,
    JointCoordinate,
    JointSpring,
    MaximumAbsolute,
    Method,
    MethodError,
    Plane,
    Position,
    RigidBody,
    Scene,
    Sphere,
    Trace,
    compile,
    simulate,
)
from spook_tracker.scalar_tests.multibody import bricard, four_bars
from tests.scenes.corpus import solid

G = 9.81  # m/s²
LINKS, LENGTH = 10, 1.0
STIFF = Method(string_stiffness=True)
ORDER6 = Method(composition="order6")


def chain(load: float, start: float = 0.01) -> Scene:
    """Ten rods of 1 kg and 1 m in a row on ball joints, a load at the end, `start` rad off the vertical."""
    along = np.array([math.sin(start), 0.0, -math.cos(start)])
    turn = (math.cos(0.5 * start), 0.0, -math.sin(0.5 * start), 0.0)
    bodies = [
        solid(f"link {k}", None, tuple((k + 0.5) * along), inertia=(1 / 12, 1 / 12, 1e-3), orientation=turn)
        for k in range(LINKS)
    ]
    bodies.append(
        RigidBody(name="load", mass=load, inertia=(0.01 * load,) * 3, position=tuple(LINKS * along))
    )
    names = [WORLD, *(body.name for body in bodies)]
    joints = [
        Ball(name=f"ball {k}", between=(names[k], names[k + 1]), at=tuple(k * along), compliance=1e-12)
        for k in range(LINKS + 1)
    ]
    return Scene(bodies=tuple(bodies), constraints=tuple(joints), gravity=(0.0, 0.0, -G), contacts=False)


def straight_period(load: float) -> float:
    """Of small swings of the straight chain, as one compound pendulum."""
    inertia = load * (LINKS**2 + 0.01) + sum(1 / 12 + (k + 0.5) ** 2 for k in range(LINKS))
    return 2.0 * math.pi * math.sqrt(inertia / (G * (load * LINKS + sum(k + 0.5 for k in range(LINKS)))))


@pytest.mark.parametrize("load", [300.0, 1e6])
@pytest.mark.parametrize("half", [False, True])
def test_a_loaded_chain_swings_with_its_period(load: float, half: bool) -> None:
    method = Method(string_stiffness=True, half_step_velocities=half)
    observe = {"x": Trace(quantity=Position("load"))}
    x = simulate(chain(load), time_step=1 / 60, duration=20.0, method=method, observe=observe)["x"][:, 0]
    before = np.nonzero((x[:-1] > 0.0) != (x[1:] > 0.0))[0]
    zero = (before + x[before] / (x[before] - x[before + 1])) / 60.0

    assert 2.0 * np.mean(np.diff(zero)) == pytest.approx(straight_period(load), rel=1e-3)
    assert np.abs(x[-420:]).max() == pytest.approx(np.abs(x).max(), rel=0.01)


def bridge(compliance: float) -> Scene:
    """400 links of 1 kg and 1 m between two walls, 45° at the ends: each lies along the mean of the forces at its ends,
    a horizontal one and the weight of what lies inside."""
    count, horizontal = 400, 0.5 * 399 * G
    angles = [math.atan(G * (k - 0.5 * (count - 1)) / horizontal) for k in range(count)]
    ends = np.cumsum([(0.0, 0.0, 0.0), *((math.cos(a), 0.0, math.sin(a)) for a in angles)], axis=0)
    links = tuple(
        solid(
            f"link {k}",
            None,
            tuple(0.5 * (ends[k] + ends[k + 1])),
            inertia=(1e-3, 1 / 12, 1 / 12),
            orientation=(math.cos(0.5 * a), 0.0, -math.sin(0.5 * a), 0.0),
        )
        for k, a in enumerate(angles)
    )
    names = [WORLD, *(link.name for link in links), WORLD]
    balls = tuple(
        Ball(name=f"ball {k}", between=(names[k], names[k + 1]), at=tuple(ends[k]), compliance=compliance)
        for k in range(count + 1)
    )
    return Scene(bodies=links, constraints=balls, gravity=(0.0, 0.0, -G), contacts=False)


def pull_of(compliance: float) -> float:
    """The bridge's horizontal force [N]: its links and the gaps ε F of its balls span what they spanned without gaps."""

    def span(horizontal: float, gap: float) -> float:
        return (
            sum(math.cos(math.atan(G * (k - 199.5) / horizontal)) for k in range(400))
            + 401 * gap * horizontal
        )

    rigid = 0.5 * 399 * G
    return float(brentq(lambda force: span(force, compliance) - span(rigid, 0.0), 0.5 * rigid, 2.0 * rigid))


def test_a_bridge_hangs_in_its_catenary() -> None:
    observe = {
        "off": MaximumAbsolute(quantity=Position(), from_start=True),
        "pull": Final(quantity=ConstraintForce("ball 200")),
    }
    held = simulate(bridge(0.0), time_step=1 / 60, duration=20.0, method=STIFF, observe=observe)
    soft = simulate(bridge(1e-8), time_step=1 / 60, duration=20.0, method=STIFF, observe=observe)

    assert held["off"].max() < 1e-11
    assert held["pull"][0] == pytest.approx(-pull_of(0.0), rel=1e-12)
    assert soft["pull"][0] == pytest.approx(-pull_of(1e-8), rel=1e-5)
    assert (
        soft["off"].max() < 401 * 1e-8 * math.sqrt(2.0) * pull_of(0.0) * 1.3
    )  # all gaps in a row, and a sag of 45°


@pytest.mark.parametrize("ball", [None, 0.0, 1.0])
def test_a_divergence_under_tension_names_it_and_a_cure_that_is_taken(ball: float | None) -> None:
    """Also where a ball falls on a floor, or lies there in every step."""
    scene = chain(1e4)
    touching = ball is not None  # where surfaces may meet, string_stiffness is refused
    if ball is not None:
        floor = RigidBody(name="floor", motion="static", shape=Plane(), position=(0.0, 0.0, -100.0))
        beside = RigidBody(name="beside", mass=1.0, shape=Sphere(0.1), position=(50.0, 0.0, ball - 99.9))
        scene = replace(scene, bodies=(*scene.bodies, floor, beside), contacts=True)
    result = simulate(scene, time_step=1 / 60, duration=5.0)

    assert result.status == "diverged"
    assert "tension" in result.failure and "smaller time step" in result.failure
    assert ("string_stiffness=True" in result.failure) != touching


@pytest.mark.parametrize("velocity", [-50.0, 10.0])
def test_a_load_that_drops_on_a_taut_chain_is_named_with_its_cure(velocity: float) -> None:
    """Stiffness from the tension of the step before cannot follow a blow; a composition holds the energy."""
    scene = chain(1e4)
    *links, heavy = scene.bodies
    falling = replace(scene, bodies=(*links, replace(heavy, velocity=(0.0, 0.0, velocity))))
    result = simulate(falling, time_step=1 / 60, duration=2.0, method=STIFF)

    assert result.status == "diverged"
    assert "load changes" in result.failure and "string_stiffness knows" in result.failure
    assert 'composition="order4"' in result.failure
    cured = simulate(
        falling,
        time_step=1 / 60,
        duration=0.2,
        method=Method(composition="order4"),
        observe={"energy": Trace(quantity=Energy())},
    )
    assert cured.completed
    # The first step takes what the joints forbid of the start.
    assert np.ptp(cured["energy"][1:]) < 0.02 * np.abs(cured["energy"][0])


def test_stiffness_of_distances_is_refused_beside_rigid_bodies() -> None:
    rod = RigidBody(name="rod", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, -1.0))
    rope = Distance(name="rope", between=((0.0, 0.0, 0.0), "rod"))

    with pytest.raises(MethodError, match=r"string_stiffness of distances.*'rope'"):
        compile(Scene(bodies=(rod,), constraints=(rope,)), time_step=0.01, method=STIFF)


def off_after_a_second(method: Method, h: float) -> float:
    place, _ = bricard._third(simulate, h, 1.0, 0.0, method)
    return float(np.linalg.norm(place[-1] - bricard.EXACT[1.0]))


def test_a_redundant_loop_without_compliance_moves_or_is_refused() -> None:
    """Bricard's mechanism: linearised rows lock it, rows with their curvature kept do not."""
    scene = bricard.scene(1 / 240, 0.0)
    plain = simulate(scene, time_step=1 / 240, duration=1.0)

    assert plain.status == "diverged"
    assert "locked by redundant joints, 'P0', 'P1'" in plain.failure and "corrections=1" in plain.failure
    assert off_after_a_second(Method(half_step_velocities=True, corrections=1), 1 / 240) < 1e-4
    assert off_after_a_second(Method(composition="order4"), 1 / 60) < 5e-9  # the reference has nine digits


@pytest.mark.parametrize(
    ("count", "order", "steps"),
    [(2, "order6", 100), (2, "order6", 80), (2, "order8", 40), (2, "order8", 200), (40, "order6", 60)],
)
def test_compositions_go_through_singular_positions(count: int, order: str, steps: int) -> None:
    """Four-bars lie flat twice a turn, where each could fold another way; a start extrapolated over more than three
    steps leads two of them there with an energy 2 % off."""
    method = Method(composition=order)  # type: ignore[arg-type]
    found = four_bars.answers(simulate, count, 1 / steps, 5.0 if count == 2 else 2.0, method)

    assert found["library_error"] < 1e-7
    assert found["energy_deviation"] < 1e-7


def spun(speed: float, spring: JointSpring | None = None) -> Scene:
    wheel = solid("wheel", None, (0.0, 0.0, 0.0), spin=(0.0, 0.0, speed), inertia=(0.2, 0.2, 0.4))
    axle = Hinge(name="axle", between=(WORLD, "wheel"), axis=(0.0, 0.0, 1.0), spring=spring)
    return Scene(bodies=(wheel,), constraints=(axle,))


@pytest.mark.parametrize("method", [Method(), Method(half_step_velocities=True), ORDER6], ids=str)
def test_a_hinge_counts_its_turns(method: Method) -> None:
    # The variational turn is fast by (h w)²/6, and the composition's hardly at all.
    observe = {"angle": Trace(quantity=JointCoordinate("axle"), every=50)}
    run = simulate(spun(4.0), time_step=0.01, steps=1000, method=method, observe=observe)

    assert np.abs(run["angle"] - 4.0 * run.sample_times["angle"]).max() < 40.0 * 0.04**2 / 6.0 * 1.01


def test_the_energy_of_a_joint_spring_counts() -> None:
    """½ I w² at the start goes into ½ k φ² and back; without damping nothing is lost but by the start offset."""
    spring = JointSpring(stiffness=0.4, damping=0.0)
    observe = {"energy": Trace(quantity=Energy())}
    method = Method(half_step_velocities=True)
    energy = simulate(spun(1.0, spring), time_step=0.01, steps=700, method=method, observe=observe)["energy"]

    assert energy[0] == pytest.approx(0.2, rel=1e-4)
    assert np.abs(energy / energy[0] - 1.0).max() < 1e-3
