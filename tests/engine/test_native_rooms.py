"""The rooms of the native engine: each includes only rooms below it, and only one knows Python."""

from __future__ import annotations

import re
from collections.abc import Mapping

import pytest

from tests.places import ROOT

SOURCES = ROOT / "engine" / "native" / "src"
ROOMS = ("linear", "run", "particles", "collision", "contacts", "rigid", "bindings")  # lowest first
BESIDE = {("collision", "particles"), ("contacts", "particles"), ("rigid", "particles")}  # neither is below


def violations(files: Mapping[str, str]) -> list[str]:
    """Includes that go up, or across to a neighbour; `files` maps "room/name" to its text."""
    found = []
    for name, text in files.items():
        room = name.split("/")[0]
        if "<nanobind" in text and room != "bindings":
            found.append(f"{name} knows Python")
        for included in re.findall(r'#include "(\w+)/', text):
            upwards = ROOMS.index(included) > ROOMS.index(room)
            if upwards or (room, included) in BESIDE:
                found.append(f"{name} includes {included}/")
    return found


def sources() -> dict[str, str]:
    return {
        path.relative_to(SOURCES).as_posix(): path.read_text()
        for path in sorted(SOURCES.rglob("*"))
        if path.is_file()
    }


def test_every_room_includes_only_rooms_below_it() -> None:
    files = sources()

    assert len(files) > 80
    assert {name.split("/")[0] for name in files} == set(ROOMS)
    assert violations(files) == []


@pytest.mark.parametrize(
    ("name", "text", "complaint"),
    [
        ("linear/planted.hpp", '#include "run/report.hpp"\n', "linear/planted.hpp includes run/"),
        (
            "rigid/planted.cpp",
            '#include "particles/path_order.hpp"\n',
            "rigid/planted.cpp includes particles/",
        ),
        ("run/planted.hpp", "#include <nanobind/nanobind.h>\n", "run/planted.hpp knows Python"),
    ],
)
def test_a_planted_include_is_seen(name: str, text: str, complaint: str) -> None:
    assert violations(sources() | {name: text}) == [complaint]
