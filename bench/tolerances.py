"""`make tolerances`: each named constant of the core times and by ten: which test goes red, and of how many runs does a bit
change?

    python bench/tolerances.py [--bits] [PART …] [--tests FILE …]     parts as contacts/internal_edges; without: all that have
                                                                      tests here; --bits: no tests

The constants of `ROOM/tolerances.hpp` are read from the environment in a module built for this (build/tolerances), so that a
change of one is a run and not a build. A constant that no test and no run misses ought to go, with what it guards. Ends
with 1 if there is one.
"""

from __future__ import annotations

import math
import os
import random
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SOURCES = ROOT / "engine/native/src"
BUILD = ROOT / "build/tolerances"
FACTORS = (10.0, 0.1)
HEAPS = 6  # of bench/same_states.py, of each kind
SLIDES = 60  # over tiles
NEAR = {  # by part: the tests beside it
    "contacts/internal_edges": ("engine/collision/test_tiles",),
    "contacts/position_projection": ("engine/contacts/test_position_projection", "engine/contacts/test_overlaps", "engine/contacts/test_piles"),
    "contacts/overlap_search": ("engine/contacts/test_position_projection", "engine/contacts/test_overlaps", "engine/contacts/test_piles"),
}  # fmt: skip
FROM_ENVIRONMENT = r"""#pragma once
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <string>
#include <type_traits>
namespace spook {
template <class Number> Number tolerance(const char* name, Number value) {
    const char* asked = std::getenv("SPOOK_TOLERANCE");  // NAME=FACTOR
    if (!asked) return value;
    const std::size_t size = std::strlen(name);
    if (std::strncmp(asked, name, size) != 0 || asked[size] != '=') return value;
    const double scaled = static_cast<double>(value) * std::atof(asked + size + 1);
    if constexpr (std::is_integral_v<Number>) return static_cast<Number>(std::fmax(1.0, std::round(scaled)));
    else return static_cast<Number>(scaled);
}
}  // namespace spook
"""


@dataclass(frozen=True)
class Constant:
    room: str
    part: str
    name: str
    value: str

    def __str__(self) -> str:
        return f"{self.room}/{self.part}/{self.name}"


DECLARATION = re.compile(r"inline constexpr ([\w:]+)((?:\s+\w+ =[^,;]+,?)+);")
PART = re.compile(r"namespace tolerances::(\w+) \{")


def declarations(text: str, room: str) -> Iterator[tuple[str, str, list[Constant]]]:
    """Each statement of a header, the type and the constants that it declares, if it does; what has no part of its own is
    its room's."""
    part = room
    for line in statements(text):
        if found := PART.match(line):
            part = found[1]
        elif line == "}":
            part = room
        declared = DECLARATION.match(line)
        sides = [one.split("=") for one in declared[2].split(",")] if declared else []
        constants = [Constant(room, part, name.strip(), value.strip()) for name, value in sides]
        yield line, declared[1] if declared else "", constants


def constants(text: str, room: str) -> list[Constant]:
    """Those of one header, in its order."""
    return [constant for _, _, found in declarations(text, room) for constant in found]


def every_constant() -> list[Constant]:
    """Of every room."""
    headers = sorted(SOURCES.glob("*/tolerances.hpp"))
    return [constant for header in headers for constant in constants(header.read_text(), header.parent.name)]


def statements(text: str) -> Iterator[str]:
    """Without comments, each on one line."""
    held = ""
    for line in re.sub(r"//.*", "", text).splitlines():
        held = f"{held} {line.strip()}".strip()
        if held.startswith("inline") and ";" not in held:
            continue
        yield held
        held = ""


def changeable(text: str, room: str) -> str:
    """The same header with numbers that the environment may change."""
    lines = ['#include "run/tolerance.hpp"']
    for line, kind, found in declarations(text, room):
        for one in found:
            lines.append(f'inline const {kind} {one.name} = tolerance<{kind}>("{one}", {one.value});')
        if line and not found:
            lines.append(line)
    return "\n".join(lines) + "\n"


def build() -> Path:
    """The module whose constants the environment changes."""
    include = BUILD / "include"
    (include / "run").mkdir(parents=True, exist_ok=True)
    write(include / "run/tolerance.hpp", FROM_ENVIRONMENT)
    for header in sorted(SOURCES.glob("*/tolerances.hpp")):
        room = header.parent.name
        (include / room).mkdir(exist_ok=True)
        write(include / room / header.name, changeable(header.read_text(), room))
    programs = Path(sys.executable).parent
    subprocess.run(
        [
            *(programs / "cmake", "-S", ROOT / "engine/native", "-B", BUILD, "-G", "Ninja"),
            *(f"-DCMAKE_MAKE_PROGRAM={programs / 'ninja'}", "-DCMAKE_BUILD_TYPE=Release"),
            *(f"-DPython_EXECUTABLE={sys.executable}", "-DSKBUILD_SABI_VERSION=3.11"),
            f"-DCMAKE_CXX_FLAGS=-iquote {include}",  # before the sources' own
        ],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    subprocess.run([programs / "cmake", "--build", BUILD], check=True, stdout=subprocess.DEVNULL)
    module = max(BUILD.glob("_core*.so"), key=lambda path: path.stat().st_mtime)
    built = module.read_bytes()
    deaf = [str(one) for one in every_constant() if f"{one}\0".encode() not in built]
    if deaf:
        raise SystemExit(f"{module} does not ask the environment for {', '.join(deaf)}")
    return module


def write(path: Path, text: str) -> None:
    """Only where it is another: what includes it need not be compiled again."""
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def run(module: Path, asked: str, *arguments: str) -> tuple[int, str]:
    environment = os.environ | {"SPOOK_WATCHED": str(module), "SPOOK_TOLERANCE": asked}
    done = subprocess.run(
        [sys.executable, *arguments], cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    return done.returncode, done.stdout + done.stderr


def red_test(module: Path, asked: str, tests: tuple[str, ...]) -> str:
    """The first test that fails, or nothing."""
    files = [f"tests/{name}.py" for name in tests]
    code, told = run(module, asked, "-m", "pytest", "-q", "-x", "-p", "tests.engine.watched_core", "-p", "no:cacheprovider", "--no-header", *files)  # fmt: skip
    if code == 0:
        return ""
    found = re.search(r"^FAILED tests/(\S+?)\.py::(\S+)", told, re.MULTILINE)
    if found is None:
        raise SystemExit(f"{asked}: {told[-2000:]}")
    return f"{found[1]}::{found[2]}"


def states(module: Path, asked: str) -> list[str]:
    """What random heaps and slides end in, a line each."""
    program = (
        "import sys; sys.path.insert(0, 'bench'); import tests.engine.watched_core, same_states, tolerances; "
        f"same_states.main(['{HEAPS}']); tolerances.slides({SLIDES})"
    )
    return run(module, asked, "-c", program)[1].splitlines()


def slides(count: int) -> None:
    """Bodies that slide over tiles in one plane, by every solver: what each ends in."""
    from spook_tracker.engine import Method, Scene, simulate
    from tests.engine.collision.test_tiles import GRAVITY, SLIDERS, floor, loose, slider_at

    chance = random.Random(0)
    for number in range(count):
        heading, speed = chance.choice((0.0, 1e-3, 0.1, 0.4, 0.25 * math.pi)), chance.uniform(1.0, 8.0)
        velocity = (speed * math.cos(heading), speed * math.sin(heading), -chance.choice((0.0, 0.0, 2.0)))
        body = slider_at(
            chance.choice(list(SLIDERS)), chance.choice((-2.7, 0.03, 0.25, 0.5)), velocity,
            chance.choice((0.0, 0.0, 0.01)), chance.choice((0.0, 5.0)),
        )  # fmt: skip
        tiles = floor(chance.choice((0.0, 0.0, 1e-6)), chance.choice((0.0, 0.5)), chance.uniform(0.3, 1.0))
        method = Method(
            solver=chance.choice(("direct", "iterative", "iterative")),
            iterations=chance.choice((10, 50, 200)),
        )
        scene = Scene(bodies=(*(loose(tiles, 0.5) if number % 12 == 0 else tiles), body), gravity=GRAVITY)
        result = simulate(
            scene,
            time_step=1.0 / chance.choice((60, 120)),
            steps=20 if number % 12 == 0 else 60,
            method=method,
        )
        print(number, result.status, result.state_hash, sorted(result.counters.items()))


def main(arguments: list[str]) -> int:
    bits = "--bits" in arguments
    parts, tests = [name for name in arguments if name != "--bits"], ()
    if "--tests" in parts:
        at = parts.index("--tests")
        parts, tests = (
            parts[:at],
            tuple(name.removeprefix("tests/").removesuffix(".py") for name in parts[at + 1 :]),
        )
    unknown = [part for part in parts if part not in NEAR]
    if unknown and not (bits or tests):
        raise SystemExit(
            f"which tests are beside {unknown[0]} is not known: say --tests NAME …, or --bits for runs alone"
        )
    module = build()
    found = [one for one in every_constant() if f"{one.room}/{one.part}" in (parts or NEAR)]
    plain = states(module, "")
    if len(plain) != HEAPS * 3 + SLIDES:
        raise SystemExit("\n".join(plain[-20:]))
    missed = []
    for constant in found:
        near = () if bits else tests or NEAR[f"{constant.room}/{constant.part}"]
        seen = False
        for factor in FACTORS:
            asked = f"{constant}={factor!r}"
            red = red_test(module, asked, near) if near else ""
            changed = len(set(plain) - set(states(module, asked)))
            seen = seen or bool(red) or changed > 0
            print(
                f"{constant} {constant.value} × {factor:g}: {red or ('no test' if near else 'tests not asked')}; {changed} of {len(plain)} runs",
                flush=True,
            )
        if not seen:
            missed.append(constant)
    print(
        f"{len(found)} constants, {len(missed)} that nothing misses: {', '.join(map(str, missed)) or 'none'}"
    )
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
