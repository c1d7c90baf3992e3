"""What a model file has and an engine lacks: by name, and by the line of the file where one is found."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mujoco

MOST_NAMED = 3
ELEMENTS = {  # that a file says a part of a model with
    "body": "body|link",
    "joint": "joint|freejoint",
    "tendon": "fixed|spatial",
    "equality": "connect|weld|flex\\w*|tendon|joint(?=[^<>]*\\bjoint1\\b)",
    "actuator": "general|motor|position|velocity|intvelocity|damper|cylinder|muscle|adhesion|dcmotor|plugin",
}
OWNERS = {"joint": "jnt_bodyid", "geom": "geom_bodyid"}


class Lacks:
    """Kinds of things that are not supported, each with the parts of the model that have it."""

    def __init__(self) -> None:
        self._found: dict[str, dict[str, str]] = {}  # what: its owners, and the kind of each

    def add(self, what: str, kind: str = "", name: str = "") -> None:
        """Something lacking; of a joint, body, geom … of that name."""
        self._found.setdefault(what, {})
        if name:
            self._found[what][name] = kind

    def of(self, what: str, model: Any, kind: str, number: int) -> None:
        """Something lacking of a part of a compiled model, by its own name or by that of its body."""
        if not (name := _name(model, kind, number)) and kind in OWNERS:
            number = int(getattr(model, OWNERS[kind])[number])
            name, kind = _name(model, "body", number), f"{kind} of body"
        self.add(what, kind, name or f"{kind} {number}")

    def __bool__(self) -> bool:
        return bool(self._found)

    def sentence(self, texts: Mapping[str, str] | None = None) -> str:
        """All of it in one line; `texts`: of its files, to tell lines from."""
        return "; ".join(f"{what}{_named(owners, texts or {})}" for what, owners in self._found.items())


def texts_of(path: Path) -> dict[str, str]:
    """What a model's file says, and what those say that it includes or attaches, by their names; "" is the file itself."""
    found: dict[str, str] = {}
    left = [path]
    while left:
        file = left.pop(0)
        if not file.is_file() or file.name in found:
            continue
        text = file.read_text(encoding="utf-8", errors="replace")
        found["" if file == path else file.name] = text
        named = re.findall(r"""<(?:include|model)\b[^<>]*?\bfile\s*=\s*["']([^"']+)""", text)
        left += [folder / name for name in named for folder in (path.parent, file.parent)]
    return found


def place_in(texts: Mapping[str, str], kind: str, name: str) -> str:
    """Where the files say a part of that name: "in line 7 of arm.xml"; empty where it is not found."""
    by_name = rf"""name\s*=\s*(["']){re.escape(name)}\1"""
    element = ELEMENTS.get(kind.rpartition(" of ")[2], kind.rpartition(" of ")[2])
    for pattern in (rf"<(?:{element})\b[^<>]*?\b{by_name}", rf"\b{by_name}"):
        if line := place_of(texts, pattern, literal=False):
            return line
    return ""


def place_of(texts: Mapping[str, str], said: str, literal: bool = True) -> str:
    """Where the files say that first, as place_in tells it; a pattern, if it is not `literal`."""
    pattern = re.escape(said) if literal else said
    for file, text in texts.items():
        if found := re.search(pattern, text):
            return f"in line {text.count(chr(10), 0, found.start()) + 1}{f' of {file}' if file else ''}"
    return ""


def _name(model: Any, kind: str, number: int) -> str:
    return mujoco.mj_id2name(model, getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), number) or ""


def _named(owners: dict[str, str], texts: Mapping[str, str]) -> str:
    if not owners:
        return ""
    first = [
        f"{kind} {name!r} {place_in(texts, kind, name)}".rstrip()
        for name, kind in list(owners.items())[:MOST_NAMED]
    ]
    more = f" and {len(owners) - MOST_NAMED} more" if len(owners) > MOST_NAMED else ""
    return f" ({', '.join(first)}{more})"
