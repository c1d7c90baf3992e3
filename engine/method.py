"""How a scene is simulated: the options of the SPOOK step. The defaults are plain SPOOK, directly solved, that follows fast turns."""

from __future__ import annotations

import dataclasses
import math
import sys
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from .check import entries, one_of
from .errors import MethodError

if TYPE_CHECKING:
    from .scene import Scene

STAGES_THAT_CAN_BE_FORCED = {  # as it is asked for: the stage that comes
    "collision": "collision",
    "solve_block": "solve_block",
    "rotation": "integrate_rotations",
}
FORMER_SOLVER = "hybrid"  # friction by iterations, the rest directly: never the best of the three
FORMER = 'method: solver="hybrid" is gone, and solved as "direct", at the same errors and less cost'
ALONE = (
    "method: one thread does the work; threads gained nothing worth it: run several simulations side by side"
)
_NUMBERS = (
    "correction_cap",
    "tolerance",
    "residual_tolerance",
    "unsettled_residual",
    "sleep_speed",
    "sleep_after",
    "floor",
)
_OF_THE_SCENE = {
    "residual_tolerance": 5e-11,
    "unsettled_residual": 0.05,
}  # of its typical speed, where not given


@dataclass(frozen=True, slots=True, kw_only=True)
class Method:
    """Options of the stepper. Anything but the defaults is a separate configuration in every table.

    turns              followed: where bodies turn by more than a fiftieth of a radian in a step, joints count in how their rows bend on
                       the way here and on, for no more solves: what spins steadily off its axle, or is held by what is led,
                       stays in place and keeps its energy. linear: rows are linear in the turn, as SPOOK has them
    corrections        curved constraints: 0, 1 or 2 extra back-substitutions per step, or solves where contacts or
                       bounds take part; each takes an order of the violation, and closed loops with redundant joints move
                       without compliance. What spins off its joint keeps its energy with 2, with
                       half_step_velocities to 1 % at a third of a radian a step. Beside contacts or bounds, what steps that are
                       too long make of them, above a twentieth of the largest kinetic energy, is "unsettled"
    correction_cap     largest curvature correction, as a fraction of the rest length or of a joint's arms, or rad
    half_step_velocities  velocities live at mid-step: half-kick start, mid-step read-out. Order 2, with contacts as long
                       as they last on flat ground: rolling, sliding in a line, gripping; or without friction on round
                       ground. A slide that turns, rolling over round ground, what opens or closes, forces that follow
                       the velocity (springs with viscosity, drag): order 1 as in plain. What bounces keeps its energy
    string_stiffness   treat the transverse stiffness of taut links, the geometric one of loaded joints, implicitly
    substeps           steps of h/substeps per reported step
    composition        symmetric composition of half-step steps; order 2 (none), 4, 6 or 8 on smooth scenes.
                       5, 9 or 17 stages a step; rows are held rigidly and their curvature to rounding, so
                       compliance, damping and corrections play no part; forces are those at the sample's time.
                       Small trees of rigid joints on the world are solved in joint coordinates, the rest by rows. Steps that are
                       too long for the tension of light bodies are taken in parts
    runge_kutta        order8: the explicit method of Dormand and Prince, twelve accelerations a step (articulated bodies) in the
                       joint coordinates of trees; a free body is one. Rows, springs and forces as for compositions, and
                       no loop; neither time reversal nor energy is kept beyond the error. The cheapest way to an error
    tolerance          of runge_kutta: a step is taken in parts, each with an estimated error of at most this, in rad or in sizes of
                       joints, or of the fastest rate, and ends where a table of loads bends; 0: a step is one part, with an error
                       of order 8 if loads bend between steps and no body turns round in one
    solver             direct; iterative (projected Gauss-Seidel); an impact
                       among up to 24 contacts that iterations do not settle is solved directly, since what it leaves stays;
                       so are up to 24 joints (and their contacts) that they do not settle, and up to 64 that
                       they leave unsettled, from then on
    iterations, residual_tolerance   when an iterative solve stops [m/s], by default 5e-11 of `Scene.typical_speed`, √(g r): 1e-10 m/s
                       for a cube of a metre on Earth; where rows are still off by more than unsettled_residual,
                       iterations go on there and nearby, for up to sixteen times the work (joints: four)
    friction           cone (isotropic), box (bound from the step before), scaled_box (current normal force)
    impacts            simultaneous: all that touch take part in one impact (a ball on four gives −.6 and four times .4);
                       what flies, balls of which one pair meets at a time or a single body of any shape, does so one after the
                       other, each at its time, as often as it meets; any other pair is hit once, as the step begins, and
                       stops without rebound where it approaches again (counters["stopped_impacts"]; "unsettled" where that
                       loses a twentieth of the largest kinetic energy; substeps tell such impacts apart); so does a joint's stop that bodies touch, another is connected to, or that flies
                       where surfaces may touch, else it is met at its times, too;
                       successive: one pair after the other until none approaches, as if there were small gaps (the
                       last ball leaves, no energy is lost at restitution 1); those that are open as a step begins in
                       the order in which they close, what flies moved from one impact to the next as above
    unsettled_residual a solve that leaves more than this [m/s], by default .05 of `Scene.typical_speed`, makes the run
                       "unsettled": the row furthest from its law, its impulse against where a step of projection would
                       put it; so does one that stopped early and left bodies sunk into each other by a fiftieth of the
                       smaller one's radius
    sleep_speed        bodies slower than this [m/s], |v| + |w| r, for `sleep_after` seconds sleep, unless they gained a
                       hundredth of it in that time or nothing held them; 0: none does. They do so by islands, all that are
                       connected by contacts, joints and springs, and wake at once, in the same step, when a body meets one
                       of them, a kinematic one that touches or holds one moves, or a load, motor or spring of one is set.
                       Asleep they have no speed, keep their places to the last bit, cost next to nothing, and forces read
                       as they were last; what speed they had is lost. Never asleep: bodies in scenes where nothing can
                       touch, that displace a fluid, whose load or joint follows the time or whose joints' friction follows
                       their load, and what touches a moving surface. Plain steps only
    sleep_after        how long bodies must have been that slow, s
    refinements        iterative refinements against the true equations after each factorisation
    floor              pivot floor in the factor only, relative to the diagonal
    threads            1; more are taken back with a warning: several simulations side by side use several cores
    force_stages       stages to keep although the scene does not need them, to measure what they cost; solve_block: the
                       general factorisation also where a chain or a mechanism in a plane has a faster way
    """

    turns: Literal["followed", "linear"] = dataclasses.field(
        default="followed", metadata={"definition": False}
    )
    corrections: int = 0
    correction_cap: float = 0.3
    half_step_velocities: bool = False
    string_stiffness: bool = False
    substeps: int = 1
    composition: Literal["none", "order4", "order6", "order8"] = "none"
    runge_kutta: Literal["none", "order8"] = "none"
    tolerance: float = 0.0
    solver: Literal["direct", "iterative"] = "direct"
    iterations: int = 50
    residual_tolerance: float | None = None
    friction: Literal["cone", "box", "scaled_box"] = "cone"
    impacts: Literal["simultaneous", "successive"] = "simultaneous"
    unsettled_residual: float | None = None
    sleep_speed: float = 0.0
    sleep_after: float = 0.5
    refinements: int = 1
    floor: float = 1e-12
    threads: int = 1
    force_stages: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        def refuse(field: str, rule: str) -> None:
            raise MethodError(f"method: {field} must be {rule}, not {getattr(self, field)!r}")

        for field in _NUMBERS:
            value = getattr(self, field)
            if value is None and field in _OF_THE_SCENE:
                continue
            if isinstance(value, bool) or not isinstance(value, int | float):
                refuse(field, "a number")
            if isinstance(value, int) and abs(value) > sys.float_info.max:
                raise MethodError(f"method: {field} is a number too large for arithmetic")
        for field in ("half_step_velocities", "string_stiffness"):
            if not isinstance(getattr(self, field), bool):
                refuse(field, "True or False")
        for field in ("corrections", "substeps", "iterations", "refinements", "threads"):
            if isinstance(getattr(self, field), bool):
                refuse(field, "a whole number")
        if not one_of(self.turns, ("followed", "linear")):
            refuse("turns", '"followed" or "linear"')
        if not isinstance(self.corrections, int) or self.corrections not in (0, 1, 2):
            refuse("corrections", "0, 1 or 2")
        if not 0.0 < self.correction_cap <= 1.0:
            refuse("correction_cap", "above 0 and at most 1")
        if not isinstance(self.substeps, int) or not 1 <= self.substeps <= 1_000_000:
            refuse("substeps", "a whole number from 1")
        if not one_of(self.composition, ("none", "order4", "order6", "order8")):
            refuse("composition", "none, order4, order6 or order8")
        if not one_of(self.runge_kutta, ("none", "order8")):
            refuse("runge_kutta", "none or order8")
        if self.runge_kutta != "none" and self.composition != "none":
            raise MethodError(
                "method: a step is a composition or one of Runge-Kutta; leave one of them at 'none'"
            )
        if not 0.0 <= self.tolerance < 1.0:
            refuse("tolerance", "from 0, which makes a step one part, to below 1")
        if self.tolerance > 0.0 and self.runge_kutta == "none":
            raise MethodError("method: tolerance is of runge_kutta; give that, or leave it at 0")
        if isinstance(self.solver, str) and self.solver == FORMER_SOLVER:
            warnings.warn(FORMER, DeprecationWarning, stacklevel=3)
            object.__setattr__(self, "solver", "direct")
        if not one_of(self.solver, ("direct", "iterative")):
            refuse("solver", "direct or iterative")
        if not one_of(self.impacts, ("simultaneous", "successive")):
            refuse("impacts", "simultaneous or successive")
        if self.unsettled_residual is not None and not self.unsettled_residual > 0.0:
            refuse("unsettled_residual", "above 0")
        if not 0.0 <= self.sleep_speed < math.inf:
            refuse("sleep_speed", "a speed from 0, which lets no body sleep")
        if not 0.0 < self.sleep_after < math.inf:
            refuse("sleep_after", "a time above 0")
        if self.sleep_speed > 0.0:
            self._refuse_beside_sleep()
        if not isinstance(self.iterations, int) or not 1 <= self.iterations <= 1_000_000_000:
            refuse("iterations", "a whole number from 1 to a thousand million")
        if self.residual_tolerance is not None and not self.residual_tolerance >= 0.0:
            refuse("residual_tolerance", "zero or above")
        if not one_of(self.friction, ("cone", "box", "scaled_box")):
            refuse("friction", "cone, box or scaled_box")
        if not isinstance(self.threads, int) or not 1 <= self.threads <= 256:
            refuse("threads", "a whole number from 1 to 256")
        if self.threads > 1:
            warnings.warn(ALONE, DeprecationWarning, stacklevel=3)
            object.__setattr__(self, "threads", 1)
        if not isinstance(self.refinements, int) or not 0 <= self.refinements <= 10:
            refuse("refinements", "a whole number from 0 to 10")
        if not 0.0 <= self.floor < 1.0:
            refuse("floor", "from 0 to below 1")
        stages = entries(self.force_stages)
        if stages is None:
            refuse("force_stages", "names of stages, such as ('rotation',)")
        object.__setattr__(self, "force_stages", tuple(stages or ()))
        for stage in self.force_stages:
            if not isinstance(stage, str) or stage not in STAGES_THAT_CAN_BE_FORCED:
                raise MethodError(
                    f"method: {stage!r} cannot be forced; try one of {', '.join(STAGES_THAT_CAN_BE_FORCED)}"
                )

    def residual_of(self, field: Literal["residual_tolerance", "unsettled_residual"], scene: Scene) -> float:
        """What is given for `field`, m/s, or its share of the scene's typical speed."""
        given: float | None = getattr(self, field)
        return _OF_THE_SCENE[field] * scene.typical_speed if given is None else given

    def _refuse_beside_sleep(self) -> None:
        """What looks further than the step at hand, or bends its rows, would not see what sleeps."""
        plain = {
            "composition": "none",
            "runge_kutta": "none",
            "half_step_velocities": False,
            "string_stiffness": False,
            "corrections": 0,
        }
        for field, value in plain.items():
            if getattr(self, field) != value:
                raise MethodError(
                    f"method: bodies sleep in plain steps only; with sleep_speed leave {field} at {value!r}"
                )


DEFAULT = Method()
PLAIN = Method(turns="linear")  # SPOOK with nothing added
