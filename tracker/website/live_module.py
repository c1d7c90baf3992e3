"""The engine for the reader's browser: the WebAssembly module as a script, and the page that runs it.

The module is built by `make wasm` and is not part of the repository. Without it the page says so.
"""

from __future__ import annotations

import base64
import zlib
from pathlib import Path

from spook_tracker.tracker.website.page_rows import Page

MODULE = "live.wasm"  # under site/static


def built_module(static: Path) -> bytes | None:
    """The module; None if it is not built."""
    built = static / MODULE
    return built.read_bytes() if built.is_file() else None


def module_script(module: bytes) -> bytes:
    """The module as a script, which a page opened from a file may load."""
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
