"""The frequency of a swing, read from its samples."""

from __future__ import annotations

import math

import numpy as np


def phase(values: np.ndarray) -> float:
    """Turn per sample [rad] of a swing about zero: x₊ + x₋ = 2 x cos φ, by least squares; NaN of what does not swing."""
    inner = values[1:-1]
    square = float(inner @ inner)
    cosine = 0.5 * float(inner @ (values[2:] + values[:-2])) / square if square > 0.0 else math.nan
    return math.acos(cosine) if abs(cosine) <= 1.0 else math.nan
