"""A team's nights from the first on, by the reusable workflow's own steps in a scratch repository.

First night, a regression, a pull request that does not help and one that does, recovery. The workflows themselves
are read by an auditor.
"""

from __future__ import annotations

import lzma
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.places import ROOT
from tests.warm import command

yaml = pytest.importorskip("yaml", reason="PyYAML is not installed here")
from tests.team.repository import BUILD, GRAVITY, git, needs_compiler  # noqa: E402
from tests.team.workflow_service import Service  # noqa: E402 (needs yaml)

ACTION = ROOT / "action.yml"
TRACK = ROOT / ".github" / "workflows" / "track.yml"
EXAMPLE = ROOT / "examples" / "pebble"
THEIRS = "cmake -S . -B build && cmake --build build"  # as tests/team/test_own_engine.py builds it; here the compiler alone
GH = """#!/bin/sh
# The comments of one pull request as a file; the calls that change it are remembered.
case "$*" in
  *PATCH*|*DELETE*|*body=*) echo "$@" >> {folder}/gh.log ;;
  *) [ ! -s {folder}/comment ] || echo 41 ;;
esac
case "$*" in
  *DELETE*) rm {folder}/comment ;;
  *body=*) cp body.md {folder}/comment ;;
esac
"""
AUDITOR = Path(sys.executable).with_name("zizmor")


class Team:
    """A clone to work in, the place it is pushed to, and the service that watches there; the settings are those of the
    example up to the table `first_left_out`."""

    def __init__(self, folder: Path, first_left_out: str = "[limits]") -> None:
        self.clone = folder / "pebble"
        ignored = shutil.ignore_patterns("build", "public", "__pycache__", "*.db*")
        shutil.copytree(EXAMPLE, self.clone, ignore=ignored)
        settings = self.clone / "tracker.toml"
        assert THEIRS in settings.read_text()
        said = settings.read_text().replace(",standard", "").replace(THEIRS, BUILD)
        settings.write_text(said.partition(first_left_out)[0])
        git(self.clone, "init", "-q", "-b", "main")
        self.commit("Throw stones")
        self.origin = folder / "origin.git"
        git(folder, "clone", "-q", "--bare", str(self.clone), str(self.origin))
        git(self.clone, "remote", "add", "origin", str(self.origin))
        programs = folder / "programs"
        programs.mkdir()
        pip = f'echo "$PIP_CONSTRAINT" "$@" >> {folder}/pip.log'
        for name, script in (("pip", f"#!/bin/sh\n{pip}\n"), ("gh", GH.format(folder=folder))):
            (programs / name).write_text(script)
            (programs / name).chmod(0o755)
        command(programs / "tracker")
        self.service = Service(self.origin, folder / "ci", programs)

    def commit(self, subject: str) -> str:
        git(self.clone, "add", ".")
        git(self.clone, "commit", "-q", "-m", subject)
        return git(self.clone, "rev-parse", "HEAD")

    def change(self, subject: str, branch: str, old: str, new: str) -> str:
        git(self.clone, "checkout", "-q", "-B", branch)
        source = self.clone / "src" / "pebble.cpp"
        text = source.read_text()
        assert old in text
        source.write_text(text.replace(old, new))
        found = self.commit(subject)
        git(self.clone, "push", "-q", "origin", branch)
        return found

    def night(self) -> dict:
        told = f'cp "$SUMMARY" "{self.clone.parent}/notified.md"'
        return self.service.run(
            TRACK, "schedule", "main", build=BUILD, options="--quick --workers 1", notify=told
        )

    def pull_request(self, branch: str, ended: dict | None = None, **inputs: str) -> dict:
        quick = {"change-options": "--quick --workers 1"}  # run times: tests/tracker/test_pairs.py
        return self.service.run(TRACK, "pull_request", branch, ended, build=BUILD, **quick, **inputs)

    def months(self) -> dict[str, int]:
        """Runs in each file of the history's branch."""
        names = git(self.origin, "ls-tree", "--name-only", "tracker-history").splitlines()
        shown = {
            name: subprocess.run(
                ["git", "show", f"tracker-history:{name}"], cwd=self.origin, capture_output=True, check=True
            ).stdout
            for name in names
        }
        return {name: len(lzma.decompress(content).splitlines()) for name, content in shown.items()}


@needs_compiler
def test_first_night_regression_pull_requests_and_recovery(tmp_path: Path) -> None:
    team = Team(tmp_path)

    first = team.night()
    assert {name: job.result for name, job in first.items()} == {
        "night": "success", "keep": "success", "publish": "success", "verdict": "success", "change": "skipped",
        "comment": "skipped",
    }, first["night"].log  # fmt: skip
    assert "measured for the first time" in first["night"].summary
    assert list(team.months().values()) == [1]
    assert not (tmp_path / "notified.md").exists(), "a green night notifies"

    bad = team.change(
        "Pull a little harder", "main", GRAVITY, GRAVITY.replace("time_step", "1.01 * time_step")
    )
    red = team.night()
    assert (red["night"].result, red["publish"].result) == ("success", "success"), "the site comes out first"
    assert red["verdict"].result == "failure"
    assert "throw/default/height\\_error" in red["night"].summary
    assert bad[:10] in red["night"].summary
    assert (tmp_path / "notified.md").read_text() == red["night"].summary
    assert re.search(r"^::error title=throw%3A .*height_error", red["night"].log, re.MULTILINE)
    assert list(team.months().values()) == [2]

    team.change("Pull harder still", "worse", "1.01 * time_step", "1.02 * time_step")
    worse = team.pull_request("worse")
    assert worse["comment"].result == "success", worse["comment"].log
    told = (tmp_path / "comment").read_text()
    assert told.startswith("<!-- tracker: what became worse -->\n**✗ ")
    assert f"worse than at pebble {bad[:7]}" in told.replace("\\", "") or bad[:7] in told
    team.pull_request("worse", {name: job for name, job in worse.items() if name != "comment"})
    calls = (tmp_path / "gh.log").read_text().splitlines()
    assert [("PATCH" in call, "issues/7/comments" in call) for call in calls] == [
        (False, True),
        (True, False),
    ]
    assert worse["change"].result == "failure"
    assert worse["night"].result == "skipped"
    assert "**regressed**" in worse["change"].summary
    assert "::error title=pebble became worse::" in worse["change"].log

    git(team.clone, "checkout", "-q", "main")
    team.change("Pull as it should", "mend", "1.01 * time_step", "time_step")
    mended = team.pull_request("mend", base="last-green")
    assert not (tmp_path / "comment").exists(), "nothing is worse: the comment is taken back"
    assert mended["change"].result == "success", mended["change"].log
    assert "**identical**" in mended["change"].summary
    assert list(team.months().values()) == [2], "a proposed change is not kept"

    git(team.clone, "checkout", "-q", "main")
    git(team.clone, "merge", "-q", "--no-ff", "-m", "Merge the mending", "mend")
    git(team.clone, "push", "-q", "origin", "main")
    well = team.night()
    assert well["verdict"].result == "success"
    assert "::error" not in well["night"].log
    assert list(team.months().values()) == [3]
    assert len(git(team.origin, "log", "--format=%h", "tracker-history").splitlines()) == 3


@needs_compiler
def test_the_composite_action_measures_a_night_and_a_change(tmp_path: Path) -> None:
    """Nothing says how commits are built: a change is compared with the history, which the action is given."""
    team = Team(tmp_path, "[build]")

    first = team.service.act(ACTION, "schedule", "main", BUILD, constraints="pins.txt")

    assert first.result == "success", first.log
    assert "measured for the first time" in first.summary
    assert (first.workspace / "public" / "index.html").is_file()
    history = first.workspace / "history"
    assert [path.name.endswith(".jsonl.xz") for path in history.iterdir()] == [True]
    installed = (tmp_path / "pip.log").read_text()
    assert installed.startswith("pins.txt install --quiet spook-tracker[standard]")

    team.change("Pull harder", "worse", GRAVITY, GRAVITY.replace("time_step", "1.02 * time_step"))
    worse = team.service.act(ACTION, "pull_request", "worse", BUILD, history, comment="said.md")

    assert worse.result == "failure"
    assert "**regressed**" in worse.summary
    assert "worse than at pebble" in (worse.workspace / "said.md").read_text()
    assert not (worse.workspace / "public").exists()


WORKFLOWS = [*sorted((ROOT / ".github" / "workflows").glob("*.yml")), ROOT / "action.yml"]


@pytest.mark.skipif(not AUDITOR.exists(), reason="zizmor is not installed here")
def test_the_auditor_finds_nothing_in_the_workflows() -> None:
    command = [
        str(AUDITOR),
        "--offline",
        "--config",
        ".github/zizmor.yml",
        ".github",
        "action.yml",
        "examples",
    ]

    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stdout
    assert "No findings" in done.stdout + done.stderr


@pytest.mark.skipif(not AUDITOR.exists(), reason="zizmor is not installed here")
def test_the_auditor_would_find_an_action_by_tag(tmp_path: Path) -> None:
    workflow = (ROOT / ".github" / "workflows" / "nightly.yml").read_text()
    (tmp_path / "w.yml").write_text(re.sub(r"(actions/cache)@\w+", r"\1@v5", workflow))

    done = subprocess.run(
        [str(AUDITOR), "--offline", str(tmp_path / "w.yml")], capture_output=True, check=False
    )

    assert done.returncode != 0


@pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda path: path.name)
def test_every_action_is_pinned_by_hash_with_its_version_beside_it(workflow: Path) -> None:
    for line in workflow.read_text().splitlines():
        if "uses:" in line and "OWNER" not in line:
            assert re.search(r"uses: [\w./-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+$", line), line


def test_whatever_may_write_installs_and_builds_nothing() -> None:
    for workflow in WORKFLOWS[:-1]:
        said = yaml.safe_load(workflow.read_text())
        assert said["permissions"] in ({}, {"contents": "read"}), workflow.name
        for name, job in said["jobs"].items():
            if "write" in job.get("permissions", {}).values():
                shell = " ".join(step.get("run", "") for step in job["steps"])
                assert not re.search(r"\b(pip|make|cmake|npm|python)\b", shell), (workflow.name, name)


def test_the_targets_that_workflows_make_are_there() -> None:
    rules = re.findall(r"^([\w-]+(?: [\w-]+)*):", (ROOT / "Makefile").read_text(), re.MULTILINE)
    targets = {name for names in rules for name in names.split()}
    weekly = yaml.safe_load((ROOT / ".github" / "workflows" / "weekly.yml").read_text())

    made = set(weekly["jobs"]["heavy"]["strategy"]["matrix"]["target"])
    for workflow in WORKFLOWS[:-1]:
        made |= set(re.findall(r"\bmake ([a-z][\w-]*)", workflow.read_text().replace('"$TARGET"', "")))

    assert made - targets == set()


def test_the_template_for_gitlab_is_yaml_and_shell() -> None:
    said = yaml.safe_load((ROOT / "examples" / "gitlab" / ".gitlab-ci.yml").read_text())

    for job in said.values():
        for line in (*job.get("before_script", ()), *job.get("script", ())):
            assert isinstance(line, str), line
            subprocess.run(["bash", "-n", "-c", line], check=True)


def test_the_template_for_gitlab_names_one_image_and_one_tracker() -> None:
    said = yaml.safe_load((ROOT / "examples" / "gitlab" / ".gitlab-ci.yml").read_text())

    assert re.fullmatch(r"python:3\.\d+\.\d+-\w+@sha256:[0-9a-f]{64}", said["variables"]["IMAGE"]), (
        "its bytes"
    )
    assert {job.get("image", "$IMAGE") for job in said.values() if isinstance(job, dict)} == {"$IMAGE"}
    assert said["variables"]["TRACKER"].startswith("spook-tracker[standard]")


def test_a_team_needs_ten_lines() -> None:
    lines = (EXAMPLE / ".github" / "workflows" / "physics.yml").read_text().splitlines()

    assert len(lines) <= 10
    given = yaml.safe_load("\n".join(lines))["jobs"]["track"]["with"]
    assert set(given) <= set(yaml.safe_load(TRACK.read_text())[True]["workflow_call"]["inputs"])
