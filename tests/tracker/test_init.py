"""`tracker init`: what it writes is run as a team would run it, by the workflow's own steps."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from tests.places import ROOT

yaml = pytest.importorskip("yaml", reason="PyYAML is not installed here")
from click.testing import CliRunner, Result  # noqa: E402

from spook_tracker.engine.build_info import build_info  # noqa: E402
from spook_tracker.tracker.beginning import Home, first_files, home  # noqa: E402
from spook_tracker.tracker.cli.main import main  # noqa: E402
from tests.team.repository import git  # noqa: E402
from tests.team.workflow_service import Service  # noqa: E402 (needs yaml)

TRACK = ROOT / ".github" / "workflows" / "track.yml"
# What the adapter can be asked, and a scene each of bodies, contacts and constraints that it cannot.
SOME = """from spook_tracker.scalar_tests.catalogue import CATALOGUE as ALL
CATALOGUE = {name: ALL[name] for name in ("falling_object", "pendulum", "spinning_top", "resting_stack", "oscillator_spring")}
"""
WRITTEN = ["tracking/__init__.py", "tracker.toml", ".github/workflows/physics.yml", "tracking/adapter.py"]


def init(folder: Path, monkeypatch: pytest.MonkeyPatch, *words: str) -> Result:
    monkeypatch.chdir(folder)
    return CliRunner().invoke(main, ["init", *words])


def called(folder: Path) -> dict:
    """What the written workflow hands to the reusable one."""
    return yaml.safe_load((folder / ".github" / "workflows" / "physics.yml").read_text())["jobs"]["track"]


def test_the_first_night_is_green_and_a_planted_breach_red(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both nights run by the workflow that was written: its inputs, and the steps of the workflow it calls."""
    clone, origin, programs = tmp_path / "marble", tmp_path / "origin.git", tmp_path / "programs"
    clone.mkdir()
    assert init(clone, monkeypatch, "marble", "--build", "true").exit_code == 0
    (clone / "tracking" / "some.py").write_text(SOME)
    git(clone, "init", "-q", "-b", "main")
    git(clone, "add", ".")
    git(clone, "commit", "-q", "-m", "Begin")
    git(tmp_path, "clone", "-q", "--bare", str(clone), str(origin))
    programs.mkdir()
    for name, line in (("pip", ":"), ("tracker", f'exec {sys.executable} -m spook_tracker "$@"')):
        (programs / name).write_text(f"#!/bin/sh\n{line}\n")
        (programs / name).chmod(0o755)
    for name in [name for name in os.environ if name.startswith("TRACKER")]:
        monkeypatch.delenv(name)
    service = Service(origin, tmp_path / "ci", programs)
    given = called(clone)["with"] | {"options": "--quick --workers 1 --catalogue tracking.some"}

    first = service.run(TRACK, "schedule", "main", **given)
    adapter = clone / "tracking" / "adapter.py"
    right = "self.velocities += self.time_step * self.gravity"
    assert right in adapter.read_text()
    adapter.write_text(adapter.read_text().replace(right, f"{right} * 1.001"))
    git(clone, "commit", "-q", "-a", "-m", "Pull a little harder")
    git(clone, "push", "-q", str(origin), "main")
    second = service.run(TRACK, "schedule", "main", **given)

    assert first["verdict"].result == "success", first["night"].log
    assert "falling_object" in first["night"].log
    assert "measured for the first time" in first["night"].summary
    assert second["publish"].result == "success", second["night"].log
    assert second["verdict"].result == "failure"
    assert "falling\\_object/default/position\\_error" in second["night"].summary
    assert git(clone, "rev-parse", "HEAD")[:10] in second["night"].summary


def test_the_workflow_is_pinned_to_this_tracker_and_gives_only_inputs_that_there_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "CMakeLists.txt").touch()
    told = init(tmp_path, monkeypatch, "marble", "--tracker", "https://example.org/us/spook-tracker")
    job, declared = called(tmp_path), yaml.safe_load(TRACK.read_text())[True]["workflow_call"]["inputs"]
    pebble = yaml.safe_load((ROOT / "examples/pebble/.github/workflows/physics.yml").read_text())
    commit = build_info.git_hash or "main"

    assert told.output.splitlines()[0] == f"wrote {', '.join(WRITTEN)}"
    assert job["uses"] == f"us/spook-tracker/.github/workflows/track.yml@{commit}"
    assert job["with"]["tracker"].endswith(f"@ git+https://example.org/us/spook-tracker@{commit}")
    assert set(job["with"]) <= set(declared)
    assert job["permissions"] == pebble["jobs"]["track"]["permissions"]
    build = "cmake -S . -B build && cmake --build build"
    assert job["with"]["build"] == build
    assert tomllib.loads((tmp_path / "tracker.toml").read_text())["build"]["command"] == build


def test_a_release_is_installed_by_its_number() -> None:
    workflow = first_files("marble", "", Home("https://example.org/us/it", "a" * 40, "1.2.3"))[WRITTEN[2]]

    assert yaml.safe_load(workflow)["jobs"]["track"]["with"]["tracker"] == "spook-tracker[standard]==1.2.3"


@pytest.mark.parametrize(
    ("engine", "build", "extras"),
    [
        ("spook", "", "standard"),
        ("mujoco", "", "standard,mujoco"),
        ("cannon", "npm install cannon-es", "standard"),
    ],
)
def test_an_engine_that_is_known_needs_no_adapter(
    engine: str, build: str, extras: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert init(tmp_path, monkeypatch, engine).exit_code == 0
    given = called(tmp_path)["with"]

    assert not (tmp_path / "tracking").exists()
    assert tomllib.loads((tmp_path / "tracker.toml").read_text())["engine"] == engine
    assert given["tracker"].startswith(f"spook-tracker[{extras}]")
    assert given.get("build", "") == build
    if engine == "spook":
        shown = CliRunner().invoke(main, ["run", "falling_object"])
        assert shown.exit_code == 0, shown.output
        assert (tmp_path / "history.db").is_file()


@pytest.mark.parametrize("kept", WRITTEN[1:])
def test_what_is_there_is_not_written_over_and_nothing_else_is_written(
    kept: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / kept).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / kept).write_text("# ours\n")

    refused = init(tmp_path, monkeypatch, "marble")

    assert refused.exit_code == 2
    assert refused.output == (
        f"tracker: {kept} is there already; nothing is written over, and nothing was written\n"
    )
    assert [str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*") if p.is_file()] == [kept]
    assert (tmp_path / kept).read_text() == "# ours\n"


@pytest.mark.parametrize(("name", "says"), [("../up", "is no name of an engine"), ("box3d", "checkout")])
def test_a_name_that_cannot_be_is_refused_in_a_sentence(
    name: str, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refused = init(tmp_path, monkeypatch, name)

    assert (refused.exit_code, len(refused.output.splitlines())) == (2, 1)
    assert says in refused.output
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("stands", [".github", "tracking", ".github/workflows"])
def test_where_one_file_cannot_be_written_none_is(
    stands: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file stands where a folder should; once it is away, the same command goes on from the beginning."""
    (tmp_path / stands).parent.mkdir(exist_ok=True)
    (tmp_path / stands).write_text("ours\n")
    before = sorted(tmp_path.rglob("*"))

    refused = init(tmp_path, monkeypatch, "marble")

    assert (refused.exit_code, len(refused.output.splitlines())) == (2, 1)
    assert "nothing was written" in refused.output
    assert sorted(tmp_path.rglob("*")) == before
    (tmp_path / stands).unlink()
    assert init(tmp_path, monkeypatch, "marble").exit_code == 0


def test_a_link_to_nowhere_is_there_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "tracker.toml").symlink_to(tmp_path / "elsewhere.toml")

    assert "tracker.toml is there already" in init(tmp_path, monkeypatch, "marble").output
    assert [path.name for path in tmp_path.iterdir()] == ["tracker.toml"]


@pytest.mark.parametrize(
    "url",
    ["not a url", 'https://h.example/a/b"', "https://us:secret@h.example/a/b", "https://h.example/a", "https://h.example/a/b\n"],
)  # fmt: skip
def test_an_address_that_no_workflow_can_call_is_refused(
    url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refused = init(tmp_path, monkeypatch, "marble", "--tracker", url)

    assert refused.exit_code == 2
    assert "is no address of a repository" in refused.output
    assert not list(tmp_path.iterdir())


def test_a_folder_of_adapters_that_is_there_keeps_what_it_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "tracking").mkdir()
    (tmp_path / "tracking" / "__init__.py").write_text("# ours\n")

    assert init(tmp_path, monkeypatch, "marble").exit_code == 0
    assert (tmp_path / "tracking" / "__init__.py").read_text() == "# ours\n"


def test_where_the_sources_are_kept_is_said_once() -> None:
    """In pyproject.toml, which the installed package tells, and in the example that a reader copies: both alike."""
    told = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["urls"]
    place = urlsplit(told["Source"]).path.strip("/")
    example = yaml.safe_load((ROOT / "examples/pebble/.github/workflows/physics.yml").read_text())
    listed = subprocess.run(
        ["git", "grep", "-l", "OWNER/", "--", ":!tests", ":!*.min.js"], cwd=ROOT, capture_output=True, text=True, check=False
    )  # fmt: skip

    assert all(url.startswith(told["Source"]) for url in told.values())
    assert example["jobs"]["track"]["uses"] == f"{place}/.github/workflows/track.yml@HASH"
    assert set(listed.stdout.split()) <= {"pyproject.toml", "examples/pebble/.github/workflows/physics.yml"}
    assert home("").url == told["Source"]
