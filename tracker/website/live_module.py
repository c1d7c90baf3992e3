"""The engine for the reader's browser: the WebAssembly module as a script, and the page that runs it.

The module is built by `make wasm` and is not part of the repository. Without it the page says so.
"""

from __future__ import annotations

import base64
import zlib
from functools import lru_cache
from pathlib import Path

from spook_tracker.tracker.website.page_rows import Page

MODULE = "live.wasm"  # under site/static


def module_script(static: Path) -> bytes | None:
    """The module as a script, which a page opened from a file may load; None if it is not built."""
    built = static / MODULE
    if not built.is_file():
        return None
    return _script(built.read_bytes())


@lru_cache(maxsize=1)  # one module, published again and again
def _script(module: bytes) -> bytes:
    return b'const LIVE_MODULE="' + base64.b64encode(zlib.compress(module, 9)) + b'";\n'


def live_page(module: str) -> Page:
    """The page on which the engine runs; `module` is the address of its script, empty if there is none."""
    return Page(
        "live.html",
        "live.html",
        "The engine, live",
        "The native engine, compiled to WebAssembly, runs in this page.",
        {"module": module},
    )
