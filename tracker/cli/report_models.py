"""Where several engines take a model, in lines and as a table for a document."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from spook_tracker.tracker.measure.model_standing import Cause, Checkpoint, Standing


LEAST = 1e-5  # m, rad: what a start is told to be off by


def standing_lines(told: Iterable[tuple[str, Standing | str]]) -> Iterator[str]:
    """Of each model a line for each time, with the groups of engines and how far they are apart."""
    for name, found in told:
        if isinstance(found, str):
            yield f"{name}: {found}"
            continue
        yield f"{name}, {found.size:.3g} m: engines within their own step errors stand together"
        for point in found.checkpoints:
            first = point.groups[0]
            groups = " | ".join(_group(point, group, first) for group in point.groups)
            yield f"  {point.time:5.2f} s  {groups}"
        if found.ends:
            yield f"  at the end  {'; '.join(f'{engine} {_end(found, engine)}' for engine in found.ends)}"
        if found.cause:
            yield f"  {_because(found.cause)}"
        yield from (f"  {engine}: {why}" for engine, why in found.refused.items())


def markdown_of(engines: Sequence[str], told: Mapping[str, Standing | str]) -> Iterator[str]:
    """A row for each model: up to when each engine stands with the first, and how far from it it ends; then why."""
    first, *others = engines
    found = {name: one for name, one in sorted(told.items()) if not isinstance(one, str)}
    yield f"| model | size, m | ends | {' | '.join(others)} |"
    yield f"|---|---|---|{'---|' * len(others)}"
    for name, one in found.items():
        end = f"{one.checkpoints[-1].time:g} s" if one.checkpoints else ""
        cells = " | ".join(_cell(one, first, other) for other in others)
        yield f"| `{name}` | {one.size:.3g} | {end} | {cells} |"
    yield from ("", "How each ends:", "")
    yield f"| model | {' | '.join(engines)} |"
    yield f"|---|{'---|' * len(engines)}"
    for name, one in found.items():
        ended = (_end(one, engine, first if engine != first else "") for engine in engines)
        yield f"| `{name}` | {' | '.join(ended)} |"
    yield ""
    yield from (f"- {_counted(found.values(), first, other)}." for other in others)
    yield from (
        "",
        f"Why {first} and another engine part, where both can be asked without parts of the model:",
        "",
    )
    yield from (f"- `{name}`: {_because(one.cause)}." for name, one in found.items() if one.cause)
    yield from ("", "What takes no part, or breaks off:", "")
    alike: dict[str, list[str]] = {}  # names by what is said of them
    for name, answer in sorted(told.items()):
        refused = {"": answer} if isinstance(answer, str) else answer.refused
        for engine, why in refused.items():
            sentence = f"{engine}: {why}" if engine else why
            alike.setdefault(sentence.replace(Path(name).name, "the file"), []).append(f"`{name}`")
    yield from (f"- {why}: {', '.join(names)}." for why, names in sorted(alike.items()))


def _cell(found: Standing, first: str, other: str) -> str:
    """Up to which time they stand together, and how far they are apart at the end; ? where their errors are too large to tell."""
    shared = [one for one in found.checkpoints if first in one.error and other in one.error]
    if not shared:
        return "-"
    alike = list(takewhile(lambda one: one.together(first, other) and not one.blurred(first, other), shared))
    if len(alike) == len(found.checkpoints):
        return "="
    end = shared[-1]
    if end.blurred(first, other) and end.together(first, other):
        then = "?"
    else:
        then = f"{end.apart(first, other):.1g} m"
    return f"= to {alike[-1].time:g} s, then {then}" if alike else then


def _end(found: Standing, engine: str, beside: str = "") -> str:
    """falls, rests from 1.8 s; and beside another engine: = where it rests alike, else how far from there."""
    if engine not in found.ends:
        return "-"
    end = found.ends[engine]
    said = "falls, " * found.falls(engine) + (f"rests from {end.settled:.1f} s" if end.rests else "moves")
    if not beside or beside not in found.ends or not (end.rests and found.ends[beside].rests):
        return said
    return f"{said} {'=' if found.rests_alike(beside, engine) else f', {found.rest_apart(beside, engine):.1g} m away'}".replace(
        " ,", ","
    )


def _counted(found: Iterable[Standing], first: str, other: str) -> str:
    """Of how many models two engines say the same at the end."""
    both = [one for one in found if first in one.ends and other in one.ends]
    resting = [one for one in both if one.ends[first].rests]
    alike = sum(one.rests_alike(first, other) for one in resting)
    too = sum(one.ends[other].rests for one in resting)
    moving = [one for one in both if not one.ends[first].rests]
    still = sum(not one.ends[other].rests for one in moving)
    falling = [one for one in both if one.falls(first)]
    fall = sum(one.falls(other) for one in falling)
    others = sum(one.falls(other) for one in both) - fall
    return (
        f"{other} takes {len(both)} of those that {first} does. Of {len(resting)} that rest in {first} {alike} rest alike and "
        f"{too - alike} elsewhere, {len(resting) - too} move; of {len(moving)} that move {still} move. Of {len(falling)} that fall "
        f"in {first} {fall} fall, and {others} that do not"
    )


def _because(cause: Cause) -> str:
    """Why two engines part, in a sentence."""
    said = f"{' and '.join(cause.engines)} part at {cause.time:g} s, by {cause.apart:.2g} m"
    if not cause.parts:
        return f"{said}, whatever part of the model is left out"
    said += f", over {' and '.join(cause.parts)}: without, {cause.left:.1g} m"
    if cause.rigid is not None:
        said += f"; in small steps, rigid and without rebound in mujoco, too, {cause.rigid:.1g} m"
    begins = [f"{cause.beyond:.2g} beyond its limits (m or rad)"] if cause.beyond > LEAST else []
    begins += [f"with an overlap of {cause.overlap:.2g} m"] if cause.overlap > LEAST else []
    return f"{said}; it begins {' and '.join(begins)}" if begins else said


def _group(point: Checkpoint, group: tuple[str, ...], first: tuple[str, ...]) -> str:
    """mujoco = spook; and of another group how far [m] it is from the first, and that in its step errors."""
    names = " = ".join(f"{engine} ±{point.error[engine]:.1e}" for engine in group)
    if group == first:
        return names
    far, errors = min((point.apart(a, b), point.error[a] + point.error[b]) for a in group for b in first)
    return (
        f"{names}, {far:.2g} m away, {far / errors:.2g} of both errors"
        if errors
        else f"{names}, {far:.2g} m away"
    )
