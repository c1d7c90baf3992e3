"""The published JSON Schema of a run document: what `export` writes and `import` accepts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import msgspec

from .json_form import schema_hook
from .run_document import SCHEMA_VERSION, RunDocument

if TYPE_CHECKING:
    from .json_form import Writable

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def document_schema() -> dict[str, Writable]:
    """JSON Schema (draft 2020-12) of RunDocument. Beyond it, import asks for sense: see tracker/store/border.py."""
    schema: dict[str, Writable] = msgspec.json.schema(RunDocument, schema_hook=schema_hook)
    about: dict[str, Writable] = {
        "$schema": DIALECT,
        "$id": f"urn:spook-tracker:run-document:{SCHEMA_VERSION}",
        "title": "Run document",
        "description": (
            "One run of the scalar tests of a physics engine. Non-finite numbers are the strings nan, inf "
            "and -inf; times are ISO 8601 with their zone."
        ),
    }
    return about | schema
