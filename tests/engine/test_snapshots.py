"""A run that is taken up in another process goes on with the same bits, and damaged bytes never pass for it."""

from __future__ import annotations

import hashlib
import pickle
import random
import struct
import subprocess
import sys
from collections.abc import Container, Iterator
from dataclasses import replace
from typing import Any

import pytest

from spook_tracker.engine import (
    ConstraintForce,
    Method,
    MethodError,
    Run,
    Scene,
    SimulationFailed,
    Snapshot,
    Sphere,
    _core,
    start,
)
from spook_tracker.engine import snapshot as form
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from tests.engine.rigid.test_energy_made import loaded_chain
from tests.engine.rigid.test_locked_trees import locked
from tests.engine.test_bits import SCENES, rng, stiff, tumble
from tests.engine.test_time_limits import islands
from tests.places import ROOT
from tests.scenes import coupling as coupling_scenes
from tests.scenes import particle as particle_scenes
from tests.scenes import rigid as rigid_scenes
from tests.scenes import sleep as sleep_scenes
from tests.scenes.corpus import solid

Made = tuple[Scene, float, Method]
BEFORE, AFTER = 40, 50  # steps
CORRUPTIONS = 10_000


def corpus() -> dict[str, Made]:
    """Whatever carries something from step to step: warm starts, sleepers, loops, drives, broken joints, histories."""
    made: dict[str, Made] = {name: (scene, 0.01, method) for name, (scene, method) in SCENES.items()}
    made["contacts, half-step"] = (sleep_scenes.heap(6), 0.01, Method(half_step_velocities=True))
    made["contacts, successive"] = (tumble(), 0.01, Method(impacts="successive"))
    made["sleepers"] = (sleep_scenes.heap(12), sleep_scenes.TIME_STEP, sleep_scenes.sleepy())
    made["a stack asleep"] = (
        sleep_scenes.scene(sleep_scenes.FLOOR, *sleep_scenes.stack()), sleep_scenes.TIME_STEP, sleep_scenes.sleepy(),
    )  # fmt: skip
    slows = solid("ball", Sphere(0.1), (0.0, 0.0, 0.1), velocity=(0.021, 0.0, 0.0))  # slow from step 15 on
    uphill = Scene(bodies=(sleep_scenes.FLOOR, slows), gravity=(-0.004, 0.0, -sleep_scenes.GRAVITY))
    made["about to sleep"] = (uphill, sleep_scenes.TIME_STEP, sleep_scenes.sleepy())
    few = Method(solver="iterative", iterations=2)
    made["unsettled"] = (islands((40,), few)[0], 0.01, few)
    for kind, scenes in (("particles", particle_scenes), ("rigid", rigid_scenes)):
        made[f"{kind}, halved"] = (stiff(scenes.tree(rng())), 0.15, Method(composition="order4"))
    made["rigid, within a tolerance"] = (
        loaded_chain(300.0),
        1 / 60,
        Method(runge_kutta="order8", tolerance=1e-6),
    )
    made["rigid, in parts"] = (loaded_chain(300.0), 1 / 60, Method(composition="order4"))
    made["a lock that breaks"] = (coupling_scenes.hung(strength=22.0), 0.01, Method())
    made["locks in a tree"] = (locked(0, "world"), 0.01, Method())
    scene, method = islands((12, 9), Method())
    made["overlaps in two islands"] = (scene, 0.01, method)
    for name in ("slider_crank", "taut_rope", "leaning_cards", "stone_bridge", "loose_bearing"):
        example = CATALOGUE[name].example()
        made[name] = (example.scene, example.time_step, example.method)
    return made


CORPUS = corpus()


def held(name: str) -> Run:
    scene, time_step, method = CORPUS[name]
    forces = {each.name: ConstraintForce(each.name) for each in scene.constraints if each.name}
    return start(scene, time_step=time_step, method=method, observe=forces)


def told(run: Run, steps: int = AFTER) -> tuple[Any, ...]:
    """What joints exert where it is, what it comes to, to the last bit, and what it has counted of its own state."""
    now = run.result()
    exerted = {name: now[name].tobytes().hex() for name in now.observables}
    try:
        run.step(steps)
        result = run.result()
    except SimulationFailed as failed:
        result = failed.result
    counted = {name: result.counters[name] for name in STATES if name in result.counters}
    return exerted, result.state_hash, result.status, result.broken, result.residual, counted


STATES = (
    "asleep",
    "slept_steps",
    "newton_iterations",
    "halved_steps",
    "redundancy_looks",
    "contacts",
    "impacts",
)  # the state's own counters

CHILD = """
import pickle, sys
from tests.engine.test_snapshots import held, told
for name, saved in pickle.load(sys.stdin.buffer).items():
    with held(name) as run:
        run.restore(pickle.loads(saved))
        print(name, told(run), sep="\\t")
"""


def test_another_process_goes_on_with_the_same_bits() -> None:
    saved, expected = {}, []
    for name in CORPUS:
        with held(name) as run:
            run.step(BEFORE)
            saved[name] = pickle.dumps(run.save())
            expected.append(f"{name}\t{told(run)}")
    there = subprocess.run(
        [sys.executable, "-c", CHILD], input=pickle.dumps(saved), capture_output=True, check=True,
        cwd=ROOT,
    )  # fmt: skip

    assert there.stdout.decode().splitlines() == expected


def test_what_was_set_and_why_it_failed_come_along() -> None:
    scene = coupling_scenes.pair()
    with start(scene, time_step=0.01) as run:
        run.set_load("torque", torque=(0.0, 0.0, -2.0))
        run.step(3)
        saved = Snapshot.from_bytes(run.save().to_bytes())
        once = told(run)
    with start(scene, time_step=0.01) as other:
        other.restore(saved)
        assert other.steps == 3
        assert told(other) == once


# --- refused ---------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def whole() -> bytes:
    with held("contacts") as run:
        run.step(BEFORE)
        return run.save().to_bytes()


def sealed(start_of: bytes, content: bytes) -> bytes:
    """With the right hash, whatever it holds."""
    return start_of + hashlib.sha256(start_of + content).digest() + content


def of_format(number: int, content: bytes = b"whatever") -> bytes:
    return sealed(form.LETTERS + number.to_bytes(2, "big"), content)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "no snapshot of a run"),
        (b"PK\x03\x04 something else", "no snapshot of a run"),
        (form.LETTERS, "damaged or cut short"),
        (of_format(form.FORMAT)[:-1], "damaged or cut short"),
        (of_format(form.FORMAT + 1), f"has format {form.FORMAT + 1}, and this engine reads {form.FORMAT}"),
        ("text", "from bytes, not from str"),
        (None, "from bytes, not from NoneType"),
    ],
)
def test_what_is_no_snapshot_of_this_engine_is_refused_in_a_sentence(data: Any, words: str) -> None:
    with pytest.raises(MethodError, match=words) as refused:
        Snapshot.from_bytes(data)
    assert "\n" not in str(refused.value)


def test_another_build_is_named(whole: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(form, "_build", lambda: "9.9 (another compiler)")
    with pytest.raises(MethodError, match=r"and this is 9\.9 \(another compiler\)"):
        Snapshot.from_bytes(whole)


def corrupted(data: bytes, chance: random.Random) -> bytes:
    """Bits flipped, bytes lost, doubled, zeroed or put in; the end cut off; something behind it."""
    at, size = chance.randrange(len(data)), 1 + int(chance.expovariate(0.1))
    match chance.randrange(7):
        case 0:
            return data[:at] + bytes([data[at] ^ 1 << chance.randrange(8)]) + data[at + 1 :]
        case 1:
            return data[:at]
        case 2:
            return data[:at] + data[at + size :]
        case 3:
            return data[:at] + data[at : at + size] + data[at:]
        case 4:
            return data[:at] + bytes(min(size, len(data) - at)) + data[at + size :]
        case 5:
            return data[:at] + chance.randbytes(size) + data[at:]
        case _:
            return data + chance.randbytes(size)


def test_no_corruption_of_its_bytes_is_taken(whole: bytes) -> None:
    chance, taken = random.Random(39), 0
    for _ in range(CORRUPTIONS):
        data = corrupted(whole, chance)
        try:
            again = Snapshot.from_bytes(data)
        except MethodError:
            continue
        assert data == whole, "what was changed was taken"
        assert again.to_bytes() == whole
        taken += 1
    assert taken < CORRUPTIONS / 10  # zeros put where zeros were


def test_no_corruption_of_its_pickle_is_taken_for_another_state(whole: bytes) -> None:
    """What Python itself refuses has Python's words; what comes through is what was saved."""
    dumped, chance = pickle.dumps(Snapshot.from_bytes(whole)), random.Random(93)
    for _ in range(CORRUPTIONS):
        try:
            again = pickle.loads(corrupted(dumped, chance))
        except Exception:
            continue
        if isinstance(again, Snapshot):
            assert again.to_bytes() == whole


# --- nothing is left out ---------------------------------------------------------------------------------


Path_ = tuple[int, ...]
PLAIN, PLAINS, ITEMS, RECORD = 1, 2, 3, 4
HEAD = struct.Struct("<BQ")


def parts(state: bytes, at: int = 0, path: Path_ = ()) -> Iterator[tuple[Path_, int, int]]:
    """Each field of a state that is no record itself: its place among the fields, where it begins and ends."""
    kind, count = HEAD.unpack_from(state, at)
    end = at + HEAD.size
    if kind == RECORD:
        for place in range(count):
            for found in parts(state, end, (*path, place)):
                yield found
                end = found[2]
        return
    if kind == ITEMS:
        for _ in range(count):
            end = list(parts(state, end))[-1][2]
    else:
        end += count if kind == PLAIN else 8 + count * struct.unpack_from("<Q", state, end)[0]
    yield path, at, end


# Fields that no scene here misses, by their places in the records: of ParticleSystem::Memory, and of
# RigidSystem::Snapshot with its RigidState, JointStates, WarmStart and ContactStage::Snapshot.
FAILED = "tells of a run that failed: the snapshot's half in Python keeps why"
ANEW = "filled anew in each step, and copied with what is not"
SAMPLE = "of a sample looked ahead for, which ends with its reading"
ENERGY = "read at the end of a whole run alone"
ASLEEP = (
    "asked for when sleepers are woken: tests/engine/rigid/test_sleeping_driven.py saves and restores those"
)
WORK = "counts work and the residual of the last solve, from which nothing goes on"
GAVE_UP = "after a solver has given up and is not asked again at once; no scene here has that"
PLACE = "where the rows of the last solve are, for readers; what is read comes along"
LOOK = "when the tension of a composition is looked at next: one look more finds the same"
NOT_READ: dict[str, dict[Path_, str]] = {
    "particles": {(0, 3): SAMPLE, (0, 4): WORK, (0, 5): GAVE_UP, (0, 6, 4): FAILED},
    "rigid": {
        **dict.fromkeys([(0, 0, place) for place in (1, 2, 6, 14, 15, 18)], FAILED),
        **dict.fromkeys([(0, 3, 0, 4), (0, 3, 2), (0, 3, 3)], GAVE_UP),
        **dict.fromkeys([(0, 0, 9), (0, 0, 10)], SAMPLE),
        **dict.fromkeys([(0, 0, 8), (0, 0, 12)], ENERGY),
        (0, 0, 25): LOOK,
        (0, 0, 28): PLACE,
        **dict.fromkeys([(0, 2, 0, 0), (0, 2, 0, 1), (0, 2, 0, 3)], ANEW),
        **dict.fromkeys([(0, 3, 0, 0, 1), (0, 3, 0, 0, 2)], ASLEEP),
    },
}


def left_out(name: str, asked: Container[Path_]) -> dict[Path_, bool]:
    """Whether a run goes on otherwise, by the field that was forgotten, of those asked for: it is as it was at the start."""
    needed = {}
    with held(name) as run:
        fresh = run.save().native.bytes()
        run.step(BEFORE)
        saved = run.save()
        once = told(run)
        state = saved.native.bytes()
        kind = type(saved.native)
        for (path, begin, end), (_, fresh_begin, fresh_end) in zip(parts(state), parts(fresh), strict=True):
            other = state[:begin] + fresh[fresh_begin:fresh_end] + state[end:]
            if other == state or path not in asked:
                continue
            try:
                run.restore(replace(saved, native=kind.of_bytes(other)))
                needed[path] = told(run) != once or run.steps != BEFORE + AFTER
            except Exception:
                needed[path] = True
    return needed


def test_no_field_of_a_state_can_be_left_out() -> None:
    """Each is either needed by some scene here to go on with the same bits, or listed with why none asks for it.

    Writing a state lists no fields, so none can be forgotten there; here it is shown that a run would tell if one were.
    """
    listed = {(kind, path) for kind, paths in NOT_READ.items() for path in paths}
    needed: set[tuple[str, Path_]] = set()
    every: set[tuple[str, Path_]] = set()
    for name in CORPUS:
        with held(name) as run:
            native = run.save().native
        kind = "rigid" if isinstance(native, _core.RigidSnapshot) else "particles"
        here = {(kind, path) for path, _, _ in parts(native.bytes())}
        every |= here
        asked = {path for _, path in here - (needed - listed)}  # one scene that misses it is enough
        needed |= {(kind, path) for path, missed in left_out(name, asked).items() if missed}

    assert every - needed - listed == set(), "fields that no scene here would miss"
    assert listed & needed == set(), "fields that are listed as not missed, and are"
    assert listed <= every, "fields that are listed and are none"
