"""Every scalar test by name: the table that `tracker run` goes through. A new test is a file and a line here."""

from __future__ import annotations

from scalar_tests import (
    falling_object,
    n_pendulum,
    oscillator_damped,
    oscillator_filter,
    oscillator_row,
    oscillator_spring,
    pendulum,
    planetarium,
)
from scalar_tests.case import ScalarTest

CATALOGUE: dict[str, ScalarTest] = {
    "falling_object": falling_object.TEST,
    "pendulum": pendulum.TEST,
    "n_pendulum": n_pendulum.TEST,
    "planetarium": planetarium.TEST,
    "oscillator_spring": oscillator_spring.TEST,
    "oscillator_row": oscillator_row.TEST,
    "oscillator_damped": oscillator_damped.TEST,
    "oscillator_filter": oscillator_filter.TEST,
}
