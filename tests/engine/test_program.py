"""Compiling keeps what a scene needs; runs end as results; nonsense is refused with one sentence."""

from __future__ import annotations

import math
import signal
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from spook_tracker.engine import (
    CentralGravity,
    Distance,
    Energy,
    Final,
    Load,
    Maximum,
    Method,
    MethodError,
    Particle,
    Position,
    Scene,
    Spring,
    Trace,
    Velocity,
    Violation,
    build_info,
    compile,
    explain,
    simulate,
)
from spook_tracker.engine.observe import JointCoordinate

GRAVITY = (0.0, 0.0, -9.81)


def body(name: str = "ball", x: float = 1.0) -> Particle:
    return Particle(name=name, mass=1.0, position=(x, 0.0, 0.0))


def pendulum() -> Scene:
    return Scene(
        bodies=(body(),),
        constraints=(Distance(name="rod", between=((0.0, 0.0, 0.0), "ball")),),
        gravity=GRAVITY,
    )


def test_a_falling_body_keeps_two_stages() -> None:
    falling = Scene(bodies=(body(),), gravity=GRAVITY)
    program = compile(falling, time_step=0.01, observe={"end": Final(quantity=Position())})

    assert program.stages == ("apply_gravity", "integrate_positions")
    assert program.run(10).counters == {
        "steps": 10,
        "substeps": 10,
        "force_evaluations": 0,
        "rows_assembled": 0,
        "block_operations": 0,
        "back_substitutions": 0,
        "sweeps": 0,
        "contacts": 0,
        "samples": 1,
    }


def test_a_weightless_body_keeps_one_stage() -> None:
    assert compile(Scene(bodies=(body(),)), time_step=0.01).stages == ("integrate_positions",)


def test_each_thing_in_a_scene_brings_its_stage() -> None:
    triangle = [body("a", 1.0), body("b", 2.0), Particle(name="c", mass=1.0, position=(1.5, 1.0, 0.0))]
    rows = [Distance(name=p + q, between=(p, q)) for p, q in ("ab", "bc", "ca")]
    forces = (
        CentralGravity(name="sun", strength=1.0),
        Spring(name="spring", between=((9.0, 0.0, 0.0), "a"), stiffness=1.0),
        Load(name="push", body="b", force=(1.0, 0.0, 0.0)),
    )
    scene = Scene(bodies=triangle, constraints=rows, forces=forces)
    method = Method(corrections=1, half_step_velocities=True)
    observe = {"energy": Maximum(quantity=Energy())}

    assert compile(scene, time_step=0.01, method=method, observe=observe).stages == (
        "apply_central_gravity",
        "apply_springs",
        "apply_loads",
        "assemble_rows",
        "solve_block",
        "correct_curvature",
        "half_step",
        "integrate_positions",
        "observe",
    )


def test_every_stage_is_explained_in_words() -> None:
    choices = explain(pendulum(), time_step=0.01)

    assert len(choices) == 34
    assert all(choice.reason for choice in choices)
    assert {choice.stage for choice in choices if choice.kept} == {
        "apply_gravity",
        "assemble_rows",
        "solve_path",
        "integrate_positions",
    }


def test_the_keyboard_interrupts_a_run() -> None:
    threading.Timer(0.3, signal.raise_signal, [signal.SIGINT]).start()
    begin = time.perf_counter()

    with pytest.raises(KeyboardInterrupt):
        simulate(pendulum(), time_step=1e-9, duration=1e6, time_limit=20.0)
    assert time.perf_counter() - begin < 10.0


def test_threads_may_share_a_program() -> None:
    program = compile(pendulum(), time_step=0.01, observe={"energy": Maximum(quantity=Energy())})
    alone = program.run(20_000)
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(program.run, [20_000] * 8))

    assert {result.state_hash for result in together} == {alone.state_hash}
    assert {float(result["energy"]) for result in together} == {float(alone["energy"])}


@pytest.mark.parametrize("time_step", [0.0, -1.0, math.nan, math.inf, "1", True])
def test_a_senseless_time_step_is_refused(time_step: float) -> None:
    with pytest.raises(MethodError, match="time_step"):
        simulate(pendulum(), time_step=time_step, steps=1)


@pytest.mark.parametrize(
    "span", [{}, {"steps": 1, "duration": 1.0}, {"steps": -1}, {"duration": math.nan}, {"steps": 1.5}]
)
def test_a_senseless_duration_is_refused(span: dict[str, float]) -> None:
    with pytest.raises(MethodError, match=r"steps|duration"):
        simulate(pendulum(), time_step=0.1, **span)  # type: ignore[arg-type]


def test_observables_of_unknown_things_are_refused() -> None:
    for quantity in (Position("absent"), Violation("nothing"), JointCoordinate("rod")):
        with pytest.raises(MethodError, match=r"absent|nothing|JointCoordinate"):
            compile(pendulum(), time_step=0.1, observe={"x": Final(quantity=quantity)})


def test_samples_beyond_the_end_are_refused() -> None:
    with pytest.raises(MethodError, match="beyond the last step"):
        simulate(pendulum(), time_step=0.1, steps=5, observe={"x": Final(quantity=Energy(), last=6)})


def test_a_duration_is_rounded_to_whole_steps() -> None:
    assert simulate(pendulum(), time_step=1 / 60, duration=22.0).steps == 1320
    assert simulate(pendulum(), time_step=0.3, duration=1.0).steps == 3


def test_traces_come_with_their_times() -> None:
    result = simulate(
        pendulum(), time_step=0.5, steps=7, observe={"x": Trace(quantity=Position(), first=1, every=3)}
    )

    assert result["x"].shape == (3, 1, 3)
    assert result.sample_times["x"].tolist() == [0.5, 2.0, 3.5]


@pytest.mark.parametrize("steps", [10**15, 10**12])
def test_a_trace_that_no_memory_holds_is_refused_before_the_run(steps: int) -> None:
    scene = Scene(bodies=(Particle(name="p", mass=1.0, position=(0.0, 0.0, 0.0)),))
    with pytest.raises(MethodError, match=r"observe 'p'.* GiB, and this machine has .*every="):
        simulate(
            scene,
            time_step=1e-3,
            steps=steps,
            observe={"v": Trace(quantity=Position(), every=10**9), "p": Trace(quantity=Position())},
        )


def test_half_step_velocities_read_the_velocity_of_the_sample() -> None:
    """Free fall is then exact: positions and velocities, at the start, within and at the end."""
    falling = Scene(bodies=(body(),), gravity=GRAVITY)
    result = simulate(
        falling,
        time_step=0.25,
        steps=8,
        method=Method(half_step_velocities=True),
        observe={"x": Trace(quantity=Position("ball")), "v": Trace(quantity=Velocity("ball"))},
    )
    times = result.sample_times["v"]

    assert np.abs(result["v"][:, 2] + 9.81 * times).max() < 1e-13
    assert np.abs(result["x"][:, 2] + 0.5 * 9.81 * times**2).max() < 1e-13
    assert abs(result.final_state["ball"][9] + 9.81 * 2.0) < 1e-13


def test_stages_are_timed_when_asked() -> None:
    result = simulate(pendulum(), time_step=0.01, steps=1000, time_stages=True)

    assert set(result.stage_seconds) <= set(result.stages)
    assert sum(result.stage_seconds.values()) <= result.seconds
    assert simulate(pendulum(), time_step=0.01, steps=10).stage_seconds == {}


def test_the_build_says_what_it_was_built_from() -> None:
    assert build_info.name == "spook"
    assert build_info.version
    assert "-ffp-contract=off" in build_info.flags
    assert build_info.dirty in (True, False, None)
    assert build_info.version.startswith("0+") or build_info.git_hash
