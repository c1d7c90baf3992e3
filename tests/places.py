"""Where things lie: the tree, what tests read, and the folder that goes on a path as a team's own does."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT / "tests" / "data"
TOYS = ROOT / "tests" / "toys"
