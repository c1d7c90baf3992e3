"""What MJCF says in one place and means in another: types of joints in default classes, and models attached by name."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Mapping
from xml.etree import ElementTree

HOLDING = ("worldbody", "body", "frame", "replicate")  # elements in which joints and bodies are


def settle_joint_types(root: ElementTree.Element) -> None:
    """Write into each joint without a type the one that its class gives."""
    kinds: dict[str, str] = {}
    for default in root.findall("default"):
        kinds |= _kinds(default, "main", kinds.get("main", ""))
    if any(kinds.values()):
        for world in root.findall("worldbody"):
            _settle(world, kinds, "main")


def _kinds(default: ElementTree.Element, name: str, inherited: str) -> dict[str, str]:
    own = [kind for joint in default.findall("joint") if (kind := joint.get("type"))]
    found = {default.get("class", name): own[-1] if own else inherited}
    for inner in default.findall("default"):
        found |= _kinds(inner, "", own[-1] if own else inherited)
    return found


def _settle(element: ElementTree.Element, kinds: Mapping[str, str], childclass: str) -> None:
    for child in element:
        if child.tag == "joint" and (kind := kinds.get(child.get("class", childclass))):
            child.set("type", child.get("type", kind))
        elif child.tag in HOLDING:
            _settle(child, kinds, child.get("childclass", childclass))


def attach(
    root: ElementTree.Element,
    models: Mapping[str, ElementTree.Element],
    counted: Callable[[ElementTree.Element], None],
) -> None:
    """Put copies of attached bodies in their place, with their prefix; `counted` is told of each before it is made."""
    for holder in [element for world in root.findall("worldbody") for element in world.iter()]:
        for place, child in enumerate(holder):
            model = models.get(child.get("model", "")) if child.tag == "attach" else None
            if model is None:
                continue
            frame = ElementTree.Element("frame")
            for part in _parts(model, child.get("body")):
                counted(part)
                frame.append(copy.deepcopy(part))
            for element in frame.iter():
                if name := element.get("name"):
                    element.set("name", child.get("prefix", "") + name)
            holder[place] = frame


def _parts(model: ElementTree.Element, name: str | None) -> Iterator[ElementTree.Element]:
    """A body of that name; all that is in its world where none is named."""
    for world in model.findall("worldbody"):
        yield from (
            element
            for element in (world.iter("body") if name else world)
            if not name or element.get("name") == name
        )
