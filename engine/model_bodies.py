"""The bodies of a model file as its elements hang them: in MJCF one in another, in URDF and SDF by joints that name two."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

from spook_tracker.engine.errors import EngineError
from spook_tracker.engine.model_file import Watched

DEEPEST = 200  # elements within elements, bodies that hang from bodies; engines read models recursively
MOVES_URDF = (
    "revolute",
    "continuous",
    "prismatic",
    "floating",
    "planar",
    "ball",
    "universal",
    "screw",
    "revolute2",
)


class ModelError(EngineError, ValueError):
    """A model file cannot be read; one sentence that names the file and what is wrong with it."""


@dataclass(slots=True)
class Body:
    """A body of the file; `moves` by joints of its own."""

    name: str
    moves: bool = False
    free: bool = False
    children: list[Body] = field(default_factory=list)


def urdf_bodies(root: ElementTree.Element, path: Path) -> Body:
    """What its links hang from, the world. ModelError where they make no tree."""
    names = [link.get("name", "") for link in root.findall("link")]
    links = {name: Body(name) for name in names}
    if not links:
        raise ModelError(f"{path} is no model: it has no links")
    most, times = Counter(names).most_common(1)[0]
    if times > 1:
        raise ModelError(f"{path} has two links {most!r}")
    inner = set()
    for joint in root.findall("joint"):
        ends = [joint.find("parent"), joint.find("child")]
        names = [end.get("link", "") if end is not None else "" for end in ends]
        if stray := [name for name in names if name not in links]:
            raise ModelError(
                f"{path}: joint {joint.get('name', '')!r} ties link {stray[0]!r}, which is not there"
            )
        if names[1] in inner:
            raise ModelError(f"{path}: link {names[1]!r} hangs from two joints, which no URDF allows")
        child = links[names[1]]
        child.moves = joint.get("type") in MOVES_URDF
        child.free = joint.get("type") == "floating"
        links[names[0]].children.append(child)
        inner.add(names[1])
    bodies = Body("", children=[link for name, link in links.items() if name not in inner])
    if hanging(bodies, path) < len(links):
        raise ModelError(f"{path}: its joints make a circle, so none of its links is the first")
    return bodies


def hang_sdf(root: ElementTree.Element, into: Body) -> None:
    """The links of all its models."""
    for model in root.iter("model"):
        links = {link.get("name", ""): Body(link.get("name", "")) for link in model.findall("link")}
        inner = set()
        for joint in model.findall("joint"):
            parent, child = (joint.findtext(end, "").strip() for end in ("parent", "child"))
            if child in links and child not in inner:
                links[child].moves = joint.get("type") in MOVES_URDF
                inner.add(child)
                if parent in links:
                    links[parent].children.append(links[child])
        fixed = model.findtext("static", "false").strip() in ("true", "1")
        for name, link in links.items():
            if name not in inner:
                link.moves = link.free = not fixed
                into.children.append(link)


def hanging(bodies: Body, path: Path) -> int:
    """How many bodies hang from it in all; ModelError where one hangs from more than engines take."""
    level, count, depth = bodies.children, 0, 0
    while level:
        level, count, depth = [b for body in level for b in body.children], count + len(level), depth + 1
        if depth > DEEPEST:
            raise ModelError(f"{path} has links that hang from more than {DEEPEST} others")
    return count


def hang_mjcf(element: ElementTree.Element, into: Body) -> None:
    """Bodies of MJCF, also those in frames."""
    for child in element:
        if child.tag == "body":
            body = Body(child.get("name", ""))
            body.free = any(
                j.tag == "freejoint" or (j.tag == "joint" and j.get("type") == "free") for j in _joints(child)
            )
            body.moves = any(True for _ in _joints(child))
            into.children.append(body)
            hang_mjcf(child, body)
        elif child.tag in ("frame", "replicate"):
            hang_mjcf(child, into)


def _joints(body: ElementTree.Element) -> Iterator[ElementTree.Element]:
    for child in body:
        if child.tag in ("joint", "freejoint"):
            yield child
        elif child.tag == "frame":
            yield from _joints(child)


def moving(
    body: Body, name: str, path: tuple[int, ...], inside: bool
) -> Iterator[tuple[Watched, Body, bool]]:
    """Bodies with joints of their own, how each is found, and whether nothing above it moves."""
    for place, child in enumerate(body.children):
        where = (child.name, ()) if child.name else (name, (*path, place))
        if child.moves:
            label = child.name or ".".join([name or "world", *map(str, where[1])])
            yield Watched(label=label.replace("/", "."), name=where[0], path=where[1]), child, not inside
        yield from moving(child, *where, inside or child.moves)


def drives(body: Body) -> bool:
    """Whether some body below it has joints of its own."""
    return any(child.moves or drives(child) for child in body.children)
