"""Mutants of a room drawn at random: one operator, number, condition or answer of its Python changed.

The draw is by a hash of seed, file and changed line: code that stays keeps its mutants, so two states of the tests are
asked about the same ones.
"""

from __future__ import annotations

import ast
import hashlib
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
ROOMS = {  # its code: its tests
    "engine": ("tests/engine",),
    "engine/peers": ("tests/engine/peers",),
    "scalar_tests": ("tests/scalar_tests",),
    "tracker": ("tests/tracker/*.py",),
    "tracker/cli": ("tests/tracker/cli", "tests/docs/test_commands.py"),
    "tracker/document": ("tests/tracker/document", "tests/tracker/store/test_hostile.py"),
    "tracker/judge": ("tests/tracker/judge",),
    "tracker/measure": ("tests/tracker/measure",),
    "tracker/store": ("tests/tracker/store",),
    "tracker/website": ("tests/website",),
}
COMPARED = {
    "<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "is not": "is", "is": "is not", "not in": "in",
    "in": "not in",
}  # fmt: skip
REACHES = {"+": "-", "-": "+", "*": "/", "/": "*", "//": "*", "%": "*", "**": "*", "@": "*"}
Change = tuple[int, int, str]  # from, to (bytes of the file), what comes there


@dataclass(frozen=True)
class Mutant:
    """One change of one file: of a text that occurs once, or, from `at` on, wherever it is."""

    name: str
    file: str
    old: str
    new: str
    at: int = -1  # bytes

    def applied(self, text: str) -> str:
        """The text with the change made; ValueError if it does not apply any more."""
        if self.at >= 0:
            content, old = text.encode(), self.old.encode()
            if content[self.at : self.at + len(old)] != old:
                raise ValueError(f"{self.name}: {self.old!r} is not there")
            return (content[: self.at] + self.new.encode() + content[self.at + len(old) :]).decode()
        if text.count(self.old) != 1:
            raise ValueError(
                f"{self.name}: {self.old!r} is in {self.file} {text.count(self.old)} times, not once"
            )
        return text.replace(self.old, self.new)


class Places:
    """Where the nodes of a file begin and end, in bytes."""

    def __init__(self, text: str) -> None:
        self.content = text.encode()
        self.lines = [0]
        for line in self.content.splitlines(keepends=True):
            self.lines.append(self.lines[-1] + len(line))

    def of(self, node: ast.expr) -> tuple[int, int]:
        assert node.end_lineno is not None and node.end_col_offset is not None
        return (
            self.lines[node.lineno - 1] + node.col_offset,
            self.lines[node.end_lineno - 1] + node.end_col_offset,
        )

    def between(self, left: ast.expr, right: ast.expr, written: dict[str, str]) -> Iterator[Change]:
        """The operator that stands between two operands."""
        first, last = self.of(left)[1], self.of(right)[0]
        told = self.content[first:last].decode()
        found = re.fullmatch(r"[\s)]*?(\S+(?: (?:not|in))?)[\s(]*", told)
        if found and found[1] in written:
            begin = first + found.start(1)
            yield begin, begin + len(found[1]), written[found[1]]

    def changes(self, node: ast.AST) -> Iterator[Change]:
        match node:
            case ast.Compare(left=left, comparators=others):
                for one, other in pairwise([left, *others]):
                    yield from self.between(one, other, COMPARED)
            case ast.BinOp(left=left, right=right):
                yield from self.between(left, right, REACHES)
            case ast.BoolOp(values=values):
                for one, other in pairwise(values):
                    yield from self.between(one, other, {"and": "or", "or": "and"})
            case ast.UnaryOp(op=ast.Not()):
                begin, end = self.of(node)
                yield begin, end, self.content[begin + len("not") : end].decode().strip()
            case ast.Constant(value=bool(value)):
                yield *self.of(node), str(not value)
            case ast.Constant(value=int(value)):
                yield *self.of(node), str(value + 1)
            case ast.Constant(value=float(value)):
                yield *self.of(node), repr(2.0 * value or 1.0)
            case ast.If(test=test) | ast.IfExp(test=test) if not isinstance(
                test, ast.UnaryOp | ast.NamedExpr
            ):
                begin, end = self.of(test)
                yield begin, end, f"not ({self.content[begin:end].decode()})"
            case ast.Return(value=ast.expr() as value) if not isinstance(value, ast.Constant):
                yield *self.of(value), "None"


def asked(node: ast.AST) -> Iterator[ast.AST]:
    """What runs: no annotation, and nothing within f-strings, whose places Python 3.11 does not know."""
    yield node
    for name, part in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list") or isinstance(node, ast.JoinedStr):
            continue
        for child in part if isinstance(part, list) else [part]:
            if isinstance(child, ast.AST):
                yield from asked(child)


def of_file(file: Path, root: Path = ROOT) -> list[Mutant]:
    """Every mutant of a file."""
    text, found = file.read_text(encoding="utf-8"), []
    places, name = Places(text), str(file.relative_to(root))
    for node in asked(ast.parse(text)):
        for begin, end, new in places.changes(node):
            old = places.content[begin:end].decode()
            line = places.content.count(b"\n", 0, begin) + 1
            if "\n" not in old:
                found.append(Mutant(f"{name}:{line} {old} -> {new}", name, old, new, begin))
    return found


def drawn(room: str, count: int, seed: int = 1, root: Path = ROOT) -> list[Mutant]:
    """So many of a room's."""
    pattern = "**/*.py" if room == "scalar_tests" else "*.py"
    ranked, seen = [], Counter[str]()
    for file in sorted((root / room).glob(pattern)):
        lines = file.read_text(encoding="utf-8").encode().splitlines()
        for mutant in of_file(file, root):
            line = int(mutant.name.split(":")[1].split()[0])
            told = f"{seed} {mutant.file} {lines[line - 1]!r} {mutant.old} {mutant.new}"
            seen[told] += 1
            ranked.append((hashlib.sha1(f"{told} {seen[told]}".encode()).hexdigest(), mutant))
    return [mutant for _, mutant in sorted(ranked, key=lambda one: one[0])[:count]]
