"""Templates of the website: everything from outside is escaped, missing names are errors.

Only here is Jinja imported. `data` is the one way to put JSON into a page: inside a script element that the
browser never runs, with every sign escaped that could end it.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import jinja2
from markupsafe import Markup as Markup

from spook_tracker.tracker.document import wording
from spook_tracker.tracker.judge.vocabulary import CLASSES, Class
from spook_tracker.tracker.resources import resource

from .formulas import formula

if TYPE_CHECKING:
    from spook_tracker.tracker.document.json_form import Writable

ESCAPES = {"<": "\\u003c", ">": "\\u003e", "&": "\\u0026", "\u2028": "\\u2028", "\u2029": "\\u2029"}


def embedded(value: Writable) -> Markup:
    """JSON for a non-executing script element. Non-finite numbers must have been replaced before."""
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    for sign, escape in ESCAPES.items():
        text = text.replace(sign, escape)
    return Markup(text)


def inside_script(text: str) -> Markup:
    """A script or style sheet of ours, or a call with JSON, as it stands in its element: nothing in it ends that."""
    return Markup(text.replace("</", "<\\/"))


def css_text(text: str) -> Markup:
    """A text for a style sheet: but for letters, digits and a few signs all is escaped, so nothing in it ends anything."""
    plain = (sign if sign.isalnum() or sign in " .,-+" else f"\\{ord(sign):x} " for sign in text)
    return Markup('"' + "".join(plain) + '"')


def said(name: Class) -> str:
    """The word of a class of nights: PASS, FAIL …"""
    return CLASSES[name][1]


def _compiled_before() -> jinja2.BytecodeCache | None:
    """Templates compiled once for all publications, in a folder of the user's own; None where there is no such place."""
    try:
        return jinja2.FileSystemBytecodeCache()
    except (OSError, RuntimeError):
        return None


def environment(folder: Path | None = None) -> jinja2.Environment:
    """The templates under site/templates with our filters."""
    made = jinja2.Environment(
        bytecode_cache=_compiled_before(),
        loader=jinja2.FileSystemLoader(folder or resource("site") / "templates"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters |= {
        "data": embedded,
        "css_text": css_text,
        "said": said,
        "clean": wording.clean,
        "clock": wording.clock,
        "day": wording.day,
        "version": wording.version,
        "short_hash": wording.short_hash,
        "commit_address": wording.commit_address,
        "web_address": wording.web_address,
        "seconds": wording.seconds,
        "number": wording.number,
        "formula": formula,
        "whose": wording.whose,
    }
    return made
