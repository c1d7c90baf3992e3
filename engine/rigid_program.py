"""Rigid bodies: pack a scene for the native pipeline, choose the stages, say why."""

from __future__ import annotations

from collections.abc import Mapping

from engine.errors import SceneError
from engine.method import Method
from engine.observe import Observable
from engine.program import Program
from engine.scene import Scene


def compile_rigid(
    scene: Scene, time_step: float, method: Method, observe: Mapping[str, Observable]
) -> Program:
    """The Program of a scene with at least one rigid body."""
    raise SceneError("rigid bodies cannot be simulated yet; use particles")
