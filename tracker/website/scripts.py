"""Scripts that hand data to a page: a page opened from a file may not fetch.

A call's data are JSON, deflated, in base64: a third of the bytes. The files of data/ hold the same numbers to be read.
"""

from __future__ import annotations

import base64
import json
import zlib


def as_json(value: object) -> str:
    """In as few letters as possible."""
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False)


def call(function: str, key: str, text: str) -> bytes:
    """A line that calls a function of the page with a key and packed JSON, which `inflated` of packed.js reads."""
    packed = base64.b64encode(zlib.compress(text.encode("utf-8", "replace"))).decode()
    return f'{function}({json.dumps(key)},"{packed}");\n'.encode()
