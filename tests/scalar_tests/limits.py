"""What tests of limits ask of the catalogue."""

from __future__ import annotations

from spook_tracker.scalar_tests.case import Measurement
from spook_tracker.scalar_tests.catalogue import CATALOGUE


def measurement(test: str, configuration: str, index: int = 0) -> Measurement:
    """One of a test's measurements in a configuration, in the order of the catalogue."""
    return [m for m in CATALOGUE[test].measurements if m.configuration == configuration][index]


def band(test: str, study: str) -> tuple[float, float]:
    """Where theory has the break point of a test's study."""
    found = next(one.expected for one in CATALOGUE[test].stability if one.name == study)
    assert found is not None
    return found
