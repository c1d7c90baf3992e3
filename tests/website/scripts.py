"""What the scripts of a website hand over, unpacked as its pages unpack it."""

from __future__ import annotations

import base64
import json
import re
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

CALL = re.compile(r'^(\w+)\(("[^"\n]*"),"([\w+/=]*)"\);$', re.MULTILINE)


def handed_over(files: Path | Iterable[Path], function: str) -> dict[str, Any]:
    """By key, the data of every call of a function in a file, or in several."""
    texts = [file.read_text("utf-8") for file in ([files] if isinstance(files, Path) else files)]
    return {
        json.loads(key): json.loads(zlib.decompress(base64.b64decode(packed)))
        for text in texts
        for called, key, packed in CALL.findall(text)
        if called == function
    }
