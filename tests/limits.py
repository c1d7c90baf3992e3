"""What tests of limits ask of the catalogue."""

from __future__ import annotations

from spook_tracker.scalar_tests.case import Measurement
from spook_tracker.scalar_tests.catalogue import CATALOGUE


def measurement(test: str, configuration: str, index: int = 0) -> Measurement:
    """One of a test's measurements in a configuration, in the order of the catalogue."""
    return [m for m in CATALOGUE[test].measurements if m.configuration == configuration][index]
