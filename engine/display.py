"""How a scene, a run and its traces are shown in a notebook: by a package that announces itself for that.

The engine draws nothing. The tracker does (`tracker/notebook.py`), and says so in its entry points; whatever else wants
to takes the same group.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from .errors import EngineError

if TYPE_CHECKING:
    from .result import Result
    from .scene import Scene

GROUP = "spook_tracker.display"


class Figure(Protocol):
    """A figure of Plotly's, as far as this room knows of it; a notebook shows one where it is the value of a cell."""

    @property
    def data(self) -> Sequence[object]:
        """Its traces."""
        ...

    def show(self) -> None:
        """Open it."""
        ...

    def write_html(self, file: str | Path) -> None:
        """Write it as a document."""
        ...


class Display(Protocol):
    """What is asked of the package that draws."""

    def scene(self, scene: Scene) -> str:
        """The scene at its start, to be turned: an HTML document that needs no other file."""
        ...

    def motion(self, result: Result) -> str:
        """The run as a replay: an HTML document that needs no other file. EngineError where it cannot be run again."""
        ...

    def traces(self, result: Result, names: tuple[str, ...]) -> Figure:
        """These traces over time."""
        ...


@dataclass(frozen=True, slots=True)
class Shown:
    """A document that a notebook shows where it is the value of a cell; `save` puts it into a file."""

    html: str

    def _repr_html_(self) -> str:
        return framed(self.html)

    def save(self, file: str | Path) -> None:
        """Write the document, for a browser; it needs no network and no other file."""
        Path(file).write_text(self.html, encoding="utf-8")

    def __repr__(self) -> str:
        return f"<Shown: {len(self.html) // 1000} kB of HTML; save(FILE) writes it>"


def framed(html: str, height: int = 640) -> str:
    """A document in a frame of its own, so that neither its style nor its scripts touch the notebook's."""
    inside = html.replace("&", "&amp;").replace('"', "&quot;")
    return f'<iframe srcdoc="{inside}" width="100%" height="{height}" style="border:0"></iframe>'


def display() -> Display:
    """The package that draws. EngineError if none is installed."""
    from importlib.metadata import entry_points  # takes as long to import as a quarter of the engine

    for point in entry_points(group=GROUP):
        found: Display = point.load()
        return found
    raise EngineError(
        "nothing that draws is installed; install it with: pip install 'spook-tracker[standard]'"
    )
