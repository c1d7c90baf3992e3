"""Several threads share the work on contacts: whatever their number, the results are equal to the bit."""

import multiprocessing
from dataclasses import replace

import numpy as np
import pytest

from spook_tracker.engine import (
    Box,
    Capsule,
    Material,
    Method,
    MethodError,
    Plane,
    RigidBody,
    Scene,
    Shape,
    Sphere,
    compile,
    start,
)

H = 1.0 / 60.0  # s
ROUGH = Material(friction=0.5)


def heap(count: int, *shapes: Shape, material: Material = ROUGH) -> Scene:
    """Bodies in layers of a square grid above a plane."""
    rng = np.random.default_rng(4)
    side = int(np.ceil(np.sqrt(count / 4)))
    bodies = [
        RigidBody(name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=material)
    ]
    for k in range(count):
        dx, dy = rng.uniform(-0.02, 0.02, 2)
        place = (0.52 * (k % side) + dx, 0.52 * (k // side % side) + dy, 0.26 + 0.52 * (k // side**2))
        bodies.append(
            RigidBody(
                name=f"b{k}", mass=1.0, shape=shapes[k % len(shapes)], position=place, material=material
            )
        )
    return Scene(bodies=tuple(bodies), gravity=(0.0, 0.0, -9.81))


BALLS = heap(1200, Sphere(0.25))
MIXED = heap(700, Sphere(0.25), Box((0.4, 0.4, 0.4)), Capsule(0.15, 0.4))
SOFT = heap(
    900, Sphere(0.25), material=Material(friction=0.4, compliance=1e-6, damping=0.03, slip_compliance=1e-4)
)
SPREAD = heap(300, Box((0.4, 0.4, 0.4)), Sphere(0.2))  # towers of their own, most of the way
SWEPT = {
    "balls": (BALLS, Method(solver="iterative", iterations=10), 25),
    "settling": (BALLS, Method(solver="iterative", iterations=60, residual_tolerance=1e-6), 8),
    "box friction": (BALLS, Method(solver="iterative", iterations=10, friction="box"), 15),
    "mixed": (MIXED, Method(solver="iterative", iterations=10), 15),
    "soft": (SOFT, Method(solver="iterative", iterations=10, substeps=2), 12),
    "islands": (SPREAD, Method(), 25),
    "asleep": (
        heap(300, Box((0.4, 0.4, 0.4))),
        Method(solver="iterative", iterations=30, sleep_speed=0.05, sleep_after=0.1),
        24,
    ),
    "rebounding": (
        heap(600, Sphere(0.25), material=Material(friction=0.3, restitution=0.5)),
        Method(solver="iterative", iterations=30),
        15,
    ),
    "successive": (heap(300, Sphere(0.25)), Method(impacts="successive"), 10),
    "directly": (heap(600, Sphere(0.25)), Method(), 10),
}


def ending(scene: Scene, method: Method, steps: int, threads: int) -> tuple[dict[str, bytes], dict[str, int]]:
    result = compile(scene, time_step=H, method=replace(method, threads=threads)).run(steps)
    return {name: state.tobytes() for name, state in result.final_state.items()}, result.counters


@pytest.mark.parametrize("name", SWEPT)
def test_results_are_equal_to_the_bit_for_every_number_of_threads(name: str) -> None:
    alone = ending(*SWEPT[name], threads=1)
    for threads in (2, 3):
        assert ending(*SWEPT[name], threads=threads) == alone


def test_a_run_is_saved_and_goes_on_with_the_same_bits() -> None:
    method = Method(solver="iterative", iterations=10, threads=2)
    with start(BALLS, time_step=H, method=method) as run:
        run.step(14)
        saved = run.save()
        run.step(6)
        end = {name: state.tobytes() for name, state in run.state.items()}
        run.restore(saved)
        run.step(6)
        assert {name: state.tobytes() for name, state in run.state.items()} == end


def _after_a_fork(program, out) -> None:
    out.put(program.run(12).final_state["b7"].tobytes())


def test_a_program_made_before_a_fork_runs_in_the_child() -> None:
    program = compile(BALLS, time_step=H, method=Method(solver="iterative", iterations=10, threads=2))
    here = program.run(12).final_state["b7"].tobytes()
    context = multiprocessing.get_context("fork")
    out = context.Queue()
    child = context.Process(target=_after_a_fork, args=(program, out))
    child.start()
    assert out.get(timeout=60) == here
    child.join(timeout=60)


@pytest.mark.parametrize("threads", [0, -1, 257, 1.5, True, "two"])
def test_a_number_of_threads_that_means_nothing_is_refused(threads: object) -> None:
    with pytest.raises(MethodError, match=r"method: threads must be a whole number"):
        Method(threads=threads)  # type: ignore[arg-type]
