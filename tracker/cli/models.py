"""`tracker models PACKAGE`: the model files of an installed package or a folder, listed and checked."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING

import click

from spook_tracker.tracker.cli.options import example

if TYPE_CHECKING:
    from spook_tracker.tracker.measure.model_packages import Looked
    from spook_tracker.tracker.measure.model_standing import Cause, Checkpoint, Standing

WORDS = {"model": "·", "runs": "✓", "part": "-", "refused": "✗", "fails": "✗"}


@click.command("models", epilog=example("tracker models gymnasium --engine mujoco"))
@click.argument("packages", metavar="PACKAGE|DIR|FILE...", nargs=-1, required=True)
@click.option(
    "--engine", "engines", metavar="NAME", multiple=True,
    help="Also load each in this engine and take ten steps; of several, say which stand together at growing times.",
)  # fmt: skip
@click.option(
    "--agree", is_flag=True, help="Also compare its swing, without contacts and losses, with MuJoCo's."
)
@click.option("--markdown", is_flag=True, help="Of several engines: a table for a document.")
@click.option("--all", "everything", is_flag=True, help="Also list files that are parts of others.")
@click.option("--workers", default=2, show_default=True, type=click.IntRange(1, 256))
def models_command(
    packages: tuple[str, ...],
    engines: tuple[str, ...],
    agree: bool,
    markdown: bool,
    everything: bool,
    workers: int,
) -> None:
    """List the MJCF, URDF and SDF files of installed packages, and say which are models and which load."""
    from spook_tracker.tracker.cli.console import say
    from spook_tracker.tracker.measure.model_packages import files_of, loaded, looked_at, stood

    paths = [path for package in packages for path in files_of(package)]
    if not paths:
        say(f"{' and '.join(packages)}: no .xml, .mjcf, .urdf or .sdf files there")
        return
    common = _common(paths)
    if markdown and len(engines) < 2:
        raise click.UsageError("--markdown is of several engines; say which with --engine")
    if len(engines) > 1:
        told = (
            (
                str(path.absolute().relative_to(common)),
                one.replace(f"{common}/", "") if isinstance(one, str) else one,
            )
            for path, one in stood(paths, engines, workers)
        )
        for line in markdown_of(engines, dict(told)) if markdown else _lines(told):
            say(line)
        return
    engine = engines[0] if engines else None
    found: list[Looked] = []
    if agree and engine is None:
        raise click.UsageError("--agree compares an engine with MuJoCo; say which with --engine")
    for looked in loaded(paths, engine, workers, agree) if engine else map(looked_at, paths):
        found.append(looked)
        if looked.word == "part" and not everything:
            continue
        name = str(looked.path.absolute().relative_to(common))
        what = f"{looked.format}, {looked.bodies} bodies, {looked.files} files" if looked.format else ""
        sentence = looked.sentence.replace(f"{common}/", "")
        say(f"{WORDS[looked.word]} {name:<44} {what:<28} {_swing(looked)}{sentence}".rstrip())
    counts = Counter(looked.word for looked in found)
    say(
        f"{len(found)} files: {', '.join(f'{count} {word}' for word, count in counts.most_common())}; in {common}"
    )
    if agree:
        alike = [looked for looked in found if looked.agrees]
        moving = sum(looked.bodies >= 3 for looked in alike)
        both = sum(looked.word == "runs" for looked in alike)
        apart = [looked.agreement for looked in found if looked.agreement and not looked.agrees]
        otherwise = sum(one.resolved for one in apart)
        say(
            f"{len(alike)} swing as in MuJoCo, {moving} of them with three bodies on joints or more; "
            f"{both} of them also run as the file has them; {otherwise} swing otherwise; of {len(apart) - otherwise} the steps say too "
            f"little; {sum(looked.out_of_time for looked in found)} out of time"
        )


def _swing(looked: Looked) -> str:
    """How far it swings from where it does in MuJoCo, of its size, and what both engines' own steps leave."""
    if (found := looked.agreement) is None:
        return ""
    sign = "=" if looked.agrees else "≠" if found.resolved else "?"
    return f"{sign} {found.apart:7.1e} (steps {found.own:.0e}, {found.reference:.0e}) "


def _lines(told: Iterable[tuple[str, Standing | str]]) -> Iterator[str]:
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


def _because(cause: Cause) -> str:
    """Why two engines part, in a sentence."""
    said = f"{' and '.join(cause.engines)} part at {cause.time:g} s, by {cause.apart:.2g} m"
    if not cause.parts:
        return f"{said}, whatever part of the model is left out"
    said += f", over {' and '.join(cause.parts)}: without, {cause.left:.1g} m"
    if cause.softness:
        said += f"; mujoco itself moves {cause.softness:.1g} m where these give way eight times faster"
    return said


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


def _common(paths: Sequence[Path]) -> Path:
    """The folder that holds them all."""
    import os

    return Path(os.path.commonpath([path.absolute().parent for path in paths]))
