"""Released versions of another engine, each in a folder of its own, asked the same questions.

A release is installed beside this environment, not into it: `pip install --target`, or `npm install --prefix`, into a folder
that comes first where the process that measures looks. What a release from PyPI needs of others is taken from here,
unless it does not start with it; then it gets a NumPy of its own time.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from packaging.requirements import Requirement

from spook_tracker.engine.find import EXTRAS, NODE
from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.document.json_form import decode
from spook_tracker.tracker.document.run_document import RunDocument

OLD_NUMPY = "numpy<2"
INSTALL_LIMIT, START_LIMIT = 600.0, 120.0  # s
WORKS = "works"  # a file in a release's folder, once the release has started


class ReleaseError(TrackerError):
    """Releases cannot be listed or installed; one sentence that names what to do."""


def released(engine: str) -> tuple[str, ...]:
    """The versions pip or npm can install here, oldest first; of npm's, those that are not tried out only (1.0.0-beta)."""
    package = _package(engine)
    if engine in NODE:
        done = _npm("view", package, "versions", "--json")
        if done.returncode:
            raise ReleaseError(f"npm finds no versions of {package}: {_last(done.stderr)}")
        told = json.loads(done.stdout)
        return tuple(
            version for version in (told if isinstance(told, list) else [told]) if "-" not in version
        )
    done = _pip("index", "versions", package)
    found = re.search(r"Available versions: (.+)", done.stdout)
    if done.returncode or not found:
        raise ReleaseError(f"pip finds no versions of {package}: {_last(done.stderr)}")
    return tuple(reversed([version.strip() for version in found[1].split(",")]))


def choose(known: Sequence[str], wanted: Sequence[str], newest: int | None) -> tuple[str, ...]:
    """Those asked for, in release order; all if none is named. Raises ReleaseError for an unknown one."""
    for version in wanted:
        if version not in known:
            raise ReleaseError(f"there is no release {version!r} to install here; the newest is {known[-1]}")
    chosen = [version for version in known if version in wanted] if wanted else list(known)
    return tuple(chosen[-newest:] if newest else chosen)


def install(engine: str, version: str, folder: Path) -> Path:
    """The folder that holds the release; what is there already is used again. Raises ReleaseError.

    What a release pins to one version is a part of it and comes along; everything else is taken from here.
    """
    place = folder / f"{engine}-{version}"
    if (place / WORKS).exists():
        return place
    if engine in NODE:
        _put_from_npm(place, f"{_package(engine)}@{version}")
        if (why := _start(engine, place)) is not None:
            shutil.rmtree(place)
            raise ReleaseError(f"{_package(engine)}@{version} is installed but does not start: {why}")
        return place
    wanted = [f"{_package(engine)}=={version}"]
    _put(place, wanted)
    parts = _pinned(place)
    if parts:
        _put(place, parts)
    for extra in ((), (OLD_NUMPY,)):
        if extra:
            _put(place, [*wanted, *parts, *extra])
        why = _start(engine, place)
        if why is None:
            return place
    shutil.rmtree(place)
    raise ReleaseError(f"{wanted[0]} is installed but does not start: {why}")


def _start(engine: str, place: Path) -> str | None:
    """Why a release does not start; None if it does, which is kept in its folder."""
    started = _python(place, "-c", f"from spook_tracker.engine.find import find; find({engine!r})")
    if started.returncode:
        return _last(started.stderr)
    (place / WORKS).touch()
    return None


def _put_from_npm(place: Path, package: str) -> None:
    place.mkdir(parents=True, exist_ok=True)
    done = _npm("install", "--silent", "--no-audit", "--no-fund", "--prefix", str(place), package)
    if done.returncode:
        shutil.rmtree(place, ignore_errors=True)
        raise ReleaseError(f"{package} cannot be installed: {_last(done.stderr)}")


def _put(place: Path, packages: Sequence[str]) -> None:
    done = _pip(
        "install", "--target", str(place), "--upgrade", "--no-deps", "--only-binary", ":all:", *packages
    )
    if done.returncode:
        shutil.rmtree(place, ignore_errors=True)
        raise ReleaseError(f"{packages[0]} cannot be installed: {_last(done.stderr)}")


def _pinned(place: Path) -> list[str]:
    """Requirements of what is installed here that name exactly one version: name==1.2.3."""
    found = []
    for file in sorted(place.glob("*.dist-info/METADATA")):
        lines = file.read_text(encoding="utf-8").partition("\n\n")[0].splitlines()
        needs = [Requirement(line.partition(":")[2]) for line in lines if line.startswith("Requires-Dist:")]
        found += [str(one) for one in needs if str(one.specifier).startswith("==") and one.marker is None]
    return found


def size(place: Path) -> int:
    """Bytes of all files in a folder."""
    return sum(file.lstat().st_size for file in place.rglob("*") if not file.is_dir())


def measure_release(
    engine: str,
    place: Path,
    tests: Sequence[str],
    *,
    limit: float | None,
    time_limit: float,
    memory: int,
    catalogue: str,
    workers: int,
) -> RunDocument:
    """One run of a release, measured in a process that sees it first. Raises ReleaseError."""
    file = place / "run.json"
    file.unlink(missing_ok=True)
    asked = ["run", *tests, "--engine", engine, "--catalogue", catalogue, "--no-record", "--json", str(file)]
    asked += ["--workers", str(workers), "--time-limit", str(time_limit), "--memory", str(memory)]
    asked += [*([] if limit is None else ["--limit", str(limit)])]
    done = _python(place, "-m", "spook_tracker", *asked, limit=None)
    if not file.exists():
        raise ReleaseError(f"{place.name} could not be measured: {_last(done.stderr)}")
    return decode(file.read_bytes(), RunDocument)


def _package(engine: str) -> str:
    packages = {**EXTRAS, **NODE}
    if engine not in packages:
        raise ReleaseError(
            f"releases of {engine!r} are not known; engines with releases: {', '.join(packages)}"
        )
    return packages[engine]


def _pip(*arguments: str) -> subprocess.CompletedProcess[str]:
    return _installer("pip", [sys.executable, "-m", "pip", "--disable-pip-version-check", *arguments])


def _npm(*arguments: str) -> subprocess.CompletedProcess[str]:
    if shutil.which("npm") is None:
        raise ReleaseError("there is no npm here; install Node")
    return _installer("npm", ["npm", *arguments])


def _installer(name: str, command: Sequence[str]) -> subprocess.CompletedProcess[str]:
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=INSTALL_LIMIT)
    except subprocess.TimeoutExpired:
        raise ReleaseError(f"{name} took longer than {INSTALL_LIMIT:g} s for {command[-1]}") from None


def _python(
    place: Path, *arguments: str, limit: float | None = START_LIMIT
) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([str(place), *filter(None, [os.environ.get("PYTHONPATH")])])
    packages = place / "node_modules"  # of npm's
    own = {"TRACKER_NODE_MODULES": str(packages)} if packages.exists() else {}
    try:
        return subprocess.run(
            [sys.executable, *arguments],
            env={**os.environ, "PYTHONPATH": path, **own},
            capture_output=True,
            text=True,
            timeout=limit,
        )
    except subprocess.TimeoutExpired:
        raise ReleaseError(f"{place.name} did not start within {START_LIMIT:g} s") from None


def _last(text: str) -> str:
    """The last line a program said before it gave up."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1][:200] if lines else "it said nothing"
