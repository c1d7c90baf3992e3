"""What the beam looks like at rest, and how well its nodes lie on the curve."""

from __future__ import annotations

import numpy as np

from ... import case
from ...sweep import apart, line, told
from .measure import settled_nodes
from .scene import COUNT, COUNTS, LENGTH, LOAD, SMALL, deflection


def draw_shape(simulate: case.Simulate) -> case.Drawing:
    x = (np.arange(COUNT) + 0.5) * LENGTH / COUNT
    nodes = settled_nodes(simulate, COUNT, LOAD)
    places = tuple(map(float, x))
    return case.Drawing(
        curves=(
            line("simulation", places, -nodes, "points"),
            line("P x² (3l − x)/(6EI)", places, -deflection(x), "reference"),
        ),
        x_label="position on the beam [m]",
        y_label="height [m]",
        note=f"At most {apart(nodes, deflection(x))} m from the formula. The thesis' beam bends too far, because its compliance was tuned by hand.",
    )


def draw_difference(simulate: case.Simulate) -> case.Drawing:
    x = (np.arange(COUNT) + 0.5) * LENGTH / COUNT
    nodes = settled_nodes(simulate, COUNT, LOAD)
    return case.Drawing(
        curves=(line("simulation − formula", x, deflection(x) - nodes, "both"),),
        x_label="position on the beam [m]",
        y_label="difference in height [m]",
        note=f"At most {apart(deflection(x), nodes)} m. The linear formula does not know how a strongly bent beam shortens.",
    )


def draw_against_count(simulate: case.Simulate) -> case.Drawing:
    errors = []
    for count in COUNTS:
        x = (np.arange(count) + 0.5) * LENGTH / count
        right = deflection(x, SMALL * LOAD)
        errors.append(float(np.abs(settled_nodes(simulate, count, SMALL * LOAD) / right - 1.0).max()))
    return case.Drawing(
        curves=(
            case.Curve(name="largest relative node error", x=tuple(map(float, COUNTS)), y=tuple(errors)),
        ),
        x_label="elements",
        y_label="largest relative error of a node",
        x_scale="log",
        y_scale="log",
        note=f"At most {told(max(errors))}. In theory the nodes are exact for any number of elements.",
    )
