"""What the page of engines says above its table of facts, and what the table must show for each sentence to stand.

And below it, of what its table has not: an arm with stops, and the engines that are not asked.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence

from bench.engine_places import SINGLE

Columns = Sequence[Mapping[str, float]]  # in the order of the facts: setting -> what it answered
UPPER = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
NO_ANSWER = ("-", "timed out", "crashed")
SMALL_STEPS = frozenset({"sapien (tgs)", "sapien (defaults)"})
JOINT_COORDINATES = frozenset(
    {
        "mujoco (defaults)", "mujoco (implicit)", "drake (sap)", "dart (joints)", "pybullet (joints)",
        "motrixsim (defaults)", "motrixsim (many-iterations)",
    }
)  # fmt: skip


def said(cell: str) -> float:
    """2.2×10⁻²² -> 2.2e-22, 10⁻⁵ -> 1e-5; what came apart is infinite."""
    if cell in ("diverged", "not finite"):
        return math.inf
    power = re.fullmatch(r"(?:(.+)×)?10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)", cell)
    return float(f"{power[1] or 1}e{power[2].translate(UPPER)}" if power else cell)


def columns(cells: Mapping[str, Sequence[str]]) -> Columns:
    """The numbers of a table, from its rows of cells by setting."""
    count = max(map(len, cells.values()), default=0)
    return [
        {name: said(row[place]) for name, row in cells.items() if row[place] not in NO_ANSWER}
        for place in range(count)
    ]


def _chain(facts: Columns) -> bool:
    exploding = all(gain[name] > 1e3 for gain in facts[:2] for name in JOINT_COORDINATES)
    others = (
        JOINT_COORDINATES | SMALL_STEPS | {"exudyn (generalised-alpha)", "drake (rk3)", "simbody (held-step)"}
    )
    bounded = [[way for name, way in gain.items() if name not in others] for gain in facts[:2]]
    return (
        exploding
        and all(gain[name] > 1e3 for gain in facts[:2] for name in SMALL_STEPS)
        and all(len(gains) >= 10 and max(gains) < 0.5 for gains in bounded)
        and math.isinf(facts[0]["drake (rk3)"])
        and facts[1]["exudyn (generalised-alpha)"] > 0.5
        and 0.55 < facts[0]["simbody (held-step)"] < 0.65
        and facts[1]["simbody (held-step)"] < 0.5
    )


def _door(facts: Columns) -> bool:
    others = [uneven for name, uneven in facts[2].items() if name != "spook (plain)"]
    return facts[2]["spook (plain)"] < 1e-12 and min(others) >= 1.0 and max(others) > 3.0


def _beam(facts: Columns) -> bool:
    sag = facts[3]
    held = {name for name, fallen in sag.items() if fallen < 1.0}
    expected = {
        "spook (plain)", "dart (joints)", "dart (constraints)", "drake (sap)", "mujoco (rk4)", "mujoco (defaults)",
        "mujoco (implicit)", "pybullet (joints)", "motrixsim (defaults)", "motrixsim (many-iterations)",
    }  # fmt: skip
    return (
        held == expected
        and all(sag[name] < 2e-3 for name in held - {"pybullet (joints)"})
        and 0.06 < sag["pybullet (joints)"] < 0.075
        and all(sag[name] >= 1.2 for name in sag.keys() - held)
    )


def _box(facts: Columns) -> bool:
    stands = {name for name, way in facts[4].items() if way < 1e-4}
    expected = {
        "spook (plain)", "cannon (accurate)", "jolt (many-iterations)", "jolt (defaults)",
        "mujoco (rk4)", "mujoco (implicit)", "mujoco (equalities)", "pybullet (joints)", "pybullet (constraints)",
        "rapier (defaults)", "rapier3d (defaults)", "sapien (tgs)", "sapien (pgs)", "sapien (defaults)",
        "box3d (many-substeps)", "box3d (defaults)", "motrixsim (defaults)", "simbody (merson)",
    }  # fmt: skip
    return stands == expected and max(facts[4], key=facts[4].__getitem__) == "mujoco (defaults)"


def _digits(facts: Columns) -> bool:
    lost = {name: name.split()[0] in SINGLE or name == "p2 (defaults)" for name in facts[5]}
    return {name.split()[0] for name in lost} >= set(SINGLE) and all(
        1e-6 < facts[5][name] < 1e-2 if much else facts[5][name] < 1e-12 for name, much in lost.items()
    )


SENTENCES: tuple[tuple[Callable[[Columns], bool], tuple[str, ...]], ...] = (
    (
        _chain,
        (
            "- **A chain of 26 links** gains energy without bound, or comes apart, in joint coordinates with semi-implicit Euler at",
            "  1/60 s and 1/240 s (with mujoco's integrator implicit in velocities, too), and with Runge-Kutta of order 3 at 1/60 s.",
            "  Rods held as constraints gain less than half a per cent,",
            "  as Runge-Kutta of order 4 does (simbody's, of Merson, 0.6 where its step is held at 1/60 s); exudyn's generalised-alpha",
            "  and the distance joints of PhysX's small steps, which sapien asks, are the exceptions.",
        ),
    ),
    (
        _door,
        (
            "- **A door on ten hinges** is held by many splits of its load. That of least norm is even; sweeps, soft constraints and",
            "  joint coordinates give others, whose forces across are off by as much as the largest of them, or by several times that.",
        ),
    ),
    (
        _beam,
        (
            "- **A beam of 80 locked boxes** on two piles falls between them where sweeps or springs hold the locks (free fall is",
            "  1.2 m in half a second); a direct solve or merged bodies hold it to two millimetres, pybullet's to seven centimetres.",
        ),
    ),
    (
        _box,
        (
            "- **A box** on a slope of 0.3 with a friction of 0.5 stands. Once it has come to rest it stays within a tenth of a",
            "  millimetre for ten seconds in spook, box3d, jolt, pybullet and sapien, in mujoco with exact friction, in the defaults of",
            "  motrixsim and rapier, in simbody when it holds an error of 1e-6, and in cannon when it is asked for accuracy; in the others",
            "  it creeps, furthest in mujoco's defaults, whose friction is regularised.",
        ),
    ),
    (
        _digits,
        (
            "- **Uniform motion** needs no method: what is lost in 1000 steps is rounding, far more in single precision than in double.",
        ),
    ),
)

ARM = (
    "## An arm with stops, in Newton's six solvers",
    "",
    "`tracker run --engine newton --catalogue bench.engine_facts:ARM` lets an arm of six links of 0.1 m and 0.1 kg fall from the",
    "level, each of whose joints has stops at half a radian. Stops give no energy. In Newton 1.8.0 SolverFeatherstone comes apart at",
    "1/60 and at 1/240 s, twenty substeps each, and so does SolverSemiImplicit; SolverMuJoCo, SolverXPBD and SolverKamino hold the",
    "arm. Without its stops Featherstone holds it, too: they are springs whose stiffness knows nothing of a light link's inertia",
    "([newton#4269](https://github.com/newton-physics/newton/issues/4269) reports it of robots).",
    "",
)
TWINS = (
    "## Is MuJoCo XLA MuJoCo?",
    "",
    "`tracker run --engine mjx --catalogue bench.engine_facts:TWINS --all --limit 300` asks how far any body is after a second from where",
    "MuJoCo has it, in the nearest of MuJoCo's settings, at 1/240 s. Both are of double precision: equal is a nanometre. With mjx",
    "3.17.0 and mujoco 4.0.0:",
    "",
    "| scene | defaults | rk4 | why |",
    "|---|---|---|---|",
    "| two hinges askew | 9×10⁻¹⁶ m | 2×10⁻¹⁵ m | the same to rounding |",
    "| two ball joints | 2×10⁻¹⁵ m | 3×10⁻⁵ m | MJX's Runge-Kutta is of order 2 where quaternions turn, MuJoCo 4's of order 4; mujoco 3.17 has MJX's to rounding |",
    "| two hinges with dry friction | 7×10⁻¹⁶ m | 3×10⁻⁸ m | our setting of MuJoCo sweeps dry friction once more, which MJX has not |",
    "| two ball joints, the far end held | 0.02 m | 0.004 m | MuJoCo adds the acceleration of the moving constraint to what its equality asks, MJX does not |",
    "| a box that slides down a slope | 2×10⁻¹⁵ m | 10⁻¹² m | the same to rounding |",
    "",
)
NEWCOMERS = (
    "## MotrixSim, which reads the files of MuJoCo",
    "",
    "`motrixsim` 0.10.1 (PyPI, 32 bits) reads MJCF: it is asked the models that MuJoCo is. Its settings, with what they rest on:",
    "",
    "| setting | what it is | source |",
    "|---|---|---|",
    "| defaults | joint coordinates, 100 iterations to 1e-3, the softness of the file's format | its own `Options` as loaded |",
    "| many-iterations | 1000 iterations to 1e-6; contacts of the time constant 2 h | `Options.max_iterations` and `solver_tolerance`; MuJoCo's manual on `solref`, whose format it reads |",
    "| equalities | the same, free bodies held by `connect` and `weld` | the elements of that format that it knows |",
    "",
    "It has semi-implicit Euler alone and passes over what it does not know of a file (integrators, cones, tendons) with a line in a",
    "log: such a scene is not supported, by the name of the element. Friction is bounded along two axes each for itself: a",
    "box on a diagonal of them stands on slopes of up to 1.4 times its friction, and one of ten tonnes creeps; 400 links end the process",
    "(`tracker run slope_grid --engine motrixsim --all`). Of a",
    "link beside its joint it tells the speed with the sign of the turning's part reversed, which is put right here while it does so.",
    "",
    "## Simbody, inside OpenSim",
    "",
    "`opensim` 4.6 (PyPI, 72 MB, 64 bits) has Simbody's joint coordinates, constraints, integrators and contact forces for Python:",
    "",
    "| setting | what it is | source |",
    "|---|---|---|",
    "| merson | Runge-Kutta-Merson, which chooses its steps: to 1e-6 a step, and none longer than the time step | OpenSim's integrator unless told |",
    "| held-step | the same with its steps held, without contacts, which are stiff springs | `Manager.setIntegratorFixedStepSize` |",
    "| defaults | as merson, to 1e-3 a step | Simbody's accuracy unless told |",
    "| cpodes | CPODES, implicit and of several steps, to 1e-6 | for stiff springs: `Manager.setIntegratorMethod` |",
    "",
    "Balls touch balls and planes by Hunt and Crossley's force, as stiff as the heaviest needs to sink by 1e-4 of the least radius;",
    "the eight corners of a box touch planes by exponential springs that stick (`ExponentialContactForce`). Its softness is its own:",
    "a cube of a metre that is pulled by 0.3 of its weight yields by 0.04 mm, and then stays. Boxes on boxes, capsules, cylinders",
    "and restitution (what Hunt and Crossley's gives back depends on the speed) are not supported. OpenSim turns free bodies and",
    "ball joints by three angles: past the place where two of them turn about one axis a held step of 1/60 s loses two thousandths",
    "of a spin of 3 rad/s (`tests/engine/peers/test_simbody.py`), where Simbody has quaternions, too.",
    "",
)
NOT_ASKED = (
    "## Engines that are not asked",
    "",
    "Tried with Python 3.11, Node and a CPU in November 2026. Those that can be had lack an adapter here:",
    "",
    "| engine | where it was looked for | what happens |",
    "|---|---|---|",
    "| Brax | `brax` 0.14.2, PyPI | installs; its positional, spring and generalized pipelines let a ball rest once JAX has compiled them; says itself that they are not maintained, and names MJX, which is asked |",
    "| JaxSim | `jaxsim` 0.9.0, PyPI | installs and imports; no adapter yet |",
    "| Havok | `@babylonjs/havok` 1.3, npm | its build for the web can be had, not tried; the native library is its maker's to license |",
    "| ODE | `libode8` 0.16.2, Debian | offered as a library, not tried; no adapter yet |",
    "| Genesis | `genesis-world` 1.4.5, PyPI | not installed: an 84 MB wheel that wants some forty more packages, VTK and OpenCV among them, and PyTorch beside it |",
    "| Chrono | PyPI, npm, Debian | not there: what PyPI calls `pychrono` is a package about delays |",
    "| AGX Dynamics | PyPI | `agx` there only marks an installation that is licensed |",
    "",
)


def carried(cells: Mapping[str, Sequence[str]]) -> tuple[list[str], list[str]]:
    """The lines of what these rows show, and the first words of what they do not, or no longer."""
    facts = columns(cells)
    shown, lacking = [], []
    for check, lines in SENTENCES:
        try:
            stands = check(facts)
        except (KeyError, IndexError, ValueError):  # an engine it is about was not asked
            stands = False
        if stands:
            shown += lines
        else:
            lacking.append(lines[0].split("**")[1])
    return shown, lacking
