"""A model file as a scalar test: what is asked of any model, with no closed form."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

from spook_tracker.engine.errors import SceneError
from spook_tracker.engine.model_file import ModelFile

from .. import case
from . import books, cost, figures, ladder, motion, rest
from .facts import LONGEST_REST, PUSH, Asked

Measure = Callable[[Asked, case.Simulate], Mapping[str, float]]


def test_of(
    title: str,
    model: ModelFile,
    *,
    file: str,
    duration: float = 5.0,
    stands_free: bool = False,
    tolerance: float = 0.0,
    files: int = 1,
    bodies: int = 0,
    driven: bool = False,
) -> case.ScalarTest:
    """The test of a model watched for `duration` [s]; beyond `tolerance` [m, rad] a change is red.

    What is driven or pushed all the time does not rest: of it the tolerance is that of its motion.
    """
    asked = Asked(model=model, duration=duration)
    may_rest = model.drive.kind in ("zero", "hold") and not model.push

    def part(
        configuration: str, metrics: tuple[case.Metric, ...], measure: Measure, note: str, held: bool = True
    ) -> case.Measurement:
        return case.Measurement(
            configuration=configuration,
            time_step=model.time_step,
            metrics=tuple(_held(metric, tolerance if held else 0.0) for metric in metrics),
            measure=partial(measure, asked),
            note=note,
        )

    return case.ScalarTest(
        title=title,
        question=f"Does {title} move, rest and cost what it did?",
        why="Engines are upgraded by people who use them, and their models break in silence. A model has no closed form, "
        "but it has a history: what it did in the release before.",
        model=f"{model.format} of {files} file{'s' * (files != 1)}, {bodies} bod{'y' if bodies == 1 else 'ies'} with joints; "
        f"watched: {', '.join(body.label for body in model.watched)}.",
        parameters=(
            ("file", file),
            ("hash of all its files", model.digest),
            ("time step", f"{model.time_step:g} s, the file's own"),
            ("start", f"keyframe {model.keyframe}" if model.keyframe else "as the file describes it"),
            ("controls", model.drive.kind),
            ("watched for", f"{duration:g} s; until it rests, {LONGEST_REST:g} s at most"),
        ),
        theory=(
            f"The same run is made with pushes of {PUSH:g} of the size in every step: what they grow to is rounding, "
            "and a difference of releases within it is none.",
            "What goes beyond is a change, however small. |state(h) − state(h/2)| says how much it is.",
            "Where the pushes have grown to a hundredth of the size the model can be predicted no longer: places are not "
            "compared from there on.",
        ),
        reference="The same model in the release before.",
        conclusion="Changed: the release does something else with this model; the sentence says with which body, when and by "
        "how much.",
        source="the model's own file",
        measurements=(
            # what tells most comes first: a first look ends after a time, and two processes share the runs of a rest
            part(
                "rest",
                rest.metrics(asked, stands_free),
                rest.measure,
                "as the file has it, until all rests",
                held=may_rest,
            ),
            part("cost", cost.COST, cost.cost, "the clock looked at after each step"),
            part("repeated", cost.REPEATABILITY, cost.repeatability, "three times the same"),
            part("motion", motion.metrics(asked), motion.measure, "as the file has it"),
            part(
                "books",
                books.METRICS,
                books.measure,
                "once with nothing that takes or gives energy, once as the file has it",
            ),
            part(
                "finest",
                (ladder.RESOLVED_TIME,),
                ladder.resolved,
                "with Runge-Kutta, an eighth and a sixteenth of the step",
            ),
        ),
        figures=figures.figures(asked),
        ladders=(ladder.ladder(asked),),
        stability=ladder.studies(asked, driven),
        example=_no_scene,
        seen=motion.seen(asked),
        as_given=True,
    )


def _held(metric: case.Metric, tolerance: float) -> case.Metric:
    """A place or turn beyond the team's own tolerance decides."""
    if metric.better != "inside" or metric.unit not in ("m", "rad") or not tolerance:
        return metric
    return replace(metric, role="gate", tolerance=tolerance)


def _no_scene() -> case.Example:
    raise SceneError("a model file is no scene of ours")
