"""Every picture in docs/, made again: `make pictures`.

    python bench/pictures.py public build/red-night/public

The first folder is the website of real nights (`make nightly`), the second that of `bench/red_night.py`. A headless
Chromium photographs them without a network; what is seen is what a reader sees.
"""

from __future__ import annotations

import argparse
import re
import sys
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent))

from tests.website.browser import photograph

DOCS = Path(__file__).parent.parent / "docs"
GREEN, RED = "green", "red"


@dataclass(frozen=True)
class Picture:
    """One of them: what it shows, and how it is seen."""

    name: str
    site: str
    page: str  # with its view after a #; "wrong" is where the first page says that it goes wrong
    width: int = 1280
    most: int = 900  # pixels high
    dark: bool = False
    at: str = ""  # selector of what it begins with


PICTURES = (
    Picture("dashboard", GREEN, "index.html", most=1500),
    Picture("dark", RED, "index.html", dark=True),
    Picture("phone", RED, "index.html", width=390, most=844),
    Picture("red-night", RED, "index.html"),
    Picture("error-run-time", RED, "tests/pendulum.html", most=620, at="#error-time"),
    Picture("replay", RED, "wrong", width=820, most=1000, at="#replay"),
    Picture("live", GREEN, "live.html#p.angle=35&scene=slope&t=1.2"),
    Picture("compare", RED, "compare.html"),
)


def going_wrong(site: Path) -> str:
    """Where the first page of a red night leads to: the moment in a replay."""
    found = re.search(r'href="([^"]*#against=[^"]*)">See it go wrong', (site / "index.html").read_text())
    if found is None:
        raise SystemExit(f"{site}/index.html leads to no moment in a replay")
    return found[1].replace("&amp;", "&")


def main() -> None:
    reader = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    reader.add_argument("green", type=Path, help="website of real nights")
    reader.add_argument("red", type=Path, help="website of bench/red_night.py")
    reader.add_argument("names", nargs="*", help=f"only these of {', '.join(p.name for p in PICTURES)}")
    asked = reader.parse_args()
    sites = {GREEN: asked.green, RED: asked.red}
    for picture in PICTURES:
        if asked.names and picture.name not in asked.names:
            continue
        site = sites[picture.site]
        page = going_wrong(site) if picture.page == "wrong" else picture.page
        made = DOCS / f"{picture.name}.png"
        photograph(
            f"{site}/{page}", made, width=picture.width, most=picture.most, dark=picture.dark, at=picture.at
        )
        print(made.relative_to(DOCS.parent))


if __name__ == "__main__":
    main()
