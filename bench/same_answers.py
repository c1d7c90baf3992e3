"""Two run documents by value: which answers differ in a bit, whatever became of definitions and run times.

    python bench/same_answers.py BEFORE.json AFTER.json

For changes that only move code. Exit code 0: every value, outcome, final state, counter, map and figure that both
hold is the same, and both hold the same ones. Definition hashes are counted apart, since they are not answers.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from pathlib import Path
from typing import Any

SHOWN = 40  # differences named one by one
WORK = ["counters", "state_hash"]
Answer = dict[str, Any]


def answers(document: dict[str, Any]) -> dict[str, Answer]:
    """Everything the engine answered, by name and part; what a clock said is left out."""
    timed = {s["key"] for s in document["series"] if s["kind"] == "time"}
    found: dict[str, Answer] = {}
    for sample in document["samples"]:
        if sample["series"] not in timed:
            found[sample["series"]] = {
                part: told for part, told in sample.items() if part not in ("series", "timing")
            }
    for kind in ("maps", "figures"):
        for drawn in document[kind]:
            name = "/".join(str(drawn.get(part, "")) for part in ("test", "configuration", "name"))
            found[f"{kind}: {name}"] = drawn
    return found


def definitions(document: dict[str, Any]) -> dict[str, Answer]:
    return {s["key"]: {"definition": s["test_version"]} for s in document["series"]}


def parts(before: Answer, after: Answer) -> list[str]:
    """The parts that are not the same text: NaN equals itself, and -0 is not 0."""
    written = [
        {part: json.dumps(told, sort_keys=True) for part, told in side.items()} for side in (before, after)
    ]
    return sorted(
        part for part in before.keys() | after.keys() if written[0].get(part) != written[1].get(part)
    )


def difference(before: dict[str, Answer], after: dict[str, Answer]) -> dict[str, list[str]]:
    """By name what differs: its parts, or that one side alone has it."""
    apart = {name: ["gone"] for name in before.keys() - after.keys()}
    apart |= {name: ["new"] for name in after.keys() - before.keys()}
    apart |= {
        name: found for name in before.keys() & after.keys() if (found := parts(before[name], after[name]))
    }
    return dict(sorted(apart.items()))


def line(name: str, found: list[str], before: dict[str, Answer], after: dict[str, Answer]) -> str:
    told = f"{name}: {', '.join(found)}"
    if "value" in found:
        told += f"; {before[name]['value']!r} -> {after[name]['value']!r}"
    return told


def test_of(name: str) -> str:
    return name.removeprefix("maps: ").removeprefix("figures: ").split("/")[0]


def main(before_file: str, after_file: str) -> int:
    before, after = (json.loads(Path(file).read_text()) for file in (before_file, after_file))
    old, new = answers(before), answers(after)
    apart = difference(old, new)
    hashes = difference(definitions(before), definitions(after))
    # What a reader sees first, then states and counts of work.
    telling = {
        name: found for name, found in apart.items() if found not in (["counters"], ["state_hash"], WORK)
    }
    for name, found in list((telling | apart).items())[:SHOWN]:
        print(line(name, found, old, new))
    for test, count in sorted(Counter(map(test_of, telling)).items()):
        print(f"  {test}: {count} values, outcomes, maps or figures differ")
    print(
        f"{len(new)} answers: {len(telling)} differ, {len(apart) - len(telling)} only in final state or work"
    )
    print(f"{len(definitions(after))} definitions, {len(hashes)} differ")
    return 1 if apart else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
