"""The example in the engine's documentation runs as it stands."""

from __future__ import annotations

import doctest

from spook_tracker import engine


def test_the_documented_example_runs() -> None:
    result = doctest.testmod(engine, optionflags=doctest.ELLIPSIS)

    assert result.attempted > 10
    assert result.failed == 0
