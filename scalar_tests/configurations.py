"""The configurations that ladders share, by name: what is asked of one is the order of accuracy that theory gives it."""

from __future__ import annotations

from collections.abc import Mapping

from spook_tracker.engine.method import PLAIN, Method

from . import case

METHODS = {
    **dict.fromkeys(("plain", "direct"), PLAIN),
    **dict.fromkeys(("half-step", "half step", "half-step velocities"), Method(half_step_velocities=True)),
    "half-step, curved twice": Method(half_step_velocities=True, corrections=2),
    "curved twice": Method(corrections=2),
    "two substeps": Method(substeps=2),
    **dict.fromkeys(("order4", "order 4"), Method(composition="order4")),
    **dict.fromkeys(("order6", "order 6"), Method(composition="order6")),
    **dict.fromkeys(("order8", "order 8"), Method(composition="order8")),
    **dict.fromkeys(("iterative", "iterative, 50 iterations"), Method(solver="iterative")),
    "iterative, 200 iterations": Method(solver="iterative", iterations=200),
    "direct, no refinement": Method(refinements=0),
}

FORMERLY = {f"iterative, {count} iterations": (f"iterative, {count} sweeps",) for count in (50, 200)}


def configured(
    orders: Mapping[str, float | None], order_range: tuple[float, float] | None = None
) -> tuple[case.Configuration, ...]:
    """A configuration for each name, with its expected order (None: none is expected) over the same range of steps [s]."""
    return tuple(
        case.Configuration(
            name=name,
            method=METHODS[name],
            expected_order=order,
            order_range=None if order is None else order_range,
            formerly=FORMERLY.get(name, ()),
        )
        for name, order in orders.items()
    )
