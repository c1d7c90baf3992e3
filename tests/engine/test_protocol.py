"""Other engines behind the protocol: what they lack is named before anything runs, and names find them."""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from spook_tracker import engine
from spook_tracker.engine import (
    Box,
    ConstraintForce,
    ContactForce,
    Distance,
    Final,
    Hinge,
    Lock,
    Material,
    MethodError,
    Motor,
    Particle,
    Plane,
    Position,
    RigidBody,
    Scene,
    Spring,
)
from spook_tracker.engine.find import BUILT, EXTRAS, NODE, EngineMissing, Peer, find
from spook_tracker.engine.protocol import (
    Capabilities,
    Configuration,
    NotSupported,
    Task,
    refuse_unsupported,
    run,
    unsupported,
)
from spook_tracker.engine.stepped import Stepped
from tests.scenes.corpus import solid
from tests.toys.stepping_engine import ENGINE

WEIGHT = Particle(name="weight", mass=2.0, position=(1.0, 0.0, 0.0))
ROD = Distance(name="rod", between=((0.0, 0.0, 0.0), "weight"), compliance=0.0)
FALL = Scene(bodies=(WEIGHT,), gravity=(0.0, 0.0, -10.0))
PENDULUM = Scene(bodies=(WEIGHT,), constraints=(ROD,), gravity=(0.0, 0.0, -10.0))


def box(name: str, **options: object) -> RigidBody:
    return RigidBody(name=name, mass=1.0, shape=Box((1.0, 1.0, 1.0)), **options)  # type: ignore[arg-type]


def test_an_adapter_answers_in_each_of_its_configurations() -> None:
    observe = {"end": Final(quantity=Position("weight"))}

    late = run(ENGINE, FALL, time_step=0.1, duration=2.0, observe=observe)
    middle = run(ENGINE, FALL, time_step=0.1, steps=20, configuration="middle", observe=observe)

    assert late["end"][2] == pytest.approx(-21.0, abs=1e-12)  # ½ g t² + ½ g t h
    assert middle["end"][2] == pytest.approx(-20.0, abs=1e-12)
    assert late.steps == 20
    assert late.state_hash != middle.state_hash


def test_an_unknown_configuration_is_answered_with_those_there_are() -> None:
    with pytest.raises(MethodError, match="late, middle"):
        run(ENGINE, FALL, time_step=0.1, steps=1, configuration="best")


@pytest.mark.parametrize(
    ("scene", "lack"),
    [
        (PENDULUM, "the joint distance"),
        (
            replace(FALL, forces=(Spring(name="s", between=((0, 0, 0), "weight"), stiffness=1.0),)),
            "force spring",
        ),
        (replace(PENDULUM, constraints=(replace(ROD, compliance=1e-3),)), "compliance of a joint"),
        (
            Scene(bodies=(solid("a", None, (0, 0, 0), inertia=((2, 0.5, 0), (0.5, 2, 0), (0, 0, 2))),)),
            "principal axes of inertia beside those of the body",
        ),
        (
            Scene(
                bodies=(
                    RigidBody(name="floor", motion="static", position=(0, 0, 0), shape=Plane()),
                    box("a", position=(0, 0, 1), material=Material(friction=0.5, restitution=0.5)),
                )
            ),
            "the shape plane, the shape box, friction, restitution",
        ),
    ],
)
def test_what_is_lacking_is_named_before_anything_runs(scene: Scene, lack: str) -> None:
    class Unrunnable(type(ENGINE)):  # type: ignore[misc]
        def record(self, task: object) -> None:
            raise AssertionError("it ran")

    with pytest.raises(NotSupported, match=lack):
        run(Unrunnable(), scene, time_step=0.1, steps=1)


def test_motors_loops_and_forces_that_are_not_shown() -> None:
    hinge = Hinge(name="axle", between=("world", "a"), motor=Motor(speed=1.0))
    lock = Lock(name="lock", between=("world", "a"))
    scene = Scene(bodies=(box("a", position=(0, 0, 0)),), constraints=(hinge, lock))
    can = Capabilities(joints=frozenset({Hinge, Lock}), shows=frozenset({ConstraintForce}), loops=False)
    observe = {"f": Final(quantity=ConstraintForce("lock")), "c": Final(quantity=ContactForce("a"))}

    lacking = unsupported(replace(can, shows_force_of=frozenset({Hinge})), scene, observe)

    assert lacking == (
        "a motor in a joint",
        "closed loops of joints",
        "the force of the joint lock",
        "the observable contact force",
    )
    assert unsupported(replace(can, motors=True, loops=True), scene, {"f": observe["f"]}) == ()


def test_the_engine_s_lack_its_configuration_s_and_its_adapter_s_are_told_apart() -> None:
    hinge = Hinge(name="axle", between=("world", "a"), motor=Motor(speed=1.0))
    lock = Lock(name="lock", between=("world", "a"))
    scene = Scene(bodies=(box("a", position=(0, 0, 0)),), constraints=(hinge, lock))
    can = Capabilities(joints=frozenset({Hinge}), motors=True, absent=frozenset({"the joint lock"}))
    adapter = SimpleNamespace(name="ours", capabilities=can)
    strict = Configuration(name="strict", reason="", lacks=("motors", "loops"))

    with pytest.raises(
        NotSupported,
        match=r"^ours \(strict\) does not support a motor in a joint, the joint lock, closed loops of joints$",
    ):
        refuse_unsupported(adapter, strict, scene, {})
    with pytest.raises(NotSupported, match=r"^our adapter cannot ask ours for the observable contact force$"):
        observe = {"c": Final(quantity=ContactForce("a"))}
        refuse_unsupported(adapter, strict, replace(scene, constraints=()), observe)


def test_a_body_alone_or_without_contacts_needs_no_shape() -> None:
    alone = Scene(bodies=(box("a", position=(0, 0, 0)),))
    two = Scene(bodies=(box("a", position=(0, 0, 0)), box("b", position=(3, 0, 0))), contacts=False)

    assert unsupported(Capabilities(), alone, {}) == ()
    assert unsupported(Capabilities(), two, {}) == ()
    assert unsupported(Capabilities(), replace(two, contacts=True), {}) == ("the shape box",)


def test_ours_is_found_by_either_name_and_by_its_module() -> None:
    assert find("spook") is find("engine") is find("spook_tracker.engine") is engine


def test_an_adapter_is_found_by_module_and_by_attribute(monkeypatch: pytest.MonkeyPatch) -> None:
    found = find("tests.toys.stepping_engine")

    assert isinstance(found, Peer)
    assert found.adapter is ENGINE
    assert find("tests.toys.stepping_engine:ENGINE").adapter is ENGINE
    assert found.build_info.version == "1.2.3"


def test_an_engine_in_the_folder_one_stands_in_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "engine_of_a_team.py").write_text("from tests.toys.stepping_engine import ENGINE\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))

    assert find("engine_of_a_team").adapter is ENGINE


def test_a_missing_engine_is_answered_with_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    monkeypatch.delitem(sys.modules, "spook_tracker.engine.peers.mujoco", raising=False)

    with pytest.raises(EngineMissing, match=r"pip install 'spook-tracker\[mujoco\]'"):
        find("mujoco")
    with pytest.raises(EngineMissing, match="name one of spook, mujoco"):
        find("no_such_engine_anywhere")


def test_a_library_that_is_not_built_is_answered_with_what_builds_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("TRACKER_BOX3D", str(tmp_path / "libspook_box3d.so"))
    monkeypatch.delitem(sys.modules, "spook_tracker.engine.peers.box3d", raising=False)

    with pytest.raises(EngineMissing, match=r"no libspook_box3d\.so in .*; build it with: \.ci/box3d"):
        find("box3d")


class Drowsy(Stepped):
    """A world that waits in each step and works in none."""

    name = "drowsy"
    configurations = (Configuration(name="slow", reason="it sleeps"),)

    def world(self, task: Task) -> Drowsy:
        return self

    def step(self, count: int) -> None:
        time.sleep(0.02 * count)

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros((1, 3)), np.zeros((1, 3))


def test_processor_time_leaves_out_what_an_engine_waited() -> None:
    answer = run(Drowsy(checkout=__file__), FALL, time_step=0.1, steps=3)

    assert answer.seconds >= 0.06
    assert 0.0 < answer.cpu_seconds < 0.5 * answer.seconds


@pytest.mark.parametrize("name", [*EXTRAS, *NODE, *BUILT])
def test_every_engine_tells_its_processor_time(name: str) -> None:
    try:
        engine_of_name = find(name)
    except EngineMissing as reason:
        pytest.skip(str(reason))
    body = RigidBody(name="weight", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.0))
    scene = Scene(bodies=(body,), gravity=(0.0, 0.0, -10.0))
    answer = engine_of_name.simulate(scene, time_step=1e-3, steps=4000)

    assert answer.seconds > 0.0
    assert answer.cpu_seconds > 0.0
