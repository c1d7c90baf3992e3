"""Every engine that is installed on every scene, and the page that says which is first where, and where we are behind.

    python bench/engines.py --db sqlite:///build/engines.db --page docs/engines.md
    python bench/engines.py --db sqlite:///build/engines.db --page docs/engines.md --only-page
    python bench/engines.py --db sqlite:///build/engines.db --missing
    python bench/engines.py --db sqlite:///build/engines.db --test climb --test rolling_log

Each engine's runs are recorded as soon as it has answered, so that an interrupted night goes on with --missing. Questions
that are new, or asked otherwise now, can be asked by themselves (--test): the page takes of every test the newest answers.
Why another engine is first stands in docs/engine-causes.toml, by hand: a cause is found, not measured. Where there is
none, the page says so.
"""

from __future__ import annotations

import argparse
import math
import os
import re
import sys
import textwrap
import time
import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent.parent))

import bench.engine_kinds as engine_kinds
import bench.engine_places as engine_places
import bench.engine_settings as engine_settings
import bench.recorded as recorded
import spook_tracker.engine.find as find
import spook_tracker.tracker as tracker
import spook_tracker.tracker.judge.rank as ranks
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.tracker.document.wording import instant, number, quantity, seconds, version
from spook_tracker.tracker.measure.run import Interrupted
from spook_tracker.tracker.measure.timing import Repeats
from spook_tracker.tracker.store.database import session_on
from spook_tracker.tracker.website.recorded import Occasion

OURS = engine_places.OURS
FACTS = "bench.engine_facts:FACTS"
# Take seconds to compile a scene: asked last, where time is short.
COMPILED = ("mujoco_warp", "newton", "mjx")
TWINS = ("mujoco_warp", "mjx")  # of MuJoCo, asked how far from it: each fact would compile a dozen scenes
FACT_LIMIT = 5.0  # s of one simulation
KEPT = Path(__file__).parents[1] / "build" / "engines" / "jax"  # what JAX compiles, as Warp keeps its own
# Of every engine, ours included: short runs are timed three times, what takes longer than this many seconds twice, visiting
# all rungs before the second; most of the time goes into models that are built anew for each.
REPEATS = Repeats(most=3, seconds=0.05, fewest=2, stages_up_to=0.02, counts_from=0.05, runs=5)
ANSWERED = ("value", "out_of_limit", "unsettled", "not_supported")  # the rest are failures
CAUSES = Path(__file__).parents[1] / "docs" / "engine-causes.toml"
LIMIT = re.compile(r"time limit of ([\d.]+) s was reached|the ([\d.]+) s for this question")
PAGE = Path(__file__).parents[1] / "docs" / "engines.md"
Causes = Mapping[tuple[str, str], tuple[str, str]]  # (test, engine): (cause, what would mend it)


def installed() -> list[str]:
    """Ours, and every other engine that is here."""
    found = [OURS]
    for name in (*find.EXTRAS, *find.NODE, *find.BUILT):
        try:
            find.find(name)
        except find.EngineMissing as reason:
            print(f"left out: {reason}", flush=True)
            continue
        found.append(name)
    return sorted(found, key=lambda name: name in COMPILED)


def measure(
    names: Sequence[str],
    database: str,
    facts: str,
    limit: float,
    tests: Sequence[str] = (),
    minutes: float = math.inf,
) -> None:
    """A run with ladders of each engine, and one of the facts, recorded each in its own; says how long both took.

    Ours and the others have one budget: `limit` [s] a simulation, and as much for those of a ladder in one setting.
    Of `tests` alone if there are any, and no facts then. After so many minutes what is finished is recorded, and which
    engines are left is said.
    """
    ends = time.monotonic() + 60.0 * minutes
    os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(KEPT))

    def watch(progress: object) -> None:
        if time.monotonic() > ends:
            raise KeyboardInterrupt

    for place, name in enumerate(names):
        if time.monotonic() > ends:
            print(f"the {minutes:g} minutes are over; not asked: {', '.join(names[place:])}", flush=True)
            return
        begin, load = time.perf_counter(), os.getloadavg()[0]
        try:
            document = tracker.run(
                tests,
                watch=watch,
                sweep=True,
                engine=name,
                workers=2,
                limit=limit,
                patience=limit,
                every_setting=False,
                repeats=REPEATS,
            )
        except Interrupted as ended:
            if time.monotonic() <= ends:
                raise
            document = ended.document
            print(f"{name}: the {minutes:g} minutes are over; of it only what was finished", flush=True)
        tracker.record(document, database)
        if not tests:
            if name not in TWINS:
                measure_facts([name], facts)
            took = time.perf_counter() - begin
            recorded.add_occasion(
                database,
                Occasion(
                    engine=name, started=document.started, seconds=round(took, 1),
                    load=(round(load, 2), round(os.getloadavg()[0], 2)), limit=limit,
                ),
            )  # fmt: skip
        outcomes = Counter(sample.outcome for sample in document.samples)
        told = ", ".join(f"{count} {word.replace('_', ' ')}" for word, count in outcomes.most_common())
        print(f"{name}: {time.perf_counter() - begin:.0f} s; {told}", flush=True)


def measure_facts(names: Sequence[str], database: str) -> None:
    """The facts alone."""
    for name in names:
        tracker.record(tracker.run(engine=name, workers=2, catalogue=FACTS, limit=FACT_LIMIT), database)


def without_a_run(names: Sequence[str], database: str) -> list[str]:
    """Those of which the database has no run at the version that is installed."""
    with session_on(database) as session:
        known = {(run.engine.name, run.engine.version) for run in _newest(tracker.History(session)).values()}
    return [name for name in names if (name, find.find(name).build_info.version) not in known]


def _newest(history: tracker.History) -> dict[str, Any]:
    """The run of each engine that started last, of whatever version."""
    return {run.engine.name: run for run in sorted(history.runs(), key=_started)}


def _started(run: Any) -> str:
    return str(run.started)


def nights(history: tracker.History) -> dict[str, list[Any]]:
    """Runs of each engine, the newest first, back to the first that was asked everything: ours, then by name.

    Of another engine all are of one version; ours goes on between two of them.
    """
    found: dict[str, list[Any]] = {}
    whole: set[str] = set()
    for run in sorted(history.runs(), key=_started, reverse=True):
        name = run.engine.name
        told = found.setdefault(name, [])
        if name in whole or (told and name != OURS and told[0].engine.version != run.engine.version):
            continue
        told.append(run)
        if run.asked is None or run.asked.whole:
            whole.add(name)
    return dict(sorted(found.items(), key=lambda one: (one[0] != OURS, one[0])))


def answered(history: tracker.History, runs: Sequence[Any]) -> ranks.Samples:
    """Every test as the newest run that was asked it answers."""
    found: dict[str, tuple[Any, Any]] = {}
    later: set[str] = set()
    for run in runs:
        here = history.samples(run.id)
        found |= {key: one for key, one in here.items() if one[0].test not in later}
        later |= {definition.test for definition, _ in here.values()}
    return found


def page(database: str, of_facts: str = "") -> str:
    """The page in Markdown, from the newest answers of each engine."""
    with session_on(database, readonly=True) as session:
        history = tracker.History(session)
        runs = nights(history)
        samples = {name: answered(history, of_one) for name, of_one in runs.items()}
    facts = _recorded_facts(of_facts) if of_facts else {}
    if OURS not in runs:
        raise SystemExit(f"{database} has no run of ours to set the others beside")
    machine = runs[OURS][0].machine
    timed = {
        name: told
        for name, told in samples.items()
        if all(run.machine.fingerprint == machine.fingerprint for run in runs[name])
    }
    run = engine_places.places(timed)
    elsewhere = ", ".join(name for name in samples if name not in timed)
    lines = [
        "# Every engine on every scene",
        "",
        "Made by `make engines`: " + ", ".join(f"{n} {version(r[0].engine)}" for n, r in runs.items()) + ".",
        f"Measured on {runs[OURS][-1].started[:10]}, one core at a time for the run times, {machine.processor}.",
        *recorded.occasion_lines(database),
        *_asked_later(runs[OURS]),
        *_not_asked(samples[OURS]),
        *_asked_in_part(samples),
        *([f"On another machine, and not timed here: {elsewhere}."] if elsewhere else []),
        f"An engine that is missing was not installed: `.ci/engines all` brings what can be had of `spook-tracker[{','.join(find.EXTRAS)}]`",
        f"and, through npm, of {', '.join(find.NODE.values())}, and builds {', '.join(find.BUILT)} from its source.",
        "",
        *READING,
        *_treatment(samples),
        "",
        *engine_places.choice(run),
        *engine_places.single(run),
        *engine_kinds.table(facts),
        *engine_settings.SETTINGS,
        *engine_kinds.ARM,
        *engine_kinds.TWINS,
        *engine_kinds.NEWCOMERS,
        *engine_kinds.NOT_ASKED,
        *_gates(samples),
        *_rungs(samples, runs),
        *engine_places.first(run),
        *_behind([one.race for one in run], causes()),
    ]
    return "\n".join(lines) + "\n"


def _recorded_facts(database: str) -> dict[str, ranks.Samples]:
    with session_on(database) as session:
        history = tracker.History(session)
        newest = _newest(history)
        names = sorted(newest, key=lambda name: (name != OURS, name))
        return {name: history.samples(newest[name].id) for name in names}


def causes() -> Causes:
    given = tomllib.loads(CAUSES.read_text(encoding="utf-8")) if CAUSES.exists() else {}
    return {
        (one["test"], engine): (one["cause"], one["cure"])
        for one in given.get("behind", [])
        for engine in one["engines"]
    }


def _gates(samples: Mapping[str, ranks.Samples]) -> list[str]:
    """What each engine says where a limit is printed or physical: what a method owes itself is no question to another."""
    gates = [d for d, _ in samples[OURS].values() if d.role == "gate"]
    printed = [d for d in gates if d.limit_kind == "physical"]
    return [
        f"## {len(printed)} printed or physical limits",
        "",
        f"They hold for every engine. The limits of {len(gates) - len(printed)} more questions are what our own method owes, often",
        "rounding, and are not counted between engines.",
        *_limits_by_now(len(printed)),
        "",
        *_counted(samples, ranks.answers(printed, samples)),
    ]


def _limits_by_now(asked: int) -> list[str]:
    """How many of them the catalogue has, where more than were asked."""
    metrics = [metric for test in CATALOGUE.values() for _, metric in test.metrics()]
    now = sum(metric.role == "gate" and metric.limit_kind == "physical" for metric in metrics)
    return [f"The catalogue has {now} by now."] if now > asked else []


def _counted(samples: Mapping[str, ranks.Samples], told: Sequence[Any]) -> list[str]:
    rows = []
    for name in samples:
        mine = [answer for _, of_gate in told for answer in of_gate if answer.engine == name]
        lacking = sum(a.sample is None or a.sample.outcome == "not_supported" for a in mine)
        failed = sum(a.sample is not None and a.sample.outcome not in ANSWERED for a in mine)
        kept = sum(a.stands == "pass" for a in mine)
        rows.append((name, kept, len(mine) - lacking - failed - kept, failed, lacking))
    return [
        "| engine | keeps | misses | fails | not supported |",
        "|---|---|---|---|---|",
        *(f"| {' | '.join(map(str, row))} |" for row in rows),
        "",
    ]


def _asked_later(runs: Sequence[Any]) -> list[str]:
    """Tests that were asked by themselves, later than the rest."""
    later = [(run, run.asked.tests) for run in reversed(runs[:-1]) if run.asked is not None]
    return [
        line
        for run, tests in later
        for line in textwrap.wrap(
            f"Asked by themselves on {run.started[:10]} ({version(run.engine)} of ours): {', '.join(tests)}.",
            118,
            break_on_hyphens=False,
        )
    ]


def _asked_in_part(samples: Mapping[str, ranks.Samples]) -> list[str]:
    """Engines whose time was over before all their ladders, which are asked last."""
    tests = {
        name: len({definition.test for definition, _ in told.values() if definition.kind == "ladder"})
        for name, told in samples.items()
    }
    part = [f"{name} {count}" for name, count in tests.items() if count < tests[OURS]]
    text = f"Asked for ladders of only some of {tests[OURS]} tests, for lack of time: {', '.join(part)}."
    return [text] if part else []


def _not_asked(samples: ranks.Samples) -> list[str]:
    """Tests that came into the catalogue after this night."""
    asked = {definition.test for definition, _ in samples.values()}
    new = [name for name in CATALOGUE if name not in asked]
    text = f"In the catalogue by now, and not asked here: {', '.join(new)}."
    return textwrap.wrap(text, 118, break_on_hyphens=False) if new else []


def _rungs(samples: Mapping[str, ranks.Samples], runs: Mapping[str, Sequence[Any]]) -> list[str]:
    """How much of the ladders below was had of each engine, and what stopped the rest."""
    rows = []
    for name, told in samples.items():
        found = [sample for definition, sample in told.values() if definition.kind == "ladder"]
        outcomes = Counter(sample.outcome for sample in found)
        bound = _limits(found)
        others = len(found) - outcomes["value"] - outcomes["timed_out"] - outcomes["not_supported"]
        took = _minutes(runs[name])
        row = (
            name,
            outcomes["value"],
            outcomes["timed_out"],
            bound or "-",
            others,
            outcomes["not_supported"],
        )
        rows.append((*row, took))
    return [
        "## Rungs of the ladders, and what was left out",
        "",
        "A simulation of any engine may take so long, of the processor's time, and where the simulations of one ladder",
        "in one setting have taken as long together its finer rungs are not tried: a front may end there where patience",
        "would lead it on. Ladders are asked in every setting, the gates in the one that the engine names first. A run",
        "beyond 50 ms is timed twice, a shorter one three times, all rungs before any again; nothing else runs then.",
        "",
        "| engine | rungs with a value | out of time | limit | diverged or else failed | not supported | whole night |",
        "|---|---|---|---|---|---|---|",
        *(f"| {' | '.join(map(str, row))} |" for row in rows),
        "",
        f"All nights together, the facts above not counted: {sum(float(row[-1].split()[0]) for row in rows if row[-1] != '-'):.1f} min.",
        "",
    ]


def _minutes(runs: Sequence[Any]) -> str:
    times = [(instant(run.started), instant(run.finished)) for run in runs]
    took = [(e - b).total_seconds() for b, e in times if b is not None and e is not None]
    return f"{sum(took) / 60.0:.1f} min" if len(took) == len(times) else "-"


def _limits(samples: Sequence[Any]) -> str:
    """The limits that samples ran into."""
    late = {m[1] or m[2] for sample in samples if (m := LIMIT.search(sample.failure))}
    return ", ".join(f"{seconds} s" for seconds in sorted(late, key=float))


def _treatment(samples: Mapping[str, ranks.Samples]) -> list[str]:
    """The one budget of all, and how often it told."""
    late = {
        name: sum(d.kind == "ladder" and sample.outcome == "timed_out" for d, sample in told.values())
        for name, told in samples.items()
    }
    bound = _limits([sample for told in samples.values() for _, sample in told.values()])
    return [
        "One budget for all, ours included: a simulation has a limit"
        + (f" ({bound})" if bound else "")
        + ", and so have those",
        f"of one ladder in one setting together; a run is timed up to {REPEATS.most} times, never less than {REPEATS.fewest}, all",
        "rungs before any again, its model built anew. Rungs that ran out of time: "
        f"{sum(late.values()) - late[OURS]} of the others, {late[OURS]} of ours.",
    ]


READING = (
    "An engine is asked in its settings (`tracker engines` says which and why); the best of them counts. A *scene*",
    "is one quantity of one scalar test, its *error* the distance from a closed form or a reference of known accuracy, its",
    "*run time* the processor's for the engine's own steps in one thread, models built before. *First* is which comes within an",
    "error soonest, whatever step that takes. What an engine cannot be asked (a joint, a shape, a force it does not show) is not",
    "supported, by name, and no mark against it. What pushes besides gravity does so from Python in dart, motrixsim, newton,",
    "pybullet and sapien, before every step, and where it is the pull of the sun in planetarium in rapier3d, too, and in mujoco,",
    "in every stage, where there is a motor, too: there the run times of these seven are Python's more than theirs. All",
    "others push in their own loop.",
    "What robots on the floor cost at an overlap of a tenth of a millimetre stands by itself: [MuJoCo and Jolt](overlaps.md).",
)


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
    parser.add_argument("--facts-db", default="sqlite:///build/engine-facts.db")
    parser.add_argument("--page", default=str(PAGE))
    parser.add_argument(
        "--limit",
        type=float,
        default=0.5,
        help="s of one simulation of any engine, and of a ladder's together",
    )
    parser.add_argument("--minutes", type=float, default=math.inf, help="in which all have to be asked")
    parser.add_argument("--missing", action="store_true", help="ask only those the database has no run of")
    parser.add_argument(
        "--facts", action="store_true", help="ask for what kinds of engines do, and nothing else"
    )
    parser.add_argument(
        "--only-page", action="store_true", help="measure nothing, write the page of what is recorded"
    )
    parser.add_argument(
        "--test", action="append", default=[], help="ask this test alone; may be repeated: new questions"
    )
    parser.add_argument("engines", nargs="*", help="by default all that are installed")
    asked: Any = parser.parse_args(arguments)
    names = [] if asked.only_page else asked.engines or installed()
    if asked.facts:
        measure_facts(names, asked.facts_db)
    else:
        names = without_a_run(names, asked.db) if asked.missing else names
        measure(names, asked.db, asked.facts_db, asked.limit, asked.test, asked.minutes)
    Path(asked.page).write_text(page(asked.db, asked.facts_db), encoding="utf-8")
    print(f"wrote {asked.page}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
