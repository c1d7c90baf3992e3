"""Figures, stability maps and motions are bulky and made every night: old ones are dropped, values never.

Kept are, for each engine, each figure and map as the newest run drew it (clean and dirty builds apart), and
as the newest run of each released version drew it; a map also as the newest run of each float environment drew it,
because it is judged against no other. Released is a version without a development part
("1.2.0"), or one whose commit has a tag. Of motions the newest eight are kept, so that a reader can lay the
night a change came in over the one before.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from . import git, models
from .database import in_words
from .history import History
from .versions import RunInfo

MOTIONS = 8
RELEASE = re.compile(r"v?\d+(\.\d+)*((a|b|rc|\.post)\d+)?")


def released(run: RunInfo, tagged: Collection[str]) -> bool:
    """Whether the run measured a released version: its figures stay."""
    engine = run.engine
    return not engine.dirty and (RELEASE.fullmatch(engine.version) is not None or engine.git_hash in tagged)


def drop_old_figures(session: Session, history: History) -> int:
    """Apply the rule and commit. Returns the number of figures, maps and motions dropped."""
    tagged = set(git.tags(history.repository).values())
    dropped = 0
    with in_words(session):
        for model, most in ((models.Figure, 1), (models.StabilityMap, 1), (models.Trajectory, MOTIONS)):
            columns = (model.run_key, model.started_at, model.position, model.test, model.name)
            kept: Counter[tuple[str, str, str, str]] = Counter()
            by_run: dict[int, list[tuple[int, str, str]]] = {}
            for run_key, _, position, test, name in session.execute(select(*columns)):
                by_run.setdefault(run_key, []).append((position, test, name))
            superfluous: list[tuple[RunInfo, int]] = []
            for run in reversed(history.runs()):
                floats = run.machine.float_environment if model is models.StabilityMap else ""
                versions = [f"newest {floats}" if run.ordered else f"newest, dirty {floats}"]
                if released(run, tagged):
                    versions.append(f"released {run.engine.version}")
                for position, test, name in by_run.get(run.key, ()):
                    places = {(run.engine.name, version, test, name) for version in versions}
                    if all(kept[place] >= (most if place[1].startswith("newest") else 1) for place in places):
                        superfluous.append((run, position))
                    kept.update(places)
            for run, position in superfluous:
                session.execute(
                    delete(model).where(
                        model.started_at == run.started_at,
                        model.run_key == run.key,
                        model.position == position,
                    )
                )
            dropped += len(superfluous)
        session.commit()
    return dropped
