"""Sentences beside figures are made from the numbers of their figure: another engine, other sentences."""

import re

import pytest

from spook_tracker.engine import simulate
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.scalar_tests.sweep import at, told
from tests.broken_engines import off_by, restless


def figure(test, name):
    return next(f for f in CATALOGUE[test].figures if f.name == name)


@pytest.mark.parametrize("engine", [simulate, restless], ids=["sound", "restless"])
def test_the_energy_of_the_pendulum_is_said_as_it_is_drawn(engine):
    drawing = figure("pendulum", "energy-against-mass").draw(engine)
    values = drawing.curves[0].y

    assert drawing.note.startswith(told(min(values)))
    assert told(max(values)) in drawing.note


def test_a_wrong_engine_does_not_agree_with_the_thesis_in_words():
    sound = figure("falling_object", "position-error").draw(simulate).note
    wrong = figure("falling_object", "position-error").draw(off_by(0.97, "gravity")).note

    assert sound.startswith("The error ends at 1.635 m, ½ g t h at 1.635 m.")
    assert re.match(r"The error ends at -5\d\.\d+ m, ½ g t h at 1\.635 m\.", wrong)


def test_what_is_not_finite_is_no_number_of_a_sentence():
    assert told(float("nan")) == told(float("inf")) == "no finite value"
    assert at((1.0, 2.0, 4.0), (10.0, 20.0, 40.0), 2.9) == 20.0
