"""Fuzz one target of tests/fuzz/targets.py: python -m tests.fuzz.run NAME [libFuzzer's options and folders]."""

from __future__ import annotations

import sys

import atheris

# An editable installation finds our code by a loader of its own, which atheris passes over: the folder goes first.
sys.meta_path.sort(key=lambda finder: type(finder).__name__ == "ScikitBuildRedirectingFinder")

with atheris.instrument_imports(include=["spook_tracker", "tomllib", "tests.fuzz.targets"]):
    from tests.fuzz.targets import TARGETS, put

if __name__ == "__main__":
    name, *options = sys.argv[1:]
    again = f"{sys.executable} -m tests.fuzz.run {name}"  # what libFuzzer starts to minimise, through a shell
    atheris.Setup([again, *options], lambda content: put(TARGETS[name], content) and None)
    atheris.Fuzz()
