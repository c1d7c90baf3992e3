"""One question for the toy engine whose gate may change by 2 % a night: inside that, only a release notices."""

from __future__ import annotations

from toy_questions import COMMON, error

from spook_tracker.engine.method import PLAIN
from spook_tracker.scalar_tests.case import Measurement, Metric, ScalarTest

AWAY = Metric(
    name="away", description="how far away", unit="m", role="gate", limit=10.0, limit_source="ours",
    relative_tolerance=0.02,
)  # fmt: skip
CREEP = ScalarTest(
    title="Creeping",
    question="How far does it creep?",
    measurements=(
        Measurement(
            configuration="plain",
            time_step=0.01,
            metrics=(AWAY,),
            measure=lambda simulate: {"away": error(simulate, 0.01, PLAIN)},  # TOY_ERROR - 0.05 m
        ),
    ),
    **COMMON,
)
CATALOGUE = {"creep": CREEP}
