"""Asks an installed wheel for a night of a team's own questions: without extras, without a compiler, beside packages of
theirs that are called engine, tracker, scalar_tests and migrations.

    python tests/installed_wheel.py      # the Python of the environment where it is installed

Needs nothing but that environment: cibuildwheel runs it on each wheel of a release, `make package` on its own.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

THEIRS = ("engine", "tracker", "scalar_tests", "migrations")
ASKS = """
import engine, tracker, scalar_tests, migrations
for module in (engine, tracker, scalar_tests, migrations):
    assert module.OWNER == "the team", module
from spook_tracker import engine as ours
import spook_tracker.tracker, spook_tracker.scalar_tests.case
assert ours.Scene is not None and not hasattr(engine, "Scene")
print(ours.__file__)
"""
QUESTIONS = """
import numpy as np
from spook_tracker.engine import Final, Particle, Position, Scene
from spook_tracker.scalar_tests.case import Example, Measurement, Metric, ScalarTest

SCENE = Scene(bodies=(Particle(name="stone", position=(0, 0, 0), mass=1.0),), gravity=(0, 0, -10.0))

def measure(simulate):
    end = simulate(SCENE, time_step=0.1, duration=1.0, observe={"end": Final(quantity=Position("stone"))})["end"]
    return {"error": float(end[2]) + 5.0}

ERROR = Metric(name="error", description="depth minus ½ g t²", unit="m", role="gate", limit=0.6)
FALL = ScalarTest(
    title="Fall", question="How far does it fall?", why="", model="", parameters=(), theory=(), reference="",
    conclusion="", source="", example=lambda: Example(scene=SCENE, time_step=0.1),
    measurements=(Measurement(configuration="plain", time_step=0.1, metrics=(ERROR,), measure=measure),),
)
CATALOGUE = {"fall": FALL}
"""


def lay_out(folder: Path) -> None:
    """A team's folder: packages under names of ours, a question, and what is tracked."""
    for name in THEIRS:
        (folder / name).mkdir()
        (folder / name / "__init__.py").write_text('OWNER = "the team"\n')
    (folder / "questions.py").write_text(QUESTIONS, encoding="utf-8")
    (folder / "tracker.toml").write_text('catalogue = "questions"\ntitle = "Ours"\n')


def run(folder: Path, programs: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """A program of the environment, with nothing else in PATH."""
    environment = {"PATH": str(programs), "PYTHONPATH": str(folder), "HOME": str(folder)}
    command = [str(programs / words[0]), *words[1:]]
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, encoding="utf-8", check=False
    )


def ask(folder: Path, programs: Path) -> None:
    """A night of theirs, its website, and what an installation without extras says of what it lacks."""

    def said(*words: str) -> str:
        done = run(folder, programs, *words)
        assert done.returncode == 0, (words, done.stdout, done.stderr)
        return done.stdout

    assert Path(said("python", "-c", ASKS)).is_relative_to(programs.parent)
    assert said("python", "-m", "spook_tracker", "--version") == said("tracker", "--version")
    said("tracker", "nightly", "--out", "public", "--workers", "2")  # spawned workers import by name
    assert "Ours" in (folder / "public" / "index.html").read_text(encoding="utf-8")
    assert "error" in said("tracker", "trend", "fall")
    said("tracker", "compare", "latest", "latest")
    said("tracker", "db", "check")


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(os.path.realpath(name))
        lay_out(folder)
        ask(folder, Path(sys.executable).parent)
    print("a night, a trend, a comparison and a website of a team's own question, with nothing else in PATH")


if __name__ == "__main__":
    main()
