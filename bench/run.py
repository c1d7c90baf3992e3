"""`make bench`: every timing claim of the project, as ratios measured side by side in one run.

Runs each bench_*.py of this folder in turn, or only those named: `python bench/run.py particles storage`.
Absolute times do not carry over between machines; the ratios do.
"""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

HERE = Path(__file__).parent


def main() -> int:
    known = {path.stem.removeprefix("bench_"): path for path in sorted(HERE.glob("bench_*.py"))}
    asked = sys.argv[1:] or list(known)
    unknown = [name for name in asked if name not in known]
    if unknown:
        print(f"no benchmark named {unknown[0]!r}; there are {', '.join(known)}", file=sys.stderr)
        return 2
    sys.path.insert(0, str(HERE))
    for name in asked:
        print(f"\n== {name} ==", flush=True)
        runpy.run_path(str(known[name]), run_name="__main__")
    return 0


if __name__ == "__main__":
    sys.exit(main())
