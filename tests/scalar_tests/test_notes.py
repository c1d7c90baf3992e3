"""Sentences beside figures are made from the numbers of their figure: another engine, other sentences."""

import functools
import re

import numpy as np
import pytest

from spook_tracker.engine import simulate
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.scalar_tests.sweep import at, told
from tests.toys.broken_engines import off_by, restless
from tests.toys.short_engine import read_off

FACTS = {  # of the thesis, of theory, of a scene: true whatever an engine gives
    "A box that is only held tells nothing about anisotropy",
    "A point that is missing here did not complete",
    "Above µ = 1 a cube tips over before it slides, so the sweep ends at 0.9",
    "Aliasing: what is seen is not the motion",
    "In the thesis it is the last but one, and its bars end at 15 %: link length and duration are not printed there",
    "In the thesis the deviation grows from about 100 boxes on, down to −8e-8 %",
    "In theory F₁ₓ = −F₂ₓ",
    "In theory mass has no effect without compliance",
    "In theory rolling ends at tan θ = 3.5 µ = 0.7",
    "In theory the nodes are exact for any number of elements",
    "In theory those between .2113 and .7887 do, whose metacentre lies below their centre of mass",
    "It is taken relative to an energy that grows as N², while most of it is the half step by which the velocity lags at the start",
    "Not a defect but a property of the method: without compliance and damping −1 is a double eigenvalue and any violation grows as (−1)ⁿ(2n + 1)",
    "Root mean square of 16 drops, which meet the floor anywhere in a step",
    "The labels of its axes are swapped",
    "The labels of the two axes are swapped in the thesis",
    "The linear formula does not know how a strongly bent beam shortens",
    "The printed limit 0.004 % is the thesis' value read as a ratio",
    "The row's frequency is (2/h) atan(h ω/2), a little below ω",
    "The thesis captions this length as energy",
    "The thesis counts the oscillation and leaves the decay out",
    "The thesis draws about 5 m: the line read one sample late, three times as steep",
    "The thesis draws the gain alone, 0.24 % at 0.02 s",
    "The thesis reads down to −2e-7 % near h = 1e-4 s, where its beam never stopped ringing",
    "The thesis' 30 m at 0.1 s is this read one sample late",
    "The thesis' beam bends too far, because its compliance was tuned by hand",
    "The thesis' beam rings at this time step (about −1e-6 %)",
    "The thesis' figure reads −5e-9 m at the middle, ten times its own limit",
    "The thesis' jump near zero is the constant of the printed sign",
    "Verlet's is a little above",
    "the largest |E − E₀| has both",
    "the printed limit is 4.9e-9 %",
    "the thesis reads 3.4 %, whatever the mass",
    "the thesis reads up to 0.2 µN at 600 kg",
    "the thesis' curve dips near tan θ = 0.3",
}
FIGURES = [
    pytest.param(figure, id=f"{name}-{figure.name}")
    for name, test in CATALOGUE.items()
    for figure in test.figures
]


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


def sentences(note):
    return {part.strip(" .;") for part in re.split(r"(?<=[.;])\s+", note)} - {""}


@functools.cache
def said(figure):
    with np.errstate(all="ignore"):
        return sentences(figure.draw(read_off(wrong=False)).note)


@pytest.mark.parametrize("figure", FIGURES)
def test_what_is_said_beside_a_figure_is_drawn_from_it_or_is_a_fact(figure):
    """With an engine that is far off, a sentence that stays was written before the run."""
    with np.errstate(all="ignore"):
        wrong = figure.draw(read_off(wrong=True)).note

    assert said(figure) & sentences(wrong) <= FACTS


def test_every_fact_that_is_listed_is_said():
    assert set().union(*(said(figure) for test in CATALOGUE.values() for figure in test.figures)) >= FACTS
