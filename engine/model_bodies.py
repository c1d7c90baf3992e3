"""The bodies of a model file as its elements hang them: in MJCF one in another, in URDF and SDF by joints that name two."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from xml.etree import ElementTree

from .errors import EngineError
from .model_file import Watched

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
    """The links of all its models, each from its parent's link; what hangs from the world hangs from `into`.

    A link name that several models have is said with its model's, as SDF does: box::link.
    """
    links: dict[str, Body] = {}  # by model::link
    still: set[str] = set()
    joints: list[tuple[str, ElementTree.Element]] = []
    for scope, model in _models(root, ""):
        parts = [f"{scope}::{link.get('name', '')}" for link in model.findall("link")]
        links |= {name: Body(name.rpartition("::")[2]) for name in parts}
        joints += [(scope, joint) for joint in model.findall("joint")]
        if model.findtext("static", "false").strip() in ("true", "1"):
            still |= {*parts}
    shared = Counter(link.name for link in links.values())
    for name, link in links.items():
        link.name = name if shared[link.name] > 1 else link.name
        link.moves = link.free = name not in still
    tops = dict(links)
    for scope, joint in joints:
        parent, child = (f"{scope}::{joint.findtext(end, '').strip()}" for end in ("parent", "child"))
        if child in tops and child != parent:
            links[child].moves = joint.get("type") in MOVES_URDF and child not in still
            links[child].free = False
            links.get(parent, into).children.append(tops.pop(child))
    into.children += tops.values()


def _models(root: ElementTree.Element, scope: str) -> Iterator[tuple[str, ElementTree.Element]]:
    """Every model with the names of those it is in."""
    for child in root:
        if child.tag == "model":
            name = child.get("name", "")
            yield (inner := f"{scope}::{name}" if scope else name), child
            yield from _models(child, inner)
        elif child.tag in ("sdf", "world"):
            yield from _models(child, scope)


def hanging(bodies: Body, path: Path) -> int:
    """How many bodies hang from it in all; ModelError where one hangs from more than engines take."""
    level, count, depth = bodies.children, 0, 0
    while level:
        level, count, depth = [b for body in level for b in body.children], count + len(level), depth + 1
        if depth > DEEPEST:
            raise ModelError(f"{path} has links that hang from more than {DEEPEST} others")
    return count


def hang_mjcf(element: ElementTree.Element, into: Body) -> None:
    """Bodies of MJCF, also those in frames, those that are replicated, and points of what is soft."""
    for child in element:
        if child.tag == "body":
            body = Body(child.get("name", ""))
            body.free = any(
                j.tag == "freejoint" or (j.tag == "joint" and j.get("type") == "free") for j in _joints(child)
            )
            body.moves = any(True for _ in _joints(child))
            into.children.append(body)
            hang_mjcf(child, body)
        elif child.tag == "frame":
            hang_mjcf(child, into)
        elif child.tag == "replicate":
            one = Body("")
            hang_mjcf(child, one)
            count = round(product_of(child.get("count", "1")))
            for k in range(count):
                last = f"{child.get('sep', '')}{k:0{len(str(count))}}"
                into.children += [_copied(body, last) for body in one.children]
        elif child.tag == "flexcomp" and child.get("rigid") != "true":
            pinned = {k for pin in child.findall("pin") for k in pin.get("id", "").split()}
            free = round(product_of(child.get("count", "1"))) - len(pinned)
            into.children += [Body("", moves=True) for _ in range(max(1, free))]
        elif child.tag == "composite":  # a cable, in releases before 4
            prefix, links = child.get("prefix", ""), round(product_of(child.get("count", "3"))) - 1
            below = into
            for k in range(links := min(links, DEEPEST)):
                name = "first" if k == 0 else "last" if k == links - 1 else str(k)
                body = Body(
                    f"{prefix}B_{name}",
                    moves=k > 0 or child.get("initial") != "none",
                    free=k == 0 and child.get("initial") == "free",
                )
                below.children.append(body)
                below = body


def product_of(counts: str) -> float:
    """What they ask for; what is no number is left to the engine."""
    try:
        return math.prod(map(float, counts.split()))
    except ValueError:
        return 1.0


def _copied(body: Body, last: str) -> Body:
    """With what hangs from it, and that behind each name."""
    below = [_copied(child, last) for child in body.children]
    return replace(body, name=body.name and body.name + last, children=below)


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
