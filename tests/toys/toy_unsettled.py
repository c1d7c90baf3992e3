"""A stack of two hundred boxes asked of the real engine: carried by it, or not by fifty sweeps (TOY_SOLVER)."""

from __future__ import annotations

import os
from dataclasses import replace

import toy_questions

from spook_tracker.engine.method import PLAIN, Method
from spook_tracker.engine.observe import Final, Position
from spook_tracker.scalar_tests.bracket import break_count
from spook_tracker.scalar_tests.case import BreakPoint, Configuration, Ladder, Measurement, Metric, Simulate
from spook_tracker.scalar_tests.stacks.resting_stack import scene

COUNT, STEPS = 200, 60
SWEEPS = Method(solver="iterative", iterations=50)


def lowered(simulate: Simulate, count: int, method: Method, time_step: float = 1 / 60):
    """How far the top has come down [m], and whether every solve settled."""
    observe = {"top": Final(quantity=Position(f"box {count}"))}
    result = simulate(scene(count), time_step=time_step, steps=STEPS, method=method, observe=observe)
    return count - 0.5 - float(result["top"][2]), result.completed


def measure(simulate: Simulate) -> dict[str, float]:
    down, _ = lowered(simulate, COUNT, Method(solver=os.environ.get("TOY_SOLVER", "direct")))
    return {"wide": down, "tight": down, "followed": down}


def tallest(simulate: Simulate) -> BreakPoint:
    return break_count(lambda count: lowered(simulate, count, SWEEPS)[1], (2, COUNT))


def _metric(name: str, role: str, limit: float | None) -> Metric:
    return Metric(
        name=name, description=f"how far the top comes down, {name}", unit="m", role=role, limit=limit,
        limit_source="a toy's" if limit else "", set_point=(-1e3, 1e3) if name == "wide" else None,
    )  # fmt: skip


STACK = replace(
    toy_questions.FALL,
    title="Tall stack",
    measurements=(
        Measurement(
            configuration="asked",
            time_step=1 / 60,
            metrics=(
                _metric("wide", "gate", 1e3),
                _metric("tight", "companion", 1e-9),
                _metric("followed", "reported", None),
            ),
            measure=measure,
        ),
    ),
    figures=(),
    ladders=(
        Ladder(
            name="top",
            description="how far the top comes down",
            unit="m",
            time_steps=(1 / 60,),
            configurations=(
                Configuration(name="direct", method=PLAIN, expected_order=None),
                Configuration(name="fifty sweeps", method=SWEEPS, expected_order=None),
            ),
            error=lambda simulate, h, method: lowered(simulate, COUNT, method, h)[0],
            target_error=1e3,
        ),
    ),
    stability=(
        replace(
            toy_questions.FALL.stability[0], name="tallest", definition="every solve settles", study=tallest
        ),
    ),
    example=lambda: toy_questions.Example(scene=scene(3), time_step=1 / 60),
)
CATALOGUE = {"stack": STACK}
