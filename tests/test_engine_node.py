"""Engines in JavaScript: one process a simulation; a hang, a death and bad numbers are outcomes. Needs Node only."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

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
    file.write_text(text)
    return file


@needs_node
def test_states_come_back_with_the_same_bits(tmp_path: Path) -> None:
    answer = """
        import { readFileSync, writeSync } from "node:fs";
        const task = JSON.parse(readFileSync(0, "utf8"));
        const states = Float64Array.from({ length: 26 }, (_, i) => (i + 1) / 3);
        const head = { kept: 2, steps: task.steps, status: "completed", failure: "", seconds: 0.5, setup_seconds: 0.25 };
        writeSync(1, JSON.stringify(head) + "\\n");
        writeSync(1, Buffer.from(states.buffer));
    """
    made = node.run(script(tmp_path, answer), task(), 5.0)

    assert made.samples.tolist() == [0, 10]
    assert made.positions[1, 0].tolist() == [14 / 3, 15 / 3, 16 / 3]
    assert made.angular_velocities[1, 0].tolist() == [24 / 3, 25 / 3, 26 / 3]
    assert (made.steps, made.seconds, made.setup_seconds) == (10, 0.5, 0.25)


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
