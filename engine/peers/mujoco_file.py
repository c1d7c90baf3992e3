"""A user's own model in MuJoCo: loaded by MuJoCo's loader, its options as the file has them, run and read.

Every release since 2.3 can do this: nothing of the bindings is used that came or went since. The file stays as it
is; a time step other than its own is set in the compiled model.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from ..errors import EngineError
from ..model_file import Drive, ModelRun, Watched
from ..protocol import NotSupported
from ..result import Result
from .lacking import place_in, place_of, texts_of
from .model_loop import Array, LoadedModel, elsewhere
from .mujoco_shown import Shown

BAD = ("mjWARN_BADQPOS", "mjWARN_BADQVEL", "mjWARN_BADQACC")
FULL = ("mjWARN_CONTACTFULL", "mjWARN_CNSTRFULL")
READS = ("MJCF", "URDF")
DAMPING = ("dof_damping", "dof_dampingpoly", "tendon_damping", "tendon_dampingpoly")  # of joints and tendons
SWITCHES = {  # of the parts a model can be asked without
    "contacts": "mjDSBL_CONTACT",
    "limits": "mjDSBL_LIMIT",
    "ties": "mjDSBL_EQUALITY",
    "dry friction": "mjDSBL_FRICTIONLOSS",
    "actuators": "mjDSBL_ACTUATION",
}
SOFTNESS = ("geom_solref", "pair_solref", "jnt_solref", "tendon_solref_lim", "eq_solref")
HARDER, IMPEDANCE = 64.0, 8.0  # times faster and stiffer where what gives way is asked as if it did not
RATIO = (0.5 * HARDER) ** 0.5  # of damping, with which what is so much faster takes its own time to come back
LOADS = 3  # times a file is loaded to tell how long it takes


def run_model(run: ModelRun, time_step: float, duration: float, time_limit: float | None) -> Result:
    """Load the file, drive it for `duration` [s] and read what is asked for."""
    mujoco.set_mju_user_warning(_unheard)
    if run.elsewhere:
        return elsewhere(__name__, run, time_step, duration, time_limit)
    began = time.perf_counter()
    try:
        first = load(run)
    except (ValueError, OSError, RuntimeError) as error:
        raise NotSupported(f"mujoco refuses {refusal(run, error)}") from None
    loads = [time.perf_counter() - began]
    if run.timed:
        for _ in range(LOADS - 1):
            began = time.perf_counter()
            load(run)
            loads.append(time.perf_counter() - began)
    try:
        return _Simulation(run, first, time_step, time_limit).result(duration, min(loads))
    except mujoco.FatalError as error:
        raise EngineError(f"mujoco gives up on {Path(run.model.path).name}: {_line(error)}") from None


def load(run: ModelRun) -> Any:
    """The compiled model; a URDF's meshes are handed in, for MuJoCo does not know where packages lie. It tells them by
    what stands after the last slash: meshes of one such name are handed in by others."""
    path = Path(run.model.path)
    if run.model.format == "URDF":
        text, files = path.read_text(encoding="utf-8"), dict[str, str]()
        for number, (name, file) in enumerate(run.model.assets.items()):
            short = name.rpartition("/")[2]
            if files.setdefault(short, file) != file:
                files[other := f"{number}_{short}"] = file
                text = text.replace(f'"{name}"', f'"{other}"').replace(f"'{name}'", f"'{other}'")
        assets = {name: Path(file).read_bytes() for name, file in files.items()}
        return mujoco.MjModel.from_xml_string(text, assets)
    return mujoco.MjModel.from_xml_path(str(path))


def _unheard(message: str) -> None:
    """MuJoCo would print it and write a log where one stands; a state it resets is found by its counters."""


def refusal(run: ModelRun, error: object) -> str:
    """What MuJoCo says of a file, with the line where the file says what it names, and what helps."""
    path, said = Path(run.model.path), _line(error)
    texts, line = texts_of(path), ""
    if not re.search(r"\bline [1-9]", said):
        if mesh := re.search(r"file '[^']*?([^'/]+)'", said):
            line = place_of(texts, mesh[1]) or place_of(texts, re.sub(r"^\d+_", "", mesh[1]))
        elif element := re.search(r"name '([^']+)'", said):
            line = place_in(texts, "body", element[1])
    helps = " (MuJoCo reads meshes as .stl, .obj and .msh: convert it)" if "no decoder" in said else ""
    return f"{path.name}{f', {line}' if line else ''}: {said.replace('; ', ', ')}{helps}"


def _line(error: object) -> str:
    return " ".join(str(error).split())[:240]


def start_at(run: ModelRun, model: Any, data: Any) -> None:
    """Put the model at its keyframe, by name or number, or as the file describes it; a swing gets its speeds, and what is to be
    rigid begins within its limits."""
    if keyframe := run.model.keyframe:
        found = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_KEY, keyframe))
        if found < 0 and keyframe.isdigit():
            found = int(keyframe)
        if not 0 <= found < model.nkey:
            raise NotSupported(f"the model has no keyframe {keyframe!r}")
        mujoco.mj_resetDataKeyframe(model, data, found)
    if run.swing:
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_EQUALITY)
        data.qvel[:] = run.swing * np.random.default_rng(run.seed).uniform(-1.0, 1.0, model.nv)
    if run.rigid:
        single = [int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_HINGE)]
        limited = np.asarray(model.jnt_limited, dtype=bool) & np.isin(model.jnt_type, single)
        places = np.asarray(model.jnt_qposadr)[limited]
        data.qpos[places] = np.clip(data.qpos[places], *np.asarray(model.jnt_range)[limited].T)
    mujoco.mj_forward(model, data)


def bodies_of(run: ModelRun, model: Any) -> npt.NDArray[np.int64]:
    """MuJoCo's numbers of the watched bodies."""
    return np.array([_body(run, model, one) for one in run.model.watched], dtype=int)


def _body(run: ModelRun, model: Any, watched: Watched) -> int:
    found = 0
    if watched.name:
        found = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, watched.name))
    for place in watched.path:
        children = np.flatnonzero(np.asarray(model.body_parentid) == found)
        children = children[children > 0]
        found = int(children[place]) if found >= 0 and place < len(children) else -1
    if found < 0:
        raise NotSupported(f"mujoco finds no body {watched.label!r} in {Path(run.model.path).name}")
    return found


def size_of(run: ModelRun, model: Any, data: Any) -> float:
    """Of what moves: how far its geoms reach from their middle, twice; its bodies where it has no geoms [m]."""
    weld = np.asarray(model.body_weldid)
    geoms = np.flatnonzero(weld[np.asarray(model.geom_bodyid)] != 0)
    places = data.geom_xpos[geoms] if len(geoms) else data.xpos[weld != 0]
    reach = np.asarray(model.geom_rbound)[geoms] if len(geoms) else np.zeros(len(places))
    if not len(places):
        raise NotSupported(f"nothing in {Path(run.model.path).name} moves")
    size = 2.0 * float(np.max(np.linalg.norm(places - places.mean(axis=0), axis=1) + reach))
    return size if np.isfinite(size) and size > 0.0 else float(model.stat.extent)


class _Simulation(LoadedModel):
    """One model with its data."""

    def __init__(self, run: ModelRun, model: Any, time_step: float, time_limit: float | None) -> None:
        super().__init__(run, time_step, time_limit)
        self.model = model
        model.opt.timestep = time_step
        alter(model, run)
        _set(model, run)
        self.data = mujoco.MjData(model)
        start_at(run, model, self.data)
        self.bodies = bodies_of(run, model)
        self.moving = np.flatnonzero(np.asarray(model.body_weldid) != 0)
        self.size, self.freedom = size_of(run, model, self.data), model.nv
        self.drive = driven(run.model.drive, model, self.data)
        self.varies = self.drive.varies

    def take(self, count: int) -> None:
        mujoco.mj_step(self.model, self.data, count)

    def push(self, change: Array) -> None:
        self.data.qvel += change

    def control(self) -> None:
        self.drive.apply(self.data)

    def trouble(self) -> str:
        for kind in BAD:
            if self.data.warning[getattr(mujoco.mjtWarning, kind)].number:
                return f"mujoco reset a state it calls bad ({kind[7:].lower()})"
        for kind in FULL:
            if self.data.warning[getattr(mujoco.mjtWarning, kind)].number:
                return "mujoco leaves contacts or constraints out, for lack of memory (<size memory>)"
        return "" if np.isfinite(self.data.qpos).all() else "a place is not finite"

    def read(self) -> None:
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_comVel(self.model, self.data)

    def poses(self) -> tuple[Array, Array]:
        return self.data.xpos[self.bodies], self.data.xquat[self.bodies]

    def shapes(self) -> dict[str, Array]:
        self.shown = Shown(self.model, self.data)
        return self.shown.arrays()

    def seen(self) -> tuple[Array, Array]:
        return self.data.xpos[self.shown.bodies], self.data.xquat[self.shown.bodies]

    def speeds(self) -> tuple[Array, Array]:
        m, d, bodies = self.model, self.data, self.moving
        spin = d.cvel[bodies, :3]
        arm = d.xipos[bodies] - d.subtree_com[np.asarray(m.body_rootid)[bodies]]
        return np.linalg.norm(d.cvel[bodies, 3:] + np.cross(spin, arm), axis=1), np.linalg.norm(spin, axis=1)

    def state(self) -> Array:
        d = self.data
        return np.concatenate([d.qpos, d.qvel, np.asarray(d.act)])

    def at_sample(self) -> dict[str, Any]:
        found: dict[str, Any] = {"violation": self.violation()}
        if self.run.conservative:
            mujoco.mj_energyPos(self.model, self.data)
            mujoco.mj_energyVel(self.model, self.data)
            found["energy"] = self.data.energy
        return found

    def at_end(self) -> dict[str, Any]:
        overlap, carried = self.contacts()
        found: dict[str, Any] = {"overlap": np.array(overlap), "load": np.array(carried)}
        if self.run.timed:
            arena = getattr(self.data, "narena", float("nan"))
            found["megabytes"] = np.array((mujoco.mj_sizeModel(self.model) + arena) / 1e6)
        return found

    def violation(self) -> float:
        """The largest of equality constraints and of joint limits, as they were at the start of the last step."""
        d = self.data
        kinds, places = np.asarray(d.efc_type)[: d.nefc], np.asarray(d.efc_pos)[: d.nefc]
        equal = kinds == int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)
        limit = kinds == int(mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT)
        held = np.concatenate([np.abs(places[equal]), np.maximum(0.0, -places[limit]), [0.0]])
        return float(held.max())

    def contacts(self) -> tuple[float, float]:
        """The deepest overlap [m] of the last step, and what contacts with the world carry over the weight of all that moves."""
        m, d = self.model, self.data
        mujoco.mj_forward(m, d)
        if not d.ncon:
            return 0.0, 0.0
        touching = d.contact
        overlap = max(0.0, float(-np.min(touching.dist)))
        weld = np.asarray(m.body_weldid)[np.asarray(m.geom_bodyid)]
        gravity = np.asarray(m.opt.gravity)
        strength = float(np.linalg.norm(gravity))
        if not strength:
            return overlap, 0.0
        frames, wrench, up = np.reshape(touching.frame, (-1, 3, 3)), np.zeros(6), -gravity / strength
        pairs = getattr(touching, "geom", None)
        ones, others = (pairs[:, 0], pairs[:, 1]) if pairs is not None else (touching.geom1, touching.geom2)
        held = 0.0
        for k in range(d.ncon):
            if ones[k] < 0 or others[k] < 0 or (weld[ones[k]] != 0) == (weld[others[k]] != 0):
                continue
            mujoco.mj_contactForce(m, d, k, wrench)
            force = float(frames[k].T @ wrench[:3] @ up)  # on the second
            held += force if weld[others[k]] != 0 else -force
        return overlap, held / (strength * float(np.asarray(m.body_mass)[self.moving].sum()))


def alter(model: Any, run: ModelRun) -> None:
    """What a run asks of the compiled model beside the file: parts left out, gains and softness other than its own."""
    off = mujoco.mjtDisableBit
    for part in run.without:
        if part == "damping":
            _undamp(model)
        else:
            model.opt.disableflags |= int(getattr(off, SWITCHES[part]))
    if run.rigid:
        _harden(model)
    _stiffen(model, run.gain)


def _harden(model: Any) -> None:
    """Contacts, limits and ties that neither give way nor rebound nor push before they touch, round cones, friction that holds.

    With its damping ratio of 1 a contact rebounds at exp(-2) of the speed, however stiff it is: it never pulls. With this ratio
    it does not, and a violation goes in the time constant of the file, as it does in our engine.
    """
    for name in SOFTNESS:
        reference = getattr(model, name)  # a time constant and a ratio, or -stiffness and -damping
        direct = reference[:, 0] < 0.0
        reference[~direct] = np.stack(
            [reference[~direct, 0] / HARDER, np.full((~direct).sum(), RATIO)], axis=1
        )
        reference[direct] *= HARDER
        impedance = getattr(model, name.replace("ref", "imp"))  # of 1 where nothing gives way
        impedance[:, :2] = 1.0 - (1.0 - impedance[:, :2]) / IMPEDANCE
    model.geom_margin[:] = 0.0
    model.pair_margin[:] = 0.0
    model.opt.cone = int(mujoco.mjtCone.mjCONE_ELLIPTIC)
    model.opt.impratio = IMPEDANCE
    model.opt.iterations, model.opt.tolerance = 200, 1e-10


def _undamp(model: Any) -> None:
    for name in DAMPING:
        if hasattr(model, name):
            getattr(model, name)[:] = 0.0


def _stiffen(model: Any, gain: float) -> None:
    """Give the position servos so many times their own gains."""
    if gain == 1.0:
        return
    servos = _servos(model)
    if not servos.any():
        raise NotSupported("the model has no position servos")
    model.actuator_gainprm[servos, 0] *= gain
    model.actuator_biasprm[servos, 1:3] *= gain


def _set(model: Any, run: ModelRun) -> None:
    """The settings of a run that are not the file's."""
    if run.accurate:
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
        model.opt.tolerance = min(1e-12, model.opt.tolerance)
        model.opt.iterations = max(200, model.opt.iterations)
    if run.conservative or run.swing:
        off = mujoco.mjtDisableBit
        model.opt.disableflags |= int(off.mjDSBL_CONTACT) | int(off.mjDSBL_LIMIT) | int(off.mjDSBL_ACTUATION)
        model.opt.disableflags |= int(off.mjDSBL_FRICTIONLOSS)
        model.opt.density = model.opt.viscosity = 0.0
        _undamp(model)


def _servos(model: Any) -> Any:
    """Actuators that ask a position: whose force falls as their length grows."""
    gain, bias = np.asarray(model.actuator_gainprm)[:, 0], np.asarray(model.actuator_biasprm)[:, 1]
    return (gain > 0.0) & np.isclose(gain, -bias)


class Driven:
    """The controls over time."""

    def __init__(self, drive: Drive, count: int, function: Callable[[float, int], Any] | None) -> None:
        self.drive, self.count, self.function = drive, count, function
        self.varies = bool(count) and drive.kind in ("table", "sinusoid", "function")
        rows = np.array(drive.rows or np.zeros((0, count + 1)), dtype=float)
        self.times, self.values = rows[:, 0], rows[:, 1:]

    def apply(self, data: Any) -> None:
        """Set the controls for the step that begins at `data.time`."""
        if not self.varies:
            return
        if self.function is not None:
            data.ctrl[:] = self._asked(float(data.time))
        elif self.drive.kind == "sinusoid":
            data.ctrl[:] = self.drive.amplitude * np.sin(2.0 * np.pi * self.drive.frequency * data.time)
        else:
            place = int(np.searchsorted(self.times, data.time + 1e-12, side="right")) - 1
            data.ctrl[:] = self.values[place] if place >= 0 else 0.0

    def _asked(self, time: float) -> Array:
        """What the user's function gives; MuJoCo would put zeros in place of what is not finite, without a word."""
        assert self.function is not None
        where = f"the control {self.drive.function} at {time:g} s"
        try:
            given = np.asarray(self.function(time, self.count), dtype=float)
        except Exception as error:
            raise EngineError(f"{where} fails: {type(error).__name__}: {_line(error)}") from None
        if given.shape != (self.count,) or not np.isfinite(given).all():
            raise EngineError(
                f"{where} gives {_line(given)}; the model has {self.count} controls, each a finite number"
            )
        return given


def driven(drive: Drive, model: Any, data: Any) -> Driven:
    """What sets the controls; those that are held are set at once. NotSupported says what does not fit the model."""
    if drive.kind == "table" and drive.rows and len(drive.rows[0]) != model.nu + 1:
        raise NotSupported(f"the table has {len(drive.rows[0]) - 1} controls and the model {model.nu}")
    function = None
    if drive.kind == "function":
        module, _, name = drive.function.partition(":")
        try:
            function = getattr(import_module(module), name)
        except Exception as error:
            raise NotSupported(f"there is no control {drive.function}: {_line(error)}") from None
    if drive.kind == "hold":
        data.ctrl[:] = holding(model, data)
    return Driven(drive, model.nu, function)


def holding(model: Any, data: Any) -> Array:
    """Controls that ask position servos to stay where they are; all others get none."""
    wanted = np.where(_servos(model), np.asarray(data.actuator_length), 0.0)
    limited = np.asarray(model.actuator_ctrllimited).astype(bool)
    low, high = np.asarray(model.actuator_ctrlrange).T if model.nu else (np.zeros(0), np.zeros(0))
    return np.where(limited, np.clip(wanted, low, high), wanted)
