"""No class of the native core grows: what is over the limits of a class of one job may only become smaller."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

SOURCES = Path(__file__).parent.parent / "engine/native/src"
MOST_MEMBERS, MOST_METHODS = 30, 40
LARGER = {  # members and methods of those that are over: lower a number that has become smaller
    "contacts/ConeFour": (37, 4),
    "contacts/PgsSolver": (48, 42),
    "particles/ParticleSystem": (17, 46),
    "rigid/JointSet": (13, 53),
}
OPENS = re.compile(r"\b(class|struct)\s+(?:alignas\([^)]*\)\s*)?([\w:]+)(?:\s+final)?(?:\s*:\s*[^{;]*)?\s*$")
NO_MEMBER = re.compile(
    r"^(?:using|friend|enum|static_assert|template\s*<[^>]*>\s*(?:struct|class)|typedef|static constexpr)\b"
)


def classes(text: str) -> Iterator[tuple[str, int, int]]:
    """Name, data members and methods of each class that a header defines, nested ones by themselves."""
    text = re.sub(
        r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|^\s*#[^\n]*', "", text, flags=re.DOTALL | re.MULTILINE
    )
    for found in re.finditer(r"\{", text):
        if opened := OPENS.search(text[max(0, found.start() - 300) : found.start()]):
            members = methods = 0
            for statement in statements(text, found.end()):
                if is_method(statement):
                    methods += 1
                else:
                    members += declarators(statement)
            yield opened[2], members, methods


def statements(text: str, at: int) -> Iterator[str]:
    """Those of a class body that begins at `at`, without what stands in braces."""
    held, depth = "", 0
    for sign in text[at:]:
        if sign == "}":
            depth -= 1
            if depth < 0:
                return
            if depth == 0 and is_method(held):  # a body; an initialiser's statement goes on
                yield held.strip()
                held = ""
        elif sign == "{":
            depth += 1
        elif depth == 0 and sign == ";":
            plain = re.sub(r"\b(?:public|private|protected)\s*:(?!:)", "", held).strip()
            nested = re.match(r"(?:struct|class|union)\s+[\w:]+(?:\s*:\s*[^(]*)?$", plain)
            if plain and not nested and not NO_MEMBER.match(plain):
                yield plain
            held = ""
        elif depth == 0:
            held += sign


def without_templates(text: str) -> str:
    """What stands in angle brackets left out."""
    before = ""
    while before != text:
        before, text = text, re.sub(r"<[^<>]*>", "", text)
    return text


def is_method(statement: str) -> bool:
    plain = without_templates(re.sub(r"operator\s*(?:<=>|[=!<>+*/-]=?|\(\)|\[\])", "operator", statement))
    return "(" in plain.split("=")[0] and not re.match(r"\s*(?:public|private|protected)\s*:\s*$", plain)


def declarators(statement: str) -> int:
    plain = without_templates(statement)
    return 1 + re.sub(r"=[^,]*", "", re.sub(r"\[[^\]]*\]", "", plain)).count(",")


def core() -> dict[str, tuple[int, int]]:
    return {
        f"{header.parent.name}/{name}": (members, methods)
        for header in sorted(SOURCES.glob("*/*.hpp"))
        if header.parent.name != "bindings"
        for name, members, methods in classes(header.read_text())
    }


def test_no_class_grows_beyond_one_job() -> None:
    over = {name: size for name, size in core().items() if size[0] > MOST_MEMBERS or size[1] > MOST_METHODS}

    assert over == LARGER


@pytest.mark.parametrize(
    ("text", "size"),
    [
        ("class A { public: A(); int f() const { return a_; } private: int a_ = 0, b_; };", (2, 2)),
        ("struct B { std::vector<std::pair<int, int>> x; double y[3] = {1, 2, 3}; using T = int; };", (2, 0)),
        (
            "struct C { bool operator==(const C&) const = default; std::function<void(int)> call; struct D; };",
            (1, 1),
        ),
        ("class E final : public F { void f(); static constexpr int n = 3; Vec3 v{}; };", (1, 1)),
    ],
)
def test_what_is_counted(text: str, size: tuple[int, int]) -> None:
    assert [found[1:] for found in classes(text)] == [size]
