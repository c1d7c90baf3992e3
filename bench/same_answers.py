"""Two run documents by value: which answers differ in a bit, whatever became of definitions and run times.

    python bench/same_answers.py BEFORE.json AFTER.json

For changes that only move code. Exit code 0: every value, outcome, final state, counter, map and figure that both
hold is the same, and both hold the same ones. Definition hashes are counted apart, since they are not answers.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

SHOWN = 40  # differences named one by one
Answers = dict[str, str]


def answers(document: dict[str, Any]) -> Answers:
    """Everything the engine answered, by name, as text; what a clock said is left out."""
    timed = {s["key"] for s in document["series"] if s["kind"] == "time"}
    found = {}
    for sample in document["samples"]:
        if sample["series"] not in timed:
            told = {name: value for name, value in sample.items() if name not in ("series", "timing")}
            found[sample["series"]] = json.dumps(told, sort_keys=True)
    for kind in ("maps", "figures"):
        for drawn in document[kind]:
            name = "/".join(str(drawn.get(part, "")) for part in ("test", "configuration", "name"))
            found[f"{kind}: {name}"] = json.dumps(drawn, sort_keys=True)
    return found


def definitions(document: dict[str, Any]) -> Answers:
    return {s["key"]: s["test_version"] for s in document["series"]}


def difference(before: Answers, after: Answers) -> list[str]:
    """What only one side holds, and what differs."""
    apart = [f"gone: {name}" for name in before.keys() - after.keys()]
    apart += [f"new: {name}" for name in after.keys() - before.keys()]
    apart += [
        f"differs: {name}\n    {before[name][:300]}\n    {after[name][:300]}"
        for name in before.keys() & after.keys()
        if before[name] != after[name]
    ]
    return sorted(apart)


def main(before_file: str, after_file: str) -> int:
    before, after = (json.loads(Path(file).read_text()) for file in (before_file, after_file))
    apart = difference(answers(before), answers(after))
    hashes = difference(definitions(before), definitions(after))
    for line in apart[:SHOWN]:
        print(line)
    print(
        f"{len(answers(after))} answers, {len(apart)} differ; {len(definitions(after))} definitions, {len(hashes)} differ"
    )
    return 1 if apart else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
