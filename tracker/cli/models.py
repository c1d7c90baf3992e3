"""`tracker models PACKAGE`: the model files of an installed package or a folder, listed and checked."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .options import example

if TYPE_CHECKING:
    from spook_tracker.tracker.measure.model_packages import Looked

WORDS = {"model": "·", "runs": "✓", "part": "-", "refused": "✗", "fails": "✗"}


@click.command("models", epilog=example("tracker models gymnasium --engine mujoco"))
@click.argument("packages", metavar="PACKAGE|DIR|FILE...", nargs=-1, required=True)
@click.option(
    "--engine", "engines", metavar="NAME", multiple=True,
    help="Also load each in this engine and take ten steps; with several engines, say which agree, and for how long.",
)  # fmt: skip
@click.option(
    "--agree", is_flag=True, help="Also compare its motion, without contacts and losses, with MuJoCo's."
)
@click.option("--markdown", is_flag=True, help="With several engines: a table for a document.")
@click.option("--all", "everything", is_flag=True, help="Also list files that are parts of other models.")
@click.option(
    "--workers",
    default=2,
    show_default=True,
    type=click.IntRange(1, 256),
    help="Processes that measure models.",
)
def models_command(
    packages: tuple[str, ...],
    engines: tuple[str, ...],
    agree: bool,
    markdown: bool,
    everything: bool,
    workers: int,
) -> None:
    """List the MJCF, URDF and SDF files of installed packages, and say which are models and which load."""
    from spook_tracker.tracker.measure.model_packages import files_of, loaded, looked_at, stood

    from .console import say
    from .report_models import markdown_of, standing_lines

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
        for line in markdown_of(engines, dict(told)) if markdown else standing_lines(told):
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


def _common(paths: Sequence[Path]) -> Path:
    """The folder that holds them all."""
    import os

    return Path(os.path.commonpath([path.absolute().parent for path in paths]))
