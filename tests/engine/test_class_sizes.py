"""No class and no function of the native core grows: what is over the limits of one job may only become smaller."""

from __future__ import annotations

import re
from collections.abc import Iterator

import lizard
import pytest

from tests.places import ROOT

SOURCES = ROOT / "engine/native/src"
MOST_MEMBERS, MOST_METHODS = 30, 40
LARGER = {  # members and methods of those that are over: lower a number that has become smaller
    "contacts/ConeFour": (37, 4)
}
MOST_BRANCHES = 25
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


def branches(name: str, text: str) -> dict[str, int]:
    """Cyclomatic number (McCabe 1976) of each function of a file, the largest of those of one name; a lambda's
    count where it stands."""
    found: dict[str, int] = {}
    for function in lizard.analyze_file.analyze_source_code(name, text).function_list:
        called = f"{name} {function.name.removeprefix('spook::')}"
        found[called] = max(found.get(called, 0), function.cyclomatic_complexity)
    return found


def test_no_function_has_more_branches_than_one_can_follow() -> None:
    assert not {
        function: number
        for source in sorted(SOURCES.glob("*/*.[ch]pp"))
        for function, number in branches(str(source.relative_to(SOURCES)), source.read_text()).items()
        if number > MOST_BRANCHES
    }


def test_which_branches_are_counted() -> None:
    text = """namespace spook {
    int A::f(int a) {
        const auto g = [&](int b) { return b > 0 && a > 0 ? b : a; };
        for (int k = 0; k < a || k < 2; ++k)
            if (g(k)) a += k;
        switch (a) { case 1: return 2; case 2: return 3; }
        while (a > 9) --a;
        return a;
    }
    void A::f() {}
    }"""
    assert branches("a.cpp", text) == {"a.cpp A::f": 1 + 2 + 2 + 1 + 2 + 1}


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
