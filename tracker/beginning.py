"""The first files of a team: adapter, tracker.toml and workflow for the engine named (`tracker init`).

An engine that the tracker knows needs no adapter. For any other one the adapter holds a stand-in in Python, particles
under gravity, so that the first night runs before the engine itself is bound.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from spook_tracker.engine.build_info import build_info
from spook_tracker.engine.find import BUILT, EXTRAS, NODE, OURS
from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.measure.run import tracker_version

ADAPTER, SETTINGS, WORKFLOW = "tracking/adapter.py", "tracker.toml", ".github/workflows/physics.yml"
PLACEHOLDER = "OWNER"  # in pyproject.toml, until the sources have a home
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_.-]*")
ADDRESS = re.compile(r"https?://[\w.:-]+(/[\w.~-]+){2,}/?", re.ASCII)  # without a user: it would be published
BUILDS = {  # a file in the root: the command that builds what it describes
    "CMakeLists.txt": "cmake -S . -B build && cmake --build build",
    "Cargo.toml": "cargo build --release",
    "meson.build": "meson setup build && meson compile -C build",
    "Makefile": "make",
}

ADAPTER_TEXT = '''\
"""{name} as the tracker asks it: what it can do, and a scene in its own terms."""

import numpy as np

from spook_tracker.engine.stepped import Capabilities, Configuration, Stepped


class World:
    """A stand-in: particles under gravity. Put the binding to your engine here, with the same two methods."""

    def __init__(self, scene, time_step):
        self.gravity, self.time_step = np.array(scene.gravity), time_step
        self.positions = np.array([body.position for body in scene.bodies])  # m
        self.velocities = np.array([body.velocity for body in scene.bodies])  # m/s

    def step(self, count):
        for _ in range(count):
            self.velocities += self.time_step * self.gravity
            self.positions += self.time_step * self.velocities

    def state(self):
        """Rigid bodies also give quaternions (n, 4) and angular velocities (n, 3), rad/s."""
        return self.positions, self.velocities


class Engine(Stepped):
    name = {quoted}
    # What is not named here is "not supported" in the tables: add shapes, joints and forces as they are bound.
    capabilities = Capabilities(rigid_bodies=False)
    configurations = (Configuration(name="default", reason="as we ship it", expected_order=1.0),)

    def world(self, task):
        return World(task.scene, task.time_step)


ENGINE = Engine(checkout=__file__)
'''
NO_BUILD = """
# How any commit is built, for pull requests, `tracker bisect` and `tracker backfill`; in Python there is nothing to build:
# [build]
# command = "true"
"""
LIMITS = """
# What the engine owes you, by series, whatever the printed limit is:
# [limits]
# "falling_object/default/position_error/*" = 2.0  # m
"""


@dataclass(frozen=True, slots=True)
class Home:
    """Where this tracker comes from, for a workflow that installs it."""

    url: str  # of the repository of its sources
    commit: str  # empty where the build does not know it
    version: str

    @property
    def released(self) -> bool:
        """A release is on the package index; anything else is installed from its commit."""
        return bool(re.fullmatch(r"\d+\.\d+\.\d+", self.version))

    @property
    def revision(self) -> str:
        """What the workflow is pinned to."""
        return self.commit or "main"

    def requirement(self, extras: str) -> str:
        """What pip installs."""
        if self.released:
            return f"spook-tracker[{extras}]=={self.version}"
        return f"spook-tracker[{extras}] @ git+{self.url}@{self.revision}"


def home(url: str = "") -> Home:
    """`url`, or what the installed package says; the commit is the one that it was built from.

    Raises TrackerError for what a workflow cannot call, or what would write a password into it.
    """
    if url and not ADDRESS.fullmatch(url):
        raise TrackerError(f"{url!r} is no address of a repository, such as https://host/owner/name")
    return Home(url.rstrip("/") or _source(), build_info.git_hash, tracker_version())


def _source() -> str:
    from importlib.metadata import PackageNotFoundError, metadata

    try:
        lines = metadata("spook-tracker").get_all("Project-URL") or []
    except PackageNotFoundError:
        lines = []
    named: dict[str, str] = {}
    for line in lines:
        label, _, url = str(line).partition(", ")
        named[label] = url
    return named.get("Source", f"https://github.com/{PLACEHOLDER}/spook-tracker")


def first_files(name: str, build: str, at: Home) -> Mapping[str, str]:
    """Path and content of every file that an engine needs. `build` is its shell command, or empty.

    Raises TrackerError for a name that no engine can have.
    """
    if not NAME.fullmatch(name):
        raise TrackerError(
            f"{name!r} is no name of an engine; begin with a letter, go on with letters, digits, . _ -"
        )
    if name in BUILT:
        raise TrackerError(
            f"{name} is built from a checkout of the tracker's sources, by {BUILT[name]}; run it there"
        )
    known = name in OURS or name in EXTRAS or name in NODE
    extras = f"standard,{name}" if name in EXTRAS else "standard"
    if name in NODE:
        build = build or f"npm install {NODE[name]}"
    files = {SETTINGS: _settings(name, "" if known else build, known), WORKFLOW: _workflow(build, extras, at)}
    if not known:
        files[ADAPTER] = ADAPTER_TEXT.format(name=name, quoted=json.dumps(name))
    return files


def build_command(folder: Path) -> str:
    """How what lies there is built, told from the files in its root; empty where they do not tell."""
    return next((command for file, command in BUILDS.items() if (folder / file).is_file()), "")


def write_first_files(folder: Path, files: Mapping[str, str]) -> list[str]:
    """Write them all, or none: TrackerError names those that are there already, or the one that cannot be written.

    Returns the paths written.
    """
    there = [path for path in files if os.path.lexists(folder / path)]
    if there:
        verb = "is" if len(there) == 1 else "are"
        raise TrackerError(
            f"{', '.join(there)} {verb} there already; nothing is written over, and nothing was written"
        )
    if ADAPTER in files and not (folder / ADAPTER).with_name("__init__.py").exists():
        files = {str(Path(ADAPTER).with_name("__init__.py")): "", **files}
    made: list[Path] = []
    for path, content in files.items():
        target = folder / path
        missing = [one for one in (target, *target.parents) if not os.path.lexists(one)]
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(content, encoding="utf-8")
        except OSError as error:
            _unmake([*missing, *made])
            raise TrackerError(
                f"{path} cannot be written, and nothing was written: {error.strerror}"
            ) from None
        made = [*missing, *made]
    return list(files)


def _unmake(made: Sequence[Path]) -> None:
    """Remove files and folders, those inside a folder before it."""
    for path in made:
        with suppress(OSError):
            path.rmdir() if path.is_dir() else path.unlink()


def _settings(name: str, build: str, known: bool) -> str:
    lines = [
        f"engine = {json.dumps(name if known else 'tracking.adapter')}",
        'catalogue = "standard"',
        f"title = {json.dumps(f'{name}, every night')}",
        'database = "sqlite:///history.db"',
    ]
    if build:
        lines += ["", "[build]  # of any commit, for pull requests, `tracker bisect` and `tracker backfill`"]
        lines += [f"command = {json.dumps(build, ensure_ascii=False)}"]
    return "\n".join(lines) + "\n" + ("" if build or known else NO_BUILD) + LIMITS


def _workflow(build: str, extras: str, at: Home) -> str:
    place = urlsplit(at.url).path.strip("/").removesuffix(".git")
    given = {"build": build, "tracker": at.requirement(extras), "options": "--quick"}
    lines = [f"      {key}: {json.dumps(value, ensure_ascii=False)}" for key, value in given.items() if value]
    return (
        f"""\
name: physics
on:
  schedule: [{{cron: "17 3 * * *"}}]
  pull_request:
  workflow_dispatch: # a night at any time
permissions: {{contents: read}}
jobs:
  track:
    uses: {place}/.github/workflows/track.yml@{at.revision}
    permissions: {{contents: write, pages: write, id-token: write, pull-requests: write}}
    with:
"""
        + "\n".join(lines)
        + "\n"
    )
