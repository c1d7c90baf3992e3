"""What do robots on the floor cost that sink in by no more than a tenth of a millimetre, beside MuJoCo and Jolt in the same run?

    python bench/overlaps.py [--rounds 5] [--page docs/overlaps.md] [TEST ...]

Exit code 1 where another engine is there sooner, 2 where one is not installed.

Asked are the catalogue's ladders of overlaps: the deepest of any two bodies at the end of any step, by geometry from where the
engine says they are. Ours is solved directly at 1/60 s. The others get the longest step of 1/60 s halved again and again
that keeps the overlap, in each of their settings, the cheapest of these counts; Jolt's bodies may sink in by 1e-5 m there instead of
what it allows otherwise, and their edges are sharp. Told is the least processor time of interleaved rounds of the whole run,
models built before; what takes longer than five seconds is run once.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent.parent))

import spook_tracker.engine.find as find
import spook_tracker.scalar_tests.overlap as overlap
from spook_tracker.engine import EngineError, Result, simulate
from spook_tracker.engine.method import PLAIN
from spook_tracker.engine.protocol import NotSupported
from spook_tracker.scalar_tests.case import Ladder
from spook_tracker.scalar_tests.catalogue import CATALOGUE

DEEPEST = 1e-4  # m
FIRST, HALVINGS = 1.0 / 60.0, 8  # s
ALIKE = 1.5  # times the least overlap of those that do not keep it: the cheapest of them is told
ALLOWED = 1e-5  # m, by which Jolt's bodies may sink in
LIMIT, PATIENCE = 30.0, 5.0  # s of one simulation, and of one that is repeated
SETTINGS = {"mujoco": ("defaults", "implicit", "rk4"), "jolt": ("defaults", "many-iterations")}
OURS = "ours"
HEAD = (
    "| scene | ours, 1/60 s: ms per simulated second (a step) | overlap, residual | MuJoCo, 1/60 s: ms (overlap) "
    "| MuJoCo within 0.1 mm | Jolt within 0.1 mm | ours is |",
    "|---|---|---|---|---|---|---|",
)


@dataclass
class Way:
    """An engine in a setting at a step: what it leaves, and the least it took [s of a simulated second]."""

    setting: str
    time_step: float  # s
    deep: float  # m
    run: Callable[[], Result]
    seconds: float = math.inf
    residual: float = 0.0  # m/s
    took: float = 0.0  # s of the last round

    def round(self) -> None:
        done = self.run()
        self.took = done.cpu_seconds
        self.seconds = min(self.seconds, done.cpu_seconds / (done.steps * self.time_step))
        self.residual = done.residual

    @property
    def words(self) -> str:
        return f"{1e3 * self.seconds:.3g} ({self.setting}, 1/{1.0 / self.time_step:.0f} s, {1e3 * self.deep:.3g} mm)"


def rigid(name: str) -> Any:
    """The engine of that name; Jolt such that nothing may sink in that it can hold."""
    peer = find.find(name)
    if name != "jolt":
        return peer
    hard = type(peer.adapter)()
    hard.configurations = tuple(replace(one, options=_hard(one.options)) for one in peer.configurations)
    return find.Peer(hard)


def _hard(options: Mapping[str, Any]) -> dict[str, Any]:
    return {
        **options,
        "rounded": 0.0,
        "settings": {**options["settings"], "mPenetrationSlop": ALLOWED},
    }


def way(ladder: Ladder, setting: str, engine: Callable[..., Result], time_step: float) -> Way:
    """Asked once how deep it goes; a run that fails is as deep as can be."""
    run = partial(ladder.timed, engine, time_step, PLAIN)
    try:
        return Way(setting, time_step, ladder.error(engine, time_step, PLAIN), run)
    except NotSupported:
        raise
    except EngineError:
        return Way(setting, time_step, math.inf, run)


def within(ladder: Ladder, peer: Any, settings: Sequence[str]) -> list[Way]:
    """The longest step of each setting that keeps the overlap; where none does, the finest step of those that come nearest."""
    kept, finest = [], []
    for setting in settings:
        engine = partial(peer.simulate, configuration=setting, time_limit=LIMIT)
        for k in range(HALVINGS + 1):
            found = way(ladder, setting, engine, FIRST / 2**k)
            if found.deep <= DEEPEST:
                kept.append(found)
                break
        else:
            finest.append(found)
    nearest = min((one.deep for one in finest), default=math.inf)
    return kept or [one for one in finest if one.deep <= ALIKE * nearest]


def row(name: str, ladder: Ladder, peers: dict[str, Any], rounds: int) -> tuple[str, bool]:
    """A line of the table, and whether no other is sooner within the overlap."""
    ours = way(ladder, OURS, simulate, FIRST)
    contest: dict[str, list[Way]] = {OURS: [ours]}
    refused: dict[str, str] = {}
    for engine, peer in peers.items():
        try:
            contest[engine] = within(ladder, peer, SETTINGS[engine])
        except NotSupported as lacking:
            refused[engine] = str(lacking).partition(" for ")[2] or str(lacking).partition("support ")[2]
    if "mujoco" in contest:
        contest["as it comes"] = [
            way(ladder, "defaults", partial(peers["mujoco"].simulate, configuration="defaults"), FIRST)
        ]
    for _ in range(rounds):
        for one in itertools.chain(*contest.values()):
            if one.took < PATIENCE:
                one.round()
    cells, ahead = [], [math.inf]
    for engine in peers:
        if engine in refused:
            cells.append(f"not asked: {refused[engine]}")
            continue
        best = min(contest[engine], key=lambda one: one.seconds)
        reached = best.deep <= DEEPEST
        cells.append(best.words if reached else f"not reached: {best.words}")
        ahead.append(best.seconds / ours.seconds)
    free = contest.get("as it comes")
    told = f"{1e3 * free[0].seconds:.3g} ({1e3 * free[0].deep:.2g} mm)" if free else "not asked"
    step = f"{1e3 * ours.seconds:.3g} ({1e3 * ours.seconds * FIRST:.2g})"
    factor = min(ahead)
    first = ours.deep <= DEEPEST and factor >= 1.0
    place = (
        "alone"
        if factor == math.inf
        else f"{factor:.2g} × ahead"
        if first
        else f"{1.0 / factor:.2g} × behind"
    )
    left = f"{1e3 * ours.deep:.0e} mm, {ours.residual:.0e} m/s"
    return f"| {name} | {step} | {left} | {told} | {' | '.join(cells)} | {place} |", first


def asked(tests: Sequence[str]) -> Iterator[tuple[str, Ladder]]:
    """Ladders of overlaps, by the name of the row."""
    for name in tests or CATALOGUE:
        for ladder in CATALOGUE[name].ladders:
            if getattr(ladder.error, "func", None) is overlap.overlap:
                what = ladder.name.removesuffix("overlap").strip()
                yield (f"{name}, {what}" if what else name), ladder


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("tests", nargs="*", help="of the catalogue (default: all with such a ladder)")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--page", type=Path, help="write the table there, too")
    given = parser.parse_args(arguments)
    try:
        peers = {name: rigid(name) for name in SETTINGS}
    except find.EngineMissing as missing:
        print(missing, file=sys.stderr)
        return 2
    lines, behind = list(HEAD), 0
    print("\n".join(lines), flush=True)
    for name, ladder in asked(given.tests):
        line, first = row(name, ladder, peers, given.rounds)
        print(line, flush=True)
        lines.append(line)
        behind += not first
    if given.page:
        versions = ", ".join(f"{name} {peer.build_info.version}" for name, peer in peers.items())
        given.page.write_text("\n".join([*TITLE, f"Measured beside {versions}.", "", *lines, ""]), "utf-8")
    return 1 if behind else 0


TITLE = (
    "# Robots on the floor within a tenth of a millimetre",
    "",
    "Made by `python bench/overlaps.py --page docs/overlaps.md`, which says what is asked. Times are processor time, ms of a",
    "simulated second; in brackets the setting, the longest step that keeps the overlap, and the overlap. An overlap that is not",
    "reached at 1/15360 s is told with what that step costs and leaves. Overlap alone is judged: what a row or a joint gives, a",
    "rebound that is none, or a wrong course are asked by the scenes' other questions.",
    "",
)

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
