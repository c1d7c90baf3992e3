"""Where nothing may be missing, a skipped test is a failed one: CI installs all that tests need, so it says so."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Generator
from typing import Any

import pytest

# What CI may lack: other engines, a clone with its history, a distribution's WebAssembly compiler.
LAWFUL = ("the extra ", "engine '", "clone", "not a git checkout")
WASM = "make wasm"
LINUX = "only Linux "  # what no installation brings to another system


def unlawful(reason: str) -> bool:
    """Whether a test skipped for this reason fails in CI."""
    if WASM in reason:
        return shutil.which("clang++-19") is not None
    if LINUX in reason:
        return sys.platform == "linux"
    return not any(words in reason for words in LAWFUL)


def _judge(report: Any) -> Any:
    if os.environ.get("CI") and report.skipped and not hasattr(report, "wasxfail"):
        reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr)
        if unlawful(reason):
            report.outcome, report.longrepr = "failed", f"skipped where nothing may be missing: {reason}"
    return report


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: Any) -> Generator[None, Any, Any]:
    return _judge((yield))


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector: pytest.Collector) -> Generator[None, Any, Any]:
    return _judge((yield))
