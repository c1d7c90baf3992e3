"""What fuzzing has kept: bytes that reach far into our code, and those that once went wrong."""

from __future__ import annotations

import pytest

from tests.fuzz.targets import KEPT, TARGETS, put


@pytest.mark.parametrize("name", TARGETS)
def test_what_was_kept_is_taken_or_refused_in_a_sentence(name: str) -> None:
    files = sorted((KEPT / name).iterdir())
    said = [put(TARGETS[name], file.read_bytes()) for file in files]

    assert "" in said, "something is taken"
    assert any(said), "something is refused"
