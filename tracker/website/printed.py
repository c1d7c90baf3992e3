"""A night as one document: an HTML file that needs nothing else, and a PDF printed from it by a browser.

A browser and no library: WeasyPrint 70 sets no MathML (h² v² (1 + 2τ/h) / 4l becomes "h2v21+2τ/h4l") and no style of
the page reaches a figure inside it (frames come out black). The pages of its contents are read in the form browsers write
(`pages_of`): pypdf reads any form, and would be a package more of every installation for these few lines; a test compares both.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.judge.accepted import Accepted

from .nights import Records
from .options import DEFAULTS, SiteOptions
from .publish import publish

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
NUMBERED = re.compile(r'<span class="page-of" data-of="([^"]*)">')
PATIENCE = 300.0  # s, for some sixty pages on a busy machine


class PrintError(TrackerError):
    """The document cannot be printed here."""


def one_file(
    history: Records,
    accepted: Sequence[Accepted] = (),
    options: SiteOptions = DEFAULTS,
) -> str:
    """The newest night's document as one HTML file: style inside, no script, no reference to another file."""
    with tempfile.TemporaryDirectory() as folder:
        site = Path(folder) / "site"
        publish(history, site, accepted, None, options)
        document = site / "document.html"
        if not document.exists():
            raise PrintError("no night is recorded yet; record one with: tracker run")
        text = document.read_text(encoding="utf-8")
        style = next((site / "assets").glob("site-*.css")).read_text(encoding="utf-8")
    text = re.sub(r"<script\b.*?</script>\n?", "", text, flags=re.DOTALL)
    text = re.sub(r'<link rel="(icon|alternate)"[^>]*>\n?', "", text)
    text = re.sub(r"<header class=\"bar\">.*?</header>\n?", "", text, flags=re.DOTALL)
    text = re.sub(r"<footer>.*?</footer>\n?", "", text, flags=re.DOTALL)
    return re.sub(r'<link rel="stylesheet"[^>]*>', lambda found: f"<style>\n{style}</style>", text, count=1)


def print_pdf(html: Path, pdf: Path) -> None:
    """Print an HTML file as PDF, with an outline and the pages of its contents, by the browser that is here.

    Only what is printed tells on which page it stands: it is printed once, with numbers as wide as any, to learn that,
    and again with the right ones.
    PrintError if there is no browser, or it fails.
    """
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        raise PrintError(
            f"a PDF is printed by a browser, and none of {', '.join(BROWSERS)} is here; install one, or ask "
            "for --html and print that"
        )
    with tempfile.TemporaryDirectory() as folder:
        text = html.read_text(encoding="utf-8")
        numbered = Path(folder) / "numbered.html"
        numbered.write_text(with_pages(text, dict.fromkeys(NUMBERED.findall(text), 88)), encoding="utf-8")
        made = _printed(browser, numbered, Path(folder))
        numbered.write_text(with_pages(text, pages_of(made.read_bytes())), encoding="utf-8")
        made = _printed(browser, numbered, Path(folder))
        pdf.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(made, pdf)


def with_pages(html: str, pages: Mapping[str, int]) -> str:
    """The document with the page of each test in its contents, as far as they are known."""

    def numbered(found: re.Match[str]) -> str:
        page = pages.get(found[1])
        return found[0] if page is None else f"{found[0]}{page}"

    return NUMBERED.sub(numbered, html)


def pages_of(pdf: bytes) -> dict[str, int]:
    """The page on which each place that is linked to stands, as browsers write it; empty where one writes otherwise."""
    order = re.findall(rb"\n(\d+) 0 obj\s*<<\s*/Type /Page\b", pdf)
    number = {page: place for place, page in enumerate(order, 1)}
    named = re.search(rb"/Dests (\d+) 0 R", pdf)
    told = named and re.search(rb"\n%s 0 obj\s*<<(.*?)>>" % named[1], pdf, re.DOTALL)
    if not told:
        return {}
    found = re.findall(rb"/(\S+) \[(\d+) 0 R", told[1])
    return {name.decode("ascii", "replace"): number[page] for name, page in found if page in number}


def _printed(browser: str, html: Path, folder: Path) -> Path:
    made = folder / "made.pdf"
    made.unlink(missing_ok=True)
    command = [
        browser, "--headless=new", "--disable-gpu", "--no-pdf-header-footer", "--disable-dev-shm-usage",
        "--generate-pdf-document-outline", f"--user-data-dir={folder}/profile", f"--print-to-pdf={made}",
    ]  # fmt: skip
    if hasattr(os, "geteuid") and os.geteuid() == 0:
        command.append("--no-sandbox")
    try:
        done = subprocess.run(
            [*command, html.absolute().as_uri()], capture_output=True, text=True, timeout=PATIENCE
        )
    except subprocess.TimeoutExpired:
        raise PrintError(f"{browser} did not finish printing within {PATIENCE:.0f} s") from None
    if not made.exists():
        last = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        raise PrintError(f"{browser} printed nothing: {last[:200]}")
    return made
