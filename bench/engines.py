"""Every engine that is installed on every scene, and the page that says who is first where, and where we are behind.

    python bench/engines.py --db sqlite:///build/engines.db --page docs/engines.md
    python bench/engines.py --db sqlite:///build/engines.db --page docs/engines.md --only-page

Why another engine is first stands in docs/engine-causes.toml, by hand: a cause is found, not measured. Where there is
none, the page says so.
"""

from __future__ import annotations

import argparse
import re
import sys
import time
import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent.parent))

import spook_tracker.engine.find as find
import spook_tracker.tracker as tracker
import spook_tracker.tracker.judge.rank as ranks
from spook_tracker.tracker.document.wording import number, quantity, seconds, version
from spook_tracker.tracker.store.database import session_on

OURS = "spook"
ANSWERED = ("value", "out_of_limit", "unsettled", "not_supported")  # the rest are failures
CAUSES = Path(__file__).parents[1] / "docs" / "engine-causes.toml"
LIMIT = re.compile(r"time limit of ([\d.]+) s was reached")
PAGE = Path(__file__).parents[1] / "docs" / "engines.md"
Causes = Mapping[tuple[str, str], tuple[str, str]]  # (test, engine): (cause, what would mend it)


def installed() -> list[str]:
    """Ours, and every other engine that is here."""
    found = [OURS]
    for name in (*find.EXTRAS, *find.NODE):
        try:
            find.find(name)
        except find.EngineMissing as reason:
            print(f"left out: {reason}", flush=True)
            continue
        found.append(name)
    return found


def measure(names: Sequence[str], database: str, limit: float) -> None:
    """A run with ladders of each engine, recorded; says how long each took."""
    for name in names:
        begin = time.perf_counter()
        document = tracker.run(sweep=True, engine=name, workers=2, limit=None if name == OURS else limit)
        tracker.record(document, database)
        outcomes = Counter(sample.outcome for sample in document.samples)
        told = ", ".join(f"{count} {word.replace('_', ' ')}" for word, count in outcomes.most_common())
        print(f"{name}: {time.perf_counter() - begin:.0f} s; {told}", flush=True)


def page(database: str) -> str:
    """The page in Markdown, from the newest run of each engine."""
    with session_on(database, readonly=True) as session:
        history = tracker.History(session)
        newest = {run.engine.name: run for run in history.runs()}
        runs = {name: newest[name] for name in sorted(newest, key=lambda name: (name != OURS, name))}
        samples = {name: history.samples(run.id) for name, run in runs.items()}
    if OURS not in runs:
        raise SystemExit(f"{database} has no run of ours to set the others beside")
    machine = runs[OURS].machine
    timed = {
        name: told for name, told in samples.items() if runs[name].machine.fingerprint == machine.fingerprint
    }
    races = ranks.races(ranks.standings(timed))
    elsewhere = ", ".join(name for name in samples if name not in timed)
    lines = [
        "# Every engine on every scene",
        "",
        "Made by `make engines`: " + ", ".join(f"{n} {version(r.engine)}" for n, r in runs.items()) + ".",
        f"Measured on {runs[OURS].started[:10]}, one core at a time for the run times, {machine.processor}.",
        *([f"On another machine, and not timed here: {elsewhere}."] if elsewhere else []),
        "An engine is asked in two or three settings (`tracker engines` says which and why); the best of them counts.",
        "",
        *_gates(samples),
        *_rungs(samples),
        *_first(races),
        *_behind(races, causes()),
    ]
    return "\n".join(lines) + "\n"


def causes() -> Causes:
    given = tomllib.loads(CAUSES.read_text(encoding="utf-8")) if CAUSES.exists() else {}
    return {
        (one["test"], engine): (one["cause"], one["cure"])
        for one in given.get("behind", [])
        for engine in one["engines"]
    }


def _gates(samples: Mapping[str, ranks.Samples]) -> list[str]:
    """What each engine says to the questions that decide green or red for ours."""
    gates = [d for d, _ in samples[OURS].values() if d.role == "gate"]
    told = ranks.answers(gates, samples)
    rows = []
    for name in samples:
        mine = [answer for _, of_gate in told for answer in of_gate if answer.engine == name]
        lacking = sum(a.sample is None or a.sample.outcome == "not_supported" for a in mine)
        failed = sum(a.sample is not None and a.sample.outcome not in ANSWERED for a in mine)
        kept = sum(a.stands == "pass" for a in mine)
        rows.append((name, kept, len(mine) - lacking - failed - kept, failed, lacking))
    return [
        f"## {len(told)} gates",
        "",
        "The limits are physical ones or the method's own; an engine of another method may rightly miss the latter.",
        "",
        "| engine | keeps | misses | fails | not supported |",
        "|---|---|---|---|---|",
        *(f"| {' | '.join(map(str, row))} |" for row in rows),
        "",
    ]


def _rungs(samples: Mapping[str, ranks.Samples]) -> list[str]:
    """How much of the ladders below was had of each engine, and what stopped the rest."""
    rows = []
    for name, told in samples.items():
        found = [sample for definition, sample in told.values() if definition.kind == "ladder"]
        outcomes = Counter(sample.outcome for sample in found)
        late = {m[1] for sample in found if (m := LIMIT.search(sample.failure))}
        bound = ", ".join(f"{seconds} s" for seconds in sorted(late, key=float))
        others = len(found) - outcomes["value"] - outcomes["timed_out"] - outcomes["not_supported"]
        rows.append(
            (name, outcomes["value"], outcomes["timed_out"], bound or "-", others, outcomes["not_supported"])
        )
    return [
        "## Rungs of the ladders",
        "",
        "A rung that takes longer than the time limit is out of time, and so are the finer ones after it: a front may",
        "end there where patience would lead it on.",
        "",
        "| engine | values | out of time | time limit | diverged or else failed | not supported |",
        "|---|---|---|---|---|---|",
        *(f"| {' | '.join(map(str, row))} |" for row in rows),
        "",
    ]


def _first(races: Sequence[ranks.Race]) -> list[str]:
    """Scene by scene: who comes within an error first, in what time, and what the next needs."""
    lines = [
        "## Who is first",
        "",
        "Run time to come within an error, in the best setting; in brackets how much longer the next engine takes.",
        "",
        "| scene | " + " | ".join(f"{error:g}" for error in ranks.ERRORS) + " |",
        "|---|" + "---|" * len(ranks.ERRORS),
    ]
    scenes: dict[str, dict[float, str]] = {}
    for race in races:
        (best, name), *rest = race.order
        further = f"{number(rest[0][0] / best, 2)} × {rest[0][1]}" if rest and best > 0.0 else "alone"
        scene = f"{race.test}, {race.ladder.replace('_', ' ')} [{race.unit}]"
        scenes.setdefault(scene, {})[race.error] = f"{name} {seconds(best)} ({further})"
    for scene, cells in scenes.items():
        lines.append(f"| {scene} | {' | '.join(cells.get(error, 'nobody') for error in ranks.ERRORS)} |")
    won = Counter(race.order[0][1] for race in races)
    score = ", ".join(f"{name} {count}" for name, count in won.most_common())
    return [*lines, "", f"First in {len(races)} places (a scene at an error): {score}.", ""]


def _behind(races: Sequence[ranks.Race], known: Causes) -> list[str]:
    """Where another engine is first though ours was asked, by how much, and why."""
    lines = ["## Where another engine is first, and why", ""]
    for race in races:
        if (behind := race.behind(OURS)) is None:
            continue
        first, theirs, mine = behind
        far = "never" if mine is None else f"{number(mine / theirs, 2)} times as long"
        cause, cure = known.get((race.test, first), ("no cause found yet", ""))
        what = f"{race.test}, {race.ladder.replace('_', ' ')} to {quantity(race.error, race.unit)}"
        lines.append(f"- **{what}**: {first} in {seconds(theirs)}, ours {far}. {_sentences(cause, cure)}")
    return lines if len(lines) > 2 else [*lines, "Nowhere."]


def _sentences(*parts: str) -> str:
    return " ".join(f"{part[0].upper()}{part[1:]}." for part in parts if part)


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--db", default="sqlite:///build/engines.db")
    parser.add_argument("--page", default=str(PAGE))
    parser.add_argument("--limit", type=float, default=5.0, help="s of one simulation of another engine")
    parser.add_argument(
        "--only-page", action="store_true", help="measure nothing, write the page of what is recorded"
    )
    parser.add_argument("engines", nargs="*", help="by default all that are installed")
    asked: Any = parser.parse_args(arguments)
    if not asked.only_page:
        measure(asked.engines or installed(), asked.db, asked.limit)
    Path(asked.page).write_text(page(asked.db), encoding="utf-8")
    print(f"wrote {asked.page}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
