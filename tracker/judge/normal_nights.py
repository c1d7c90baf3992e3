"""What independent normal nights do by chance: Student's t, and whether nights look like such ones.

A permutation test holds whatever the noise is and pays for it: of sixty nights and four it tells one step in ten
fewer than Student's test, which is exact where nights are independent and normal. So that one decides alone where
nights show neither memory nor skewness nor heavy tails. Accidents that were not seen yet are not normal: no single
night counts for more than `WEIGHT` deviations, and so two in four nights are no shift.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    Values: TypeAlias = npt.NDArray[np.float64]

RARER = 4.265  # standard deviations, by the t test: one in a hundred thousand
LEARNT = 40  # nights: the skewness of fewer tells too little
WEIGHT = 3.5  # deviations: more of one night is an accident
WHITE = 1.2816  # standard deviations of an autocorrelation: one in ten without memory exceeds it
NORMAL_SCORE = 2.3263  # one in a hundred that are normal exceeds it
MEMORY = (1, 5)  # lags, nights, at which nights that remember each other are noticed


def chance(base: Values, last: Values, enough: float = 1.0) -> float:
    """How probable it is that the mean of the last nights lies so far above the nights before.

    By Student's t, whose degrees of freedom are those of the nights before; 1 where these do not look like
    independent normal ones, or are too few to tell. What is not rarer than `enough` is not looked at so closely.
    """
    import numpy as np

    count, level = len(base), float(np.mean(base))
    noise = float(np.std(base, ddof=1)) if count >= LEARNT else 0.0
    if noise <= 0.0:
        return 1.0
    rise = float(np.mean(np.minimum(last, level + WEIGHT * noise))) - level
    if rise <= 0.0:
        return 1.0
    probability = exceeded(rise / (noise * math.sqrt(1.0 / len(last) + 1.0 / count)), count - 1)
    return probability if probability >= enough or independent_and_normal(base) else 1.0


def independent_and_normal(base: Values) -> bool:
    """Whether nights show no memory, and no tail towards the worse that normal ones have not."""
    import numpy as np

    count = len(base)
    off = (base - np.mean(base)) / np.std(base)
    if any(float(off[lag:] @ off[:-lag]) > WHITE * math.sqrt(count) for lag in MEMORY):
        return False
    skewed = skewness_score(float(np.mean(off**3)), count)
    return skewed < NORMAL_SCORE and kurtosis_score(float(np.mean(off**4)), count) < NORMAL_SCORE


def skewness_score(skewness: float, count: int) -> float:
    """The standard normal deviate of a skewness of so many normal values, eight at least (D'Agostino 1970)."""
    n = float(count)
    scaled = skewness * math.sqrt((n + 1) * (n + 3) / (6 * (n - 2)))
    fourth = 3 * (n * n + 27 * n - 70) * (n + 1) * (n + 3) / ((n - 2) * (n + 5) * (n + 7) * (n + 9))
    square = math.sqrt(2 * (fourth - 1)) - 1
    return math.asinh(scaled / math.sqrt(2 / (square - 1))) / math.sqrt(0.5 * math.log(square))


def kurtosis_score(kurtosis: float, count: int) -> float:
    """The same of a kurtosis, three in the mean, of twenty values at least (Anscombe and Glynn 1983)."""
    n = float(count)
    variance = 24 * n * (n - 2) * (n - 3) / ((n + 1) ** 2 * (n + 3) * (n + 5))
    scaled = (kurtosis - 3 * (n - 1) / (n + 1)) / math.sqrt(variance)
    third = 6 * (n * n - 5 * n + 2) / ((n + 7) * (n + 9))
    third *= math.sqrt(6 * (n + 3) * (n + 5) / (n * (n - 2) * (n - 3)))
    freedom = 6 + 8 / third * (2 / third + math.sqrt(1 + 4 / third**2))
    below = 1 + scaled * math.sqrt(2 / (freedom - 4))
    root = math.copysign((abs(1 - 2 / freedom) / max(abs(below), 1e-12)) ** (1 / 3), below)
    return (1 - 2 / (9 * freedom) - root) / math.sqrt(2 / (9 * freedom))


def student(freedom: float) -> float:
    """The quantile of Student's t that is exceeded with one probability in 100 000 (Wallace 1959)."""
    z = RARER * (8.0 * freedom + 3.0) / (8.0 * freedom + 1.0)
    return math.sqrt(freedom * math.expm1(min(z * z / freedom, 700.0)))


def exceeded(t: float, freedom: float) -> float:
    """The probability that Student's t exceeds a value above zero: the inverse of `student` (Wallace 1959)."""
    z = math.sqrt(freedom * math.log1p(t * t / freedom)) * (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0)
    return 0.5 * math.erfc(z / math.sqrt(2.0))
