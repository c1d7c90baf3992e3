"""Which engine this is: version, commit, compiler and flags, baked in when the native part was built."""

from __future__ import annotations

from dataclasses import dataclass

from . import _core


@dataclass(frozen=True, slots=True)
class BuildInfo:
    """What was built from what. None or "" means that it was not known at build time, never a guess."""

    name: str
    version: str  # "0+unknown" without git
    git_hash: str
    dirty: bool | None  # whether tracked files differed from the commit
    commit_time: str  # ISO 8601
    parents: tuple[str, ...]
    compiler: str
    flags: str


def _version(facts: dict[str, str]) -> str:
    """What the package build was told; else from git, as PEP 440 wants it; never a guess.

    A shallow clone cannot count its commits, and an archive may not know its commit: both say so.
    """
    if facts["version"]:
        return facts["version"]
    short = "g" + facts["git_hash"][:9]
    if not facts["git_hash"]:
        return "0+unknown"
    if not facts["shallow"]:
        return f"0+archive.{short}"
    if facts["shallow"] == "true":
        return f"0+shallow.{short}"
    changed = ".dirty" if facts["dirty"] == "true" else ""
    if not facts["describe"]:
        return f"0.1.dev{facts['count']}+{short}{changed}"
    tag, distance, _ = facts["describe"].rsplit("-", 2)
    if distance == "0" and not changed:
        return tag.removeprefix("v")
    return f"{tag.removeprefix('v')}.post{distance}+{short}{changed}"


def _read() -> BuildInfo:
    facts = _core.build_facts()
    return BuildInfo(
        name="spook",
        version=_version(facts),
        git_hash=facts["git_hash"],
        dirty={"true": True, "false": False}.get(facts["dirty"]),
        commit_time=facts["commit_time"],
        parents=tuple(facts["parents"].split()),
        compiler=facts["compiler"],
        flags=facts["flags"],
    )


build_info = _read()
