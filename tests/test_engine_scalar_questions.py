"""Scalar tests put to the dense oracle get the answers they get from the engine."""

from __future__ import annotations

import pytest

from spook_tracker import engine
from spook_tracker.scalar_tests.case import Measurement
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from tests import oracle_simulate

ASKED = ("falling_object", "pendulum", "oscillator_row", "oscillator_damped", "oscillator_filter")
QUESTIONS = [
    (name, m) for name in ASKED for m in CATALOGUE[name].measurements if m.configuration != "long run"
]


@pytest.mark.parametrize(
    ("name", "measurement"), QUESTIONS, ids=[f"{n} {m.configuration}" for n, m in QUESTIONS]
)
def test_oracle_and_engine_give_the_same_answer(name: str, measurement: Measurement) -> None:
    dense, native = (
        measurement.measure(simulate) for simulate in (oracle_simulate.simulate, engine.simulate)
    )

    assert dense.keys() == native.keys()
    for metric, value in dense.items():
        assert native[metric] == pytest.approx(value, rel=1e-9, abs=1e-9), metric
