"""What a test watches, by short names: at every step, at the end, and the largest there was."""

from __future__ import annotations

from typing import Any

from spook_tracker.engine import Final, Maximum, Trace
from spook_tracker.engine.observe import Quantity


def traces(**quantities: Quantity) -> dict[str, Any]:
    return {name: Trace(quantity=quantity) for name, quantity in quantities.items()}


def finals(**quantities: Quantity) -> dict[str, Any]:
    return {name: Final(quantity=quantity) for name, quantity in quantities.items()}


def maxima(**quantities: Quantity) -> dict[str, Any]:
    return {name: Maximum(quantity=quantity) for name, quantity in quantities.items()}
