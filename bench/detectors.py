"""`make detectors`: what the judge of run times finds and what it cries over, beside asv's steps, Otava and ruptures.

Synthetic noise and steps (tests/histories/noise.py), and histories that continuous integration of other projects has
published (tests/data/recorded: each file says whose, at which commit). Alarms are starts of red stretches after
sixty nights of learning; the other tools see each history whole, which favours them, and a step of theirs counts
where it is upward, of asv's where it is above 5 %, its own threshold for a regression. Delays are of night after night
for all. ruptures splits by the squares of what is left (l2) and by a Gaussian kernel (rbf), in units of the noise from one
night to the next; it leaves its penalty to who asks, so that these were chosen for it on these data (PENALTY).
They are asked where they are installed; `make detectors` puts them into an environment of their own, for Otava pins
its NumPy. `--page FILE` writes the tables as Markdown, with the versions that answered.
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
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import itertools

from spook_tracker.tracker.judge.run_times import judge_noisy
from spook_tracker.tracker.judge.segments import NORMAL
from spook_tracker.tracker.judge.shifts import RARE
from tests.histories import noise as battery

LEARNING, NIGHTS = 60, 560
AFTER = 15  # nights looked at after a step
UPWARD = 0.05
PENALTY = {"l2": 3.0, "rbf": 0.5}  # logarithms of the number of nights: less cries more, more is later
NEAR = 10  # nights: a step may be told so much before or after another tells it
AT = 45  # of sixty nights: where the step of a mix begins
MIXES = [(0.0005, 0.03), (0.002, 0.03), (0.005, 0.03), (0.01, 0.03), (0.01, 0.05), (0.01, 0.1), (0.03, 0.1), (0.03, 0.2), (0.02, 0.05), (0.005, 0.02)]  # fmt: skip
RECORDED = Path(__file__).resolve().parent.parent / "tests" / "data" / "recorded"
EXPLAINED = RECORDED.parent / "recorded_alarms.json"
WHAT_CAN_BE = """\
No test finds every step. The bound for alarms within n nights: a detector with a given rate of false alarms a night raises one
in n nights without a change with at most n times that probability, whatever it uses;
and no test of that size finds more than the most powerful one on all these nights together (Neyman and Pearson; averaging over the
nights before gains nothing, as the power is concave in the size). If level and noise have to be
estimated, no unbiased test finds more than Student's (Lehmann and Romano, Testing Statistical Hypotheses, 5.3).
For +3 % at 1 % noise, three deviations, in four nights after sixty; and for +10 % on
clusters 8 % apart, both known, in six:"""
WHAT_IS = """\
Fifty series of a thousand nights should raise no false alarm, so ours requires a chance of one in 100 000 under correlated
nights, and a permutation test that is valid for any noise. Where the nights before look independent
and normal, Student's test of the last four decides alone: at one in 20 000 until a series has sixty nights, at less the
longer it is, at one in 100 000 from three hundred on. In it no night counts for more than 3.5 deviations: two slow nights
may be an accident of the machine, where the best test, which knows that there are none, needs one. On two clusters the
same test is applied to the distance from the nearer cluster, also of the last six nights. Compare Otava's share with its alarms on
the same noise. A rise must also exceed four deviations of the usual change of twenty nights against the twenty before:
a drifting level changes by more than its noise from night to night suggests. Without this rule ours raises 31 alarms in 10 000
night-values of the walk, and 22 in the seasons."""
MISSING = """\
Of 54k1/boa all fifteen named series with sixty values are included; the unnamed values in its file
mix several benchmarks and are no series. Drift is measured against the first nights, as these data do not
say what was released or accepted."""
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


def ruptures(kernel: str) -> Detector:
    def detect(values: Sequence[float]) -> list[int]:
        import ruptures

        logs = np.log(np.array(values))
        moves = np.diff(logs)
        noise = NORMAL * float(np.median(np.abs(moves - np.median(moves)))) / math.sqrt(2.0)
        search = ruptures.KernelCPD("linear" if kernel == "l2" else kernel, min_size=2)
        ends = search.fit(logs / max(noise, 1e-12)).predict(pen=PENALTY[kernel] * math.log(len(logs)))
        levels = [float(np.mean(logs[i:j])) for i, j in itertools.pairwise([0, *ends])]
        return [end for end, (low, high) in zip(ends, itertools.pairwise(levels), strict=False) if high > low]

    return detect


def detectors() -> dict[str, Detector]:
    """Ours, and those of the others that are installed."""
    found: dict[str, Detector] = {"ours": ours}
    if find_spec("asv"):
        found["asv"] = asv_steps
    if find_spec("otava"):
        found["Otava"] = otava
    if find_spec("ruptures"):
        found |= {f"ruptures {kernel}": ruptures(kernel) for kernel in PENALTY}
    return found


def others() -> str:
    """The other tools that are installed, with their versions."""
    known = {"asv": "asv", "otava": "apache-otava", "ruptures": "ruptures"}
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


def false_alarms(found: dict[str, Detector], which: range) -> list[str]:
    kinds: dict[str, list[list[float]]] = {
        name: [list(map(float, battery.noise(name, s, NIGHTS))) for s in which] for name in battery.STATIONARY
    }
    kinds["two levels, ten nights each, from the third visit on"] = [
        list(map(float, battery.visits(10, 1.08)(battery.generator(draw, s), NIGHTS)))
        for draw in ("visits", "vis2", "vis3")
        for s in which
    ]
    for name in battery.MACHINES:
        both = [battery.machine(name, s, NIGHTS) for s in which]
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


def steps(found: dict[str, Detector], which: range) -> list[str]:
    rows = []
    for name, (_, _, nights) in battery.STEPS.items():
        cells = [f"{name}, within {nights} nights"]
        for detect in found.values():
            told = [delay(detect, list(map(float, battery.step(name, s, LEARNING, AFTER)))) for s in which]
            late = sorted(AFTER + 1 if d is None else d for d in told)
            middle = late[len(late) // 2]
            hits = sum(d is not None and d <= nights for d in told)
            median = f"median {middle}" if middle <= AFTER else f"median above {AFTER}"
            cells.append(f"{100.0 * hits / len(which):.0f} % ({median})")
        rows.append(cells)
    return table(["steps found", *found], rows)


def blamed(found: dict[str, Detector], series: int) -> list[str]:
    """Of the reds of each mix of noise and step: how many name the right commit, and how many one beside it.

    Sixty nights, of which the step begins at `AT`, all seen. `least squares` is told that there is one step. The others
    name the upward step that is nearest to it, which favours them.
    """
    rows = []
    for noise, step in MIXES:
        named: dict[str, list[int]] = {name: [] for name in (*found, "least squares")}
        accused = []
        for seed in range(series):
            values = 1000.0 * (1.0 + noise * np.random.default_rng(seed).standard_normal(60))
            values[AT:] *= 1.0 + step
            night = judge_noisy(list(map(float, values)))[-1]
            if night.state == "detected" and night.worse_at is not None and night.accused is not None:
                named["ours"].append(night.worse_at)
                accused.append(night.accused[0] < AT <= night.accused[1])
            for name in found:
                if name != "ours" and (places := detect_any(name, found[name], list(map(float, values)))):
                    named[name].append(min(places, key=lambda place: abs(place - AT)))
            named["least squares"].append(one_step(values))
        cells = [f"+{100.0 * step:g} % at {100.0 * noise:g} % noise"]
        for places in named.values():
            off = np.abs(np.array(places) - AT)
            cells.append(
                f"{100.0 * np.mean(off == 0):.1f} and {100.0 * np.mean(off <= 1):.1f} % of {len(off)}"
            )
        rows.append([*cells, f"{100.0 * np.mean(accused):.1f} %"])
    head = [f"right commit, and within one, of {series} series", *named, "true one is accused by ours"]
    return table(head, rows)


def detect_any(name: str, detect: Detector, values: Sequence[float]) -> list[int]:
    """Upward steps of another tool, however small."""
    if name != "asv":
        return detect(values)
    from asv.step_detect import detect_steps

    pairs = itertools.pairwise(detect_steps(list(values)))
    return [after[0] for before, after in pairs if after[2] > before[2]]


def one_step(values: Any) -> int:
    """Where two levels fit best, by least squares of logarithms."""
    logs = np.log(values)
    before = np.arange(1, len(logs))
    sums, every = np.cumsum(logs)[:-1], float(np.sum(logs))
    apart = sums / before - (every - sums) / (len(logs) - before)
    return int(before[np.argmax(apart**2 * before * (len(logs) - before))])


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
            others = [p for name in ("asv", "Otava") for p in places.get(name, [])]
            for name, theirs in places.items():
                counts[name] += len(theirs)
            seen = sum(any(abs(p - q) <= NEAR for q in others) for p in places["ours"])
            near, alone = near + seen, alone + len(places["ours"]) - seen
        cells = [f"{file.stem}: {len(histories)} series, {sum(map(len, histories))} values"]
        rows.append([*cells, *(str(count) for count in counts.values()), f"{near} and {alone}"])
    near_others = f"ours within {NEAR} nights of asv's or Otava's, and not"
    head = ["alarms on recorded histories", *found, near_others]
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


def best_of_nights(rate: float, learning: int = LEARNING, nights: int = 4, apart: float = 3.0) -> list[float]:
    """The most that can be found within some nights, a step so many deviations high, at so many alarms a night.

    Level and noise known; noise known; both to be learnt from the nights before.
    """
    from scipy import stats

    size, freedom = nights * rate, learning + nights - 2
    learnt = apart / math.sqrt(1.0 / nights + 1.0 / learning)
    return [
        float(stats.norm.sf(stats.norm.isf(size) - apart * math.sqrt(nights))),
        float(stats.norm.sf(stats.norm.isf(size) - learnt)),
        float(stats.nct.sf(stats.t.isf(size, freedom), freedom, learnt)),
    ]


def best_on_clusters(rate: float, factor: float = 1.08, step: float = 1.10, nights: int = 6) -> float:
    """The same on two clusters that are known, drawn anew each night: by the likelihood ratio, from 200 000 draws.

    Drawn is only what happens after the step: the probability of L > c before it is the mean of 1/L over those above.
    """
    draws = np.random.default_rng(6)
    middles = np.where(draws.random((200_000, nights)) < 0.5, factor, 1.0)
    values = step * middles * (1.0 + 0.01 * draws.standard_normal(middles.shape))

    def log_density(of: float) -> Any:
        humps = [
            np.exp(-0.5 * ((values / (of * middle) - 1.0) / 0.01) ** 2) / middle for middle in (1.0, factor)
        ]
        return np.log(np.maximum((humps[0] + humps[1]) / of, 1e-300))

    ratio = np.sort(np.sum(log_density(step) - log_density(1.0), axis=1))[::-1]
    false = np.cumsum(np.exp(-ratio)) / len(ratio)
    return float(np.searchsorted(false, nights * rate)) / len(ratio)


def bounds() -> list[str]:
    """What no test can exceed at a given rate of false alarms."""
    rows = []
    for rate in (1e-4, RARE, 1e-5):
        cells = [*best_of_nights(rate), best_on_clusters(rate)]
        rows.append(
            [f"one in {1.0 / rate:,.0f}".replace(",", " "), *(f"{100.0 * cell:.1f} %" for cell in cells)]
        )
    head = [
        f"alarms a night, {LEARNING} nights learnt",
        "level and noise known",
        "noise known",
        "both learnt",
        "clusters known",
    ]
    return table(head, rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--series", type=int, default=20, help="of each kind")
    parser.add_argument("--first", type=int, default=0, help="of them: other draws than the page's")
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
        "Made by `make detectors`, not by hand; `bench/detectors.py` explains what is counted,",
        f"the noise in `tests/histories/noise.py`. {given.series} series of {NIGHTS} nights of each kind.",
        *([f"Compared with {others()}."] if len(found) > 1 else []), "",
        *false_alarms(found, range(given.first, given.first + given.series)),
        *steps(found, range(given.first, given.first + 2 * given.series)), *blamed(found, 20 * given.series), *WHAT_CAN_BE.splitlines(), "", *bounds(),
        *WHAT_IS.splitlines(), "",
        *recorded(found, given.recorded), *MISSING.splitlines(), "", *explained(),
    ]  # fmt: skip
    print("\n".join(lines))
    print(f"{time.process_time() - started:.0f} s of processor time")
    if given.page:
        given.page.write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
