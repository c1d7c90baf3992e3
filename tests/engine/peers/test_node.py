"""Engines in JavaScript: one process an engine; a hang, a death and bad numbers are outcomes. Needs Node only."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import Hinge, RigidBody, Scene
from spook_tracker.engine.find import EngineMissing, find
from spook_tracker.engine.peers import node

BODY = {
    "position": [1.0, 2.0, 3.0],
    "orientation": [1.0, 0.0, 0.0, 0.0],
    "velocity": [4.0, 5.0, 6.0],
    "spin": [7.0, 8.0, 9.0],
}
needs_node = pytest.mark.skipif(shutil.which("node") is None, reason="Node is not installed")


def task(**changes: Any) -> dict[str, Any]:
    return {"bodies": [BODY], "steps": 10, "every_step": False} | changes


def script(folder: Path, text: str) -> Path:
    file = folder / "engine.mjs"
    loop = Path(node.__file__).with_name("loop.mjs").as_uri()
    file.write_text(f'import {{ serve }} from "{loop}"; serve(async (task) => {{ {text} }});')
    return file


@needs_node
def test_states_come_back_with_the_same_bits(tmp_path: Path) -> None:
    answer = """
        let done = 0;
        const state = () => Array.from({ length: 13 }, (_, i) => (13 * done + i + 1) / 3);
        return { state, step: () => { done += 1; } };
    """
    made = node.run(script(tmp_path, answer), task(), 5.0)

    assert made.samples.tolist() == [0, 10]
    assert made.positions[1, 0].tolist() == [131 / 3, 132 / 3, 133 / 3]
    assert made.angular_velocities[1, 0].tolist() == [141 / 3, 142 / 3, 143 / 3]
    assert (made.steps, made.status) == (10, "completed")
    assert made.seconds > 0.0


@needs_node
def test_a_process_answers_one_task_after_the_other_and_a_new_one_follows_a_death(tmp_path: Path) -> None:
    counting = """
        globalThis.tasks = (globalThis.tasks ?? 0) + 1;
        if (task.steps === 13) throw new RangeError("unlucky");
        console.log("a word that is no answer");
        return { state: () => [process.pid, globalThis.tasks, ...Array(11).fill(0)], step: () => {} };
    """
    engine = script(tmp_path, counting)
    first, second = (node.run(engine, task(), 30.0).positions[0, 0] for _ in range(2))
    assert (first[0], first[1], second[1]) == (second[0], 1.0, 2.0)

    with pytest.raises(node.NodeError, match="RangeError: unlucky"):
        node.run(engine, task(steps=13), 30.0)
    third = node.run(engine, task(), 30.0).positions[0, 0]
    assert third[0] != first[0]
    assert third[1] == 1.0


@needs_node
def test_a_task_longer_than_a_pipe_holds_arrives_whole(tmp_path: Path) -> None:
    text = "return { state: () => [task.names.length, ...Array(12).fill(0)], step: () => {} };"
    names = "ä" * 1_000_000
    for _ in range(2):
        made = node.run(script(tmp_path, text), task(names=names), 30.0)
        assert made.positions[0, 0, 0] == len(names)


@needs_node
def test_a_process_that_dies_idle_is_no_fault_of_the_next_task(tmp_path: Path) -> None:
    engine = script(tmp_path, "return { state: () => [process.pid, ...Array(12).fill(0)], step: () => {} };")
    pid = int(node.run(engine, task(), 30.0).positions[0, 0, 0])
    os.kill(pid, signal.SIGKILL)
    next(one for one in node._SERVED.values() if one._process.pid == pid)._process.wait(20.0)
    assert int(node.run(engine, task(), 30.0).positions[0, 0, 0]) != pid


@needs_node
def test_a_task_that_is_never_read_is_timed_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What hangs after its answer reads no task, and a pipe holds only the beginning of a large one."""
    monkeypatch.setattr(node, "GRACE", 0.5)
    text = "return { state: () => Array(13).fill(0), step: () => {}, free: () => { for (;;); } };"
    engine = script(tmp_path, text)
    assert node.run(engine, task(), 30.0).status == "completed"
    assert node.run(engine, task(names="x" * 1_000_000), 0.5).status == "timed_out"


@needs_node
@pytest.mark.skipif(sys.platform != "linux", reason="only Linux ends a process with its parent")
def test_a_process_ends_with_the_one_that_asked(tmp_path: Path) -> None:
    """Whether it waits for a task or never ends one; the parent is killed and tells it nothing."""
    engine = script(
        tmp_path, "if (task.steps === 1) for (;;); return { state: () => [process.pid], step: () => {} };"
    )
    for steps in (0, 1):
        asking = f"""
import json, os, signal, sys, threading
from pathlib import Path
from spook_tracker.engine.peers import node
served = node.Served(Path({str(engine)!r}))
print(served._process.pid, flush=True)
if {steps}:
    threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGKILL)).start()
served.answer({{"steps": {steps}, "every_step": False}}, None)
os.kill(os.getpid(), signal.SIGKILL)
"""
        done = subprocess.run([sys.executable, "-c", asking], stdout=subprocess.PIPE, text=True, timeout=60)
        assert done.returncode == -signal.SIGKILL
        pid = int(done.stdout)
        until = monotonic() + 20.0
        while Path(f"/proc/{pid}").exists() and monotonic() < until:
            sleep(0.02)
        assert not Path(f"/proc/{pid}").exists() or " Z " in Path(f"/proc/{pid}/stat").read_text()


@needs_node
def test_a_process_that_hangs_is_ended_and_timed_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(node, "GRACE", 0.5)
    made = node.run(script(tmp_path, "for (;;);"), task(), 0.5)

    assert made.status == "timed_out"
    assert "its process was ended" in made.failure
    assert made.positions.tolist() == [[BODY["position"]]], "where it was before"


@needs_node
@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("throw new TypeError('no such joint');", "ended with 1: TypeError: no such joint"),
        ("process.kill(process.pid, 'SIGKILL'); for (;;);", "ended with -9: it said nothing"),
        ("const all = []; for (;;) all.push(new Array(1e6).fill(1));", "FATAL ERROR"),
    ],
    ids=["raises", "is killed", "takes all memory"],
)
def test_a_process_that_dies_is_a_crash_that_says_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, said: str
) -> None:
    monkeypatch.setattr(node, "HEAP", 64)
    with pytest.raises(node.NodeError, match=said):
        node.run(script(tmp_path, text), task(), 30.0)


def swinging(count: int) -> Scene:
    """Bodies side by side, each about a hinge of its own 1 m above it."""
    bodies = [
        RigidBody(name=f"b{k}", mass=2.0, inertia=(0.5, 0.5, 0.5), position=(k + 0.1, 0.0, -1.0))
        for k in range(count)
    ]
    hinges = [
        Hinge(name=f"h{k}", between=("world", f"b{k}"), at=(float(k), 0.0, 0.0), axis=(0.0, 1.0, 0.0))
        for k in range(count)
    ]
    return Scene(bodies=tuple(bodies), constraints=tuple(hinges), gravity=(0.0, 0.0, -9.81))


@pytest.mark.parametrize("name", ["cannon", "jolt", "p2", "rapier"])
def test_what_a_process_answered_before_changes_no_bit(name: str) -> None:
    try:
        engine = find(name)
    except EngineMissing as reason:
        pytest.skip(str(reason))

    def answer(count: int, configuration: str) -> list[float]:
        run = engine.simulate(
            swinging(count), time_step=1 / 60, steps=5, observe={}, configuration=configuration
        )
        return [float(x) for state in run.final_state.values() for x in state]

    names = [configuration.name for configuration in engine.configurations]
    fresh = []
    for configuration in names:
        node._end_all()
        fresh.append(answer(2, configuration))
    answer(5, names[0])
    assert [answer(2, configuration) for configuration in names] == fresh


def test_a_missing_package_is_named_with_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv(node.FOLDER, raising=False)
    with pytest.raises(ImportError):
        node.package("no-such-engine")
    monkeypatch.setattr(node.shutil, "which", lambda name: None)
    with pytest.raises(ImportError, match="Node is not installed"):
        node.package("cannon-es")


@needs_node
def test_a_package_is_found_here_above_or_where_it_is_said_to_be(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "node_modules" / "an-engine"
    folder.mkdir(parents=True)
    (folder / "package.json").write_text(json.dumps({"version": "1.2.3", "module": "dist/engine.js"}))
    below = tmp_path / "a" / "b"
    below.mkdir(parents=True)
    monkeypatch.chdir(below)
    monkeypatch.delenv(node.FOLDER, raising=False)

    assert node.package("an-engine") == folder
    assert node.facts(folder)["version"] == "1.2.3"
    assert node.entry(folder) == (folder / "dist" / "engine.js").as_uri()
    monkeypatch.chdir("/")
    monkeypatch.setenv(node.FOLDER, str(tmp_path / "node_modules"))
    assert node.package("an-engine") == folder


@pytest.mark.parametrize(("name", "way"), [("cannon", "npm install cannon-es"), ("exudyn", "pip install")])
def test_an_engine_that_is_not_installed_says_how_to_install_it(
    name: str, way: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing(module: str) -> Any:
        raise ImportError("there is none")

    monkeypatch.setattr("spook_tracker.engine.find.importlib.import_module", missing)
    with pytest.raises(EngineMissing, match=way):
        find(name)


def test_nothing_is_kept_of_a_run_without_an_answer_but_its_start() -> None:
    made = node._nothing(task(every_step=True), "late")

    assert made.velocities.tolist() == [[BODY["velocity"]]]
    assert np.array_equal(made.samples, [0])
