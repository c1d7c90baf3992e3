"""How long a website takes: ten years of nights at once, and one more night on top.

Synthetic runs (`tests/synthetic_history.py`) stand for the nights; the ratio of the two is the claim.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent))

from spook_tracker.tracker.website.publish import publish
from tests.synthetic_history import decade


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "public"
        seconds = []
        for nights in (3650, 3651):
            history = decade(nights)
            start = time.perf_counter()
            report = publish(history, out)
            seconds.append(time.perf_counter() - start)
            print(f"{nights} nights: {seconds[-1]:.1f} s, {report}")
        print(f"one more night / all nights: {seconds[1] / seconds[0]:.2f}")


if __name__ == "__main__":
    main()
