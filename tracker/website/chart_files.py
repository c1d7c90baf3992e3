"""The data of every chart in a file of its own, loaded when the chart is seen."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from spook_tracker.tracker.website.diagrams import View
from spook_tracker.tracker.website.folder import digest
from spook_tracker.tracker.website.templates import embedded


def chart_files(context: dict[str, Any]) -> dict[str, bytes]:
    """Address and content of a script for each chart of a page; the charts are told where theirs is.

    The address comes from the content: what a browser has kept is never an old one, equal charts share a file,
    and no name from outside becomes the name of a file. A script, because a page opened from a file may not fetch.
    """
    files = {}
    for view in _views(list(context.values())):
        data = embedded(view.figure)
        view.key = digest(data.encode("utf-8", "replace"))
        files[view.file] = f'charted("{view.key}",{data});\n'.encode("utf-8", "replace")
    return files


def _views(things: list[Any] | tuple[Any, ...]) -> Iterator[View]:
    for thing in things:
        if isinstance(thing, View):
            yield thing
        elif isinstance(thing, list | tuple):
            yield from _views(thing)
