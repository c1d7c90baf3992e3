"""The folder of the website: built beside the old one and swapped in, so that a reader never meets a half one.

A marker file says that the folder is ours, from what each file was made and how long it is. A folder without it is
never touched. A file whose source is unchanged keeps its bytes and its time; one that was cut short is made again.
"""

from __future__ import annotations

import ctypes
import errno
import hashlib
import json
import os
import shutil
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from spook_tracker.tracker.document.errors import TrackerError

MARKER = ".tracker-site.json"
YOUNG = 3600.0  # s; no publication takes that long
AT_FDCWD, RENAME_EXCHANGE = -100, 2


class FolderError(TrackerError):
    """The website cannot be written there."""


@dataclass
class Folder:
    """A website being built at `new`, to take the place of `old`."""

    old: Path
    new: Path
    known: dict[str, str]  # path to digest and size, of the old one
    made: dict[str, str] = field(default_factory=dict)
    written: int = 0
    skipped: int = 0

    def unchanged(self, path: str, digest: str) -> bool:
        """Whether the old site has the whole file, made from the same."""
        before = self.old / path
        return before.is_file() and self.known.get(path) == _mark(digest, before)

    def add(self, path: str, digest: str, make: Callable[[], bytes]) -> None:
        """Put a file in place: the old one if it was made from the same, else what `make` gives."""
        target, before = self.new / path, self.old / path
        target.parent.mkdir(parents=True, exist_ok=True)
        if self.unchanged(path, digest):
            _keep(before, target)
            self.skipped += 1
        else:
            target.write_bytes(make())
            self.written += 1
        self.made[path] = digest


@contextmanager
def replacing(out: Path) -> Iterator[Folder]:
    """A folder to fill; it takes the place of `out` when all went well and vanishes when it did not."""
    out = Path.cwd() / out  # not resolved: a link is refused below
    known = _known(out)
    new = out.with_name(f".{out.name}.new-{uuid.uuid4().hex[:8]}")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        _sweep(out)
        new.mkdir()
        folder = Folder(out, new, known)
        yield folder
        files = {path: _mark(made, new / path) for path, made in sorted(folder.made.items())}
        marker = {"made_by": "tracker publish", "files": files}
        (new / MARKER).write_text(json.dumps(marker, indent=0) + "\n", encoding="utf-8")
        _swap(new, out)
    except OSError as error:
        raise FolderError(f"the website cannot be written to {out}: {error.strerror or error}") from error
    finally:
        shutil.rmtree(new, ignore_errors=True)


def refuse_unusable(out: Path) -> None:
    """FolderError if no website can be put there: asked before a night is measured, not after."""
    _known(out)
    place = out.absolute().parent
    while not place.exists() and place != place.parent:
        place = place.parent
    if not place.is_dir() or not os.access(place, os.W_OK):
        raise FolderError(f"the website cannot be written to {out}: {place} is no folder one may write to")


def digest(*parts: bytes) -> str:
    """What a file was made from, in sixteen hexadecimal digits."""
    made = hashlib.sha256()
    for part in parts:
        made.update(len(part).to_bytes(8, "big"))
        made.update(part)
    return made.hexdigest()[:16]


def _known(out: Path) -> dict[str, str]:
    """What the folder holds and from what it was made. FolderError if it is not ours."""
    if out.is_symlink() or (out.exists() and not out.is_dir()):
        raise FolderError(f"{out} is not a folder; choose another place with --out")
    if not out.exists() or not any(out.iterdir()):
        return {}
    try:
        marker = json.loads((out / MARKER).read_text(encoding="utf-8"))
        files = marker["files"]
        if marker["made_by"] != "tracker publish" or not isinstance(files, dict):
            raise ValueError
    except (OSError, ValueError, KeyError, TypeError):
        raise FolderError(
            f"{out} holds files that this tracker did not write; choose an empty folder with --out"
        ) from None
    return {str(path): str(made) for path, made in files.items()}


def _mark(digest: str, file: Path) -> str:
    return f"{digest} {file.stat().st_size}"


def _keep(before: Path, target: Path) -> None:
    try:
        os.link(before, target)  # the old name goes with the old folder, so one name remains
    except OSError:
        shutil.copy2(before, target)


def _sweep(out: Path) -> None:
    """Remove what publications that were killed left beside the site; a young folder may still be in work."""
    for left in out.parent.iterdir():
        ours = any(left.name.startswith(f".{out.name}.{kind}-") for kind in ("new", "old"))
        if ours and left.is_dir() and not left.is_symlink() and time.time() - left.stat().st_mtime > YOUNG:
            shutil.rmtree(left, ignore_errors=True)


def _swap(new: Path, out: Path) -> None:
    """`new` becomes `out` in one step where the system can exchange two folders, else in two."""
    if not out.exists():
        new.rename(out)
        return
    if _exchange(new, out):
        shutil.rmtree(new, ignore_errors=True)
        return
    aside = out.with_name(f".{out.name}.old-{uuid.uuid4().hex[:8]}")
    out.rename(aside)
    try:
        new.rename(out)
    except OSError:
        aside.rename(out)
        raise
    shutil.rmtree(aside, ignore_errors=True)


def _exchange(one: Path, other: Path) -> bool:
    """Linux' renameat2(RENAME_EXCHANGE); False where there is none."""
    try:
        renameat2 = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, AttributeError):
        return False
    result = renameat2(AT_FDCWD, os.fsencode(one), AT_FDCWD, os.fsencode(other), RENAME_EXCHANGE)
    if result == 0:
        return True
    if ctypes.get_errno() in (errno.ENOSYS, errno.EINVAL, errno.ENOTSUP):
        return False
    raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
