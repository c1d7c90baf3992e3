"""What the releases of an engine changed, in the terminal and as a page; beside its changelog, if one is given."""

from __future__ import annotations

import itertools
import textwrap
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from spook_tracker.tracker.judge.comparison_document import Change
from spook_tracker.tracker.judge.release_notes import (
    Changelog,
    Checked,
    Step,
    alike,
    by_test,
    check,
    told,
    visible,
)
from spook_tracker.tracker.judge.release_order import (
    NOT_DRAWN,
    Scene,
    ToldLine,
    direct_first,
    left_out,
    scenes,
    told_of,
)

from .release_models import model_page, only_models, without_models

if TYPE_CHECKING:
    from spook_tracker.tracker.store.history import History
    from spook_tracker.tracker.store.versions import RunInfo


def steps_between(history: History, engine: str) -> tuple[list[RunInfo], list[Step]]:
    """The newest run of each measured release, oldest first, and what changed from each to the next."""
    from spook_tracker.tracker.library import compare

    drawn: dict[str, Scene] = {}
    newest = {run.engine.version: run for run in history.runs(engine)}
    runs = list(newest.values())
    for run in runs:  # a test may be one that the newest was not asked
        drawn |= scenes(history.cards(run.id))
    steps = []
    for before, after in itertools.pairwise(runs):
        found = compare(history, before.id, after.id)
        both = history.samples(before.id).keys() & history.samples(after.id).keys()
        steps.append(
            Step(
                release=after.engine.version,
                before=before.engine.version,
                changes=tuple(direct_first([change for change in found.changes if visible(change)], drawn)),
                asked=len(both),
                alike=alike(found.changes),
                scenes=drawn,
            )
        )
    return runs, steps


def text_lines(engine: str, steps: Sequence[Step], changelog: Changelog | None) -> list[str]:
    """A line for every release, and below it what changed: direct questions first, of each the worst."""
    if not steps:
        return [
            f"fewer than two releases of {engine} are recorded; measure more: tracker backfill --engine {engine}"
        ]
    lines: list[str] = []
    for step in steps:
        lines.append(f"{engine} {step.release} after {step.before}: {_count(len(step.changes), 'change')}")
        for test, found in by_test(step.changes).items():
            if test in step.alike:
                lines += [f"  {test}: {sentence}" for sentence in told(found)]
                continue
            shown, out = told_of(found, step.scenes.get(test, NOT_DRAWN))
            lines += [
                f"  {one.word:<14} {one.change.series}  {values(one.change)}{_brought(one)}" for one in shown
            ]
            lines += [f"  {'':<14} {left_out(test, out)}"] if out else []
        lines += _unchanged(step)
    if changelog is None:
        return lines
    checked = check(steps, changelog)
    lines += ["", f"against {changelog.source}"]
    lines += [f"  found   {entry.release} {entry.says}" for entry, _ in checked.found]
    lines += [f"  missed  {entry.release} {entry.says}" for entry in checked.missed]
    lines += [f"  unsaid  {release}: {_tests(changes)}" for release, changes in checked.unsaid]
    return lines


def _unchanged(step: Step) -> list[str]:
    """The models a release left alone: to the bit, or but for rounding."""
    still = {test: found for test, found in step.alike.items() if test not in by_test(step.changes)}
    exact = [test for test, (_, rounded) in still.items() if not rounded]
    rounded = [f"{test} ({found[1]} of {sum(found)} values)" for test, found in still.items() if found[1]]
    lines = [f"  the same bits: {', '.join(exact)}"] if exact else []
    return lines + ([f"  but for rounding the same: {', '.join(rounded)}"] if rounded else [])


def page(
    engine: str, history: History, runs: Sequence[RunInfo], steps: Sequence[Step], changelog: Changelog | None
) -> str:
    """The same as a page in Markdown. Every number in it comes from the recorded runs."""
    models = model_page(engine, history.cards(runs[-1].id), steps)
    names = sorted({series.partition("/")[0] for run in runs for series in history.samples(run.id)})
    if only_models(names, steps):
        against = [] if changelog is None else _against(check(steps, changelog), changelog)
        lines = [f"# What {len(runs)} releases of {engine} changed of models", "", *against, *models]
        return "\n".join(lines).rstrip() + "\n"
    names = [name for name in names if not any(name in step.alike for step in steps)]
    versions = " ".join(run.engine.version for run in runs)
    again = f"tracker backfill --engine {engine} {versions} --limit 5 {' '.join(f'--test={name}' for name in names)}"
    lines = [
        f"# What {len(runs)} releases of {engine} changed",
        "",
        *_prose(
            f"Each release from {runs[0].engine.version} to {runs[-1].engine.version} was installed from the package "
            f"index into a folder of its own and asked {_count(max(step.asked for step in steps), 'question')} of these "
            f"tests: {', '.join(names)}. A change is a value that moved by more than 1e-6 of itself (and more than "
            "1e-12), or another outcome. Run times and what ran into a time limit are left out."
        ),
        "",
        "This page is made by two commands, which reproduce every number in it:",
        "",
        *(
            f"    {line}"
            for line in textwrap.wrap(again, 100, break_on_hyphens=False, subsequent_indent="        ")
        ),
        f"    tracker releases {engine} --changelog docs/{engine}-changelog.toml --markdown",
        "",
        "| release | values of questions | changes | where |",
        "|---|---|---|---|",
        _row(history, runs[0], None),
        *(_row(history, run, step) for run, step in zip(runs[1:], steps, strict=True)),
        "",
    ]
    if changelog is not None:
        lines += _against(check(steps, changelog), changelog)
    lines += [*models, "## Every change", ""]
    for step in without_models(steps):
        if step.changes:
            lines += [f"### {step.release}, after {step.before}", ""]
            lines += [*_change_table(step), ""]
    return "\n".join(lines).rstrip() + "\n"


def _row(history: History, run: RunInfo, step: Step | None) -> str:
    samples = [sample for _, sample in history.samples(run.id).values()]
    good = sum(sample.outcome in ("value", "unsettled", "out_of_limit") for sample in samples)
    changes = "" if step is None else str(len(step.changes))
    return f"| {run.engine.version} | {good} of {len(samples)} | {changes} | {_tests(step.changes if step else ())} |"


def _against(checked: Checked, changelog: Changelog) -> list[str]:
    lines = [
        "## Against the changelog",
        "",
        *_prose(
            f"Read: {changelog.source}, which goes up to {changelog.last}. Its entries about behaviour that these scenes "
            "could show name the series that could show them; an entry is found if one of these changed with the "
            "release, which does not prove that it was the cause."
        ),
        "",
        f"**Found: {len(checked.found)}**",
        "",
    ]
    for entry, changes in checked.found:
        lines.append(f"- {entry.release}, item {entry.item}: {entry.says}. Seen in {_tests(changes)}:")
        lines.append(f"  `{changes[0].series}` {values(changes[0])}.")
    lines += ["", f"**Missed: {len(checked.missed)}**", ""]
    lines += [f"- {entry.release}, item {entry.item}: {entry.says}." for entry in checked.missed]
    lines += ["", f"**Not in the changelog: {_count(len(checked.unsaid), 'release')}**", ""]
    for release, changes in checked.unsaid:
        told = [f"`{found[0].series}` {values(found[0])}" for found in by_test(changes).values()]
        lines.append(f"- {release}: {'; '.join(told)}.")
    if checked.blown_up:
        lines += [
            "",
            *_prose(
                f"Rounding decides the values of runs that blow up ({', '.join(f'`{one}`' for one in changelog.blown_up)}"
                f"); their changes in {', '.join(checked.blown_up)} count for nothing here."
            ),
        ]
    if checked.unread:
        lines += [
            "",
            f"The changelog at hand does not reach {', '.join(checked.unread)}; their changes are below.",
        ]
    return [*lines, ""]


def _change_table(step: Step) -> list[str]:
    lines = ["| series | before | after | unit | |", "|---|---|---|---|---|"]
    for test, found in by_test(step.changes).items():
        shown, out = told_of(found, step.scenes.get(test, NOT_DRAWN))
        for one in shown:
            before, after = _words(one.change)
            said = f"{one.word}{_brought(one)}"
            lines.append(f"| `{one.change.series}` | {before} | {after} | {one.change.unit} | {said} |")
        lines += [f"| {left_out(test, out)} | | | | |"] if out else []
    return lines


def _brought(one: ToldLine) -> str:
    """What a collapse changed besides, by name alone."""
    names = ", ".join(dict.fromkeys(change.metric for change in one.brought))
    return f", and with it {names}" if names else ""


def values(change: Change) -> str:
    """Before and after, with the unit."""
    before, after = _words(change)
    return f"{before} → {after} {change.unit}".rstrip()


def _words(change: Change) -> tuple[str, str]:
    """Six digits, and more where six do not tell the two apart."""
    for digits in (6, 9, 17):
        before = _word(change.before, change.before_outcome, digits)
        after = _word(change.after, change.after_outcome, digits)
        if before != after:
            break
    return before, after


def _word(value: float | None, outcome: str | None, digits: int) -> str:
    if value is not None and outcome in ("value", "unsettled", "out_of_limit"):
        return f"{float(value):.{digits}g}"
    return (outcome or "not asked").replace("_", " ")


def _prose(text: str) -> list[str]:
    return textwrap.wrap(text, 115, break_on_hyphens=False, break_long_words=False)


def _tests(changes: Iterable[Change]) -> str:
    return ", ".join(by_test(changes)) or "-"


def _count(number: int, noun: str) -> str:
    return f"{number or 'no'} {noun}{'' if number == 1 else 's'}"
