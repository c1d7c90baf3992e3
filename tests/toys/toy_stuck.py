"""Three questions for the toy engine: a quick one, one that never ends and says when it began, one behind it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from toy_questions import STAND, error

from spook_tracker.engine.method import PLAIN


def never(simulate):
    Path("stuck").touch()
    while True:
        error(simulate, 0.1, PLAIN)


STUCK = replace(STAND, measurements=(replace(STAND.measurements[0], measure=never),))
CATALOGUE = {"quick": STAND, "stuck": STUCK, "behind": STAND}
