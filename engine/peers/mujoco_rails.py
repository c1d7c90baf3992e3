"""Sums of joint coordinates that something pulls at, in a compiled MuJoCo model: fixed tendons, servos that give way or hold several joints.

Each gets a light carriage on a level rail of the world, which goes as the sum does, a metre a radian: what acts on the sum is the
rail's. A tendon through sites alone that has no more than a longest length is a wire.
"""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from ..bodies import WORLD, RigidBody
from ..couplings import Relation, Wire
from ..joints import JointSpring, Limit, Prismatic
from .lacking import Lacks

Array = npt.NDArray[np.float64]
ALONG_JOINT, AT_SITE = (int(getattr(mujoco.mjtWrap, f"mjWRAP_{kind}")) for kind in ("JOINT", "SITE"))
NOT_LINEAR = ("tendon_stiffnesspoly", "tendon_dampingpoly", "tendon_springyield")  # releases have them or not


def servo_name(actuator: int) -> str:
    """Of the carriage that a servo drives."""
    return f"servo {actuator}"


def wraps(model: Any, tendon: int, kind: int) -> list[tuple[int, float]]:
    """What a tendon runs along, if all of it is of that kind: its numbers and coefficients; else nothing."""
    way = range(int(model.tendon_adr[tendon]), int(model.tendon_adr[tendon] + model.tendon_num[tendon]))
    if any(int(model.wrap_type[wrap]) != kind for wrap in way):
        return []
    return [(int(model.wrap_objid[wrap]), float(model.wrap_prm[wrap])) for wrap in way]


def summed(terms: Iterable[tuple[int, float]]) -> list[tuple[int, float]]:
    """Every joint once; none whose coefficients cancel."""
    found: dict[int, float] = defaultdict(float)
    for joint, factor in terms:
        found[joint] += factor
    return [(joint, factor) for joint, factor in found.items() if factor]


class Rails:
    """The carriages, wires and what holds them, as they are asked for."""

    def __init__(self, model: Any, data: Any, light: float, lacks: Lacks) -> None:
        self.m, self.d, self.light, self.lacks = model, data, light, lacks
        self.bodies: list[RigidBody] = []
        self.constraints: list[Prismatic | Relation | Wire] = []
        gravity = np.asarray(model.opt.gravity)
        rail = np.eye(3)[int(np.argmin(np.abs(gravity)))]
        rail = rail - gravity * (rail @ gravity) / max(gravity @ gravity, 1e-300)
        self.level = rail / np.linalg.norm(rail)

    def add(self, name: str, terms: Sequence[tuple[int, float]], joints: Sequence[str], **acts: Any) -> None:
        """A carriage that goes as Σ factor × joint, with spring, limit, friction, motor and armature as of a Prismatic."""
        m, d = self.m, self.d
        inertia = [float(m.dof_M0[m.jnt_dofadr[joint]]) / factor**2 for joint, factor in terms]
        rate = sum(factor * float(d.qvel[m.jnt_dofadr[joint]]) for joint, factor in terms)
        mass = self.light * min(inertia)
        self.bodies.append(
            RigidBody(
                name=name,
                position=(0.0, 0.0, 0.0),
                mass=mass,
                inertia=(mass,) * 3,
                velocity=tuple(self.level * rate),
            )
        )
        rail = f"rail of {name}"
        self.constraints += [
            Prismatic(name=rail, between=(WORLD, name), axis=tuple(self.level), compliance=0.0, **acts),
            Relation(
                name=f"rack of {name}",
                terms=(*((joints[joint], factor) for joint, factor in terms), (rail, -1.0)),
                compliance=0.0,
            ),
        ]

    def tendon(
        self,
        tendon: int,
        name: str,
        has: Callable[[str], bool],
        joints: Sequence[str],
        at_site: Callable[[int], tuple[str, Array]],
    ) -> None:
        """What a tendon does by itself; those that only measure, or that an actuator pulls, are none of its business."""
        m = self.m
        stiffness = float(m.tendon_stiffness[tendon]) if has("SPRING") else 0.0
        damping = float(m.tendon_damping[tendon]) if has("DAMPER") else 0.0
        friction = float(m.tendon_frictionloss[tendon]) if has("FRICTIONLOSS") else 0.0
        limited = bool(m.tendon_limited[tendon]) and has("LIMIT")
        armature = float(m.tendon_armature[tendon]) if hasattr(m, "tendon_armature") else 0.0
        if any(np.any(getattr(m, poly, np.zeros(m.ntendon))[tendon]) for poly in NOT_LINEAR):
            return self.lacks.add("a tendon with a spring or damping that is not linear", "tendon", name)
        held = {
            "stiffness": stiffness,
            "damping": damping,
            "friction": friction,
            "a limit": limited,
            "armature": armature,
        }
        what = [word for word, there in held.items() if there]
        if not what:
            return None
        low, high = (float(value) for value in m.tendon_range[tendon])
        short, long = (float(value) for value in m.tendon_lengthspring[tendon])
        here = float(self.d.ten_length[tendon])
        relaxed = relaxation(m.tendon_solref_lim[tendon])
        terms = summed(wraps(m, tendon, ALONG_JOINT))
        if not terms:
            sites = [at_site(site) for site, _ in wraps(m, tendon, AT_SITE)]
            ways = [one[0] == other[0] for one, other in itertools.pairwise(sites)]
            if what != ["a limit"] or low > 0.0 or not sites or any(ways):
                return self.lacks.add(f"a tendon through space with {what[0]}", "tendon", name)
            through = tuple((body, tuple(place)) for body, place in sites)
            self.constraints.append(
                Wire(name=f"tendon {name}", through=through, length=high, damping=relaxed)
            )
            return None
        if stiffness and short != long:
            return self.lacks.add("a tendon whose spring has play", "tendon", name)
        return self.add(
            f"tendon {name}",
            terms,
            joints,
            spring=spring(stiffness, stiffness * (short - here), damping),
            limit=Limit(lower=low - here, upper=high - here, damping=relaxed) if limited else None,
            friction=friction,
            armature=armature,
        )

    def tie(self, tie: int, joints: Sequence[str], close: float) -> Relation | str:
        """l₁ − l₁₀ = c₀ + c₁ (l₂ − l₂₀) of tendons along joints; or in words what no scene of ours can say of it."""
        m = self.m
        one, two, c = int(m.eq_obj1id[tie]), int(m.eq_obj2id[tie]), np.asarray(m.eq_data[tie])[:5]
        terms: list[tuple[int, float]] = []
        gap = -float(c[0])
        for tendon, factor in ((one, 1.0), (two, -float(c[1]))):
            if tendon < 0 or not factor:
                continue
            along = wraps(m, tendon, ALONG_JOINT)
            if not along:
                return "a tie of a tendon through space"
            terms += [(joint, factor * arm) for joint, arm in along]
            gap += factor * float(self.d.ten_length[tendon] - m.tendon_length0[tendon])
        if two >= 0 and np.any(c[2:]):
            return "a tie of tendons by a curve"
        if len(terms := summed(terms)) < 2:
            return "a tie of a tendon along one joint"
        if abs(gap) > close:
            return f"a tie of tendons that starts {gap:.3g} m or rad off"
        return Relation(
            name=f"equality {_name(m, tie)}",
            terms=tuple((joints[joint], factor) for joint, factor in terms),
            damping=relaxation(m.eq_solref[tie]),
        )


def spring(
    stiffness: float, pull: float, damping: float, max_force: float | None = None
) -> JointSpring | None:
    """What is linear in place and speed, as one row, and pulls by that much at the start [N/m, N, N s/m]; none where it is nothing."""
    if not stiffness and not damping:
        return None
    softest = max(stiffness, FADING * damping)
    return JointSpring(
        stiffness=softest,
        rest=pull / softest,
        damping=damping / softest,
        max_force=max_force,
    )


FADING = 1e-9  # 1/s: stiffness over damping of what is damped alone


def relaxation(solref: Any) -> float:
    """In what time [s] a violation goes: the time constant, or damping over stiffness where these are given (below zero)."""
    first, second = float(solref[0]), float(solref[1])
    return first if first > 0.0 else second / first if first else 0.0


def _name(model: Any, tie: int) -> str:
    return mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_EQUALITY, tie) or f"equality {tie}"
