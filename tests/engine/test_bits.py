"""Equal input gives equal bits: again, compiled anew, watched, timed, in pieces, and back and on again."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    Box,
    ConstraintForce,
    Distance,
    Energy,
    Hinge,
    JointCoordinate,
    Material,
    Method,
    Motor,
    Plane,
    Position,
    Prismatic,
    RigidBody,
    Scene,
    Sinusoid,
    Sphere,
    Trace,
    Velocity,
    compile,
    simulate,
    start,
)
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from tests.engine.particles.test_composition import line, planet
from tests.engine.particles.test_rough_wires import hung
from tests.engine.rigid.test_armature import ROTOR, pendulum
from tests.engine.rigid.test_plane_steps import four_bar, rods
from tests.engine.rigid.test_time_functions import slider
from tests.engine.rigid.test_tyres import wheel
from tests.scenes import corpus
from tests.scenes import particle as particle_scenes
from tests.scenes import rigid as rigid_scenes

STEPS, BEFORE = 90, 40


def tumble(friction: float = 0.5) -> Scene:
    """Boxes and balls that fall on each other and on a floor: impacts, resting contacts, friction."""
    material = Material(friction=friction, restitution=0.3)
    floor = RigidBody(
        name="floor", position=(0.0, 0.0, 0.0), shape=Plane(), motion="static", material=material
    )
    bodies = [
        RigidBody(
            name=f"body {k}",
            mass=1.0 + k,
            shape=Box((0.4, 0.3, 0.2)) if k % 2 else Sphere(0.2),
            position=(0.05 * k, -0.03 * k, 0.3 + 0.35 * k),
            angular_velocity=(0.3, -0.2 * k, 0.1),
            material=material,
        )
        for k in range(5)
    ]
    return Scene(bodies=(floor, *bodies), gravity=(0.2, 0.1, -9.81))


def rng() -> np.random.Generator:
    return np.random.default_rng(7)


def stiff(scene: Scene) -> Scene:
    """Its rows held rigidly, as compositions want them."""
    held: dict[str, Any] = {"compliance": 0.0, "damping": None}
    rows = [
        replace(row, rest_length=None, **held) if isinstance(row, Distance) else replace(row, **held)
        for row in scene.constraints
    ]
    return replace(scene, constraints=tuple(rows))


SCENES: dict[str, tuple[Scene, Method]] = {
    **{f"particles: {name}": (build(rng()), Method()) for name, build in particle_scenes.KINDS.items()},
    "particles, half-step": (particle_scenes.chain(rng()), Method(half_step_velocities=True)),
    "particles, curved": (particle_scenes.loop(rng()), Method(corrections=2)),
    "particles, order 4": (stiff(particle_scenes.tree(rng())), Method(composition="order4")),
    "particles, strings": (particle_scenes.tree(rng()), Method(string_stiffness=True)),
    "particles, sweeps": (particle_scenes.tree(rng()), Method(solver="iterative")),
    "rigid": (rigid_scenes.tree(rng()), Method()),
    "rigid, loop": (rigid_scenes.loop(rng()), Method(corrections=1)),
    "rigid, everything": (rigid_scenes.everything(rng()), Method(substeps=2)),
    "rigid, half-step": (rigid_scenes.tree(rng()), Method(half_step_velocities=True)),
    "rigid, order 6": (stiff(rigid_scenes.tree(rng())), Method(composition="order6")),
    "rigid, strings": (CATALOGUE["loaded_rods"].example().scene, Method(string_stiffness=True)),
    "rigid, sweeps": (rigid_scenes.everything(rng()), Method(solver="iterative")),
    "contacts": (tumble(), Method()),
    "contacts, sweeps": (tumble(), Method(solver="iterative", iterations=30)),
    "contacts, box": (tumble(), Method(friction="box")),
}

HALF, SWEEPS = Method(half_step_velocities=True), Method(solver="iterative", iterations=10)
ORDERS = {name: Method(composition=name) for name in ("order4", "order6", "order8")}  # type: ignore[arg-type]
PLANE = {
    "plain": Method(), "half-step": HALF, "corrected": Method(corrections=1), "substeps": Method(substeps=3),
    "half-step, corrected once": Method(corrections=1, half_step_velocities=True),
    "half-step, corrected": Method(corrections=2, half_step_velocities=True), **ORDERS,
}  # fmt: skip


def balls() -> Scene:
    """What earlier solves left in the solvers must not be seen by later ones, or must go back too."""
    bodies = [corpus.floor(corpus.ROUGH)]
    for k in range(64):
        place = (0.55 * (k % 3) + 0.02 * np.sin(3.0 * k), 0.55 * (k // 3 % 3), 0.5 + 0.55 * (k // 9))
        bodies.append(corpus.solid(f"ball{k}", Sphere(0.25), place, material=corpus.ROUGH))
    return Scene(bodies=tuple(bodies), gravity=corpus.DOWN)


MORE: dict[str, tuple[Scene, Method]] = {
    **{f"rods in a plane, {name}": (rods(3), method) for name, method in PLANE.items() if name not in ORDERS},
    **{f"four-bars in a plane, {name}": (four_bar(), method) for name, method in PLANE.items() if name not in ORDERS},
    **{f"rods, {name}": (corpus.rods(), method) for name, method in PLANE.items()},
    **{f"{name}, order 4": (scene, ORDERS["order4"]) for name, scene in (("a row", line(4)), ("a planet", planet()))},
    **{f"a rotor, {name}": (pendulum(armature=ROTOR), PLANE[name]) for name in ("plain", "half-step", "order6")},
    "a tyre": (wheel((10.0, 1.0, 0.0), friction=(0.9, 0.5)), Method()),
    "a rough wire": (hung(5.0, 1.0, 2, (0.3, 0.1)), Method()),
    "a drive that follows the time": (slider(motor=Motor(speed=Sinusoid(amplitude=1.0, frequency=1.0))), Method()),
    "a heap": (corpus.heap(12), Method()),
    "a heap, sweeps": (corpus.heap(12), Method(solver="iterative")),
    "balls": (balls(), Method()),
    "balls, sweeps": (balls(), SWEEPS),
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES | MORE)
def test_a_run_gives_the_same_bits_however_it_is_asked(name: str) -> None:
    scene, method = (SCENES | MORE)[name]
    watched: dict[str, Any] = {"x": Position(), "v": Velocity(), "energy": Energy()}
    if scene.constraints:
        first = scene.constraints[0]
        watched["force"] = ConstraintForce(first.name)
        if isinstance(first, Hinge | Prismatic):
            watched["coordinate"] = JointCoordinate(first.name)
    traces = {key: Trace(quantity=what, every=3 if key == "force" else 1) for key, what in watched.items()}
    program = compile(scene, time_step=0.01, method=method)
    whole = program.run(STEPS)
    seen = simulate(scene, time_step=0.01, steps=STEPS, method=method, observe=traces)
    equal = [whole, program.run(STEPS), program.run(STEPS, time_stages=True), seen]

    with start(scene, time_step=0.01, method=method, observe=watched) as run:
        for piece in (1, 0, 36, 3, 50):
            run.step(piece)
            if run.steps == BEFORE:
                saved = run.save()
            for key, trace in traces.items():
                if run.steps % trace.every == 0:
                    np.testing.assert_array_equal(seen[key][run.steps // trace.every], run[key])
        equal.append(run.result())
        run.step(13)
        run.restore(saved)
        assert run.steps == BEFORE
        run.step(STEPS - BEFORE)
        assert run.result().state_hash == whole.state_hash
        with start(scene, time_step=0.01, method=method, observe=watched) as other:
            other.restore(saved)
            other.step(STEPS - BEFORE)
            assert other.result().state_hash == whole.state_hash

    for result in equal:
        assert result.state_hash == whole.state_hash
        assert result.steps == whole.steps == STEPS
        assert result.residual == whole.residual
    counted = [{**result.counters, "samples": 0} for result in equal]
    assert counted[0] == counted[1] == counted[2]
    if (
        method.composition == "none" and not method.half_step_velocities
    ):  # there a reading is a solve of its own
        assert counted[0] == counted[3] == counted[4]


def test_every_example_of_the_catalogue_can_be_held_and_saved() -> None:
    for name, test in CATALOGUE.items():
        if test.example is None:
            continue
        example = test.example()
        whole = simulate(example.scene, time_step=example.time_step, steps=12, method=example.method)
        with start(example.scene, time_step=example.time_step, method=example.method) as run:
            run.step(5)
            saved = run.save()
            run.step(3)
            run.restore(saved)
            run.step(7)

            assert whole.state_hash == run.result().state_hash, name
