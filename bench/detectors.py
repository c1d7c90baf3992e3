"""`make detectors`: what the judge of run times finds and what it cries over, beside asv's steps and Otava.

Synthetic noise and steps (tests/noise_battery.py), and histories that continuous integration of other projects has
published (tests/data/recorded: each file says whose, at which commit). Alarms are starts of red stretches after
sixty nights of learning; the other tools see each history whole, which favours them, and a step of theirs counts
where it is upward and above 5 %, asv's own threshold for a regression. Delays are of night after night for all.
asv and apache-otava are asked where they are installed; `make detectors` puts them into an environment of their own,
for Otava pins its NumPy. `--page FILE` writes the tables as Markdown, with the versions that answered.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Callable, Sequence
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import itertools

from spook_tracker.tracker.judge.noise import judge_noisy
from spook_tracker.tracker.judge.shifts import RARE
from tests import noise_battery as battery

LEARNING, NIGHTS = 60, 560
AFTER = 15  # nights looked at after a step
UPWARD = 0.05
NEAR = 10  # nights: a step may be told so much before or after another tells it
RECORDED = Path(__file__).resolve().parent.parent / "tests" / "data" / "recorded"
EXPLAINED = RECORDED.parent / "recorded_alarms.json"
WHAT_CAN_BE = """\
No test finds every step. The mean of four nights, three deviations up, is what tells +3 % at 1 % noise after four
nights; the best test for it (Neyman and Pearson) at a rate of false alarms finds no more than this. Fifty series of a
thousand nights shall be silent, so ours asks for one in 100 000, and Student's test is then what sixty nights allow.
On two clusters nights are drawn from both: one draw in 64 puts all of six into the faster one, where +10 % ends 2 %
above the slower; no second test confirms what is told there, so it has to be as rare by itself.
Otava's share stands beside its alarms on the same noise."""
MISSING = """\
Of 54k1/boa all that has sixty values and a name is here, fifteen series; what its file holds beside them under no name
mixes several benchmarks in turn and is no series. Drift is told against the first nights, as nothing in these data
says what was released or accepted."""
Detector = Callable[[Sequence[float]], list[int]]  # places where it says that it became slower


def ours(values: Sequence[float]) -> list[int]:
    red = [night.state == "detected" for night in judge_noisy(values)]
    return [place for place in range(1, len(red)) if red[place] and not red[place - 1]]


def asv_steps(values: Sequence[float]) -> list[int]:
    from asv.step_detect import detect_steps

    steps = detect_steps(list(values))
    pairs = itertools.pairwise(steps)
    return [after[0] for before, after in pairs if after[2] > (1.0 + UPWARD) * before[2]]


def otava(values: Sequence[float]) -> list[int]:
    from otava.series import Metric, Series

    series = Series("t", None, list(range(len(values))), {"s": Metric(1, 1.0)}, {"s": list(values)}, {})
    points = series.analyze().change_points["s"]
    return [p.index for p in points if p.stats.mean_2 > p.stats.mean_1]


def detectors() -> dict[str, Detector]:
    """Ours, and those of the others that are installed."""
    found: dict[str, Detector] = {"ours": ours}
    if find_spec("asv"):
        found["asv"] = asv_steps
    if find_spec("otava"):
        found["Otava"] = otava
    return found


def others() -> str:
    """The other tools that are installed, with their versions."""
    known = {"asv": "asv", "otava": "apache-otava"}
    return ", ".join(f"{tool} {version(tool)}" for module, tool in known.items() if find_spec(module))


def alarms(detect: Detector, histories: Sequence[Sequence[float]]) -> tuple[int, int]:
    """Alarms after the nights of learning, and night-values they were raised in."""
    raised = sum(place >= LEARNING for values in histories for place in detect(values))
    return raised, sum(len(values) - LEARNING for values in histories)


def delay(detect: Detector, values: Sequence[float]) -> int | None:
    """Nights until the step is told, the first being one; None if none of the first nights tells it."""
    for nights in range(1, AFTER + 1):
        if any(place >= LEARNING - 2 for place in detect(values[: LEARNING + nights])):
            return nights
    return None


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    rule = ["---", *["---:"] * (len(head) - 1)]
    return ["| " + " | ".join(row) + " |" for row in (head, rule, *rows)] + [""]


def false_alarms(found: dict[str, Detector], series: int) -> list[str]:
    kinds: dict[str, list[list[float]]] = {
        name: [list(map(float, battery.noise(name, s, NIGHTS))) for s in range(series)]
        for name in battery.STATIONARY
    }
    kinds["two levels, ten nights each, from the third visit on"] = [
        list(map(float, battery.visits(10, 1.08)(battery.generator(draw, s), NIGHTS)))
        for draw in ("visits", "vis2", "vis3")
        for s in range(series)
    ]
    for name in battery.MACHINES:
        both = [battery.machine(name, s, NIGHTS) for s in range(series)]
        kinds[name] = [list(map(float, seconds)) for seconds, _ in both]
        kinds[f"{name}, by the kernel"] = [list(map(float, seconds / kernel)) for seconds, kernel in both]
    rows = []
    for name, histories in kinds.items():
        cells = [name]
        for detect in found.values():
            raised, values = alarms(detect, histories)
            cells.append(f"{1e4 * raised / values:.1f}")
        rows.append(cells)
    return table(["alarms in 10 000 night-values", *found], rows)


def steps(found: dict[str, Detector], series: int) -> list[str]:
    rows = []
    for name, (_, _, nights) in battery.STEPS.items():
        cells = [f"{name}, within {nights} nights"]
        for detect in found.values():
            told = [
                delay(detect, list(map(float, battery.step(name, s, LEARNING, AFTER)))) for s in range(series)
            ]
            late = sorted(AFTER + 1 if d is None else d for d in told)
            middle = late[len(late) // 2]
            hits = sum(d is not None and d <= nights for d in told)
            median = f"median {middle}" if middle <= AFTER else f"median above {AFTER}"
            cells.append(f"{100.0 * hits / series:.0f} % ({median})")
        rows.append(cells)
    return table(["steps found", *found], rows)


def histories_of(file: Path) -> list[list[float]]:
    """The series of a recorded history: tests/data/recorded says where its numbers are from."""
    return list(json.loads(file.read_text(encoding="utf-8"))["values"].values())


def recorded(found: dict[str, Detector], files: Sequence[Path]) -> list[str]:
    """Alarms of each detector, and how many of ours stand within a few nights of a step that another sees."""
    rows = []
    for file in files:
        near = alone = 0
        counts = dict.fromkeys(found, 0)
        histories = histories_of(file)
        for values in histories:
            places = {name: [p for p in detect(values) if p >= LEARNING] for name, detect in found.items()}
            others = [p for name, theirs in places.items() if name != "ours" for p in theirs]
            for name, theirs in places.items():
                counts[name] += len(theirs)
            seen = sum(any(abs(p - q) <= NEAR for q in others) for p in places["ours"])
            near, alone = near + seen, alone + len(places["ours"]) - seen
        cells = [f"{file.stem}: {len(histories)} series, {sum(map(len, histories))} values"]
        rows.append([*cells, *(str(count) for count in counts.values()), f"{near} and {alone}"])
    head = ["alarms on recorded histories", *found, f"ours within {NEAR} nights of another's, and not"]
    return table(head, rows) if rows else []


def explained() -> list[str]:
    """Each alarm of ours on the recorded histories and what is behind it: tests hold that none is left out."""
    told = json.loads(EXPLAINED.read_text(encoding="utf-8"))
    rows = [
        [
            f"{alarm['file']}: {alarm['series']}", alarm["commit"], str(alarm["night"]), alarm["size"],
            alarm["near"] or "–", alarm["why"],
        ]
        for alarm in told
    ]  # fmt: skip
    return table(["each of ours", "commit", "value", "size", "another's near", "what is behind it"], rows)


def bounds() -> list[str]:
    """What no test can exceed: +3 % at 1 % noise within four nights, at a given rate of false alarms."""
    from scipy import stats

    rows = []
    for rare in (1e-4, RARE, 1e-5):
        alarm = stats.norm.isf(rare)
        apart = 3.0 / math.sqrt(1.0 / 4.0 + 1.0 / LEARNING)
        cells = [
            stats.norm.sf(alarm - 3.0 * math.sqrt(4.0)),
            stats.norm.sf(alarm - apart),
            stats.nct.sf(stats.t.isf(rare, LEARNING - 1), LEARNING - 1, apart),
        ]
        rows.append(
            [f"one in {1.0 / rare:,.0f}".replace(",", " "), *(f"{100.0 * cell:.1f} %" for cell in cells)]
        )
    head = [
        f"false alarms a night, {LEARNING} nights learnt",
        "level and noise known",
        "noise known",
        "both learnt",
    ]
    return table(head, rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--series", type=int, default=20, help="of each kind")
    parser.add_argument(
        "--recorded",
        type=Path,
        nargs="*",
        default=sorted(RECORDED.glob("*.json")),
        help="files as in tests/data",
    )
    parser.add_argument("--page", type=Path, help="write the tables here")
    given = parser.parse_args()
    found = detectors()
    started = time.process_time()
    lines = [
        "# Detectors of slower run times, scored", "",
        "Made by `make detectors`, not by hand; what is counted stands at the head of `bench/detectors.py`,",
        f"the noise in `tests/noise_battery.py`. {given.series} series of {NIGHTS} nights of each kind.",
        *([f"Beside ours: {others()}."] if len(found) > 1 else []), "",
        *false_alarms(found, given.series), *steps(found, 2 * given.series), *WHAT_CAN_BE.splitlines(), "", *bounds(),
        *recorded(found, given.recorded), *MISSING.splitlines(), "", *explained(),
    ]  # fmt: skip
    print("\n".join(lines))
    print(f"{time.process_time() - started:.0f} s of processor time")
    if given.page:
        given.page.write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
