"""CI has everything a test needs: there a test that is skipped for want of it fails, elsewhere it is skipped."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests import skips
from tests.places import ROOT

TESTS = """
import pytest

@pytest.mark.skipif(True, reason="no node here")
def test_of_a_page(): ...

def test_of_another_engine():
    pytest.skip("the extra exudyn is not installed")

@pytest.mark.xfail(strict=True)
def test_known(): assert False
"""

ALONE = os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}  # loading those costs more than all else here


@pytest.mark.parametrize(
    ("ci", "said"), [("", "2 skipped, 1 xfailed"), ("true", "1 skipped, 1 xfailed, 1 error")]
)
def test_what_ci_installs_is_never_skipped_there(tmp_path: Path, ci: str, said: str) -> None:
    (tmp_path / "test_some.py").write_text(TESTS)
    command = [sys.executable, "-m", "pytest", "-p", "tests.skips", "-p", "no:cacheprovider", tmp_path]
    done = subprocess.run(command, env=ALONE | {"CI": ci}, cwd=ROOT, capture_output=True, text=True)

    assert said in done.stdout
    assert ("skipped where nothing may be missing: " in done.stdout) == bool(ci)


def test_a_file_that_cannot_even_be_read_for_want_of_something_fails_too(tmp_path: Path) -> None:
    (tmp_path / "test_some.py").write_text("import pytest\npytest.importorskip('no_such_module')\n")
    command = [sys.executable, "-m", "pytest", "-p", "tests.skips", "-p", "no:cacheprovider", tmp_path]
    done = subprocess.run(command, env=ALONE | {"CI": "true"}, cwd=ROOT, capture_output=True, text=True)

    assert "1 error" in done.stdout


@pytest.mark.parametrize(("system", "said"), [("linux", True), ("darwin", False)])
def test_what_only_linux_does_is_skipped_elsewhere_and_never_there(
    system: str, said: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "platform", system)

    assert skips.unlawful("Skipped: only Linux ends a process with its parent") is said
    assert skips.unlawful("Skipped: no node here")
