"""Where the folders lie that are data, not modules: migrations and site, in a wheel and in a checkout."""

from __future__ import annotations

from pathlib import Path


def resource(name: str) -> Path:
    """The folder `name`: inside the package in a wheel, beside it in a checkout."""
    package = Path(__file__).resolve().parent
    for folder in (package / name, package.parent / name):
        if folder.is_dir():
            return folder
    raise FileNotFoundError(
        f"the folder {name!r} is missing from this installation; install the tracker again"
    )
