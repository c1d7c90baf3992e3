"""Instructions counted by valgrind's callgrind: where they were spent, and only the engine's."""

from __future__ import annotations

import shutil
import sys
import sysconfig
from pathlib import Path

import pytest

import spook_tracker.tracker.measure.callgrind as callgrind
from spook_tracker.tracker.document.errors import TrackerError

PROFILE = """\
# callgrind format
positions: line
events: Ir

ob=(1) /opt/a/libengine.so
fn=(1) step
12 100
+1 20
cob=(2) /usr/lib/libm.so
cfn=(2) sin
calls=3 0
* 900
* 5

ob=(2)
fn=(2)
40 890
-1 10

ob=(1)
fn=(3) solve
7 1000
totals: 2025
"""


def test_instructions_count_where_they_were_spent() -> None:
    """The cost of a call belongs to the object that is called, whose name may stand first at the call."""
    costs = callgrind.self_costs(PROFILE)

    assert costs == {"/opt/a/libengine.so": 1125, "/usr/lib/libm.so": 900}
    assert sum(costs.values()) == 2025, "as the profile's own total"


def test_only_the_engine_is_counted() -> None:
    packages = sysconfig.get_path("purelib")
    others = (
        "/usr/lib/x86_64-linux-gnu/libc.so.6",
        f"{sys.base_prefix}/lib/libpython3.11.so.1.0",
        f"{packages}/numpy/_core/_multiarray_umath.so",
        f"{packages}/scipy.libs/libopenblas.so",
        f"{packages}/msgspec/_core.so",
        f"{sys.base_prefix}/lib/python3.11/lib-dynload/_json.so",
    )

    assert not [name for name in others if callgrind._of_engine(name)]
    assert callgrind._of_engine("/opt/a/pebble/build/libpebble.so")
    assert callgrind._of_engine(f"{packages}/mujoco/libmujoco.so.3.3.0")


def test_without_valgrind_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)

    with pytest.raises(TrackerError, match="needs valgrind; install it"):
        callgrind.count_instructions("spook", "standard", "pendulum", 10)


def test_the_engine_that_was_told_is_looked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A valgrind that counts nothing: what it is given to run, runs."""
    (fake := tmp_path / "valgrind").write_text('#!/bin/sh\nshift 2\nexec "$@"\n')
    fake.chmod(0o755)
    monkeypatch.setattr(shutil, "which", lambda name: str(fake))

    with pytest.raises(
        TrackerError, match=r"pendulum cannot be counted: .*there is no engine 'no_such_engine'"
    ):
        callgrind.count_instructions("no_such_engine", "standard", "pendulum", 10)


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="no valgrind here")
def test_what_goes_wrong_under_valgrind_is_said(tmp_path: Path) -> None:
    """It goes wrong where NumPy would be imported, which takes eight seconds under valgrind."""
    (tmp_path / "numpy.py").write_text("raise ImportError('this is no NumPy')")

    with pytest.raises(TrackerError, match=r"fall cannot be counted: .*this is no NumPy"):
        callgrind.count_instructions("spook", "standard", "fall", 10, tmp_path)
