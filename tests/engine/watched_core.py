"""A pytest plugin: the native module built with sanitizers ($SPOOK_WATCHED) in place of the installed one."""

from __future__ import annotations

import importlib.util
import os
import sys

NAME = "spook_tracker.engine._core"

_spec = importlib.util.spec_from_file_location(NAME, os.environ["SPOOK_WATCHED"])
assert _spec is not None and _spec.loader is not None
_module = importlib.util.module_from_spec(_spec)
sys.modules[NAME] = _module
_spec.loader.exec_module(_module)
