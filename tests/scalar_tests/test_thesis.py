"""What is said of the thesis' figures and misprints: each number is found again."""

from __future__ import annotations

import math

import numpy as np
import pytest

from spook_tracker.engine import simulate
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.scalar_tests.thesis.beam.scene import COUNT, SIZE, sag_of_compliant_beam
from spook_tracker.scalar_tests.thesis.door.measure import SINGLE
from spook_tracker.scalar_tests.thesis.inclined_plane.friction import PRESSED, STEEP
from spook_tracker.scalar_tests.thesis.inclined_plane.scene import FRICTION, MODELS, force_ratio, unloaded
from spook_tracker.scalar_tests.thesis.n_pendulum.figures import (
    OTHER_DURATION,
    OTHER_LINK,
    other_reading,
    swing,
)
from tests.oracles import chain as oracle_chain


def said(test: str) -> str:
    return " ".join(CATALOGUE[test].misprints)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("degrees", [0.0, 15.0, 30.0, 45.0, 80.0, 200.0])
def test_three_models_of_friction_are_three_as_the_load_goes(model: str, degrees: float) -> None:
    """What the slope asks for, held to the circle or to a square of the bound now, or of the bound a step before."""
    alpha = math.radians(degrees)
    asked = STEEP * np.array([math.cos(alpha), math.sin(alpha)])
    bound = FRICTION * (1.0 + PRESSED if model == "box" else 1.0)
    square = math.hypot(*np.clip(asked, -bound, bound))
    expected = min(STEEP, FRICTION) if model == "cone" else square

    assert force_ratio(unloaded(simulate, STEEP, alpha, PRESSED, MODELS[model])) == pytest.approx(
        expected, rel=1e-9
    )


def test_the_three_models_are_drawn_apart_as_in_print() -> None:
    figure = next(one for one in CATALOGUE["friction"].figures if one.thesis == "Fig 3.18, as drawn")
    curves = {curve.name: np.array(curve.y) for curve in figure.draw(simulate).curves}

    assert np.ptp(curves["cone"]) < 1e-9
    assert np.all(curves["box"] > curves["scaled box"] + 0.05)
    assert np.ptp(curves["scaled box"]) > 0.2
    assert 0.75 < max(map(np.max, curves.values())) <= 0.8


def test_the_chain_of_the_other_reading_is_the_printed_one() -> None:
    ours, long = swing(simulate)[0], other_reading(simulate)
    hundred = other_reading(simulate, 100)
    coarse = [swing(simulate, time_step=0.02)[0].max(), other_reading(simulate, time_step=0.02).max()]

    assert (int(long.argmax()) + 1, round(float(long.max()), 1)) == (25, 16.5)
    assert round(float(hundred.max()), 1) == 20.5
    assert [round(float(one)) for one in coarse] == [42, 22]
    assert round(float(ours.max()), 3) == 34.483
    text = said("n_pendulum")
    assert all(
        words in text for words in ("16.5 % (link 25)", "20.5 % with 100", "42 % at h = 0.02 s", "give 22 %")
    )


def test_longer_links_are_less_gravity() -> None:
    """Found again by the chain's prototype, whose links are 1 m: in shares of a link only g h²/l counts."""
    h = 1.0 / 60.0
    run = oracle_chain.swing(oracle_chain.level(26), h / math.sqrt(OTHER_LINK), round(OTHER_DURATION / h))
    long = other_reading(simulate)

    assert 100.0 * float(np.abs(run.violation).max()) == pytest.approx(float(long.max()), rel=2e-3)


def test_one_hidden_compliance_is_behind_the_limit_and_figure_3_5_but_not_figure_3_4() -> None:
    def percent(count: int, compliance: float) -> float:
        return 100.0 * sag_of_compliant_beam(count, compliance) / (count * SIZE[0])

    assert percent(COUNT, 2.3e-15) == pytest.approx(4.9e-9, rel=0.01)
    assert percent(200, 2.5e-15) == pytest.approx(8e-8, rel=0.01)
    assert sag_of_compliant_beam(COUNT, 2.3e-14) == pytest.approx(5e-9, rel=0.02)
    assert all(words in said("beam") for words in ("2.3e-15 m/N", "2.5e-15", "2.3e-14", "8e-8 %"))


def test_what_32_bits_resolve_is_where_figure_3_9_lies() -> None:
    low, high = SINGLE, 2.0 * SINGLE

    assert 10**-5.3 < low < high < 10**-4.8
    assert f"{low:.0e}".replace("e-0", "e-") == "6e-6" and f"{high:.1e}".replace("e-0", "e-") == "1.2e-5"
    assert "6e-6 to 1.2e-5 %" in said("door")
