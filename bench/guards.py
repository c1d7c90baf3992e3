"""Break guards of SECURITY.md one at a time, and see that the tests which stand for them fail; prints the score.

`python bench/guards.py 15 --seed 39` breaks fifteen chosen at random, `python bench/guards.py NAME …` those named, and
without either all. A guard is broken in this tree itself, which has to be clean, and mended before the next: what starts
processes starts them from here. Ends with 1 if a test passes, or hangs, without what it stands for.
"""

from __future__ import annotations

import argparse
import random
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
APART, WORKERS = "tracker/measure/apart.py", "tracker/measure/workers.py"
TRACK = ".github/workflows/track.yml"
LONGEST = 900  # s that the tests of one guard may take


@dataclass(frozen=True)
class Guard:
    """What stands between an attack and harm, how it is broken, and which test says so."""

    name: str
    file: str
    old: str  # occurs once
    new: str
    tests: str  # a file in tests/, then perhaps words that choose of its tests


GUARDS = (
    Guard("what is measured is imported apart", APART, 'return answering(_asked("run", source, request, (), watch))', "from spook_tracker.tracker.measure import run as here; return answering(here.run(source, request, watch))", "tracker/measure/test_gates"),
    Guard("an end is no answer", APART, "elif news is None:\n                    how", "elif False:\n                    how", "tracker/measure/test_gates whatever_ends"),
    Guard("an import has a time limit", APART, "patience = START_LIMIT + request.time_limit", "patience = 1e9", "tracker/measure/test_gates hangs"),
    Guard("what is called good is held to its limit", APART, "if sample.passed != (", "if False and sample.passed != (", "tracker/measure/test_gates limit_that_is_changed"),
    Guard("a catalogue that asks nothing is no green", APART, "if not run.samples:", "if False:", "tracker/measure/test_gates asks_nothing"),
    Guard("what supports nothing is no green", "tracker/cli/report_table.py", 'if any(sample.outcome != "not_supported" for sample in document.samples):', "if True:", "tracker/measure/test_gates supports_nothing"),
    Guard("what is no longer supported is lost", "tracker/judge/exact_values.py", "return state.level is not None and (state.red", "return False and (state.red", "tracker/judge/test_support_lost"),
    Guard("another definition hides no loss", "tracker/judge/series_history.py", "return next((nights[i] for i in before), None)", "return None", "tracker/judge/test_support_lost definition"),
    Guard("a worker that ended has not answered", WORKERS, 'return (Lost("crashed", DIED, self.place.value),)', 'return (Lost("not_supported", DIED, self.place.value),)', "tracker/measure/test_gates exit_code_0"),
    Guard("modules of ours are looked for in no folder of theirs", APART, '* sys.flags.no_site + ["-P"]', "* sys.flags.no_site", "tracker/measure/test_gates called_like_a_module"),
    Guard("a snapshot is of its bytes", "engine/snapshot.py", "if len(data) < CONTENT or data[HASHED:CONTENT] != _hash(data[:HASHED], data[CONTENT:]):", "if len(data) < CONTENT:", "engine/test_snapshots no_snapshot"),
    Guard("a snapshot is of one build", "engine/snapshot.py", "if build != _build():", "if False:", "engine/test_snapshots build"),
    Guard("make says what builds", "Makefile", "export PIP_BUILD_CONSTRAINT ?=", "PIP_BUILD_CONSTRAINT ?=", "test_build_constraints"),
    Guard("what is dated ahead is left out", "tracker/store/stored_runs.py", "run for run in every if run.started_at <= latest", "run for run in every", "tracker/store/test_clocks"),
    Guard("a night tells of its own run", "tracker/library.py", "    with History.open(database, NO_TIME) as history:", "    with History.open(database) as history:", "tracker/store/test_clocks recorded"),
    Guard("words for a server name no file", "tracker/store/connection.py", "        _refuse_secrets(chosen)\n", "        pass\n", "tracker/store/test_secrets"),
    Guard("the end of a password is no host", "tracker/store/connection.py", "elif _misread(url):", "elif False:", "tracker/store/test_secrets"),
    Guard("of a server its place alone is shown", "tracker/store/connection.py", 'return f"postgresql://{place}/', 'return f"postgresql://{url.username}:{url.password}@{place}/', "tracker/store/test_secrets"),
    Guard("an odd answer is one sample's", "tracker/measure/fitting.py", "return sample if not fault else _crashed(sample.series, fault)", "return sample", "tracker/measure/test_odd_answers"),
    Guard("a worker has a group of its own", WORKERS, "os.setpgid(0, 0)", "pass", "tracker/measure/test_started_by_adapters"),
    Guard("a session is ended whole", "tracker/measure/left_behind.py", "    for _ in range(ROUNDS):", "    for _ in range(0):", "tracker/measure/test_started_by_adapters"),
    Guard("a worker has none of our streams", WORKERS, "    os.dup2(2, 1)\n", "", "tracker/measure/test_workers prints"),
    Guard("what measures has none of our streams", APART, "    os.dup2(2, 1)  #", "    pass  #", "tracker/measure/test_gates prints"),
    Guard("compiling is in the time of a run", "engine/watch.py", "    if left <= 0.0:", "    if False:", "engine/test_time_limits compiled"),
    Guard("hosts are marks", "tracker/measure/other_tools.py", "no. {hashlib.sha256(host.encode()).hexdigest()[:6]}", "{host}", "tracker/measure/test_other_tools host"),
    Guard("a home page is an address", "tracker/cli/options.py", "if address and not web_address(address):", "if False:", "tracker/cli/test_settings home_page"),
    Guard("what is no number is no limit", "tracker/cli/options.py", "if found != found:", "if False:", "tracker/cli/test_settings no_number"),
    Guard("nights that overlap are added", TRACK, "sorted([*there.values(), *more.values()], key=order)", "sorted([*more.values()], key=order)", "team/test_overlaps three_of_three"),
    Guard("what is kept is not rewritten", TRACK, "items() if name not in known}", "items()}", "team/test_overlaps rewrites_nothing"),
    Guard("a push that comes late is made again", TRACK, 'if git push -q origin "HEAD:refs/heads/$BRANCH"; then exit 0; fi', 'git push -q origin "HEAD:refs/heads/$BRANCH" || true; exit 0', "team/test_overlaps too_late"),
    Guard("the history is believed before its database", "tracker/store/months.py", "if _measured(kept) != _measured(stored):", "if False:", "team/test_overlaps no_use"),
    Guard("a comment is of our account", TRACK, """ours='.user.login == "github-actions[bot]"'""", "ours='true'", "team/test_comments"),
    Guard("what may write builds nothing", TRACK, "pull-requests: write # the one comment; nothing is installed or built here\n    steps:\n", "pull-requests: write # the one comment; nothing is installed or built here\n    steps:\n      - run: pip install .\n", "team/test_workflow installs_and_builds"),
    Guard("actions are pinned by hash", TRACK, "actions/deploy-pages@cd2ce8fcbc39b97be8ca5fce6e763baed58fa128 # v5.0.0", "actions/deploy-pages@v5", "team/test_workflow pinned"),
    Guard("what is printed is obeyed by no terminal", "tracker/document/outside.py", 'def inert(text: str) -> str:\n', 'def inert(text: str) -> str:\n    return text\n\n\ndef _inert(text: str) -> str:\n', "tracker/document/test_outside"),
    Guard("names are text on a page", "tracker/website/templates.py", "autoescape=True", "autoescape=False", "website/test_browser hostile_names"),
    Guard("a document has a size", "tracker/store/border.py", "    if len(data) > MAX_BYTES:", "    if False:", "tracker/store/test_transfer"),
    Guard("a whole number has 64 bits", "tracker/store/border.py", "if abs(part) > MAX_INTEGER:", "if False:", "tracker/store/test_transfer"),
    Guard("what is called good is finite", "tracker/store/border.py", 'if (sample.outcome == "value" or sample.passed) and not', 'if False and not', "tracker/store/test_transfer"),
    Guard("a line of a month ends", "tracker/store/months.py", "file.readline(MAX_BYTES + 1)", "file.readline()", "tracker/store/test_months"),
    Guard("a month is whole until the rename", "tracker/store/months.py", "        beside.replace(path)", '        path.write_bytes(b"")\n        beside.replace(path)', "tracker/store/test_months"),
    Guard("triggers of others are refused", "tracker/store/schema.py", "        if name is not None:", "        if False:", "tracker/store/test_database trigger"),
    Guard("a file with triggers is not read on a short way", "tracker/store/reader.py", "[(head(),)] or triggers):", "[(head(),)]):", "tracker/store/test_database trigger"),
    Guard("an id is no path", "tracker/store/transfer.py", 'slug = re.sub(r"[^A-Za-z0-9-]+", "-", run.id)', "slug = run.id", "tracker/store/test_transfer path"),
    Guard("a month from elsewhere is a month", TRACK, """                  sys.exit(f"{new.name} is no month")""", "                  pass", "team/test_overlaps"),
    Guard("red goes before what was not written", "tracker/cli/measuring.py", "exit(RED if red else UNUSABLE)", "exit(RED if kept else UNUSABLE)", "tracker/cli/test_after_measuring"),
    Guard("what is stored is on the disk", "tracker/store/connection.py", '"synchronous = FULL"', '"synchronous = OFF"', "tracker/store/test_database told"),
    Guard("a worker ends with its supervisor", WORKERS, "    _never_outlive(lifeline, parent)\n", "", "tracker/measure/test_workers outlives"),
    Guard("settings above a repository are others'", "tracker/cli/settings.py", "for folder in above[: root + 1] if", "for folder in above if", "tracker/cli/test_settings belongs_to_others"),
    Guard("a worker elsewhere is like this one", "tracker/measure/executors.py", "if not there.like(here):", "if False:", "tracker/measure/test_executors refused"),
)  # fmt: skip


def broken(guard: Guard) -> str:
    """The file without its guard; ValueError if the guard is not there exactly once."""
    text = (ROOT / guard.file).read_text(encoding="utf-8")
    if text.count(guard.old) != 1:
        raise ValueError(f"{guard.name}: {guard.old!r} is in {guard.file} {text.count(guard.old)} times")
    return text.replace(guard.old, guard.new)


def passes(guard: Guard) -> bool:
    """Whether its tests pass in the tree as it stands."""
    file, *words = guard.tests.split()
    chosen = ["-k", words[0]] if words else []
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-x",
        "-p",
        "no:cacheprovider",
        f"tests/{file}.py",
        *chosen,
    ]
    try:
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=LONGEST, check=False)
    except subprocess.TimeoutExpired:
        print(f"HUNG      {guard.name}", flush=True)
        return True
    if done.returncode not in (0, 1):
        raise RuntimeError(done.stdout[-2000:] + done.stderr[-2000:])
    return done.returncode == 0


def red(guard: Guard) -> bool:
    """Whether its tests fail without it."""
    file = ROOT / guard.file
    whole = file.read_bytes()
    try:
        file.write_text(broken(guard), encoding="utf-8")
        return not passes(guard)
    finally:
        file.write_bytes(whole)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("chosen", nargs="*", help="how many, or names")
    parser.add_argument("--seed", type=int, default=39)
    asked = parser.parse_args()
    if subprocess.run(["git", "diff", "--quiet", "HEAD"], cwd=ROOT, check=False).returncode:
        print("guards are broken in this tree: commit what is changed first")
        return 1
    guards = [guard for guard in GUARDS if not asked.chosen or guard.name in asked.chosen]
    if asked.chosen and asked.chosen[0].isdigit():
        guards = random.Random(asked.seed).sample(GUARDS, int(asked.chosen[0]))
    found = 0
    for guard in guards:
        dead = red(guard)
        found += dead
        print(f"{'red     ' if dead else 'PASSED  '}  {guard.name:52} {guard.tests}", flush=True)
    print(f"\n{found} of {len(guards)} broken guards turn their tests red, seed {asked.seed}")
    return 0 if found == len(guards) else 1


if __name__ == "__main__":
    sys.exit(main())
