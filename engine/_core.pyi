"""The native module. Kept by hand; tests/test_engine_stub.py holds it to the compiled module."""

from collections.abc import Sequence
from typing import Any

def build_facts() -> dict[str, str]: ...

Point = tuple[float, float, float]
Columns = dict[str, Any]

class QuantityRequest:
    def __init__(self, kind: str, index: int, point: Point, other: int) -> None: ...

class Observation:
    def __init__(
        self, quantity: int, reduction: str, first: int, last: int, from_start: bool, every: int
    ) -> None: ...

class ParticleProgram:
    def __init__(
        self,
        bodies: Columns,
        rows: Columns,
        springs: Columns,
        fields: Columns,
        gravity: Point,
        method: dict[str, Any],
        quantities: Sequence[QuantityRequest],
        observations: Sequence[Observation],
    ) -> None: ...
    def run(self, steps: int, time_limit: float, timed: bool) -> dict[str, Any]: ...
    @property
    def choices(self) -> list[tuple[str, bool, str]]: ...
    @property
    def stages(self) -> list[str]: ...

class RigidProgram:
    def __init__(
        self,
        bodies: Columns,
        joints: Columns,
        motors: Columns,
        limits: Columns,
        joint_springs: Columns,
        springs: Columns,
        fields: Columns,
        colliders: Columns,
        no_contact: Columns,
        contacts: bool,
        gravity: Point,
        method: dict[str, Any],
        quantities: Sequence[QuantityRequest],
        observations: Sequence[Observation],
    ) -> None: ...
    def run(self, steps: int, time_limit: float, timed: bool) -> dict[str, Any]: ...
    @property
    def choices(self) -> list[tuple[str, bool, str]]: ...
    @property
    def stages(self) -> list[str]: ...
