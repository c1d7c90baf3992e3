"""The data of every chart in a file, loaded when the chart is seen."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from .diagrams import View
from .folder import digest
from .scripts import as_json, call

NIGHTLY = 16  # files of run times, which are others every night


def nightly_file(test: str) -> str:
    """Address of the script with all that a test's page says of run times; few files, for every night writes all."""
    return f"charts/tonight-{zlib.crc32(test.encode('utf-8', 'replace')) % NIGHTLY}.js"


@dataclass
class ChartFiles:
    """The scripts with the data of charts, as pages ask for them.

    What stands still is addressed by its content: what a browser has kept is never an old one, equal charts share
    a file, and no name from outside becomes the name of a file. Run times stand together in files that every night
    writes again. Scripts, because a page opened from a file may not fetch.
    """

    nightly: dict[str, set[bytes]] = field(default_factory=dict)  # address to what it calls

    def add(self, context: Mapping[str, object]) -> dict[str, tuple[str, bytes]]:
        """Address of the script of each chart of a page, what it is made from, and its content, empty where it is there as
        it was; the charts are told where theirs is."""
        files = {}
        for view in _views(list(context.values())):
            if view.figure is None:  # as it was
                files[view.file] = view.mark, b""
                continue
            data = as_json(view.figure)
            view.figure = None  # a page is made from where its numbers are, not from the numbers
            if view.nightly:
                view.key = f"{view.nightly}/{view.name.removeprefix(view.nightly + '-')}"
                view.file = nightly_file(view.nightly)
                self._hand_over(view.file, call("charted", view.key, data))
                continue
            view.key = digest(data.encode("utf-8", "replace"))
            view.file = f"charts/{view.key}.js"
            script = call("charted", view.key, data)
            view.mark = digest(script)
            files[view.file] = view.mark, script
        return files

    def add_part(self, test: str, text: str) -> None:
        """What the page of a test says of run times in words."""
        self._hand_over(nightly_file(test), call("told", test, as_json(text)))

    def _hand_over(self, address: str, line: bytes) -> None:
        self.nightly.setdefault(address, set()).add(line)

    def nightly_files(self) -> dict[str, bytes]:
        """Address and content of the scripts of run times."""
        return {address: b"".join(sorted(calls)) for address, calls in sorted(self.nightly.items())}


def _views(things: Iterable[object]) -> Iterator[View]:
    for thing in things:
        if isinstance(thing, View):
            yield thing
        elif isinstance(thing, list | tuple):
            yield from _views(thing)
