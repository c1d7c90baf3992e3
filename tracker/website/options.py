"""What a website is told beside the history: whose it is, and what goes along."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, kw_only=True)
class SiteOptions:
    """Whose website it is, and what is published with it."""

    title: str = ""  # on every page
    home_page: str = ""  # address of the project
    colour: str = ""  # of links and buttons, #rrggbb
    mutants: Path | None = None  # the record that `make mutants` writes: engines wrong on purpose
    recorded: Path | None = (
        None  # a folder that `make recorded` writes: nights of other engines, measured elsewhere
    )
    documents: Path | None = None  # a folder of HTML files, published as docs/
    with_database: bool = False  # readers can load the SQLite file of the history


DEFAULTS = SiteOptions()
