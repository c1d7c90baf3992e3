"""Where the folders lie that are data, not modules: migrations and site."""

from __future__ import annotations

from pathlib import Path


def resource(name: str) -> Path:
    """The folder `name`, beside this package: in an installation and in a checkout alike."""
    folder = Path(__file__).resolve().parent.parent / name
    if not folder.is_dir():
        raise FileNotFoundError(
            f"the folder {name!r} is missing from this installation; install the tracker again"
        )
    return folder
