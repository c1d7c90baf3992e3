"""A time limit and the keyboard end a run inside its steps, however long one of them takes."""

from __future__ import annotations

import gc
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from spook_tracker.engine import (
    Box,
    Energy,
    Load,
    Lock,
    Material,
    Method,
    Plane,
    Program,
    RigidBody,
    Scene,
    SimulationFailed,
    Sphere,
    Trace,
    TriangleMesh,
    compile,
    simulate,
    start,
)
from tests.scenes.contact import DOWN, TIME_STEP
from tests.scenes.corpus import solid

LIMIT = 0.1  # s
LATE = 0.1  # s of processor time: what is left of it cannot be told from a busy machine
ROUGH = Material(friction=0.5)


@pytest.fixture(autouse=True)
def uncollected() -> Iterator[None]:
    """A collection of the test process's own garbage takes .1 s, as much as is asked here."""
    gc.disable()
    yield
    gc.enable()


Made = tuple[Scene, Method]


def ground() -> RigidBody:
    return RigidBody(name="ground", motion="static", shape=Plane(), position=(0, 0, 0), material=ROUGH)


def wedged(count: int, method: Method) -> Made:
    """Spheres that overlap their neighbours: hundreds of rounds."""
    rng = np.random.default_rng(1)
    balls = tuple(
        solid(
            f"ball {k}",
            Sphere(0.25),
            tuple(0.45 * np.array([k % 10, k // 10 % 10, k // 100 + 0.45]) + rng.uniform(-0.02, 0.02, 3)),
            material=ROUGH,
        )
        for k in range(count)
    )
    return Scene(bodies=(ground(), *balls), gravity=DOWN), method


def islands(counts: tuple[int, ...], method: Method) -> Made:
    """Wedged spheres, far from each other: an island and a thread for each."""
    loose = []
    for k, count in enumerate(counts):
        for ball in wedged(count, method)[0].bodies[1:]:
            x, y, z = ball.position
            loose.append(replace(ball, name=f"{k}, {ball.name}", position=(x + 100.0 * k, y, z)))
    return Scene(bodies=(ground(), *loose), gravity=DOWN), method


def sheet(side: int) -> Made:
    """Plates locked to all their neighbours, rigidly: each loop has rows to spare."""
    plates, locks = [], []
    for i in range(side):
        for j in range(side):
            plates.append(
                RigidBody(name=f"{i} {j}", mass=1.0, shape=Box((0.9, 0.9, 0.1)), position=(i, j, 0))
            )
            for a, b in ((i - 1, j), (i, j - 1)):
                if min(a, b) >= 0:
                    name = f"{a} {b} to {i} {j}"
                    locks.append(Lock(name=name, between=(f"{a} {b}", f"{i} {j}"), compliance=0.0))
    held = plates[0]
    plates[0] = RigidBody(name=held.name, motion="static", shape=held.shape, position=held.position)
    return Scene(bodies=tuple(plates), constraints=tuple(locks), gravity=DOWN, contacts=False), Method()


def landscape(side: int) -> Made:
    """A plate on the tops of a mesh: every step asks thousands of triangles."""
    x, y = np.meshgrid(np.linspace(-4, 4, side), np.linspace(-4, 4, side))
    corners = np.stack([x, y, 0.02 * np.sin(9 * x) * np.cos(7 * y)], axis=-1).reshape(-1, 3)
    triangles = []
    for i in range(side - 1):
        for j in range(side - 1):
            k = side * i + j
            triangles += [(k, k + 1, k + side), (k + 1, k + side + 1, k + side)]
    mesh = TriangleMesh(tuple(map(tuple, corners)), tuple(triangles))
    land = RigidBody(name="land", motion="static", shape=mesh, position=(0, 0, 0), material=ROUGH)
    plates = tuple(
        solid(f"plate {k}", Box((7, 7, 0.5)), (0, 0, 0.3 + 0.52 * k), material=ROUGH) for k in range(3)
    )
    return Scene(bodies=(land, *plates), gravity=DOWN), Method()


SCENES: dict[str, Callable[[], Made]] = {
    "exact friction": lambda: wedged(600, Method()),
    "a million sweeps": lambda: wedged(
        300, Method(solver="iterative", iterations=10**6, residual_tolerance=0.0)
    ),
    "box friction": lambda: wedged(400, Method(friction="box")),
    "rows to spare": lambda: sheet(30),
    "a mesh": lambda: landscape(60),
    "contacts before the first step": lambda: wedged(400, Method(half_step_velocities=True)),
    "the second of two islands": lambda: islands((20, 600), Method()),
}


@pytest.mark.parametrize("name", SCENES)
def test_a_time_limit_holds_inside_a_step(name: str) -> None:
    """One step of these takes .1 s to minutes. What was done before the limit is what so many steps give."""
    scene, method = SCENES[name]()
    program = compile(scene, time_step=TIME_STEP, method=method)
    result = program.run(10**6, time_limit=LIMIT)

    assert result.status == "timed_out"
    assert result.cpu_seconds < LIMIT + LATE
    assert result.failed_step == result.steps + 1
    if done := min(result.steps, 2):
        assert program.run(done).steps == done


ENERGY = {"energy": Trace(quantity=Energy())}


@pytest.mark.parametrize("observe", [{}, ENERGY], ids=["unobserved", "observed"])
def test_a_time_limit_holds_before_the_first_step(observe: dict[str, Trace]) -> None:
    """Velocities at mid-step are found before the first step, those at the start are asked for, and those at the end."""
    scene, method = wedged(400, Method(half_step_velocities=True))
    began = time.process_time()
    result = simulate(
        scene, time_step=TIME_STEP, steps=10**6, method=method, observe=observe, time_limit=LIMIT
    )

    assert time.process_time() - began < LIMIT + LATE
    assert (result.status, result.steps, result.failed_step) == ("timed_out", 0, 1)
    assert "before step 1" in result.failure
    assert all(values.shape == (0,) for values in result.partial.values())
    for body in scene.bodies:
        state = result.final_state[body.name]
        assert tuple(state[:3]) == body.position
        assert np.isnan(state[7:]).all()  # not found


@pytest.mark.parametrize(("side", "limit"), [(30, 0.005), (90, 0.8)], ids=["in Python", "in the core"])
def test_the_clock_runs_while_a_scene_is_compiled(side: int, limit: float) -> None:
    """Compiling the larger takes seconds, four fifths of them in the core."""
    scene, method = sheet(side)
    began = time.process_time()
    result = simulate(scene, time_step=TIME_STEP, steps=1, method=method, time_limit=limit, observe=ENERGY)

    assert time.process_time() - began < limit + LATE
    assert (result.status, result.steps, result.failed_step) == ("timed_out", 0, 1)
    assert result.failure.endswith("before step 1: the scene was still being compiled")
    assert result.partial["energy"].shape == result.sample_times["energy"].shape == (0,)
    assert tuple(result.final_state["3 4"][:3]) == scene.body("3 4").position
    assert np.isnan(result.final_state["3 4"][7:]).all()


def test_a_held_run_tells_in_time_how_far_it_came() -> None:
    """Its velocities of the start take .3 s, are found without a limit, and again after it."""
    scene, method = wedged(300, Method(half_step_velocities=True))
    with start(scene, time_step=TIME_STEP, method=method, observe={"energy": Energy()}) as run:
        began = time.process_time()
        with pytest.raises(SimulationFailed) as failed:
            run.step(time_limit=LIMIT)
        assert time.process_time() - began < LIMIT + LATE
        told = failed.value.result
        assert told.status == "timed_out" and np.isnan(told.partial["energy"])
        assert tuple(told.final_state["ball 3"][:3]) == scene.body("ball 3").position


def test_steps_done_before_the_limit_are_kept() -> None:
    """Ten steps of some hundredths of a second: a block of many would lose them all."""
    scene, method = wedged(300, Method(solver="iterative", iterations=400, residual_tolerance=0.0))
    program = compile(scene, time_step=TIME_STEP, method=method)
    result = program.run(10**6, time_limit=0.3)
    steps = result.steps

    assert steps >= 1
    assert program.run(steps).state_hash == result.state_hash


PROGRAM = """
import sys
from spook_tracker.engine import compile
from tests.engine.test_time_limits import SCENES, TIME_STEP
scene, method = SCENES[sys.argv[1]]()
program = compile(scene, time_step=TIME_STEP, method=method)
print("running", flush=True)
program.run(10**6, time_limit=60.0)
"""


def test_the_keyboard_interrupts_a_step() -> None:
    child = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, "a million sweeps"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert child.stdout is not None
    assert child.stdout.readline() == "running\n"
    time.sleep(0.3)
    child.send_signal(signal.SIGINT)
    began = time.monotonic()
    _, words = child.communicate(timeout=30.0)

    assert "KeyboardInterrupt" in words
    assert time.monotonic() - began < 10.0  # not the minute it would run; how soon is asked below


PROMPT = 3.0 * LATE  # s of processor time: asked at most ten times a second


def interrupted_after(seconds: float, work: Callable[[], object]) -> float | None:
    """How late it ends [s], in processor time, after the signal of Ctrl-C; None if it ended before that.

    The system raises the signal once this process has had so much processor time, however busy the machine is.
    """
    before = signal.signal(signal.SIGPROF, signal.default_int_handler)
    try:
        began = time.process_time()
        signal.setitimer(signal.ITIMER_PROF, seconds)
        work()
    except KeyboardInterrupt:
        return time.process_time() - began - seconds
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
    return None


def long_run(program: Program) -> Callable[[], object]:
    return lambda: program.run(10**6, time_limit=600.0)


@pytest.mark.parametrize("name", SCENES)
def test_the_keyboard_interrupts_a_step_at_once(name: str) -> None:
    scene, method = SCENES[name]()
    late = interrupted_after(LIMIT, long_run(compile(scene, time_step=TIME_STEP, method=method)))

    assert late is not None
    assert late < PROMPT


def test_the_keyboard_interrupts_compiling_at_once() -> None:
    scene, method = sheet(90)
    late = interrupted_after(6 * LIMIT, lambda: compile(scene, time_step=TIME_STEP, method=method))

    assert late is not None
    assert late < PROMPT


def test_a_scene_that_another_thread_compiles_holds_nothing_up() -> None:
    scene, method = sheet(40)
    other = threading.Thread(target=compile, args=(scene,), kwargs={"time_step": TIME_STEP, "method": method})
    began = last = time.monotonic()
    other.start()
    longest = 0.0
    while other.is_alive():
        time.sleep(0.001)
        longest, last = max(longest, time.monotonic() - last), time.monotonic()

    assert longest < 0.5 * (last - began)


FAILS = 60  # the step that is unfit


def falls_and_fails() -> Made:
    """Balls fall for half a second and land, and their steps become long; then a body's spin is no number any more.

    Blocks of steps have grown while nothing was met: the one that ends unfit holds some twenty long steps, and is
    replayed one by one to find the step.
    """
    rng, gap = np.random.default_rng(1), 0.52  # m
    balls = tuple(
        solid(
            f"ball {k}",
            Sphere(0.25),
            (
                gap * (k % 5) + rng.uniform(-0.009, 0.009),
                gap * (k // 5 % 5) + rng.uniform(-0.009, 0.009),
                2.02 + 0.501 * (k // 25),
            ),
            material=ROUGH,
        )
        for k in range(200)
    )
    inertia = 1e308  # kg m²: at 1.8 rad/s its angular momentum is none of the numbers there are
    spun = solid("spun", None, (100.0, 0.0, 50.0), spin=(0.0, 0.0, 1.0), inertia=(inertia,) * 3)
    torque = (sys.float_info.max - inertia) / (TIME_STEP * (FAILS - 0.5))  # N m
    spin = Load(name="spin", body="spun", torque=(0.0, 0.0, torque))
    scene = Scene(bodies=(ground(), *balls, spun), forces=(spin,), gravity=DOWN)
    return scene, Method(solver="iterative", iterations=6000, residual_tolerance=0.0)


@pytest.fixture(scope="module")
def failing() -> tuple[Program, float]:
    """A run that fails, and s of the processor until then: what comes later is the replay."""
    scene, method = falls_and_fails()
    program = compile(scene, time_step=TIME_STEP, method=method)
    passed = program.run(FAILS - 1)
    assert passed.completed and passed.cpu_seconds > LATE
    return program, passed.cpu_seconds


ATTEMPTS = 20  # on a busy machine blocks may not have grown, and there is next to nothing to replay


def test_a_time_limit_holds_while_a_block_is_replayed(failing: tuple[Program, float]) -> None:
    """The limit is of the clock on the wall: how much of that is ours is found by trying."""
    program, passed = failing
    limit = 1.3 * passed
    for _ in range(ATTEMPTS):
        result = program.run(10**6, time_limit=limit)
        if result.status != "timed_out":
            assert result.failed_step == FAILS
            limit /= 1.2
        elif result.cpu_seconds < 1.1 * passed:  # before the replay began
            limit *= 1.4
        else:
            assert result.cpu_seconds < limit + LATE
            assert result.failed_step == result.steps + 1
            assert result.steps < FAILS - 1  # of a block that is not finished nothing is kept
            return
    pytest.fail("no limit fell into a replay")


def test_the_keyboard_interrupts_a_replay(failing: tuple[Program, float]) -> None:
    program, passed = failing
    for _ in range(ATTEMPTS):
        late = interrupted_after(1.3 * passed, long_run(program))
        if late is not None:
            assert late < PROMPT
            return
    pytest.fail("no interruption fell into a replay")
