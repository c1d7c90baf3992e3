"""The binding to our shared library: what a team has already, in one form or another."""

import ctypes
from pathlib import Path

import numpy as np

BUILD = Path(__file__).parents[1] / "build"
LIBRARY = ctypes.CDLL(str(next(BUILD.glob("libpebble.*"))))
ROD = np.dtype([("first", np.int32), ("second", np.int32), ("length", np.float64)], align=True)


class World:
    """Particles and rods; `add` and `join`, then `step`."""

    def __init__(self, gravity, time_step, iterations):
        self.gravity, self.time_step, self.iterations = np.array(gravity, dtype=float), time_step, iterations
        self.positions, self.velocities, self.inverse_masses = np.empty((0, 3)), np.empty((0, 3)), np.empty(0)
        self.rods = np.empty(0, dtype=ROD)
        self.shown = None

    def add(self, position, velocity=(0.0, 0.0, 0.0), mass=None):
        """A particle; without a mass, a fixed point. Returns its number."""
        self.positions = np.vstack([self.positions, position])
        self.velocities = np.vstack([self.velocities, velocity])
        self.inverse_masses = np.append(self.inverse_masses, 0.0 if mass is None else 1.0 / mass)
        return len(self.positions) - 1

    def join(self, first, second, length):
        """A rod between two particles."""
        self.rods = np.append(self.rods, np.array((first, second, length), dtype=ROD))

    def at(self, places):
        """Positions of some particles."""
        return self.positions[list(places)]

    def step(self, count):
        """Let the library take that many steps."""
        arrays = (self.positions, self.velocities, self.inverse_masses, self.rods, self.gravity)
        x, v, w, rods, g = (array.ctypes.data_as(ctypes.c_void_p) for array in arrays)
        LIBRARY.pebble_step(
            x, v, w, len(self.positions), rods, len(self.rods), g,
            ctypes.c_double(self.time_step), self.iterations, count,
        )  # fmt: skip

    def state(self):
        """Positions and velocities of the bodies that were asked for: fixed points come after them."""
        return self.positions[: self.shown], self.velocities[: self.shown]
