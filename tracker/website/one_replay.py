"""A motion as one HTML document that needs no other file: the replay of a test's page, for a notebook or a mail."""

from __future__ import annotations

import base64
import zlib
from functools import cache

from spook_tracker.tracker.document.run_document import SceneDrawing, Trajectory
from spook_tracker.tracker.document.wording import number
from spook_tracker.tracker.resources import resource

from .motions import motion_script
from .scenery import scenery
from .templates import Markup, environment, inside_script

SCRIPTS = ("packed.js", "scene-poses.js", "scene-marks.js", "scene-view.js", "player.js", "replay.js")
LIBRARY = "three-scene.min.js"
KEY = "run"


def replay_document(drawn: SceneDrawing, motion: Trajectory, title: str, still: bool = False) -> str:
    """The document; `still` leaves out what plays, for a motion in which nothing moves."""
    note = "" if still else f"{motion.count} samples, {number(motion.step, 3)} s apart."
    if motion.failure:
        note += f" It ends early: {motion.failure}."
    return (
        environment()
        .get_template("replay.html")
        .render(
            title=title,
            note=note,
            still=still,
            scenery=scenery(drawn),
            sources=[{"key": KEY, "address": "", "label": ""}],
            style=_static("site.css"),
            theme=_static("theme.js"),
            scripts=[*map(_static, SCRIPTS), inside_script(motion_script(KEY, motion).decode())],
            library=_library(),
        )
    )


def _static(name: str) -> Markup:
    return inside_script((resource("site") / "static" / name).read_text(encoding="utf-8"))


@cache
def _library() -> str:
    """A quarter of its length, as base64."""
    packed = zlib.compress((resource("site") / "static" / LIBRARY).read_bytes(), 9)
    return base64.b64encode(packed).decode("ascii")
