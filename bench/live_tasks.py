"""How long the live page keeps its main thread from answering: every task of it, while its default scene computes.

    python bench/live_tasks.py                      of a site of its own; or of a published page, such as public/live.html

Told is processor time of the page's main thread, from Chromium's own trace; wall time beside it is what a busy machine
makes of that. Red (exit 1) if a task takes more than 50 ms, the length from which browsers call a task long.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent.parent))

from spook_tracker.tracker.website.publish import publish
from tests.website.browser import MISSING, arrive, browser, look, programs, wait_for
from tests.website.test_causes import nights

LONG = 50.0  # ms
RUNS = 5  # of the scene, each begun by a slider
MOVED = """
const slider = document.querySelector('.live input[type=range]');
slider.value = String(Number(slider.min) + arguments[0] * (Number(slider.max) - Number(slider.min)));
slider.dispatchEvent(new Event('input', { bubbles: true }));
slider.dispatchEvent(new Event('change', { bubbles: true }));
"""


def tasks(driver: Any, address: str) -> list[tuple[float, float, str]]:
    """Processor and wall time [ms] of each task so far of the main thread of the page at `address`, longest first, and what it was."""
    events = [
        message["params"]
        for entry in driver.get_log("performance")
        if (message := json.loads(entry["message"])["message"])["method"] == "Tracing.dataCollected"
    ]
    # Other renderers are the browser's own pages, such as that of a new tab.
    pages = {e["pid"] for e in events if address in str(e.get("args", {}).get("data", {}).get("url", ""))}
    mains = {
        (e["pid"], e["tid"])
        for e in events
        if e["name"] == "thread_name" and e["args"]["name"] == "CrRendererMain" and e["pid"] in pages
    }
    mine = [e for e in events if e.get("ph") == "X" and (e["pid"], e["tid"]) in mains]
    inner = [
        e for e in mine if e["name"] in ("FunctionCall", "EvaluateScript", "v8.compile", "Layout", "Paint")
    ]

    def what(task: dict[str, Any]) -> str:
        inside = [
            e for e in inner if e["tid"] == task["tid"] and task["ts"] <= e["ts"] < task["ts"] + task["dur"]
        ]
        if not inside:
            return ""
        longest = max(inside, key=lambda e: e.get("tdur", 0))
        return f"{longest['name']} {longest.get('args', {}).get('data', {}).get('functionName', '')}"

    found = [
        (e.get("tdur", 0) / 1e3, e["dur"] / 1e3, what(e))
        for e in mine
        if e["name"] == "ThreadControllerImpl::RunTask" and "dur" in e
    ]
    return sorted(found, reverse=True)


def main() -> int:
    programs_found = programs()
    if programs_found is None:
        raise SystemExit(MISSING)
    with tempfile.TemporaryDirectory() as folder:
        if len(sys.argv) == 1:
            publish(nights(), Path(folder) / "public")
        page = Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else Path(folder) / "public" / "live.html"
        if not page.is_file():
            raise SystemExit(f"there is no {page}; build its engine with: make wasm")
        return told(page, programs_found)


def told(page: Path, chrome: tuple[str, str]) -> int:
    """Says the longest tasks of the page; 1 if one is too long."""
    with browser(*chrome, trace="toplevel,devtools.timeline") as driver:
        look(driver, width=1400)
        arrive(driver, page.as_uri())
        wait_for(driver, "!!document.querySelector('.live').page")
        for run in range(RUNS):
            driver.execute_script(MOVED, (run + 1) / (RUNS + 1))
            driver.execute_async_script("setTimeout(arguments[0], 1500)")
        found = tasks(driver, page.as_uri())
    print(f"{len(found)} tasks; the longest, ms of processor time (wall):")
    for spent, wall, name in found[:5]:
        print(f"  {spent:6.1f} ({wall:6.1f})  {name}")
    return int(found[0][0] > LONG)


if __name__ == "__main__":
    raise SystemExit(main())
