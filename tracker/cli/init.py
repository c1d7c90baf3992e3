"""`tracker init`: the first files of a team, for the engine named."""

from __future__ import annotations

from pathlib import Path

import click

from .options import example


@click.command("init", epilog=example("tracker init pebble", "tracker init mujoco"))
@click.argument("engine")
@click.option(
    "--build",
    metavar="COMMAND",
    default="",
    help="Shell command that builds your engine; by default derived from CMakeLists.txt, Cargo.toml, meson.build or Makefile.",
)
@click.option(
    "--tracker",
    "url",
    metavar="URL",
    default="",
    help="Repository of the tracker that the workflow calls; by default the one this package names.",
)
def init(engine: str, build: str, url: str) -> None:
    """Write adapter, tracker.toml and workflow for ENGINE into this folder; existing files are never overwritten.

    ENGINE is one of `tracker engines`, or the name of your own: its adapter then holds a stand-in, so that a first night
    runs before your engine is bound.
    """
    from spook_tracker.tracker.beginning import (
        ADAPTER,
        PLACEHOLDER,
        WORKFLOW,
        build_command,
        first_files,
        home,
        write_first_files,
    )

    from .console import say

    here, at = Path.cwd(), home(url)
    files = first_files(engine, build or build_command(here), at)
    say(f"wrote {', '.join(write_first_files(here, files))}")
    if PLACEHOLDER in at.url:
        say(
            f"note: {WORKFLOW} calls {at.url}: put the repository of the tracker there, or give it with --tracker"
        )
    if not at.commit:
        say(f"note: this tracker does not know its commit; {WORKFLOW} follows the branch {at.revision}")
    say("next:")
    say("  tracker run falling_object               # the first table")
    if ADAPTER in files:
        say(f"  edit {ADAPTER}                 # bind your engine where the stand-in is")
    say("  tracker nightly --quick --out public     # a night and its website")
    say("  git add . ; git commit                   # but history.db* and public/: name them in .gitignore")
