"""Actuators of a compiled MuJoCo model, joint by joint: what of them is linear, and what controls make of the rest."""

from __future__ import annotations

from collections import defaultdict
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from spook_tracker.engine.peers.lacking import Lacks

Array = npt.NDArray[np.float64]
BY_JOINT = tuple(int(getattr(mujoco.mjtTrn, f"mjTRN_{kind}")) for kind in ("JOINT", "JOINTINPARENT"))
BY_TENDON = int(mujoco.mjtTrn.mjTRN_TENDON)
ONE_NUMBER = tuple(int(getattr(mujoco.mjtJoint, f"mjJNT_{kind}")) for kind in ("HINGE", "SLIDE"))
AFFINE, UNBIASED = (int(getattr(mujoco.mjtBias, f"mjBIAS_{kind}")) for kind in ("AFFINE", "NONE"))
FIXED, STATIC = int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtDyn.mjDYN_NONE)
FADING = 1e-9  # 1/s: stiffness over damping of what is damped alone
ALONG_JOINT = int(mujoco.mjtWrap.mjWRAP_JOINT)


class Drives:
    """On joints of places q, with l = Σ arm q: force = arm (gain u + b₀ + b₁ l + b₂ l̇), the last two on one joint alone."""

    def __init__(self, model: Any, data: Any, on: bool, lacks: Lacks) -> None:
        self.m, self.lacks = model, lacks
        self.control = np.array(data.ctrl)
        self._of: dict[int, list[tuple[int, float]]] = defaultdict(list)  # actuator, arm
        self._bounded: dict[int, list[tuple[int, float]]] = defaultdict(list)  # servos of bounded force
        off = int(getattr(model.opt, "disableactuator", 0))
        for actuator in range(model.nu if on else 0):
            group = int(model.actuator_group[actuator])
            if 0 <= group < 31 and off >> group & 1:
                continue
            arms = self._arms(actuator)
            if why := self._refused(actuator, arms):
                name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_ACTUATOR, actuator) or str(actuator)
                lacks.add(f"an actuator {why}", "actuator", name)
                continue
            for joint, arm in arms:
                (self._bounded if self._gives_way(actuator, joint) else self._of)[joint].append(
                    (actuator, arm)
                )

    def _arms(self, actuator: int) -> list[tuple[int, float]]:
        """Joints it acts on, and how far its length grows with each; empty where its transmission is another."""
        m = self.m
        kind, number = int(m.actuator_trntype[actuator]), int(m.actuator_trnid[actuator, 0])
        gear = float(m.actuator_gear[actuator, 0])
        if kind in BY_JOINT:
            return [(number, gear)]
        if kind != BY_TENDON:
            return []
        wraps = range(m.tendon_adr[number], m.tendon_adr[number] + m.tendon_num[number])
        if any(int(m.wrap_type[wrap]) != ALONG_JOINT for wrap in wraps):
            return []
        return [(int(m.wrap_objid[wrap]), gear * float(m.wrap_prm[wrap])) for wrap in wraps]

    def _refused(self, actuator: int, arms: list[tuple[int, float]]) -> str:
        """Why it is not supported; empty if it is."""
        m = self.m
        servo = bool(np.any(self._bias(actuator)[1:]))
        kinds = {
            "that pulls by a way through space, a site or a body": not arms,
            "on a ball or free joint": any(int(m.jnt_type[joint]) not in ONE_NUMBER for joint, _ in arms),
            "with activation dynamics": int(m.actuator_dyntype[actuator]) != STATIC,
            "with a gain or bias that is not affine": int(m.actuator_gaintype[actuator]) != FIXED
            or int(m.actuator_biastype[actuator]) not in (AFFINE, UNBIASED),
            "that is a servo whose bounds are not the same both ways": servo
            and any(
                self._gives_way(actuator, joint) and not self._even(actuator, joint) for joint, _ in arms
            ),
            "that is a servo on a joint of bounded force, which others drive as well": servo
            and any(m.jnt_actfrclimited[joint] and self._others(actuator, joint) for joint, _ in arms),
            "that is a servo of several joints": servo and len(arms) > 1,
            "with damping of its own": self._any(actuator, "damping", "dampingpoly"),
            "with a delay": self._any(actuator, "delay"),
        }
        return next((what for what, there in kinds.items() if there), "")

    def _any(self, actuator: int, *names: str) -> bool:
        """Whether some of these, which releases of MuJoCo have or have not, are not zero."""
        return any(np.any(getattr(self.m, f"actuator_{n}", np.zeros(self.m.nu))[actuator]) for n in names)

    def _gives_way(self, actuator: int, joint: int) -> bool:
        """Whether it is a servo of bounded force."""
        bounds = self.m.actuator_forcelimited[actuator] or self.m.jnt_actfrclimited[joint]
        return bool(bounds) and bool(np.any(self._bias(actuator)[1:]))

    def _ranges(self, actuator: int, joint: int) -> list[tuple[float, float]]:
        """Bounds of the force on the joint [N or N m]."""
        m, found = self.m, []
        if m.actuator_forcelimited[actuator]:
            scale = abs(self._arm(actuator, joint))
            low, high = m.actuator_forcerange[actuator]
            found.append((float(low) * scale, float(high) * scale))
        if m.jnt_actfrclimited[joint]:
            low, high = m.jnt_actfrcrange[joint]
            found.append((float(low), float(high)))
        return found

    def _arm(self, actuator: int, joint: int) -> float:
        return sum(arm for one, arm in self._arms(actuator) if one == joint)

    def _even(self, actuator: int, joint: int) -> bool:
        return all(low == -high for low, high in self._ranges(actuator, joint))

    def _others(self, actuator: int, joint: int) -> bool:
        return any(
            one != actuator and any(other == joint for other, _ in self._arms(one))
            for one in range(self.m.nu)
        )

    def bounded(self, joint: int) -> list[tuple[int, float]]:
        """Servos of a joint that give way, each with its arm."""
        return self._bounded.get(joint, [])

    def servo(self, joint: int, actuator: int, arm: float, here: float) -> tuple[float, float, float, float]:
        """Of one that gives way: stiffness, where it pulls from `here` [m or rad], damping, and its largest force."""
        _, by_place, by_speed = self._bias(actuator)
        stiffness, damping = -float(by_place) * arm**2, -float(by_speed) * arm**2
        softest = max(stiffness, FADING * damping)
        pull = arm * (self._given(actuator) + float(by_place) * arm * here)
        return (
            softest,
            pull / softest if softest else 0.0,
            damping,
            min(high for _, high in self._ranges(actuator, joint)),
        )

    def of(self, joint: int) -> list[tuple[int, float]]:
        """Actuators of a joint, each with its arm."""
        return self._of.get(joint, [])

    def driven(self) -> list[int]:
        """Joints with actuators."""
        return sorted({*self._of, *self._bounded})

    def armature(self, joint: int) -> float:
        """Rotor inertia of its actuators, seen from the joint [kg m² or kg]."""
        rotors = getattr(self.m, "actuator_armature", np.zeros(self.m.nu))
        if any(rotors[actuator] and self._of_several(actuator) for actuator, _ in self.of(joint)):
            self.lacks.add("an actuator with armature on several joints")
        return sum(
            float(rotors[actuator]) * arm**2 for actuator, arm in (*self.of(joint), *self.bounded(joint))
        )

    def _of_several(self, actuator: int) -> bool:
        return sum(actuator == one for held in self._of.values() for one, _ in held) > 1

    def linear(self, joint: int) -> tuple[float, float]:
        """Stiffness and damping that actuators give a joint."""
        stiffness = damping = 0.0
        for actuator, arm in self.of(joint):
            _, by_place, by_speed = self._bias(actuator)
            stiffness -= float(by_place) * arm**2
            damping -= float(by_speed) * arm**2
        return stiffness, damping

    def _bias(self, actuator: int) -> Array:
        found: Array = np.asarray(self.m.actuator_biasprm[actuator])[:3] * (
            int(self.m.actuator_biastype[actuator]) == AFFINE
        )
        return found

    def force(self, joint: int, here: float) -> float:
        """What the actuators push with where the joint is `here` and stands still [N or N m]; controls within their ranges."""
        m, total = self.m, 0.0
        for actuator, arm in self.of(joint):
            force = self._given(actuator) + float(self._bias(actuator)[1]) * arm * here
            if m.actuator_forcelimited[actuator]:
                force = float(np.clip(force, *m.actuator_forcerange[actuator]))
            total += arm * force
        if m.jnt_actfrclimited[joint]:
            total = float(np.clip(total, *m.jnt_actfrcrange[joint]))
        return total

    def _given(self, actuator: int) -> float:
        """What its control and its constant give, before its arm; the control within its range."""
        m, control = self.m, float(self.control[actuator])
        clamped = not m.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL)
        if m.actuator_ctrllimited[actuator] and clamped:
            control = float(np.clip(control, *m.actuator_ctrlrange[actuator]))
        return float(m.actuator_gainprm[actuator, 0]) * control + float(self._bias(actuator)[0])
