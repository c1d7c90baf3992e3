"""`make mutants`: build engines that are wrong on purpose, and see that each is caught by the test that is named for it.

A clone of this repository is built once and asked the named tests. Then it is changed in one place at a time,
committed, built again (one file, mostly) and asked again: the comparison of the two runs must say *regressed* of a
series of the named test. At the end the change is taken back, and every answer must be there again, to the bit.
Mutants of the tracker itself are put to the named test of the test suite instead.

`python bench/mutants.py NAME …` runs only those named, `--tonight 4` four of them, others every night, `--page FILE`
writes the table as Markdown, `--record FILE` the page of the website: `tracker publish --mutants FILE` shows it.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import re
import subprocess
import sys
import sysconfig
import tempfile
import time
import tomllib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import msgspec

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import spook_tracker.tracker.measure.commits as commits
from bench.mutant_list import MUTANTS, Mutant
from spook_tracker.tracker.document.json_form import decode
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.judge.choice import worst_change
from spook_tracker.tracker.past import compare_documents

ROOT = Path(__file__).resolve().parent.parent


def changed(place: Path, changes: Iterable[tuple[str, str, str]]) -> None:
    """The sources with the changes made; ends the program where a text is not there any more."""
    for file, old, new in changes:
        text = (place / file).read_text(encoding="utf-8")
        if old not in text:
            sys.exit(f"{file} no longer holds {old!r}; bring this mutant up to date")
        (place / file).write_text(text.replace(old, new), encoding="utf-8")


def git(place: Path, *arguments: str) -> None:
    who = ("-c", "user.name=mutant", "-c", "user.email=mutant@example.org")
    subprocess.run(["git", "-C", str(place), *who, *arguments], check=True, capture_output=True)


def build(place: Path) -> None:
    """As tracker.toml says; ends the program where it does not build."""
    command = tomllib.loads((ROOT / "tracker.toml").read_text(encoding="utf-8"))["build"]["command"]
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    line, said = ["bash", "-euo", "pipefail", "-c", command], {**os.environ, "PATH": path}
    done = subprocess.run(line, cwd=place, env=said, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{place} does not build: {commits.last_words(done.stderr or done.stdout)}")


def measure(place: Path, tests: Sequence[str], sweep: bool) -> RunDocument:
    """What the clone answers, to its own questions."""
    file = place / "run.json"
    file.unlink(missing_ok=True)
    done = commits.call(place, "run", *tests, "--no-record", "--json", str(file), *["--sweep"] * sweep)
    if not file.exists():
        sys.exit(f"{place} gives no answers: {done.stderr[-500:]}")
    return decode(file.read_bytes(), RunDocument)


def caught_by_scalar_test(place: Path, mutant: Mutant, sound: RunDocument) -> tuple[bool, str]:
    """Whether a series of the named test regressed, and which did most."""
    git(place, "commit", "-qam", mutant.story)
    try:
        build(place)
        document = compare_documents(sound, measure(place, (mutant.caught_by,), mutant.sweep))
    finally:
        git(place, "reset", "-q", "--hard", "HEAD~1")
    worst = worst_change(document)
    if worst is None or worst.word != "regressed" or worst.test != mutant.caught_by:
        return False, "nothing is worse"
    return True, f"{worst.series}: {worst.name or worst.word}, {worst.sentence}"


def caught_by_native_test(place: Path, mutant: Mutant) -> tuple[bool, str]:
    """Whether the named function of a C++ test fails: the program says its name, and at which line."""
    file, _, name = mutant.caught_by.partition("::")
    build(place)
    cmake, folder = str(Path(sys.executable).with_name("cmake")), place / "build" / "cpp-tests"
    (library,) = (place / "build").rglob("libspook.a")
    source = (f"-S{place / 'engine/native/tests'}", f"-B{folder}", "-DCMAKE_BUILD_TYPE=Release")
    test = Path(file).stem
    for command in (
        (cmake, *source, f"-DSPOOK_LIBRARY={library}"),
        (cmake, "--build", str(folder), "--target", test),
    ):
        subprocess.run(command, check=True, capture_output=True)
    done = subprocess.run([str(folder / test)], capture_output=True, text=True)
    where = lines_of(place / file, name)
    git(place, "reset", "-q", "--hard")
    said = [line for line in (done.stdout + done.stderr).splitlines() if line.strip()]
    failed = [int(number) for line in said for number in re.findall(rf"{test}\.cpp:(\d+)", line)]
    return done.returncode != 0 and any(line in where for line in failed), said[
        0
    ] if said else "nothing fails"


def lines_of(file: Path, function: str) -> range:
    """Where a function of a C++ test stands: from its name to the brace that ends it."""
    lines = file.read_text(encoding="utf-8").splitlines()
    start = next(i for i, line in enumerate(lines, 1) if re.match(rf"\w+ {function}\(", line))
    return range(start, next(i for i in range(start, len(lines) + 1) if lines[i - 1] == "}") + 1)


def caught_by_test(place: Path, mutant: Mutant) -> tuple[bool, str]:
    """Whether the named test of the suite fails."""
    if ".cpp::" in mutant.caught_by:
        return caught_by_native_test(place, mutant)
    if mutant.native:
        build(place)
    search = os.pathsep.join([str(place), sysconfig.get_path("purelib")])
    command = [sys.executable, "-S", "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", mutant.caught_by]
    done = subprocess.run(
        command, cwd=place, env={**os.environ, "PYTHONPATH": search}, capture_output=True, text=True
    )
    git(place, "reset", "-q", "--hard")
    last = [line for line in done.stdout.splitlines() if line.strip()]
    return done.returncode == 1, last[-1] if last else done.stderr[-200:]


def tonights(count: int, day: datetime.date) -> tuple[Mutant, ...]:
    """So many of them, others every night, until all had their turn."""
    start = day.toordinal() * count % len(MUTANTS)
    return tuple((MUTANTS * 2)[start : start + min(count, len(MUTANTS))])


def page(rows: Sequence[tuple[Mutant, bool, str]]) -> str:
    caught = sum(found for _, found, _ in rows)
    lines = [
        "# Engines that are wrong on purpose", "",
        f"Made by `make mutants`, not by hand: {caught} of {len(rows)} are caught by the test that is named for them.", "",
        "| room | what is wrong | caught by | what it says |", "|---|---|---|---|",
    ]  # fmt: skip
    for mutant, found, said in rows:
        by = mutant.caught_by if found else f"NOT by {mutant.caught_by}"
        lines.append(f"| {mutant.room} | {mutant.story} | `{by}` | {said.replace('|', '/')} |")
    return "\n".join(lines) + "\n"


def recorded(file: Path, rows: Sequence[tuple[Mutant, bool, str]], commit: str, day: datetime.date) -> None:
    """Take these into the record that the website's page is made from; what else it holds of the list stays."""
    known: dict[str, dict[str, Any]] = {}
    if file.exists():
        known = {entry["name"]: entry for entry in json.loads(file.read_text(encoding="utf-8"))}
    for mutant, found, said in rows:
        known[mutant.name] = {
            "name": mutant.name, "room": mutant.room, "story": mutant.story, "caught_by": mutant.caught_by,
            "caught": found, "said": said, "commit": commit, "day": day.isoformat(),
        }  # fmt: skip
    listed = [known[mutant.name] for mutant in MUTANTS if mutant.name in known]
    file.write_text(json.dumps(listed, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="mutants to try; all if none is named")
    parser.add_argument("--tonight", type=int, metavar="N", help="N of them, others every night")
    parser.add_argument("--commit", default="HEAD", metavar="REV", help="which engine to spoil")
    parser.add_argument(
        "--keep", type=Path, metavar="DIR", help="build there, and leave it for the next time"
    )
    parser.add_argument("--page", type=Path, help="write the table here")
    parser.add_argument("--record", type=Path, metavar="FILE", help="take the answers into this record")
    given = parser.parse_args()
    today = datetime.datetime.now(datetime.UTC).date()
    chosen = tonights(given.tonight, today) if given.tonight else MUTANTS
    chosen = tuple(m for m in chosen if not given.names or m.name in given.names)
    rows: list[tuple[Mutant, bool, str]] = []
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        head = commits.full_hash(ROOT, given.commit)
        place = commits.checked_out(ROOT, head, (given.keep or Path(folder)).resolve())
        build(place)
        sound = {
            sweep: measure(place, sorted(tests), sweep)
            for sweep in (False, True)
            if (tests := {m.caught_by for m in chosen if m.sweep == sweep and not m.of_the_suite})
        }
        for mutant in chosen:
            started = time.monotonic()
            changed(place, mutant.changes)
            if mutant.of_the_suite:
                found, said = caught_by_test(place, mutant)
            else:
                found, said = caught_by_scalar_test(
                    place, mutant, only(sound[mutant.sweep], mutant.caught_by)
                )
            rows.append((mutant, found, said))
            if given.record:
                recorded(given.record, rows[-1:], head, today)
            took = f"{time.monotonic() - started:.0f} s"
            print(
                f"{'caught' if found else 'MISSED'}  {mutant.room}/{mutant.name} ({took}): {mutant.story}; {said}",
                flush=True,
            )
        same = True
        if False in sound:
            build(place)
            again = compare_documents(
                sound[False], measure(place, sorted({d.test for d in sound[False].series}), False)
            )
            same = again.verdict == "identical"
            print(
                f"{'identical' if same else 'DIFFERENT'}  the engine as it was, built again: {again.counts}",
                flush=True,
            )
    if given.page:
        given.page.write_text(page(rows), encoding="utf-8")
    return 0 if same and all(found for _, found, _ in rows) else 1


def only(run: RunDocument, test: str) -> RunDocument:
    """The run without its other tests."""
    series = tuple(d for d in run.series if d.test == test)
    keys = {d.key for d in series}
    return msgspec.structs.replace(
        run, series=series, samples=tuple(s for s in run.samples if s.series in keys), maps=()
    )


if __name__ == "__main__":
    sys.exit(main())
