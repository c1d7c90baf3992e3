"""What a run says about its tests and its engine: the words of each test and the stages its scene needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from spook_tracker.engine.errors import EngineError
from spook_tracker.scalar_tests.case import ScalarTest
from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.document.run_document import EngineVersion, StageChoice, TestCard

from .commit import changed_since, subject_and_author
from .question import ask, sentence
from .scene_drawing import drawing
from .step_cost import LeavingOut

if TYPE_CHECKING:
    from .questions import Engine, Stage


def test_card(name: str, test: ScalarTest, engine: Engine, out: LeavingOut | None) -> TestCard:
    """The test as it is worded now; `out` is what leaving stages out saves, if measured."""
    return TestCard(
        name=name,
        title=test.title,
        question=test.question,
        why=test.why,
        model=test.model,
        parameters=test.parameters,
        theory=test.theory,
        reference=test.reference,
        conclusion=test.conclusion,
        source=test.source,
        misprints=test.misprints,
        seven=test.seven,
        stages=stages(test, engine, out.saved if out is not None else {}),
        scene=ask(lambda: drawing(test.example().scene)).value,
        lacks=dict(test.lacks),
        saving=out.told() if out is not None else None,
        measured=test.measured,
        topic=test.topic,
    )


def stages(test: ScalarTest, engine: Engine, saved: Mapping[str, float]) -> tuple[StageChoice, ...]:
    """Stages kept and left out of the test's example scene; empty where the engine cannot say."""
    answer = ask(lambda: explained(test, engine))
    return tuple(
        StageChoice(
            stage=choice.stage,
            kept=choice.kept,
            reason=sentence(choice.reason),
            saved_seconds_per_step=None if choice.kept else saved.get(choice.stage),
        )
        for choice in answer.value or ()
    )


def explained(test: ScalarTest, engine: Engine) -> Sequence[Stage]:
    """The engine's choices for the test's example scene, stage by stage. Raises TrackerError if it tells none."""
    if not hasattr(engine, "explain"):
        raise TrackerError(
            f"{engine.build_info.name} does not say which stages a scene needs; ours does: --engine spook"
        )
    example = test.example()
    return engine.explain(
        example.scene, time_step=example.time_step, method=example.method, observe=example.observe
    )


def scene_file(test: ScalarTest) -> str:
    """Its example scene as MJCF. Raises TrackerError with what that cannot say, or what is not installed."""
    try:
        from spook_tracker.engine.peers.mjcf import mjcf
    except ImportError as error:
        raise TrackerError(
            f"MJCF is checked by MuJoCo, which is not installed ({error}); install it with: "
            "pip install 'spook-tracker[mujoco]'"
        ) from None
    try:
        example = test.example()
        return mjcf(example.scene, example.time_step)
    except EngineError as lack:
        raise TrackerError(f"{test.title}: {lack}") from None


def engine_version(engine: Engine) -> EngineVersion:
    """The engine's own account of what it was built from."""
    info = engine.build_info
    own = [*map(Path, getattr(engine, "__path__", ()))]  # an editable build lies in its repository
    subject, author = subject_and_author(info.git_hash, [Path.cwd(), *own])
    moved = not info.dirty and changed_since(info.git_hash, own)
    return EngineVersion(
        name=info.name,
        version=info.version + (("+", ".")["+" in info.version] + "dirty") * moved,
        git_hash=info.git_hash,
        dirty=bool(info.dirty) or moved,
        commit_time=info.commit_time,
        parents=tuple(info.parents),
        compiler=info.compiler,
        flags=info.flags,
        subject=subject,
        author=author,
    )
