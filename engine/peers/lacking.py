"""What a model file has and an engine lacks: by name, and by the line of the file where one is found."""

from __future__ import annotations

import re

MOST_NAMED = 3


class Lacks:
    """Kinds of things that are not supported, each with the parts of the model that have it."""

    def __init__(self) -> None:
        self._found: dict[str, dict[str, str]] = {}  # what: its owners, and the kind of each

    def add(self, what: str, kind: str = "", name: str = "") -> None:
        """Something lacking; of a joint, body, geom … of that name."""
        self._found.setdefault(what, {})
        if name:
            self._found[what][name] = kind

    def __bool__(self) -> bool:
        return bool(self._found)

    def sentence(self, text: str = "") -> str:
        """All of it in one line; `text` is the file's, to tell lines from."""
        return "; ".join(f"{what}{_named(owners, text)}" for what, owners in self._found.items())


def _named(owners: dict[str, str], text: str) -> str:
    if not owners:
        return ""
    first = [f"{kind} {name!r}{_line(name, text)}" for name, kind in list(owners.items())[:MOST_NAMED]]
    more = f" and {len(owners) - MOST_NAMED} more" if len(owners) > MOST_NAMED else ""
    return f" ({', '.join(first)}{more})"


def _line(name: str, text: str) -> str:
    """Where the file names it."""
    found = re.search(rf"""\bname\s*=\s*(["']){re.escape(name)}\1""", text)
    return f" in line {text.count(chr(10), 0, found.start()) + 1}" if found else ""
