"""The engine for the reader's browser: the WebAssembly module as a script, and the page that runs it.

The module is built by `make wasm` and is not part of the repository. Without it there is no such page.
"""

from __future__ import annotations

import base64
import json
import zlib
from functools import lru_cache
from pathlib import Path

from .page_rows import Page

MODULE = "live.wasm"  # under site/static


def built_module(static: Path) -> bytes | None:
    """The module; None if it is not built."""
    built = static / MODULE
    return built.read_bytes() if built.is_file() else None


@lru_cache(maxsize=1)  # .09 s of each website that a process publishes
def module_script(module: bytes, worker: bytes) -> bytes:
    """The module and the worker's source as a script, which a page opened from a file may load."""
    source = json.dumps(worker.decode()).replace("</", "<\\/").encode()
    return b'const LIVE_MODULE="%b",LIVE_WORKER=%b;\n' % (base64.b64encode(zlib.compress(module, 9)), source)


def live_page(module: str) -> Page:
    """The page on which the engine runs; `module` is the address of its script."""
    return Page(
        "live.html",
        "live.html",
        "The engine, live",
        "The native engine, compiled to WebAssembly, runs in this page.",
        {"module": module},
    )
