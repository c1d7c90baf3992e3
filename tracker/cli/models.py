"""`tracker models PACKAGE`: the model files of an installed package or a folder, listed and checked."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from spook_tracker.tracker.cli.options import example

if TYPE_CHECKING:
    from spook_tracker.tracker.measure.model_packages import Looked
    from spook_tracker.tracker.measure.model_standing import Checkpoint, Standing

WORDS = {"model": "·", "runs": "✓", "part": "-", "refused": "✗", "fails": "✗"}


@click.command("models", epilog=example("tracker models gymnasium --engine mujoco"))
@click.argument("package", metavar="PACKAGE|DIR|FILE")
@click.option(
    "--engine", "engines", metavar="NAME", multiple=True,
    help="Also load each in this engine and take ten steps; of several, say which stand together at growing times.",
)  # fmt: skip
@click.option(
    "--agree", is_flag=True, help="Also compare its swing, without contacts and losses, with MuJoCo's."
)
@click.option("--all", "everything", is_flag=True, help="Also list files that are parts of others.")
@click.option("--workers", default=2, show_default=True, type=click.IntRange(1, 256))
def models_command(
    package: str, engines: tuple[str, ...], agree: bool, everything: bool, workers: int
) -> None:
    """List the MJCF, URDF and SDF files of an installed package, and say which are models and which load."""
    from spook_tracker.tracker.cli.console import say
    from spook_tracker.tracker.measure.model_packages import files_of, loaded, looked_at, stood

    paths = files_of(package)
    if not paths:
        say(f"{package} holds no .xml, .mjcf, .urdf or .sdf files")
        return
    common = _common(paths)
    if len(engines) > 1:
        for path, found_together in stood(paths, engines, workers):
            for line in _standing_lines(str(path.relative_to(common)), found_together):
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
        name = str(looked.path.relative_to(common))
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
        say(
            f"{len(alike)} swing as in MuJoCo, {moving} of them with three bodies on joints or more; "
            f"{both} of them also run as the file has them"
        )


def _swing(looked: Looked) -> str:
    """How far it swings from where it does in MuJoCo, of its size, and what both engines' own steps leave."""
    if (found := looked.agreement) is None:
        return ""
    sign = "=" if looked.agrees else "≠" if found.resolved else "?"
    return f"{sign} {found.apart:7.1e} (steps {found.own:.0e}, {found.reference:.0e}) "


def _standing_lines(name: str, found: Standing | str) -> list[str]:
    """One model: a line for each time, with the groups of engines and how far they are apart."""
    if isinstance(found, str):
        return [f"{name}: {found}"]
    lines = [f"{name}, {found.size:.3g} m: engines within their own step errors stand together"]
    for point in found.checkpoints:
        first = point.groups[0]
        groups = " | ".join(_group(point, group, first) for group in point.groups)
        lines.append(f"  {point.time:5.2f} s  {groups}")
    return lines + [f"  {engine}: {why}" for engine, why in found.refused.items()]


def _group(point: Checkpoint, group: tuple[str, ...], first: tuple[str, ...]) -> str:
    """mujoco = spook; and of another group how far [m] it is from the first, and that in its step errors."""
    names = " = ".join(f"{engine} ±{point.error[engine]:.1e}" for engine in group)
    if group == first:
        return names
    far, errors = min(
        (point.distance[(a, b) if (a, b) in point.distance else (b, a)], point.error[a] + point.error[b])
        for a in group
        for b in first
    )
    return (
        f"{names}, {far:.2g} m away, {far / errors:.2g} of both errors"
        if errors
        else f"{names}, {far:.2g} m away"
    )


def _common(paths: Sequence[Path]) -> Path:
    """The folder that holds them all."""
    import os

    return Path(os.path.commonpath([path.parent for path in paths]))
