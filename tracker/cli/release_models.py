"""What releases changed of models, as a page: model by model, what moved, what only rounded, what stayed to the bit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from spook_tracker.tracker.judge.release_notes import Step, by_test, told

if TYPE_CHECKING:
    from spook_tracker.tracker.document.run_document import TestCard


def model_page(engine: str, cards: Iterable[TestCard], steps: Sequence[Step]) -> list[str]:
    """A table of all models, and below it in words what changed. `cards` are those of the newest run."""
    files = {card.name: dict(card.parameters).get("file", "") for card in cards}
    models = sorted({test for step in steps for test in step.alike})
    if not models:
        return []
    releases = " ".join([steps[0].before, *(step.release for step in steps)])
    lines = [
        "## Models",
        "",
        "A value has *the same bits*, or differs by *rounding* (no more than what pushes of 1e-15 of the model's size in every",
        "step have grown to by then), or *changed*. Reproduce it, with each model of the table as NAME=FILE:",
        "",
        f"    tracker backfill --engine {engine} {releases} --model NAME=FILE",
        "",
        f"| model | file | {' | '.join(step.release for step in steps)} |",
        f"|---|---|{'---|' * len(steps)}",
    ]
    for model in models:
        cells = " | ".join(_cell(step, model) for step in steps)
        lines.append(f"| {model} | `{files.get(model, '')}` | {cells} |")
    lines += ["", _counted(models, steps), ""]
    for step in steps:
        changed = {test: found for test, found in by_test(step.changes).items() if test in step.alike}
        if changed:
            lines += [f"### Models in {step.release}, after {step.before}", ""]
            for test, found in changed.items():
                lines += [f"- **{test}**: {'; '.join(told(found))}."]
            lines.append("")
    return lines


def _cell(step: Step, model: str) -> str:
    same, rounded = step.alike.get(model, (0, 0))
    changed = len(by_test(step.changes).get(model, ()))
    if changed:
        return f"**changed**, {changed} of {same + rounded + changed} values"
    if rounded:
        return f"rounding, {rounded} of {same + rounded} values"
    return "same bits" if same else "not asked"


def _counted(models: Sequence[str], steps: Sequence[Step]) -> str:
    def count(step: Step) -> str:
        words = [_cell(step, model).split(",")[0].strip("*") for model in models]
        return f"{step.release}: {words.count('changed')} changed, {words.count('rounding')} rounded, {words.count('same bits')} the same bits"

    return f"{len(models)} models. {'; '.join(map(count, steps))}."


def without_models(steps: Sequence[Step]) -> list[Step]:
    """The same steps, of all other tests."""
    return [
        replace(step, changes=tuple(change for change in step.changes if change.test not in step.alike))
        for step in steps
    ]


def only_models(names: Iterable[str], steps: Sequence[Step]) -> bool:
    """Whether nothing but models was asked."""
    models = {test for step in steps for test in step.alike}
    return all(name in models for name in names)
