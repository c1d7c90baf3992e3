"""Processes of tests that begin at once: forked by a server that has imported what they work with.

A fresh interpreter takes most of a second to import the database; these are as killable, and start in milliseconds.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

SERVER = multiprocessing.get_context("forkserver")
SERVER.set_forkserver_preload(["pytest", "tests.tracker.store.database_work"])


def begun(work: Callable[..., None], *given: Any) -> tuple[BaseProcess, Connection]:
    """A process doing `work(pipe, *given)`, and our end of its pipe, which ends when it does."""
    ours, theirs = SERVER.Pipe()
    process = SERVER.Process(target=work, args=(theirs, *given), daemon=True)
    process.start()
    theirs.close()
    return process, ours


def said(pipe: Connection) -> list[Any]:
    """Everything the process at the other end sends until it ends, killed or not."""
    found = []
    while True:
        try:
            found.append(pipe.recv())
        except (EOFError, ConnectionError):
            return found
