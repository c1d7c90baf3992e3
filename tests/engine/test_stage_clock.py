"""The clock of stages: the time of a step is that of its stages, and each has its own."""

from __future__ import annotations

from dataclasses import replace

import pytest

from spook_tracker import engine
from spook_tracker.engine import (
    CentralGravity,
    Material,
    Method,
    Particle,
    Plane,
    Result,
    Scene,
    Sphere,
    Spring,
)
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.tracker.measure.step_cost import step_cost
from tests.scenes.corpus import fixed, solid

STEPS = 120
BESIDE_SHARE = 0.05  # of the step: keeping a state to go back to, checks of it, and the clock
BESIDE = 0.5e-6  # s per step, of the same where a step takes less than a microsecond; a preemption is as long as twenty
RUNS = 4  # the best: what else runs here comes between two stages in some


def timed(program: engine.Program, steps: int) -> Result:
    """The run with the least between its stages."""
    runs = [program.run(steps, 5.0, time_stages=True) for _ in range(RUNS)]
    return min(runs, key=lambda run: run.seconds - sum(run.stage_seconds.values()))


def expect_whole_step(program: engine.Program, steps: int) -> None:
    result = timed(program, steps)
    spent, choices = result.stage_seconds, {choice.stage: choice for choice in program.explain()}
    kept = {stage for stage, choice in choices.items() if choice.kept}

    assert set(spent) <= kept, "a stage that is left out has no time"
    beside = result.seconds - sum(spent.values())
    assert 0.0 <= beside <= BESIDE_SHARE * result.seconds + BESIDE * result.steps
    ran = set(kept)
    if not result.counters["contacts"]:  # nothing to rebound, and no rows that can let go but those of joints
        ran -= {"impact"} if "assemble_rows" in spent else {"impact", "assemble_rows", "pivot"}
    elif {"pivot", "solve_iterative"} & set(spent):
        ran.discard("solve_block")  # "while nothing touches"
    without = {stage for stage in ran if not {stage, choices[stage].within} & set(spent)}
    assert not without, "a stage that ran has a time, or is part of one that has"


@pytest.mark.parametrize("name", CATALOGUE)
def test_the_times_of_stages_are_the_step(name: str) -> None:
    example = CATALOGUE[name].example()
    steps = max(1, min(STEPS, round(1.0 / example.time_step)))

    expect_whole_step(
        engine.compile(example.scene, time_step=example.time_step, method=example.method), steps
    )


def heap(bodies: int = 12) -> Scene:
    ground = fixed("ground", Plane(), (0.0, 0.0, 0.0), material=Material(friction=0.5))
    balls = tuple(
        solid(
            f"ball {i}",
            Sphere(0.5),
            (0.3 * (i % 3), 0.2 * (i % 2), 0.5 + 1.05 * i),
            material=Material(friction=0.5),
        )
        for i in range(bodies)
    )
    return Scene(bodies=(ground, *balls), gravity=(0.0, 0.0, -9.81))


@pytest.mark.parametrize(
    "method",
    [Method(), Method(solver="iterative"), Method(sleep_speed=0.05)],
    ids=lambda method: f"{method.solver}-{method.sleep_speed}",
)
def test_the_times_of_stages_are_the_step_of_a_heap(method: Method) -> None:
    expect_whole_step(engine.compile(heap(), time_step=1 / 60, method=method), 300)


def particles(**changes: object) -> Scene:
    balls = tuple(Particle(name=f"p{i}", mass=1.0, position=(float(i), 1.0, 0.0)) for i in range(4))
    return replace(Scene(bodies=balls), **changes)  # type: ignore[arg-type]


SPRINGS = tuple(
    Spring(name=f"s{i}", between=("p0", f"p{1 + i % 3}"), stiffness=1e-3, rest_length=1.0) for i in range(400)
)
FIELDS = tuple(CentralGravity(name=f"f{i}", centre=(0.0, -5.0 - i, 0.0), strength=1e-3) for i in range(100))
HEAVY = {  # the stage that is nearly all of the step, since there is so much of its work
    "solve_iterative": (heap(), Method(solver="iterative", iterations=5000, residual_tolerance=1e-300)),
    "apply_springs": (particles(forces=SPRINGS), Method()),
    "apply_central_gravity": (particles(forces=FIELDS), Method()),
}


@pytest.mark.parametrize("stage", HEAVY)
def test_the_stage_with_the_work_has_the_time(stage: str) -> None:
    scene, method = HEAVY[stage]
    spent = timed(engine.compile(scene, time_step=1 / 60, method=method), 60).stage_seconds

    assert spent[stage] > 0.8 * sum(spent.values())


def test_what_a_step_costs_is_of_one_run() -> None:
    cost = step_cost(CATALOGUE["pile"], engine.simulate)

    assert cost is not None
    assert cost.whole == pytest.approx(sum(cost.stages.values()) + cost.beside, rel=1e-12)
    assert 0.0 <= cost.beside < BESIDE + BESIDE_SHARE * cost.whole
