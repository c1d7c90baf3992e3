"""The mutation run says what it seems to say."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def test_every_mutant_of_the_mutation_run_still_applies() -> None:
    """A rule that is written differently takes its mutant along, or the run would say less than it seems to."""
    spec = importlib.util.spec_from_file_location("mutation", ROOT / "bench" / "mutation.py")
    assert spec is not None and spec.loader is not None
    mutation = importlib.util.module_from_spec(spec)
    sys.modules["mutation"] = mutation
    spec.loader.exec_module(mutation)

    for mutant in mutation.MUTANTS:
        text = (ROOT / mutant.file).read_text()
        assert mutation.applied(mutant, text) != text
