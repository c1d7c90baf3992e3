"""The slider-crank of its question in the plane, step by step, written from its rows and nothing of the engine."""

from __future__ import annotations

import math

import numpy as np

from spook_tracker.scalar_tests.mechanisms import slider_crank


def cranked(crank: float, speed: float, steps: int, guided: bool = False) -> np.ndarray:
    """Places of the slider [m], or, `guided`, of the rod's far end, which then has nothing but its row across the guide."""
    return stepped(crank, speed, steps, guided)[0]


def stepped(crank: float, speed: float, steps: int, guided: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """The same, and what the motor carries [N m] in each step.

    Rows are as many as there are speeds, so no mass has a say: G v₊ = −a g + (1 − b) G v of pin and wrist, the crank's speed
    as the motor wants; a step turns by h w. It ends where h w of the rod reaches 1.
    """
    s, h = slider_crank, slider_crank.TIME_STEP
    spread = 1.0 + 4.0 * s.RELAXATION

    def along(angle: float) -> np.ndarray:
        return np.array((math.cos(angle), math.sin(angle)))

    def across(arm: np.ndarray) -> np.ndarray:
        return np.array((-arm[1], arm[0]))

    turn, height = s.START, crank * math.sin(s.START)
    lean = -math.asin(height / s.ROD)
    slider = crank * math.cos(s.START) + math.sqrt(s.ROD**2 - height**2)
    middle = crank * along(turn) + 0.5 * s.ROD * along(lean)
    leaning = -speed * crank * math.cos(turn) / (s.ROD * math.cos(lean))
    moving = speed * crank * across(along(turn)) + leaning * 0.5 * s.ROD * across(along(lean))
    sliding = -speed * crank * math.sin(turn) - leaning * s.ROD * math.sin(lean)
    v, found, carried = (
        np.array((speed, *moving, leaning, sliding)),
        [slider],
        [],
    )  # of crank, rod, rod's turn, slider
    masses = np.array((s.TURNING, s.ROD_MASS, s.ROD_MASS, s.ROD_MASS * s.ROD**2 / 12.0, s.SLIDER))
    for _ in range(steps):
        arm, end = 0.5 * s.ROD * along(lean), np.array((slider, 0.0))
        rows, off = np.zeros((5, 5)), np.zeros(5)
        rows[0, 0] = 1.0
        # A reaction acts on both bodies at the second one's point: the rod's at the pin, the slider's at the wrist.
        rows[1:3, 0], rows[1:3, 1:3], rows[1:3, 3] = -across(middle - arm), np.eye(2), -across(arm)
        rows[3:5, 1:3], rows[3:5, 3], rows[3:5, 4] = -np.eye(2), -across(end - middle), (1.0, 0.0)
        off[1:3], off[3:5] = middle - arm - crank * along(turn), end - middle - arm
        if guided:
            rows[3], off[3] = (0.0, 0.0, 1.0, across(arm)[1], 0.0), (middle + arm)[1]
            rows[4], off[4] = (
                (0.0, -1.0, 0.0, -across(arm)[0], 1.0),
                0.0,
            )  # the slider is but where the end is
        right = (rows @ v - 4.0 / h * off) / spread
        right[0] = speed
        before, v = v, np.linalg.solve(rows, right)
        carried.append(float(np.linalg.solve(rows.T, masses * (v - before))[0]) / h)
        if abs(h * v[3]) >= 1.0:
            break
        turn, lean = turn + h * v[0], lean + h * v[3]
        middle, slider = middle + h * v[1:3], slider + h * v[4]
        found.append(float((middle + 0.5 * s.ROD * along(lean))[0]) if guided else slider)
    return np.array(found), np.array(carried)
