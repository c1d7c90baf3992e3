"""`tracker models PACKAGE`: the model files of an installed package or a folder, listed and checked."""

from __future__ import annotations

from collections import Counter
from typing import Any

import click

from spook_tracker.tracker.cli.options import example

WORDS = {"model": "·", "runs": "✓", "part": "-", "refused": "✗", "fails": "✗"}


@click.command("models", epilog=example("tracker models gymnasium --engine mujoco"))
@click.argument("package", metavar="PACKAGE|DIR")
@click.option("--engine", metavar="NAME", help="Also load each in this engine and take ten steps.")
@click.option("--all", "everything", is_flag=True, help="Also list files that are parts of others.")
@click.option("--workers", default=2, show_default=True, type=click.IntRange(1, 256))
def models_command(package: str, engine: str | None, everything: bool, workers: int) -> None:
    """List the MJCF, URDF and SDF files of an installed package, and say which are models and which load."""
    from spook_tracker.tracker.cli.console import say
    from spook_tracker.tracker.measure.model_packages import files_of, loaded, looked_at

    paths = files_of(package)
    if not paths:
        say(f"{package} holds no .xml, .mjcf, .urdf or .sdf files")
        return
    common = _common(paths)
    found: list[Any] = []
    for looked in loaded(paths, engine, workers) if engine else map(looked_at, paths):
        found.append(looked)
        if looked.word == "part" and not everything:
            continue
        name = str(looked.path.relative_to(common))
        what = f"{looked.format}, {looked.bodies} bodies, {looked.files} files" if looked.format else ""
        say(
            f"{WORDS[looked.word]} {name:<44} {what:<28} {looked.sentence.replace(f'{common}/', '')}".rstrip()
        )
    counts = Counter(looked.word for looked in found)
    say(
        f"{len(found)} files: {', '.join(f'{count} {word}' for word, count in counts.most_common())}; in {common}"
    )


def _common(paths: Any) -> Any:
    """The folder that holds them all."""
    import os
    from pathlib import Path

    return Path(os.path.commonpath([path.parent for path in paths]))
