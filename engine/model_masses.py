"""Masses and moments of inertia of a model file, and densities of MJCF, checked before an engine takes a wrong one for valid."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from xml.etree import ElementTree

MOST = 1e100  # kg, kg m², kg/m³: squares of momenta stay finite
ROUNDING = 1e-12  # what programs that write files leave of a zero
PRINCIPAL, PRODUCTS = ("ixx", "iyy", "izz"), ("ixy", "ixz", "iyz")
MASSES = {  # element: attributes that say one, or several
    "inertial": ("mass", "diaginertia", "fullinertia"),
    "geom": ("mass", "density"),
    "flexcomp": ("mass",),
    "mass": ("value",),
    "inertia": (*PRINCIPAL, *PRODUCTS),
}


def wrong_mass(root: ElementTree.Element) -> tuple[str, str] | None:
    """The first mass, inertia or density that is not finite, negative or beyond all bounds: a pattern that finds it in the
    file, and what is wrong with it. Text that is no number is left to the engines, which refuse it."""
    for element in root.iter():
        for name, written, numbers, signed in _said(element):
            for number in numbers:
                if not math.isfinite(number):
                    return written, f"a {name} of {number:g}, which is not finite"
                if abs(number) > MOST:
                    return written, f"a {name} of {number:g}; it may be {MOST:g} at most"
                if number < -ROUNDING and not signed:
                    return written, f"a {name} of {number:g}, which is negative"
    return None


def _said(element: ElementTree.Element) -> Iterator[tuple[str, str, list[float], bool]]:
    """Each of its masses: its name, a pattern that finds it, its numbers, and whether they may be negative."""
    for name in MASSES.get(element.tag, ()):
        numbers = _numbers(element.get(name, ""))
        written = rf"""<{element.tag}\b[^<>]*\b{name}\s*=\s*["']{re.escape(element.get(name, ""))}["']"""
        if name == "fullinertia":  # three principal moments, three products
            yield "moment of inertia", written, numbers[:3], False
            numbers = numbers[3:]
        yield _name(element.tag, name), written, numbers, name in (*PRODUCTS, "fullinertia")
    if element.tag in ("mass", *PRINCIPAL, *PRODUCTS) and element.text:  # of an SDF
        written = rf"<{element.tag}\b[^<>]*>{re.escape(element.text)}"
        yield _name(element.tag, element.tag), written, _numbers(element.text), element.tag in PRODUCTS


def _name(tag: str, attribute: str) -> str:
    if attribute == "density":
        return "density"
    return "mass" if "mass" in (tag, attribute) else "moment of inertia"


def _numbers(text: str) -> list[float]:
    try:
        return [float(word) for word in text.split()]
    except ValueError:
        return []
