"""What is installed: one name, complete, beside a team's own packages called engine, tracker and scalar_tests.

The wheel here is made without compiling: its binary is the one of this environment, so that the test takes
seconds. `make package` builds the real one from the archive of the sources and asks it the same.
"""

from __future__ import annotations

import importlib.metadata
import os
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import venv
import zipfile
from pathlib import Path

import pytest

from spook_tracker.engine import _core

backend = pytest.importorskip("scikit_build_core.build", reason="the build backend is not installed here")

ROOT = Path(__file__).resolve().parents[1]
REAL = os.environ.get("SPOOK_TEST_REAL_WHEEL") == "1"
FOLDERS = ("engine", "scalar_tests", "tracker", "migrations", "site")
THEIRS = ("engine", "tracker", "scalar_tests", "migrations")
ASKS = """
import engine, tracker, scalar_tests, migrations
for module in (engine, tracker, scalar_tests, migrations):
    assert module.OWNER == "the team", module
from spook_tracker import engine as ours
import spook_tracker.tracker, spook_tracker.scalar_tests.catalogue
assert ours.Scene is not None and not hasattr(engine, "Scene")
print(ours.__file__)
"""


def tracked() -> set[str]:
    """Every file of this tree that git knows, or would if it were added."""
    done = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    if done.returncode:
        pytest.skip("not a clone, so nobody says which files belong to it")
    return {name for name in done.stdout.splitlines() if (ROOT / name).is_file()}


def built(kind: str, folder: Path, tree: Path = ROOT) -> Path:
    """An archive of a tree, made in a process of its own: the backend changes folders."""
    code = "import sys; from scikit_build_core import build; "
    code += (
        "build.build_sdist(sys.argv[1])"
        if kind == "sdist"
        else f"build.build_wheel(sys.argv[1], {{}} if {REAL} else {{'wheel.cmake': 'false', 'wheel.platlib': 'true'}})"
    )
    folder.mkdir()
    done = subprocess.run(
        [sys.executable, "-c", code, str(folder)], cwd=tree, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    (archive,) = folder.iterdir()
    return archive


def test_the_archive_of_sources_holds_each_file_once(tmp_path: Path) -> None:
    """The folders are linked below the installed name: archived once, there, as files and not as links."""
    wanted = {f"spook_tracker/{name}" if name.split("/")[0] in FOLDERS else name for name in tracked()}

    with tarfile.open(built("sdist", tmp_path / "sdist")) as archive:
        members = archive.getmembers()

    names = {member.name.partition("/")[2] for member in members}
    assert len(names) == len(members)
    assert all(member.isfile() for member in members)
    assert names - wanted == {"PKG-INFO"}
    assert wanted - names == set()


def unpacked(archive: Path, folder: Path) -> Path:
    """The tree in an archive."""
    shutil.unpack_archive(archive, folder, filter="data")
    (tree,) = folder.iterdir()
    return tree


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An environment with the wheel, and the dependencies of this one: the network is not asked."""
    folder = tmp_path_factory.mktemp("installed")
    tree = unpacked(built("sdist", folder / "sdist"), folder / "sources") if REAL else ROOT
    wheel = built("wheel", folder / "dist", tree)
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    wanted = {f"spook_tracker/{name}" for name in tracked() if name.split("/")[0] in FOLDERS}
    wanted = {name for name in wanted if not name.startswith("spook_tracker/engine/native/")}
    assert wanted - names == set()
    assert "spook_tracker/py.typed" in names  # type checkers of a team see our types
    assert {name.split("/")[0].partition("-")[0] for name in names} == {"spook_tracker"}

    place = folder / "environment"
    venv.create(place, with_pip=False, symlinks=True)
    python = place / "bin" / "python"
    install = ["-m", "pip", "--python", str(python), "install", "-q", "--no-deps", "--no-index", str(wheel)]
    subprocess.run([sys.executable, *install], check=True, capture_output=True)
    site = next(place.glob("lib/python3*/site-packages"))
    if not REAL:
        shutil.copy(str(_core.__file__), site / "spook_tracker" / "engine")
    (site / "dependencies.pth").write_text(f"{sysconfig.get_path('purelib')}\n")  # its own .pth stay unread
    for name in THEIRS:
        (site / name).mkdir()
        (site / name / "__init__.py").write_text('OWNER = "the team"\n')
    return place


@pytest.mark.skipif(sys.platform == "win32", reason="environments look different there")
def test_it_works_beside_a_teams_own_engine_tracker_and_scalar_tests(installed: Path, tmp_path: Path) -> None:
    for name in THEIRS:  # once more in the folder they work in
        shutil.copytree(next(installed.glob(f"lib/*/site-packages/{name}")), tmp_path / name)
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "TRACKER"))
    }

    def said(*command: str) -> str:
        done = subprocess.run(
            [str(installed / "bin" / command[0]), *command[1:]],
            cwd=tmp_path, env=environment, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, (command, done.stdout, done.stderr)
        return done.stdout

    assert said("python", "-c", ASKS).startswith(str(installed))
    assert said("python", "-m", "spook_tracker", "--version") == said("tracker", "--version")
    said("tracker", "run", "falling_object", "--workers", "2")  # spawned workers import by name
    assert "falling_object" in said("tracker", "trend", "falling_object")
    said("tracker", "publish", "--out", "public")
    assert (tmp_path / "public" / "index.html").is_file()
    said("tracker", "db", "check")


HIDDEN = """
import sys

class Hidden:
    \"\"\"What an installation without extras has not.\"\"\"

    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("scipy", "pandas", "plotly", "distributed", "fastparquet"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Hidden())
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


@pytest.mark.skipif(sys.platform == "win32", reason="environments look different there")
def test_a_night_of_a_teams_own_questions_needs_no_extra_and_no_compiler(
    installed: Path, tmp_path: Path
) -> None:
    """Without SciPy, pandas and Plotly, and with nothing in PATH but the environment itself."""
    shutil.copytree(next(installed.glob("lib/*/site-packages/engine")), tmp_path / "engine")
    (tmp_path / "sitecustomize.py").write_text(HIDDEN)
    (tmp_path / "questions.py").write_text(QUESTIONS)
    (tmp_path / "tracker.toml").write_text('catalogue = "questions"\ntitle = "Ours"\n')
    environment = {"PATH": str(installed / "bin"), "PYTHONPATH": str(tmp_path), "HOME": str(tmp_path)}

    def tracker(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [str(installed / "bin" / "tracker"), *words],
            cwd=tmp_path, env=environment, capture_output=True, text=True, check=False,
        )  # fmt: skip

    night = tracker("nightly", "--out", "public")
    standard = tracker("list", "--catalogue", "standard")
    table = tracker("export", "--format", "csv", "--out", "x.csv")

    assert night.returncode == 0, night.stderr
    assert "Ours" in (tmp_path / "public" / "index.html").read_text(encoding="utf-8")
    assert standard.returncode == table.returncode == 2
    assert "pip install 'spook-tracker[standard]'" in standard.stderr
    assert "spook-tracker[data]" in table.stderr
    assert not {"scipy", "pandas", "plotly"} & {
        name.partition(">")[0]
        for name in importlib.metadata.requires("spook-tracker") or ()
        if "extra" not in name
    }
