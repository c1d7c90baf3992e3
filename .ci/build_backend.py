"""scikit-build-core's build backend; an archive of the sources says which commit it was made from.

`git archive` fills in the $Format$ of `.source-archive`, which `engine/native/build_info.cmake` reads where there is no
git. An archive made by a build backend would carry the placeholders: here they are filled in the archive, and the tree
is left as it is.
"""

from __future__ import annotations

import gzip
import io
import os
import re
import subprocess
import tarfile
from pathlib import Path
from typing import Any

from scikit_build_core import build as _core
from scikit_build_core.build import (  # the hooks that need nothing of ours
    build_editable,
    build_wheel,
    get_requires_for_build_editable,
    get_requires_for_build_sdist,
    get_requires_for_build_wheel,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)

__all__ = [
    "build_editable",
    "build_sdist",
    "build_wheel",
    "get_requires_for_build_editable",
    "get_requires_for_build_sdist",
    "get_requires_for_build_wheel",
    "prepare_metadata_for_build_editable",
    "prepare_metadata_for_build_wheel",
]
FACTS = Path(".source-archive")


def _say_version() -> None:
    """Where git has no tag, `.ci/version` knows better, for builds with the Makefile or without."""
    try:
        told = subprocess.run(
            ["sh", ".ci/version"], capture_output=True, text=True, check=False
        ).stdout.strip()
    except OSError:
        return
    if told:
        os.environ.setdefault("VCS_VERSIONING_PRETEND_VERSION", told)


_say_version()


def build_sdist(sdist_directory: str, config_settings: dict[str, Any] | None = None) -> str:
    """The archive of the sources, its commit inside."""
    name: str = _core.build_sdist(sdist_directory, config_settings)
    told = _filled(FACTS.read_text(encoding="utf-8"))
    if told:
        _replace(Path(sdist_directory) / name, FACTS.name, told.encode())
    return name


def _filled(template: str) -> str:
    """What `git archive` would write; empty where nothing is to be filled in or this is no clone of ours."""
    if "$Format:" not in template or _git("ls-files", "--error-unmatch", str(FACTS)) is None:
        return ""
    told = re.sub(
        r"\$Format:(.*?)\$", lambda found: _git("show", "-s", f"--format={found[1]}") or "", template
    )
    changed = _git("status", "--porcelain", "--untracked-files=no")
    return told + ("changed: true\n" if changed else "")


def _git(*words: str) -> str | None:
    try:
        done = subprocess.run(["git", *words], capture_output=True, text=True, check=False)
    except OSError:
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def _replace(archive: Path, name: str, content: bytes) -> None:
    """Write the archive again with another content of that file; everything else stays to the byte."""
    written = io.BytesIO()
    with (
        tarfile.open(archive) as old,
        gzip.GzipFile(fileobj=written, mode="wb", mtime=0) as packed,
        tarfile.open(fileobj=packed, mode="w", format=tarfile.PAX_FORMAT) as new,
    ):
        for member in old:
            file = old.extractfile(member)
            if member.name.partition("/")[2] == name:
                member.size, file = len(content), io.BytesIO(content)
            new.addfile(member, file)
    archive.write_bytes(written.getvalue())
