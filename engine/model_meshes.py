"""Meshes written as text and pictures, looked through before an engine's own reader comes to harm by one."""

from __future__ import annotations

import re
import struct
from pathlib import Path
from xml.parsers import expat

import numpy as np

from .model_bodies import ModelError

ENTITIES = "declares XML entities, which no model needs; write out what they stand for"
MOST_POINTS = 50_000_000  # of a picture, which takes some thirty bytes a point while it is read


def harm_in(file: Path) -> str:
    """Why engines' own readers would come to harm by it; empty if they would not, or it is neither."""
    kind = file.suffix.lower()
    if kind == ".dae":
        parser = expat.ParserCreate()  # keeps no tree, which takes ten times the text
        parser.EntityDeclHandler = _no_entity
        try:
            parser.Parse(file.read_bytes(), True)
        except ModelError as error:
            return str(error)
        except (expat.ExpatError, ValueError, LookupError) as error:
            return f"is no XML: {error}"
    with file.open("rb") as start:
        head = start.read(24)
    if head.startswith(b"\x89PNG") and len(head) == 24:
        width, height = struct.unpack(">II", head[16:])
        if width * height > MOST_POINTS:
            return f"is a picture of {width} by {height} points; it may have {MOST_POINTS:.0e}"
    if kind == ".obj":
        content = re.sub(rb"\\\r?\n", b" ", re.sub(rb"#.*", b"", file.read_bytes()))
        corners = len(re.findall(rb"^[ \t]*v[ \t]", content, re.MULTILINE))
        faces = b" ".join(re.findall(rb"^[ \t]*f[ \t]+(.*)", content, re.MULTILINE))
        try:
            named = np.array(re.sub(rb"/\S*", b"", faces).split(), dtype=np.int64)
        except (ValueError, OverflowError):
            return "has faces of something else than whole numbers"
        if len(far := named[(named == 0) | (np.abs(named) > corners)]):
            return f"has a face with corner {far[0]}, of {corners}"
    return ""


def _no_entity(*_declared: object) -> None:
    raise ModelError(ENTITIES)
