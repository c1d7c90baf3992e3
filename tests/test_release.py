"""A release is checked, dated, tagged, and from then on the level that drift is measured against."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

import pytest

from spook_tracker.engine.build_info import _version
from tests.places import ROOT, TOYS

WHO = {
    "GIT_AUTHOR_NAME": "Ada Example", "GIT_AUTHOR_EMAIL": "ada@example.org",
    "GIT_COMMITTER_NAME": "Ada Example", "GIT_COMMITTER_EMAIL": "ada@example.org",
    "GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_SYSTEM": os.devnull,
}  # fmt: skip


class Clone:
    """A clone of this repository in which one may release."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def run(self, *command: str, **more: str) -> subprocess.CompletedProcess[str]:
        environment = os.environ | WHO | more
        return subprocess.run(
            command, cwd=self.folder, env=environment, capture_output=True, text=True, check=False
        )

    def git(self, *arguments: str) -> str:
        done = self.run("git", *arguments)
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    def commit(self, subject: str) -> str:
        self.git("commit", "-q", "--allow-empty", "-m", subject)
        return self.git("rev-parse", "HEAD")

    def release(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        return self.run("sh", ".ci/release", *arguments)

    def version(self) -> str:
        """What an engine built here would call itself."""
        facts = dict.fromkeys(("version", "describe", "count"), "")
        facts |= {"git_hash": self.git("rev-parse", "HEAD"), "dirty": "false", "shallow": "false"}
        facts["describe"] = self.git("describe", "--tags", "--long", "--match", "v[0-9]*")
        return _version(facts)


@pytest.fixture
def clone(tmp_path: Path) -> Clone:
    folder = tmp_path / "clone"
    done = subprocess.run(
        ["git", "clone", "-q", str(ROOT), str(folder)], capture_output=True, text=True, check=False
    )
    if done.returncode or (folder / ".git" / "shallow").exists():
        pytest.skip("not a full clone, so there is nothing to release")
    made = Clone(folder)
    for tag in made.git("tag").split():
        made.git("tag", "-d", tag)
    for name in (
        ".ci/release",
        ".ci/subjects",
        ".ci/version",
        ".ci/build_backend.py",
        "CHANGELOG.md",
        "VERSION",
    ):
        shutil.copy(ROOT / name, folder / name)
    made.git("add", "-A")
    made.commit("Take over what is not committed yet")
    made.git("tag", "-a", "v0.0.1", "-m", "where subjects are counted from")
    return made


def test_a_release_dates_the_changelog_and_tags_it(clone: Clone) -> None:
    before = (clone.folder / "CHANGELOG.md").read_text()

    done = clone.release("1.0.0")

    assert done.returncode == 0, done.stderr
    today = datetime.now(UTC).date().isoformat()
    text = (clone.folder / "CHANGELOG.md").read_text()
    assert text == before.replace("## Unreleased\n", f"## Unreleased\n\n## 1.0.0 ({today})\n", 1)
    assert clone.git("status", "--porcelain") == ""
    for name in (".github/workflows/track.yml", "action.yml", "examples/gitlab/.gitlab-ci.yml"):
        text = (clone.folder / name).read_text()
        assert re.findall(r"spook-tracker\[standard\](\S*?)\"?(?:\s|$)", text) == ["==1.0.0"], name
    assert clone.git("cat-file", "-t", "v1.0.0") == "tag"
    assert clone.git("rev-parse", "v1.0.0^{commit}") == clone.git("rev-parse", "HEAD")
    assert (clone.folder / "VERSION").read_text() == "1.0.0\n"
    assert clone.version() == "1.0.0"
    clone.commit("One more")
    assert re.fullmatch(r"1\.0\.0\.post1\+g[0-9a-f]{9}", clone.version())


def told(folder: Path) -> str:
    """The version a build is told there; empty where the build asks git itself."""
    done = subprocess.run(["sh", ".ci/version"], cwd=folder, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_without_tags_the_version_is_that_of_the_last_release_and_compare_takes_it_as_printed(
    clone: Clone, tmp_path: Path
) -> None:
    assert told(clone.folder) == "", "no release yet: git counts"
    assert clone.release("1.0.0").returncode == 0
    assert told(clone.folder) == "", "git has the tag"
    clone.git("tag", "-d", "v0.0.1", "v1.0.0")
    versions = [told(clone.folder)]
    clone.commit("One more")
    versions.append(told(clone.folder))
    short = f"g{clone.git('rev-parse', '--short=9', 'HEAD')}"
    assert versions == ["1.0.0", f"1.0.0.post1+{short}"]

    asked = "import sys; sys.path[:0] = ['.ci']; import build_backend as b; b.prepare_metadata_for_build_wheel('built')"
    (clone.folder / "built").mkdir()
    made = clone.run(sys.executable, "-c", asked)
    assert made.returncode == 0, made.stderr
    (metadata,) = (clone.folder / "built").glob("*.dist-info/METADATA")
    assert f"\nVersion: {versions[1]}\n" in metadata.read_text(), "pip builds without the Makefile"
    shutil.rmtree(clone.folder / "built")

    kept = {
        "TRACKER_DB": str(tmp_path / "history.db"),
        "PYTHONPATH": str(TOYS),
        "TRACKER_ENGINE": "toy_engine",
    }
    kept |= {"TRACKER_CATALOGUE": "toy_creep:CATALOGUE", "TOY_ERROR": "1.0", "TOY_PARENT": ""}
    tracker = (sys.executable, "-m", "spook_tracker")
    for version, commit in zip(versions, ("HEAD^", "HEAD"), strict=True):
        build = {"TOY_VERSION": version, "TOY_HASH": clone.git("rev-parse", commit)}
        build["TOY_TIME"] = clone.git("log", "-1", "--format=%cI", commit)
        assert clone.run(*tracker, "run", "--workers", "0", **kept, **build).returncode == 0
    for after in (versions[1], "1.0.0.post1"):
        compared = clone.run(*tracker, "compare", "1.0.0", after, **kept)
        assert compared.returncode == 0, compared.stdout + compared.stderr

    clone.folder.joinpath("VERSION").chmod(0o755)
    assert told(clone.folder) == f"1.0.0.post1+{short}.dirty"
    subprocess.run(
        ["git", "clone", "-q", "--depth", "1", f"file://{clone.folder}", str(tmp_path / "few")], check=True
    )
    assert told(tmp_path / "few") == f"1.0.0+shallow.{short}"
    (tmp_path / "unpacked").mkdir()
    subprocess.run(
        f"git -C {clone.folder} archive HEAD | tar x -C {tmp_path}/unpacked", shell=True, check=True
    )
    assert told(tmp_path / "unpacked") == f"1.0.0+archive.{short}"
    (tmp_path / "unpacked" / "PKG-INFO").touch()  # an archive that a build has made says its version there
    assert told(tmp_path / "unpacked") == ""


def test_a_release_that_cannot_be_is_refused_before_anything_changes(clone: Clone) -> None:
    def refused(version: str, words: str) -> None:
        state = clone.git("rev-parse", "HEAD"), clone.git("tag"), clone.git("status", "--porcelain")
        for arguments in ((version,), ("--check", version)):
            done = clone.release(*arguments)
            assert done.returncode == 1
            assert words in done.stderr
            assert done.stderr.count("\n") == 1
        assert state == (clone.git("rev-parse", "HEAD"), clone.git("tag"), clone.git("status", "--porcelain"))

    for text in ("", "1", "1.2", "v1.2.3", "1.2.3; rm", "next", "1.2.3.4"):
        refused(text, "is no version")
    assert clone.release("--check", "1.0.0").returncode == 0
    assert clone.git("tag") == "v0.0.1"
    assert clone.release("1.0.0").returncode == 0
    refused("1.0.0", "is there already")
    refused("0.9.0", "would come before v1.0.0")
    refused("1.0.1", "nothing under Unreleased")
    changelog = clone.folder / "CHANGELOG.md"
    changelog.write_text(changelog.read_text().replace("## Unreleased\n", "## Unreleased\n- More.\n", 1))
    refused("1.0.1", "not committed")
    clone.git("commit", "-qam", "Say what is new")
    assert clone.release("1.0.1").returncode == 0


def test_all_checks_run_between_the_question_and_the_tag() -> None:
    told = subprocess.run(
        ["make", "-n", "release", "VERSION=1.2.3"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout

    order = ["release --check", "lint-imports", "ctest", "tests/test_packaging.py", 'release "1.2.3"']
    places = [told.index(words) for words in order]
    assert places == sorted(places)


def test_a_subject_that_lists_would_cut_is_named(clone: Clone) -> None:
    assert clone.run("sh", ".ci/subjects").returncode == 0
    clone.commit("x" * 72)
    assert clone.run("sh", ".ci/subjects").returncode == 0
    clone.commit("y" * 73)

    done = clone.run("sh", ".ci/subjects")

    assert done.returncode == 1
    assert "y" * 73 in done.stderr and "x" * 72 not in done.stderr


def test_drift_against_a_release_end_to_end(clone: Clone) -> None:
    """Each night stays inside the tolerance of 2 % of the night before; all together they leave the release."""

    def night(error: float) -> subprocess.CompletedProcess[str]:
        parents = clone.git("rev-parse", "HEAD^")
        return clone.run(
            sys.executable, "-m", "spook_tracker", "nightly", "--workers", "0", "--db", "history.db", "--out", "public",
            PYTHONPATH=str(TOYS), TRACKER_ENGINE="toy_engine", TRACKER_CATALOGUE="toy_creep:CATALOGUE",
            TOY_VERSION=clone.version(), TOY_HASH=clone.git("rev-parse", "HEAD"), TOY_PARENT=parents,
            TOY_TIME=clone.git("log", "-1", "--format=%cI"), TOY_ERROR=repr(error), COLUMNS="160",
        )  # fmt: skip

    clone.folder.joinpath(".git", "info", "exclude").write_text("history.db*\npublic\n")
    assert clone.release("1.0.0").returncode == 0
    first = night(1.05)
    assert first.returncode == 0, first.stdout + first.stderr
    clone.commit("Step 1")
    inside = night(1.065)
    assert inside.returncode == 0, inside.stdout + inside.stderr
    clone.commit("Step 2")

    last = night(1.075)

    assert last.returncode == 1, last.stdout + last.stderr
    assert "drift" in last.stdout.lower()
    assert "since 1.0.0" in last.stdout
    page = (clone.folder / "public" / "regressions.html").read_text().lower()
    assert "drift" in page

    assert clone.run(
        "git", "commit", "-qm", "x"
    ).returncode  # nothing is left to commit: the tree stayed clean


def test_make_release_runs_what_its_line_of_help_says(clone: Clone) -> None:
    """In a clone, without doing it: first whether it is possible, then the checks that are named, then the release."""
    (said,) = re.findall(r"make release VERSION=1\.2\.3 +(.+), then", (ROOT / "Makefile").read_text())
    planned = clone.run("make", "--dry-run", "--always-make", "MAKE=make", "release", "VERSION=1.2.3").stdout
    steps = [line for line in planned.splitlines() if ".ci/release" in line or line.startswith("make ")]

    assert steps == ['sh .ci/release --check "1.2.3"', "make check test package", 'sh .ci/release "1.2.3"']
    assert said == "check, test and package"
