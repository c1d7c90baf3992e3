"""What one piece of work may take, unless something else is said. Numbers alone: the command line starts with them."""

from __future__ import annotations

TIME_LIMIT = 1200.0  # s of wall time
MEMORY = 4096  # MB more than the process has at its start
