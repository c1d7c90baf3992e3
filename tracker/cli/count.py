"""`tracker count`: instructions where the processor shows no counter."""

from __future__ import annotations

import click

from .options import example, source_options
from .settings import present


@click.command(epilog=example("tracker count pendulum --steps 100"))
@click.argument("tests", nargs=-1, required=True, metavar="TEST...")
@click.option(
    "--steps",
    default=100,
    show_default=True,
    type=click.IntRange(min=1),
    help="Steps to count of each example.",
)
@source_options
def count(tests: tuple[str, ...], steps: int, engine: str, catalogue: str) -> None:
    """Count the engine's instructions in the example scenes of tests, by valgrind's callgrind.

    For machines without a hardware counter, as most virtual machines; takes about a minute a test. Independent of the
    clock.
    """
    from spook_tracker.tracker.measure.callgrind import count_instructions

    from .console import say

    for test in tests:
        found = count_instructions(engine, catalogue, test, steps, present().folder)
        say(f"{test}: {found.instructions} instructions in {steps} steps, in {', '.join(found.objects)}")
