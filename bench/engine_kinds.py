"""What the page of engines says above its table of facts, and what the table must show for each sentence to stand.

And below it, of what its table has not: an arm with stops, and the engines that are not asked.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence

import spook_tracker.tracker.judge.rank as ranks
from bench.engine_places import OURS, SINGLE
from spook_tracker.tracker.document.wording import number

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
    cell = cell.replace("−", "-")
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
        "mujoco (implicit)", "newton (mujoco)", "pybullet (joints)", "motrixsim (defaults)", "motrixsim (many-iterations)",
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
        "newton (mujoco)", "newton (kamino)", "newton (vbd)",
    }  # fmt: skip
    furthest = sorted(facts[4], key=facts[4].__getitem__)[-3:]
    return stands == expected and furthest == [
        "mujoco (defaults)",
        "newton (featherstone)",
        "newton (semi-implicit)",
    ]


def _digits(facts: Columns) -> bool:
    lost = {name: name.split()[0] in SINGLE or name == "p2 (defaults)" for name in facts[5]}
    return {name.split()[0] for name in lost} >= set(SINGLE) and all(
        1e-6 < facts[5][name] < 1e-2 if much else facts[5][name] < 1e-12 for name, much in lost.items()
    )


OF_ORDER = {"mujoco (rk4)": 4.0, "drake (rk3)": 3.0} | dict.fromkeys(
    ("exudyn (trapezoidal)", "exudyn (generalised-alpha)", "simbody (merson)", "simbody (held-step)", "simbody (defaults)"),
    2.0,
)  # fmt: skip
NO_ORDER = ("newton (mujoco)", "simbody (cpodes)")  # at rounding; chooses its steps itself


def _order(facts: Columns) -> bool:
    orders = {name: found for name, found in facts[6].items() if name not in NO_ORDER}
    return facts[6]["newton (mujoco)"] < 0.5 and all(
        abs(found - OF_ORDER.get(name, 1.0)) < 0.15 for name, found in orders.items()
    )


def _hung(facts: Columns) -> bool:
    hung = facts[7]
    joints = {"mujoco (defaults)", "mujoco (implicit)", "dart (joints)", "drake (sap)", "pybullet (joints)"}
    swept = {name for name in hung if name.split()[0] in ("box3d", "cannon", "jolt", "p2", "sapien")}
    tensions = (
        "spook (plain)",
        "mujoco (rk4)",
        "mujoco (equalities)",
        "drake (rk3)",
        "drake (constraints)",
        "newton (mujoco)",
    )
    return (
        all(hung[name] >= 1e6 for name in joints | {"exudyn (trapezoidal)", "simbody (merson)", "simbody (defaults)"})
        and all(hung[name] == 100.0 for name in (*tensions, "newton (xpbd)"))
        and all(hung[name] <= 100.0 for name in swept)
        and all(hung[name] == load for name, load in (("sapien (pgs)", 10.0), ("sapien (tgs)", 0.0)))
    )  # fmt: skip


def _stacked(facts: Columns) -> bool:
    stacked = facts[8]
    hard = {name for name, mass in stacked.items() if mass >= 1e4}
    return (
        hard
        == {"spook (plain)", "mujoco (rk4)", "mujoco (implicit)", "mujoco (equalities)", "newton (mujoco)"}
        and stacked["spook (plain)"] == 1e6
        and {name for name, mass in stacked.items() if mass == 1e3}
        == {"dart (joints)", "dart (constraints)", "newton (kamino)", "sapien (tgs)"}
        and stacked["newton (xpbd)"] == stacked["sapien (pgs)"] == 100.0
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
            "  millimetre for ten seconds in spook, box3d, jolt, pybullet and sapien, in mujoco with exact friction, in three of newton's",
            "  solvers, in the defaults of motrixsim and rapier, in simbody when it holds an error of 1e-6, and in cannon when it is asked",
            "  for accuracy; in the others it creeps, furthest where friction is regularised: in newton's two solvers with contacts as",
            "  springs, and in mujoco's defaults.",
        ),
    ),
    (
        _digits,
        (
            "- **Uniform motion** needs no method: what is lost in 1000 steps is rounding, far more in single precision than in double.",
        ),
    ),
    (
        _order,
        (
            "- **A pendulum** is of order 1 in every engine that steps velocities before positions, whether by joint coordinates, by",
            "  sweeps over rows (PGS; PhysX's TGS alike) or by sweeps over positions (XPBD); of order 2 in exudyn and simbody, of 3 in",
            "  drake's and of 4 in mujoco's Runge-Kutta. Newton has mujoco's in single precision, whose rounding is all that is left at",
            "  1/60 s: its number is no order, nor is that of cpodes, which chooses its steps itself.",
        ),
    ),
    (
        _hung,
        (
            "- **A load on a light chain**: joint coordinates with velocities stepped first, and implicit or error-controlled steps, carry",
            "  a million times a link. Where a step takes tensions from where it begins the fastest sideways motion sets the bound, 372",
            "  times where h ω = 2, in ours, with constraints solved whole, and at 2.8 with Runge-Kutta: a hundred. XPBD carries as much;",
            "  sweeps over rows (PGS) end at a hundred or before, PhysX's at ten, and its small steps (TGS) hold no distances here, as above.",
        ),
    ),
    (
        _stacked,
        (
            "- **A heavy box on a light one** rests a million times as heavy in ours, ten thousand times in mujoco's equations asked for",
            "  hard contacts (newton's, too), a thousand times in dart, in newton's kamino and by PhysX's small steps (TGS); by XPBD and",
            "  by PhysX's sweeps (PGS) a hundred times, in all others as much or less.",
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
    "| Havok | `@babylonjs/havok` 1.3, npm | its build for the web (MIT, single precision) runs in Node and lets a ball fall, by less than semi-implicit Euler and more than the exact way; no adapter yet; the native library is its maker's to license |",
    "| ODE | `libode8` 0.16.2, Debian | runs through `ctypes`, in double precision: a ball falls as by semi-implicit Euler; no adapter yet |",
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


def table(samples: Mapping[str, ranks.Samples]) -> list[str]:
    """The facts, a row for each setting of each engine."""
    cells: dict[tuple[str, str], dict[str, str]] = {}
    heads: dict[str, str] = {}
    for name, told in samples.items():
        for definition, sample in told.values():
            assert definition.time_step is not None
            place = f"{definition.test} {definition.time_step:g}"
            steps = (
                f", h = 1/{round(1.0 / definition.time_step)} s" if definition.test == "fact_chain" else ""
            )
            heads.setdefault(place, f"{HEADS[definition.test]}{steps}")
            setting = definition.configuration if name != OURS else "plain"
            answered = sample.outcome in ("value", "unsettled", "out_of_limit")
            said = "-" if sample.outcome == "not_supported" else sample.outcome.replace("_", " ")
            cells.setdefault((name, setting), {})[place] = number(sample.value, 2) if answered else said
    if not cells:
        return []
    rows = [
        f"| {name} ({setting}) | " + " | ".join(row.get(place, "-") for place in heads) + " |"
        for (name, setting), row in cells.items()
        if set(row.values()) != {"-"}
    ]
    shown, lacking = carried(
        {
            f"{name} ({setting})": [row.get(place, "-") for place in heads]
            for (name, setting), row in cells.items()
        }
    )
    for words in lacking:
        print(f"left out, the table does not show it: {words}", flush=True)
    return [
        "## What kinds of engines do",
        "",
        KINDS,
        "",
        *shown,
        *([""] if shown else []),
        "| engine (setting) | " + " | ".join(heads.values()) + " |",
        "|---|" + "---|" * len(heads),
        *rows,
        "",
    ]


HEADS = {
    "fact_chain": "chain of 26: energy gained [%]",
    "fact_door": "door on 10 hinges: unevenness",
    "fact_beam": "80 boxes: sag in 0.5 s [m]",
    "fact_creep": "box held by friction: creep in 10 s [m]",
    "fact_digits": "uniform motion: relative error",
    "fact_order": "pendulum: order, 1/60 to 1/240 s",
    "fact_hung": "chain of 10: load carried, of a link's mass",
    "fact_stacked": "box: mass carried, of its own",
}
KINDS = "Eight questions whose answers follow from how an engine is made, in every setting (`bench/engine_facts.py` states them; mjx and mujoco_warp, which are MuJoCo again, are asked below):"
