"""What pages of the website may weigh: the first one whole, the others without their charts, each as it travels."""

from __future__ import annotations

import gzip
import re
from pathlib import Path

FIRST, OTHERS = 100_000, 400_000  # bytes
SENT = (
    FIRST  # bytes of any page compressed, as servers send it: none takes longer to arrive than the first may
)
WHOLE_HISTORY = ("document.html",)  # the report has everything in one piece


def before_charts(page: Path) -> int:
    """Bytes of a page without its charts."""
    text = page.read_text(encoding="utf-8")
    return len(re.sub(r'<figure class="chart.*?</figure>', "", text, flags=re.DOTALL).encode())


def too_heavy(site: Path) -> list[str]:
    """Every page of a website that is above its budget, and by how much."""
    found = []
    for page in sorted(site.rglob("*.html")):
        name = page.relative_to(site).as_posix()
        if name in WHOLE_HISTORY:
            continue
        weight, most = (page.stat().st_size, FIRST) if name == "index.html" else (before_charts(page), OTHERS)
        if weight > most:
            found.append(f"{name}: {weight} bytes of {most}")
        if (sent := len(gzip.compress(page.read_bytes(), mtime=0))) > SENT:
            found.append(f"{name}: {sent} bytes of {SENT} compressed")
    return found
