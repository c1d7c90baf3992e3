"""The changelog is for users: one effect a line, under Added, Changed, Faster, Fixed and Removed.

`tests/test_guards.py` asks it of CHANGELOG.md.
"""

from __future__ import annotations

import re

import pytest

KINDS = ("Added", "Changed", "Faster", "Fixed", "Removed")
LONGEST = 132  # characters of a line
MOST = 200  # lines of a version


def faults(text: str) -> list[str]:
    """What of the newest version's part is not as it should be, with its line."""
    lines = text.split("\n## ")[1].splitlines()[1:]
    found = [f"{len(lines)} lines: merge entries of one effect, at most {MOST}"] if len(lines) > MOST else []
    kind, seen = "", []
    for line in filter(None, lines):
        if heading := re.fullmatch(r"### (\w+)(?:: [a-z ]+)?", line):
            if heading[1] not in KINDS or (kind and KINDS.index(heading[1]) < KINDS.index(kind)):
                found.append(f"headings are {', '.join(KINDS)}, in this order: {line}")
            kind = heading[1]
        elif not kind:
            found.append(f"put it under one of {', '.join(KINDS)}: {line}")
        elif not (line.startswith("- ") and line.endswith(".")):
            found.append(f"one line, one sentence, from '- ' to a full stop: {line}")
        elif len(line) > LONGEST:
            found.append(f"{len(line)} characters, say it in {LONGEST}: {line}")
        elif line in seen:
            found.append(f"said twice: {line}")
        seen.append(line)
    return found


@pytest.mark.parametrize(
    ("planted", "told"),
    [
        ("- Loose, without a heading.\n\n### Added\n- It is.", "put it under one of"),
        ("### Fixed\n- It is.\n\n### Added\n- It is new.", "in this order"),
        ("### News\n- It is.", "headings are"),
        ("### Added\n- It begins,\n  and goes on.", "one sentence"),
        ("### Added\n- It is\n", "one sentence"),
        ("### Added\n- It is " + "very " * 30 + "long.", "say it in"),
        ("### Added\n- It is.\n- It is.", "said twice"),
        ("### Added\n" + "\n".join(f"- Number {n}." for n in range(201)), "merge entries"),
    ],
)
def test_what_is_not_in_the_form_is_told(planted: str, told: str) -> None:
    found = faults(f"# Changelog\n\n## Unreleased\n{planted}\n\n## 1.0.0\nfree text\n")

    assert any(told in fault for fault in found), found
