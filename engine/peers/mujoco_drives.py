"""Actuators of a compiled MuJoCo model, joint by joint: what of them is linear, and what controls make of the rest."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from ..joints import JointSpring
from .lacking import Lacks
from .mujoco_rails import ALONG_JOINT, FADING, spring, summed, wraps

Array = npt.NDArray[np.float64]
BY_JOINT = tuple(int(getattr(mujoco.mjtTrn, f"mjTRN_{kind}")) for kind in ("JOINT", "JOINTINPARENT"))
BY_TENDON = int(mujoco.mjtTrn.mjTRN_TENDON)
ONE_NUMBER = tuple(int(getattr(mujoco.mjtJoint, f"mjJNT_{kind}")) for kind in ("HINGE", "SLIDE"))
AFFINE, UNBIASED = (int(getattr(mujoco.mjtBias, f"mjBIAS_{kind}")) for kind in ("AFFINE", "NONE"))
FIXED = int(mujoco.mjtGain.mjGAIN_FIXED)
STATIC, INTEGRATED, *FILTERED = (
    int(getattr(mujoco.mjtDyn, f"mjDYN_{kind}")) for kind in ("NONE", "INTEGRATOR", "FILTER", "FILTEREXACT")
)


class Drives:
    """On joints of places q, with l = Σ arm q: force = arm (gain u + b₀ + b₁ l + b₂ l̇); u a control, or what it becomes in time."""

    def __init__(self, model: Any, data: Any, on: bool, lacks: Lacks) -> None:
        self.m, self.lacks = model, lacks
        self.control = np.array(data.ctrl)
        self.activation = np.array(data.act)
        self.servos: dict[int, list[tuple[int, float]]] = {}  # of several joints: joint, arm
        self._of: dict[int, list[tuple[int, float]]] = defaultdict(list)  # actuator, arm
        self._bounded: dict[int, list[tuple[int, float]]] = defaultdict(list)  # servos of bounded force
        off = int(getattr(model.opt, "disableactuator", 0))
        for actuator in range(model.nu if on else 0):
            group = int(model.actuator_group[actuator])
            if 0 <= group < 31 and off >> group & 1:
                continue
            arms = self._arms(actuator)
            if why := self._refused(actuator, arms):
                lacks.of(f"an actuator {why}", model, "actuator", actuator)
                continue
            if self._is_servo(actuator) and len(arms) > 1:
                self.servos[actuator] = arms
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
        return [(joint, gear * arm) for joint, arm in summed(wraps(m, number, ALONG_JOINT))]

    def _refused(self, actuator: int, arms: list[tuple[int, float]]) -> str:
        """Why it is not supported; empty if it is."""
        m = self.m
        servo, several = self._is_servo(actuator), len(arms) > 1
        tendon = int(m.actuator_trnid[actuator, 0]) if int(m.actuator_trntype[actuator]) == BY_TENDON else -1
        kinds = {
            "that pulls by a way through space, a site or a body": not arms,
            "on a ball or free joint": any(int(m.jnt_type[joint]) not in ONE_NUMBER for joint, _ in arms),
            "with activation dynamics that are not linear": int(m.actuator_dyntype[actuator])
            not in (STATIC, INTEGRATED, *FILTERED)
            or int(m.actuator_actnum[actuator]) > 1,
            "on a tendon of bounded force": tendon >= 0
            and np.any(getattr(m, "tendon_actfrclimited", np.zeros(m.ntendon))[tendon]),
            "with a gain or bias that is not affine": int(m.actuator_gaintype[actuator]) != FIXED
            or int(m.actuator_biastype[actuator]) not in (AFFINE, UNBIASED),
            "that is a servo whose bounds are not the same both ways": servo
            and any(
                self._gives_way(actuator, joint) and not self._even(actuator, joint) for joint, _ in arms
            ),
            "that is a servo on a joint of bounded force, which others drive as well": servo
            and any(m.jnt_actfrclimited[joint] and self._others(actuator, joint) for joint, _ in arms),
            "that is a servo of several joints, one of them of bounded force": servo
            and several
            and any(m.jnt_actfrclimited[joint] for joint, _ in arms),
            "that pushes away from where it stands or drives what moves": servo
            and several
            and bool(np.any(self._bias(actuator)[1:] > 0.0)),
            "with damping of its own": self._any(actuator, "damping", "dampingpoly"),
            "with a delay": self._any(actuator, "delay"),
        }
        return next((what for what, there in kinds.items() if there), "")

    def _any(self, actuator: int, *names: str) -> bool:
        """Whether some of these, which releases of MuJoCo have or have not, are not zero."""
        return any(np.any(getattr(self.m, f"actuator_{n}", np.zeros(self.m.nu))[actuator]) for n in names)

    def _is_servo(self, actuator: int) -> bool:
        return bool(np.any(self._bias(actuator)[1:]))

    def _gives_way(self, actuator: int, joint: int) -> bool:
        """Whether it is a servo of bounded force."""
        bounds = self.m.actuator_forcelimited[actuator] or self.m.jnt_actfrclimited[joint]
        return bool(bounds) and self._is_servo(actuator)

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

    def shared(self, actuator: int, length: float) -> JointSpring:
        """Of a servo of several joints, what pulls at their sum, which is `length` at the start."""
        m, (_, by_place, by_speed) = self.m, self._bias(actuator)
        stiffness, damping = -float(by_place), -float(by_speed)
        most = float(m.actuator_forcerange[actuator, 1]) if m.actuator_forcelimited[actuator] else None
        pull = self._given(actuator) + float(by_place) * length
        found = spring(stiffness, pull, damping, most)
        assert found is not None, "a servo has stiffness or damping"
        return found

    def rest(self, actuator: int, length: float) -> float:
        """Where it pulls to [m or rad], from `length`."""
        rest = self.shared(actuator, length).rest
        assert isinstance(rest, float), "controls are numbers"
        return rest

    def rotor(self, actuator: int) -> float:
        """Inertia of an actuator along its length [kg m² or kg]."""
        return float(getattr(self.m, "actuator_armature", np.zeros(self.m.nu))[actuator])

    def changes(self) -> bool:
        """Whether activations move while the controls stay."""
        return any(
            self._asked(actuator) != (self.activation[place] if kind != INTEGRATED else 0.0)
            for actuator, place, kind in self._activated()
        )

    def pass_on(self, time_step: float) -> None:
        """The activations after a step [s] at these controls; also of those that act a step early (actearly)."""
        m = self.m
        for actuator, place, kind in self._activated():
            here, asked = float(self.activation[place]), self._asked(actuator)
            if kind == INTEGRATED:
                here += asked * time_step
            else:
                lag = max(float(m.actuator_dynprm[actuator, 0]), 1e-15)  # s
                here += (asked - here) * -math.expm1(-time_step / lag)
            if m.actuator_actlimited[actuator]:
                here = float(np.clip(here, *m.actuator_actrange[actuator]))
            self.activation[place] = here

    def _activated(self) -> Iterator[tuple[int, int, int]]:
        """Actuators that are not driven by their controls at once, their places among activations, and their kinds."""
        for actuator in sorted(
            {
                *self.servos,
                *(one for held in (*self._of.values(), *self._bounded.values()) for one, _ in held),
            }
        ):
            if (kind := int(self.m.actuator_dyntype[actuator])) != STATIC:
                yield actuator, int(self.m.actuator_actadr[actuator]), kind

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
        """What its control, or its activation, and its constant give, before its arm."""
        m = self.m
        if int(m.actuator_dyntype[actuator]) == STATIC:
            given = self._asked(actuator)
        else:
            given = float(self.activation[int(m.actuator_actadr[actuator])])
        return float(m.actuator_gainprm[actuator, 0]) * given + float(self._bias(actuator)[0])

    def _asked(self, actuator: int) -> float:
        """Its control, within its range."""
        m, control = self.m, float(self.control[actuator])
        clamped = not m.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL)
        if m.actuator_ctrllimited[actuator] and clamped:
            control = float(np.clip(control, *m.actuator_ctrlrange[actuator]))
        return control
