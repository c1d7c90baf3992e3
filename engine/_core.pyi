"""The native module. Kept by hand; tests/test_engine_stub.py holds it to the compiled module."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

def build_facts() -> dict[str, str]: ...

class ParticleProgram:
    def __init__(
        self,
        bodies: npt.NDArray[np.float64],
        row_ends: npt.NDArray[np.int64],
        rows: npt.NDArray[np.float64],
        spring_ends: npt.NDArray[np.int64],
        springs: npt.NDArray[np.float64],
        fields: npt.NDArray[np.float64],
        gravity: tuple[float, float, float],
        method: dict[str, Any],
        quantities: Sequence[tuple[str, int, tuple[float, float, float]]],
        observations: Sequence[tuple[int, str, int, int, bool, int]],
    ) -> None: ...
    def run(self, steps: int, time_limit: float, timed: bool) -> dict[str, Any]: ...
    @property
    def solver(self) -> str: ...
    @property
    def held_twice(self) -> bool: ...

class RigidProgram:
    def __init__(
        self,
        body_kinds: npt.NDArray[np.int64],
        bodies: npt.NDArray[np.float64],
        joint_kinds: npt.NDArray[np.int64],
        joints: npt.NDArray[np.float64],
        spring_ends: npt.NDArray[np.int64],
        springs: npt.NDArray[np.float64],
        fields: npt.NDArray[np.float64],
        collider_kinds: npt.NDArray[np.int64],
        colliders: npt.NDArray[np.float64],
        no_contact: npt.NDArray[np.int64],
        gravity: tuple[float, float, float],
        method: dict[str, Any],
        quantities: Sequence[tuple[str, int, tuple[float, float, float]]],
        observations: Sequence[tuple[int, str, int, int, bool, int]],
    ) -> None: ...
    def run(self, steps: int, time_limit: float, timed: bool) -> dict[str, Any]: ...
    @property
    def solver(self) -> str: ...
    @property
    def contacts_possible(self) -> bool: ...
