"""A model file as something an engine can be asked: which file, started and driven how, and what of it is watched.

A `ModelRun` takes the place of a `Scene` in `simulate`: an engine that reads the file's format loads it with its own
loader and gives a `Result`. One without says so: `NotSupported`. Nothing here reads a file (`engine.model_reading`
does) and nothing here knows an engine.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

Format = Literal["MJCF", "URDF", "SDF"]
DRIVES = ("zero", "hold", "table", "sinusoid", "function")
SHOWN_AS = ("sphere", "box", "capsule", "facets", "plane")  # what a drawing has; sizes as a DrawnSolid's
PARTS = (
    "contacts",
    "limits",
    "ties",
    "dry friction",
    "actuators",
    "damping",
)  # of a model, that can be left out


@dataclass(frozen=True, slots=True, kw_only=True)
class Watched:
    """A body whose place and turn are read. An unnamed one is found from its nearest named ancestor (or the world, "")
    by the places of children, each from 0: ("torso", (2, 0)) is the first child of the third child of torso."""

    label: str  # what a reader sees; unique in its model
    name: str  # as the file has it
    path: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """What the actuators get over time. A table holds each row from its time on; a function gets (time [s], count)."""

    kind: Literal["zero", "hold", "table", "sinusoid", "function"] = "zero"
    rows: tuple[tuple[float, ...], ...] = ()  # of a table: time [s], then a control each
    amplitude: float = 0.0  # of a sinusoid, in the unit of the controls
    frequency: float = 0.0  # Hz
    function: str = ""  # module:name
    digest: str = ""  # of the module that holds the function: another one is another test


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelFile:
    """A model and how it is started. `digest` is a hash over all its files: where it lies makes no other model."""

    path: str = field(metadata={"definition": False})
    format: Format
    digest: str
    time_step: float  # s, the file's own
    watched: tuple[Watched, ...]
    keyframe: str = ""  # its name, or its number; "": as the file describes it
    drive: Drive = Drive()
    push: float = (
        0.0  # of the size a second and a body: random changes of velocity in every step, part of the question
    )
    seed: int = 0  # of those
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)  # m/s², for engines whose loaders do not read it
    assets: Mapping[str, str] = field(default_factory=dict, metadata={"definition": False})  # name → path


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelRun:
    """One simulation of a model: what `simulate` is given in place of a scene.

    The Result's observables are, of the watched bodies B at the samples S: position (S, B, 3) m, orientation
    (S, B, 4), both from the world; speed (B,) m/s of the end, size () m of what moves,
    energy (S, 2) J, potential and kinetic, where an engine tells it, violation (S,) of equality constraints and joint
    limits in m or rad, and of the last state overlap () m, load () N carried by contacts with what does not move over the weight of what moves. With
    `until_settled` the run ends early, but not before the last sample: settled () is since when [s] it has been calm, NaN if it
    moves, and creep (B,) m/s. With
    `timed`: load_seconds, step_seconds and worst_step_seconds, real_time_factor, megabytes. With `shown`, of the bodies N that
    are seen body_place (S, N, 3) m and body_turn (S, N, 4), and of their shapes G at the start shape_kind (G,), a place in
    SHOWN_AS, shape_size (G, W) m, NaN beyond its numbers, shape_body (G,), a place among N, shape_fixed (G,), shape_place
    (G, 3) m and shape_turn (G, 4); NotSupported where an engine tells no shapes.
    """

    model: ModelFile
    samples: tuple[float, ...] = ()  # s, growing
    until_settled: bool = False
    push: float = 0.0  # of the size a second and a body, as random changes of velocity in every step
    seed: int = 0
    timed: bool = False
    accurate: bool = False  # the engine's most accurate setting in place of the file's
    conservative: bool = False  # without all that takes or gives energy but gravity and springs
    swing: float = 0.0  # rad/s and m/s: conservative, without equality constraints, joints started by up to that at random
    gain: float = 1.0  # times the file's own, of its servos
    without: frozenset[str] = frozenset()  # of PARTS: what is left out to see what it does
    rigid: bool = False  # all that gives way as hard as can be, without rebound, begun within limits
    elsewhere: bool = False  # in a process of its own
    shown: bool = False  # with all that is seen of it
