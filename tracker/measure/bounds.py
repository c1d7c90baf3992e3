"""What is asked, where, and what one piece of work may take, unless something else is said: the command line starts with it."""

from __future__ import annotations

START_LIMIT = 120.0  # s in which a new process has read its program, on a machine however busy
TIME_LIMIT = 1200.0  # s of wall time
MEMORY = 4096  # MB more than the process has at its start
PROCESS = "process"  # the executor: processes of this machine
STANDARD = "spook_tracker.scalar_tests.catalogue:CATALOGUE"  # our questions
LOOK = 7.0  # s of the processor that a process has for a first look: two of them, with their start, ten on the clock
