"""Heaps and stacks: what a step costs, at which overlap, and how the cost grows.

A heap is ten layers of bodies of 1 kg, dropped in a grid at a spacing of .55 m with a jitter of .02 m onto a plane. Costs
are CPU time of this process.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from functools import partial

import numpy as np

from bench.costs import asked, bench, cost, exact, in_units
from bench.floors import floor
from spook_tracker.engine import (
    Box,
    Capsule,
    ContactCount,
    ContactForce,
    Final,
    Material,
    Method,
    Penetration,
    Plane,
    Program,
    Result,
    RigidBody,
    Scene,
    Shape,
    Sphere,
    compile,
    start,
)
from spook_tracker.tracker.measure.step_cost import allocated

TIME_STEP = 1.0 / 60.0  # s
GRAVITY = 9.81  # m/s²
ROUGH = Material(friction=0.5)
GROUND = RigidBody(name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=ROUGH)
STEPS = 240  # 4 s
KNOCKS = (0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.5)  # m/s: one alone is luck, costs differ tenfold
BALL, CUBE = Sphere(0.25), Box((0.5, 0.5, 0.5))
OVERLAP = 1e-3  # m, what heaps of spheres are compared at
STARTS = range(1, 16)  # seeds: heaps by ten sweeps are chaotic
PASSES = 3  # over all that is held, a step: collision, solve and projection
HEAPS = range(3, 10)  # seeds of mixed bodies: they end in heaps whose costs differ twofold


def heap(count: int, shape: Shape = BALL, seed: int = 1) -> Scene:
    """Bodies in layers of a square grid, each a little aside."""
    rng = np.random.default_rng(seed)
    side = math.ceil(math.sqrt(count / 10))
    bodies = [GROUND]
    for k in range(count):
        x, y, z = 0.55 * (k % side), 0.55 * (k // side % side), 0.5 + 0.55 * (k // side**2)
        dx, dy = rng.uniform(-0.02, 0.02, 2)
        bodies.append(
            RigidBody(name=f"b{k}", mass=1.0, shape=shape, position=(x + dx, y + dy, z), material=ROUGH)
        )
    return Scene(bodies=tuple(bodies), gravity=(0.0, 0.0, -GRAVITY))


def stack(count: int, knock: float = 0.0) -> Scene:
    """`count` unit boxes on each other, the topmost pushed sideways at `knock` [m/s]."""
    boxes = [
        RigidBody(
            name=f"b{k}",
            mass=1.0,
            shape=Box((1.0, 1.0, 1.0)),
            position=(0.0, 0.0, 0.5 + k),
            velocity=(knock if k == count - 1 else 0.0, 0.0, 0.0),
            material=ROUGH,
        )
        for k in range(count)
    ]
    return Scene(bodies=(GROUND, *boxes), gravity=(0.0, 0.0, -GRAVITY))


def prepared(scene: Scene, method: Method) -> Program:
    observe = {
        "overlap": Final(quantity=Penetration()),
        "contacts": Final(quantity=ContactCount()),
        "load": Final(quantity=ContactForce("ground")),
    }
    return compile(scene, time_step=TIME_STEP, method=method, observe=observe)


@dataclass(frozen=True)
class Watched:
    """A run, step by step."""

    costs: list[float]  # s of the processor, of each step
    overlap: float  # m, at the end
    result: Result

    @property
    def mean(self) -> float:
        return float(np.mean(self.costs))

    @property
    def last(self) -> float:
        """Mean of the last second [s]."""
        return float(np.mean(self.costs[-60:]))


def watched(scene: Scene, steps: int = STEPS, method: Method = Method()) -> Watched:  # noqa: B008 - frozen
    costs = []
    with start(scene, time_step=TIME_STEP, method=method, observe={"overlap": Penetration()}) as held:
        for _ in range(steps):
            begin = time.process_time()
            held.step()
            costs.append(time.process_time() - begin)
        return Watched(costs, float(held["overlap"]), held.result())


def by_iterations(count: int, **more: int) -> Method:
    return Method(solver="iterative", iterations=count, **more)  # type: ignore[arg-type]


def at_equal_overlap() -> dict[str, float]:
    """1000 spheres over four seconds: the cheapest setting by iterations within OVERLAP, and the overlaps left."""
    cheapest, parted = math.inf, 0.0
    for iterations in (5, 10, 20, 50):
        for substeps in (1, 2, 4):
            if iterations * substeps > 60:
                continue
            fall = watched(heap(1000), method=by_iterations(iterations, substeps=substeps))
            if fall.result.completed and fall.overlap <= OVERLAP:
                cheapest = min(cheapest, fall.mean)
            if iterations > 10 and substeps == 1:
                parted = max(parted, fall.overlap if fall.result.completed else math.inf)
    ends = [watched(heap(1000, seed=k), method=by_iterations(10)) for k in STARTS]
    left = [end.overlap if end.result.completed else math.inf for end in ends]
    return {"step": in_units(cheapest, "operation"), "parted": parted, "by_ten": float(np.median(left))}


def exactly(method: Method) -> dict[str, float]:
    """1000 spheres: what the last second and the whole fall cost, and the overlap left."""
    fall = watched(heap(1000), method=method)
    left = fall.overlap if fall.result.completed else math.inf
    return {
        "last": in_units(fall.last, "operation"),
        "way": in_units(fall.mean, "operation"),
        "overlap": left,
    }


def bin_of(count: int) -> Scene:
    """The heap between four walls that leave it no room to spread."""
    side = 0.55 * math.ceil(math.sqrt(count / 10))
    middle, walls = 0.5 * side - 0.275, []
    for k, (x, y) in enumerate(((1, 0), (-1, 0), (0, 1), (0, -1))):
        place = (middle + x * (0.5 * side + 0.5), middle + y * (0.5 * side + 0.5), 5.0)
        size = (1.0, side + 2.0, 20.0) if x else (side + 2.0, 1.0, 20.0)
        walls.append(
            RigidBody(name=f"wall {k}", motion="static", shape=Box(size), position=place, material=ROUGH)
        )
    loose = heap(count)
    return Scene(bodies=(*walls, *loose.bodies), gravity=loose.gravity)


def packed(count: int, method: Method) -> dict[str, float]:
    """Spheres wedged in a bin: the residual reached, by what makes a run unsettled; none where it says that it is."""
    scene = bin_of(count)
    result = prepared(scene, method).run(STEPS)
    share = result.residual / method.residual_of("unsettled_residual", scene)
    return {
        "residual": 0.0 if result.status == "unsettled" else share,
        "near_answers": result.counters["unsettled_solves"],
    }


def growth(largest: int) -> dict[str, float]:
    """The cost per contact of heaps by a smaller one's and what memory takes, of three rounds over all sizes the best."""
    programs = {}
    for count in (1000, 100, largest):
        scene = heap(count)
        before = allocated() or 0.0
        programs[count] = prepared(scene, by_iterations(10))
        contacts = programs[count].run(STEPS).counters["contacts"] / STEPS
        held = ((allocated() or 0.0) - before) / contacts
    best: dict[int, float] = {}
    for _ in range(3):  # side by side: what slows the machine down for a while slows all of them
        for count, program in programs.items():
            for _ in range(3 if count <= 1000 else 1):
                result = program.run(STEPS)
                each = result.cpu_seconds / max(1, result.counters["contacts"])
                best[count] = min(best.get(count, math.inf), each if result.completed else math.inf)
    return {
        "times_floor": best[largest] / (best[1000] + PASSES * held * floor("byte")),
        "times_1000": best[largest] / best[1000],
        "small_times_1000": best[100] / best[1000],
        "held": held,
    }


def at_rest(scene: Scene) -> float:
    """Seconds of a step of a stack once its first steps are done."""
    return float(np.mean(watched(scene, 100).costs[10:]))


def stacks() -> dict[str, float]:
    """Stacks: at rest against knocked, and tall against low."""
    low = watched(stack(100), 100)
    rest = float(np.mean(low.costs[10:]))
    knocked = {knock: watched(stack(100, knock=knock), 30) for knock in KNOCKS}
    hit = knocked[0.5].mean
    fallen = watched(heap(1000, CUBE), 200).last
    unsettled = sum(fall.result.counters["unsettled_solves"] for fall in knocked.values())
    return {
        "rest": in_units(rest, "operation"),
        "longest": in_units(max(low.costs[0], *knocked[0.5].costs), "operation"),
        "boxes": in_units(fallen, "operation"),
        "at_rest": rest / hit,
        "knocked": hit / rest,
        "knocked_mean": float(np.mean([fall.mean for fall in knocked.values()])) / rest,
        "tall": at_rest(stack(500)) / 5 / rest,
        "wide": fallen / 10 / rest,
        "near_answers": unsettled / (30 * len(KNOCKS)),
        "near": max(fall.result.residual for fall in knocked.values()),
    }


def asleep(solver: str) -> dict[str, float]:
    """1000 fallen boxes asleep against the same awake, alone and with a ball that rolls away from them for ever."""
    lying = heap(1000, CUBE)
    ball = RigidBody(
        name="ball", mass=1.0, shape=BALL, position=(-50.0, 0.0, 0.25), velocity=(-1.0, 0.0, 0.0)
    )
    rolls = Scene(bodies=(*lying.bodies, ball), gravity=lying.gravity)
    found = {"awake_boxes": 0.0}
    for title, scene in (("alone", lying), ("beside", rolls)):
        costs = []
        for speed in (0.0, 0.02):
            method = Method(solver=solver, sleep_speed=speed)  # type: ignore[arg-type]
            with start(scene, time_step=TIME_STEP, method=method) as held:
                held.step(240)
                begin = time.process_time()
                held.step(60)  # at once: each call keeps a state to go back to
                costs.append(time.process_time() - begin)
                sleepers = held.result().counters.get("asleep", 0)
        found[title] = costs[1] / costs[0]
        found["awake_boxes"] += 1000 - sleepers
    return found


def mixed(count: int, seed: int = 3) -> Scene:
    """Balls, boxes and capsules in turn, in layers of a square grid."""
    rng = np.random.default_rng(seed)
    shapes: tuple[Shape, ...] = (Sphere(0.25), Box((0.4, 0.4, 0.4)), Capsule(0.15, 0.4))
    bodies = [GROUND]
    for k in range(count):
        dx, dy = rng.uniform(-0.05, 0.05, 2)
        place = (0.7 * (k % 4) + dx, 0.7 * (k // 4 % 4) + dy, 0.5 + 0.7 * (k // 16))
        bodies.append(RigidBody(name=f"b{k}", mass=1.0, shape=shapes[k % 3], position=place, material=ROUGH))
    return Scene(bodies=tuple(bodies), gravity=(0.0, 0.0, -GRAVITY))


def overhang(count: int, part: float) -> Scene:
    """Plates of 1 × 1 × .1 m on a table, each out by `part` of the harmonic overhang."""
    table = RigidBody(
        name="table", motion="static", shape=Box((2.0, 2.0, 1.0)), position=(-1.0, 0.0, 0.5), material=ROUGH
    )
    bodies, edge = [GROUND, table], 0.0
    for k in range(count):
        edge += part * 0.5 / (count - k)
        place = (edge - 0.5, 0.0, 1.05 + 0.1 * k)
        bodies.append(
            RigidBody(name=f"p{k}", mass=1.0, shape=Box((1.0, 1.0, 0.1)), position=place, material=ROUGH)
        )
    return Scene(bodies=tuple(bodies), gravity=(0.0, 0.0, -GRAVITY))


def unlike_bodies() -> dict[str, float]:
    """64 mixed bodies and a fallen overhang, solved directly: step by step, against iterations over the same bodies."""
    swept = float(np.median(watched(mixed(64), method=Method(solver="iterative")).costs))
    falls = [watched(mixed(64, seed)).costs for seed in HEAPS]
    each = [float(np.median(fall)) for fall in falls]
    middle = max(each[0], float(np.median(each)))
    plates = watched(overhang(10, 1.01), 2 * STEPS).costs
    return {
        "times_iterations": middle / swept,
        "times_median": max(max(fall) / own for fall, own in zip(falls, each, strict=True)),
        "step": in_units(middle, "operation"),
        "longest": in_units(max(map(max, falls)), "operation"),
        "plates": in_units(float(np.median(plates[-60:])), "operation"),
    }


def huge() -> dict[str, float]:
    """100 000 spheres, the whole fall by ten iterations a step: out of reach of a night."""
    result = prepared(heap(100_000), by_iterations(10)).run(STEPS)
    return {
        "overlap": float(result["overlap"]) if result.completed else math.inf,
        "step": in_units(result.cpu_seconds / STEPS, "operation"),
    }


MET = "what is asked"
STEP = partial(cost, "step", "the mean step", unit="operation")
BENCH = partial(bench, beside="iterations, smaller heaps, stacks at rest and arithmetic of this machine")
TESTS = {
    "heaps": BENCH(
        "Heaps and stacks",
        "What does a step of a heap cost, at which overlap, and how does it grow?",
        *(
            asked(title, measure, *metrics, time_step=TIME_STEP)
            for title, measure, *metrics in (
                (
                    "1000 spheres, iterations",
                    at_equal_overlap,
                    STEP(1.1e7, "5 ms where it was set"),
                    exact(
                        "parted", "overlap by more than ten iterations", 1e-6, "one parting a step", unit="m"
                    ),
                    exact(
                        "by_ten",
                        "overlap by ten, the median of fifteen starts",
                        1e-6,
                        "one parting a step",
                        unit="m",
                    ),
                ),
                (
                    "1000 spheres exactly",
                    partial(exactly, Method()),
                    cost(
                        "last", "a step of the last second", 1.3e8, "60 ms where it was set", unit="operation"
                    ),
                    cost("way", "a step of the fall", 3.2e8, "150 ms where it was set", unit="operation"),
                    exact("overlap", "at the end", 1e-9, MET, unit="m"),
                ),
                *(
                    (
                        f"{count} spheres in a bin",
                        partial(packed, count, method),
                        exact(
                            "residual",
                            "by what is told as unsettled",
                            1.0,
                            "a run has an answer or says so",
                            unit="1",
                        ),
                        cost("near_answers", "solves with a near answer"),
                    )
                    for count, method in ((64, Method()), (256, Method(solver="iterative")))
                ),
                (
                    "10000 spheres",
                    partial(growth, 10_000),
                    cost(
                        "times_floor",
                        "a contact and step, by that of 1000 and three ways of all it holds through memory",
                        1.2,
                        MET,
                    ),
                    cost("times_1000", "a contact and step, by that of 1000"),
                    cost("held", "allocated for a contact", unit="B"),
                    cost("small_times_1000", "of 100, by that of 1000", 1.6, "what sorting pairs may cost"),
                ),
                (
                    "stacks of 100",
                    stacks,
                    cost("rest", "a step at rest", 2.5e6, "1.2 ms where it was set", unit="operation"),
                    cost(
                        "longest",
                        "any step of a start, or after a knock at .5 m/s",
                        2.1e7,
                        "10 ms",
                        unit="operation",
                    ),
                    cost(
                        "boxes", "a step of 1000 boxes in 100 stacks, fallen", 1.1e7, "5 ms", unit="operation"
                    ),
                    cost("at_rest", "at rest, by knocked at .5 m/s", 0.5, "at rest no matrix is factored"),
                    # Where Newton's hold lost the path a knock cost 160.
                    cost("knocked", "knocked at .5 m/s, by at rest", 15.0, "the path of pivots is followed"),
                    cost(
                        "knocked_mean",
                        "the same in the mean over speeds",
                        30.0,
                        "the path of pivots is followed",
                    ),
                    cost("tall", "500 at rest, a box, by one of 100", 1.6, "linear"),
                    cost("wide", "100 stacks of ten, a box, by one of 100", 1.8, "linear"),
                    exact("near_answers", "share of knocked steps with a near answer", 0.25, MET, unit="1"),
                    exact("near", "residual of these", 0.01, "a tenth of what is unsettled", unit="m/s"),
                ),
                *(
                    (
                        f"1000 boxes asleep, {solver}",
                        partial(asleep, solver),
                        cost("alone", "a step, by one awake", 0.02, "no body is looked at"),
                        cost(
                            "beside",
                            "the same while a ball rolls by",
                            0.25,
                            "they are looked for, and no more",
                        ),
                        exact("awake_boxes", "after five seconds", 0.0, "all have come to rest", unit="1"),
                    )
                    for solver in ("direct", "iterative")
                ),
                (
                    "64 mixed bodies",
                    unlike_bodies,
                    cost("times_iterations", "the median step, by that of 50 iterations", 9.0, MET),
                    cost("times_median", "any step, by the median of its fall", 10.0, MET),
                    STEP(8.5e6, "4 ms where it was set"),
                    cost("longest", "any step", 6.4e7, "30 ms where it was set", unit="operation"),
                    cost(
                        "plates",
                        "a step of ten fallen plates",
                        2.1e6,
                        "1 ms where it was set",
                        unit="operation",
                    ),
                ),
            )
        ),
    ),
    "huge_heap": BENCH(
        "A heap of 100 000",
        "Does a heap out of reach of a night settle?",
        asked(
            "iterative",
            huge,
            exact("overlap", "at the end", OVERLAP, "what heaps of spheres are compared at", unit="m"),
            STEP(),
            time_step=TIME_STEP,
        ),
    ),
}
