"""`make bench`: every timing claim of the project, as ratios measured side by side in one run.

Runs each bench_*.py of this folder in turn, or only those named: `python bench/run.py particles storage`.
Absolute times do not carry over between machines; the ratios do. Exit code 1 if a limit is missed. Heaps and the
frames of a browser take minutes and run when named: `make bench-heaps`, `make bench-replay`.
"""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

HERE = Path(__file__).parent
BY_NAME = ("heaps", "replay")
LAST = ("growth",)  # takes minutes alone: the others have answered by then


def main() -> int:
    known = {path.stem.removeprefix("bench_"): path for path in sorted(HERE.glob("bench_*.py"))}
    asked = sys.argv[1:] or sorted((set(known) - {*BY_NAME}), key=lambda name: (name in LAST, name))
    unknown = [name for name in asked if name not in known]
    if unknown:
        print(f"no benchmark named {unknown[0]!r}; there are {', '.join(known)}", file=sys.stderr)
        return 2
    sys.path.insert(0, str(HERE))
    missed = []
    for name in asked:
        print(f"\n== {name} ==", flush=True)
        sys.argv = [str(known[name])]  # its own: what was asked of us are names
        try:
            runpy.run_path(str(known[name]), run_name="__main__")
        except SystemExit as end:  # how a benchmark says that a limit was missed
            if end.code:
                missed.append(name)
    if missed:
        print(f"\nlimits missed in: {', '.join(missed)}", file=sys.stderr)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
