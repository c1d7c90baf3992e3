"""The thesis' figures of the planetarium, drawn from this run."""

from __future__ import annotations

import numpy as np

from spook_tracker import engine

from ... import case
from ...sweep import apart, line, sweep, told
from .scene import DURATION, HALF_STEP, TIME_STEP, energies, exact_position, orbit_radius, scene

TIME_STEPS = (TIME_STEP, 0.1, 0.25, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0)  # s
EVERY = 120  # samples apart in the figures, 2 s


def _orbit(simulate: case.Simulate) -> np.ndarray:
    observe = {"planet": engine.Trace(quantity=engine.Position("planet"), every=EVERY)}
    result = simulate(scene(), time_step=TIME_STEP, duration=DURATION, observe=observe)
    return np.asarray(result["planet"])


def draw_orbit(simulate: case.Simulate) -> case.Drawing:
    """The orbit in its plane."""
    planet = _orbit(simulate)
    angle, far = np.unwrap(np.arctan2(planet[:, 1], planet[:, 0])), np.hypot(planet[:, 0], planet[:, 1])
    rounds = float(angle[-1] - angle[0]) / (2.0 * np.pi)
    exact = [exact_position(t) for t in np.linspace(0.0, 366.0, 184)]
    return case.Drawing(
        curves=(
            line("simulation", planet[:, 0], planet[:, 1]),
            line("Kepler", [x for x, _ in exact], [y for _, y in exact], "reference"),
        ),
        x_label="x [m]",
        y_label="y [m]",
        note=f"{told(rounds, 3)} rounds, at most {apart(far, orbit_radius(angle))} m off the ellipse.",
    )


def draw_energy(simulate: case.Simulate) -> case.Drawing:
    """Energy deviation against time, right and as printed."""
    time, right, printed = energies(simulate, TIME_STEP, every=EVERY)
    return case.Drawing(
        curves=(
            line("½v² − k²/r", time, right),
            line("½v² + k²/r, as printed", time, printed),
        ),
        x_label="time [s]",
        y_label="energy deviation [%]",
        note=f"The thesis' ±2 % is the sign of its Eq 3.18: ½v² + k²/r swings by {told(float(np.abs(printed).max()))} %. "
        f"The energy itself swings by {told(float(np.abs(right).max()))} %.",
    )


def draw_energy_itself(simulate: case.Simulate) -> case.Drawing:
    """The right energy alone, since the printed one hides it."""
    time, right, _ = energies(simulate, TIME_STEP, every=EVERY)
    time_half, half, _ = energies(simulate, TIME_STEP, HALF_STEP, every=EVERY)
    return case.Drawing(
        curves=(line("plain", time, right), line("half-step", time_half, half)),
        x_label="time [s]",
        y_label="energy deviation [%]",
    )


def draw_radius(simulate: case.Simulate) -> case.Drawing:
    """Distance against angle."""
    planet = _orbit(simulate)
    angle = np.unwrap(np.arctan2(planet[:, 1], planet[:, 0]))
    return case.Drawing(
        curves=(
            line("simulation", angle, np.hypot(planet[:, 0], planet[:, 1])),
            line("1/(1 + ξ sin θ)", angle, orbit_radius(angle), "reference"),
        ),
        x_label="angle θ [rad]",
        y_label="distance r [m]",
        note="The labels of the two axes are swapped in the thesis.",
    )


def draw_time_step(simulate: case.Simulate) -> case.Drawing:
    """Energy deviation against time step."""

    def worst(which: int) -> tuple[float, ...]:
        return sweep(TIME_STEPS, lambda h: np.abs(energies(simulate, h)[which]).max())

    right = worst(1)
    return case.Drawing(
        curves=(
            line("½v² − k²/r", TIME_STEPS, right, "both"),
            line("½v² + k²/r, as printed", TIME_STEPS, worst(2), "both"),
        ),
        x_label="time step [s]",
        y_label="largest energy deviation [%]",
        note=f"{told(right[0])} % at {TIME_STEPS[0]:.3g} s and {told(right[-1])} % at {TIME_STEPS[-1]:g} s. The thesis' jump "
        "near zero is the constant of the printed sign. The labels of its axes are swapped.",
    )


FIGURES = (
    case.Figure(name="orbit", title="The orbit", draw=draw_orbit, thesis="Fig 3.32"),
    case.Figure(name="energy", title="Energy deviation against time", draw=draw_energy, thesis="Fig 3.33"),
    case.Figure(
        name="energy-itself", title="Energy deviation against time, right sign", draw=draw_energy_itself
    ),
    case.Figure(name="radius", title="Distance against angle", draw=draw_radius, thesis="Fig 3.34"),
    case.Figure(
        name="energy-against-time-step",
        title="Energy deviation against time step",
        draw=draw_time_step,
        thesis="Fig 3.35",
    ),
)
