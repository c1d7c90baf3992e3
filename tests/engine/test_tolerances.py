"""The numbers that the core is tuned by stand in one header a room, and `make tolerances` can change each."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from tests.places import ROOT

sys.path.insert(0, str(ROOT / "bench"))

import tolerances

HEADERS = sorted(tolerances.SOURCES.glob("*/tolerances.hpp"))
ROOMS = [header.parent for header in HEADERS]
NAMED = re.compile(r"^(?:inline )?constexpr (?:double|int|unsigned|std::\w+) (\w+) =[^({]*;", re.MULTILINE)
NO_TOLERANCES = {  # a number of another kind
    "lanes",  # of a vector
    "none",  # a link that is not there
    "no_bound",  # infinity
    "unbounded",
    "swung_in",  # a bit
    "feature_bits",  # of a key
    "beside",  # features
    "leaf",  # of a tree
    "few",  # a size, and what it must exceed
    "most_rows",
    "kUnbounded",
    "kPi",
}


def declared(header: Path) -> list[tolerances.Constant]:
    return tolerances.constants(header.read_text(), header.parent.name)


@pytest.mark.parametrize("room", ROOMS, ids=lambda room: room.name)
def test_what_is_tuned_stands_in_one_header_of_its_room(room: Path) -> None:
    elsewhere = {
        f"{file.name}: {name}"
        for file in room.iterdir()
        if file.name != "tolerances.hpp"
        for name in NAMED.findall(re.sub(r"//.*", "", file.read_text()))
        if name not in NO_TOLERANCES
    }

    assert elsewhere == set()


@pytest.mark.parametrize("header", HEADERS, ids=lambda header: header.parent.name)
def test_each_says_what_it_stands_for_in_the_part_that_reads_it(header: Path) -> None:
    text, room = header.read_text(), header.parent
    statements = re.findall(r"(?://[^\n]*\n)?inline constexpr [^;]*;[^\n]*(?:\n {4,}//[^\n]*)?", text)
    assert [statement for statement in statements if "//" not in statement] == []
    for constant in declared(header):
        files = [room / f"{constant.part}.cpp"] if constant.part != room.name else list(room.iterdir())
        read = [
            file
            for file in files
            if file.name != header.name and re.search(rf"\b{constant.name}\b", file.read_text())
        ]
        assert read, f"{constant} is read by nothing"


@pytest.mark.parametrize("header", HEADERS, ids=lambda header: header.parent.name)
def test_each_can_be_changed_from_outside(header: Path) -> None:
    """By its name in the header that `make tolerances` builds with; what it misses there would count as unmissed."""
    changed = tolerances.changeable(header.read_text(), header.parent.name)
    names = re.findall(r'= tolerance<[\w:]+>\("([^"]+)", ', changed)

    assert names == [str(constant) for constant in declared(header)]
    assert (
        len(set(names))
        == len(names)
        == len(re.findall(r"\b\w+ =\s[^;,]+[;,]", re.sub(r"//.*", "", header.read_text())))
    )
    assert "constexpr" not in changed


def test_the_tests_beside_a_part_are_there() -> None:
    parts = {f"{constant.room}/{constant.part}" for constant in tolerances.every_constant()}

    assert set(tolerances.NEAR) <= parts
    assert all((ROOT / "tests" / f"{name}.py").exists() for near in tolerances.NEAR.values() for name in near)
