"""What a release changed of a model, in words: which body, when, by how much, and how much that is.

Takes changes of series whose rounding was measured (tracker.measure.model_files); their names say body and quantity:
`bowl.rest_z`, `bowl.place@0.5s`, `settled`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

AT_REST = re.compile(r"(?P<body>.+)\.rest_(?P<what>x|y|z|turn)")
ON_THE_WAY = re.compile(r"(?P<body>.+)\.(?P<what>place|turn)@(?P<time>[0-9.e+-]+)s")
IN_THE_MEAN = re.compile(r"(?P<body>.+)\.mean_place")
NAMED = 3  # bodies in a sentence
WHOLE = {  # of a model as a whole
    "settled": "settles at {after} s, not at {before} s",
    "predictable_time": "can be predicted for {after} s, not for {before} s",
    "overlap": "overlaps by {after} m at rest, not by {before} m",
    "creep": "creeps at {after} m/s at rest, not at {before} m/s",
    "load": "contacts carry {after} of the weight at rest, not {before}",
    "differing_runs": "{after} of two repeated runs differ, not {before}",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Moved:
    """One value that is another one: `severity` is how much that is, as the judge says it."""

    metric: str
    unit: str
    before: float
    after: float
    severity: str = ""
    became: str = ""  # in words, where the outcome is another one: "value became diverged"


def first_look(values: Mapping[str, float], moving: str = "") -> str:
    """What one run says of a model by itself: how it ends (`moving`: in what words it does not rest), how long it can be
    predicted, what a step takes."""
    found = [moving] if moving else []
    if not moving and "settled" in values:
        found.append(f"rests from {values['settled']:.3g} s on")
    if "predictable_time" in values:
        found.append(f"can be predicted for {values['predictable_time']:.3g} s")
    if {"step_time", "real_time_factor"} <= {*values}:
        fast = values["real_time_factor"]
        found.append(f"{1e6 * values['step_time']:.3g} µs a step, {fast:.3g} times real time")
    return "; ".join(found)


def severity(sentence: str) -> str:
    """What a judge's sentence says after the distance."""
    return sentence.partition(": ")[2]


def words(moves: Iterable[Moved]) -> list[str]:
    """A sentence for what rests otherwise, one for what moves otherwise, one for each quantity of the whole."""
    moves = list(moves)
    became = {one.became: one.metric for one in moves if one.became}
    values = [one for one in moves if not one.became]
    found = [f"{metric} and its like: {how}" for how, metric in became.items()]
    return [*found, *_at_rest(values), *_on_the_way(values), *_in_the_mean(values), *_whole(values)]


def _at_rest(moves: Sequence[Moved]) -> list[str]:
    bodies: dict[str, dict[str, Moved]] = {}
    for one in moves:
        if read := AT_REST.fullmatch(one.metric):
            bodies.setdefault(read["body"], {})[read["what"]] = one
    told = sorted(bodies.items(), key=lambda item: -max(abs(m.after - m.before) for m in item[1].values()))
    sentences = [f"{body} rests {_pose(found)}" for body, found in told[:NAMED]]
    return _with_rest(sentences, len(told))


def _pose(found: Mapping[str, Moved]) -> str:
    change = {what: one.after - one.before for what, one in found.items()}
    parts = []
    if up := change.get("z", 0.0):
        parts.append(f"{abs(up):.3g} m {'higher' if up > 0.0 else 'lower'}")
    if aside := math.hypot(change.get("x", 0.0), change.get("y", 0.0)):
        parts.append(f"{aside:.3g} m aside")
    if turned := change.get("turn", 0.0):
        parts.append(
            f"turned by {abs(turned):.3g} rad more" if turned > 0 else f"turned by {abs(turned):.3g} rad less"
        )
    worst = max(found.values(), key=lambda one: (one.unit == "m", abs(one.after - one.before)))
    return " and ".join(parts) + (f" ({worst.severity})" if worst.severity else "")


def _on_the_way(moves: Sequence[Moved]) -> list[str]:
    times: dict[float, dict[str, Moved]] = {}
    for one in moves:
        if read := ON_THE_WAY.fullmatch(one.metric):
            here = times.setdefault(float(read["time"]), {})
            there = here.get(read["body"])
            if there is None or abs(one.after - one.before) > abs(there.after - there.before):
                here[read["body"]] = one
    if not times:
        return []
    told = []
    for at in dict.fromkeys((min(times), max(times))):
        body, one = max(times[at].items(), key=lambda item: abs(item[1].after - item[1].before))
        much = f" ({one.severity})" if one.severity else ""
        told.append(f"{body} by {abs(one.after - one.before):.3g} {one.unit} at {at:g} s{much}")
    return [f"moves otherwise from {min(times):g} s on: {'; '.join(told)}"]


def _in_the_mean(moves: Sequence[Moved]) -> list[str]:
    """Of bodies that only a distribution tells of, the one whose mean has moved most."""
    told = {read["body"]: one for one in moves if (read := IN_THE_MEAN.fullmatch(one.metric))}
    if not told:
        return []
    body, one = max(told.items(), key=lambda item: abs(item[1].after - item[1].before))
    before, after = _told_apart(one)
    return [f"{body} ends {after} m from its start in the mean over small pushes, not {before} m"]


def _whole(moves: Sequence[Moved]) -> list[str]:
    found = []
    for one in moves:
        if one.metric in WHOLE:
            before, after = _told_apart(one)
            found.append(WHOLE[one.metric].format(before=before, after=after))
    return found


def _told_apart(one: Moved) -> tuple[str, str]:
    """Both values, with as many digits as tell them apart."""
    for digits in (3, 6, 9, 12):
        before, after = f"{one.before:.{digits}g}", f"{one.after:.{digits}g}"
        if before != after:
            break
    return before, after


def _with_rest(sentences: list[str], count: int) -> list[str]:
    more = count - len(sentences)
    if more and sentences:
        sentences[-1] += (
            f", and so {'does' if more == 1 else 'do'} {more} more bod{'y' if more == 1 else 'ies'}"
        )
    return sentences
