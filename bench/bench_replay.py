"""What a frame of a replay costs: script for ten thousand bodies that move and turn, drawn without a graphics card.

A trajectory that no engine made (boxes and balls, positions and orientations between two samples, so that both are
interpolated) is played in headless Chromium. `player.cost` is the script of one frame: every body placed, the
picture asked for, the curves moved. An absolute limit: a frame of a screen is 16.7 ms long on any machine, and half of
that is left to the browser.

What a night records is less: a scene's first 300 bodies (`MOST_SOLIDS`), because a trajectory has 120 kB
(`MOST_BYTES`) and ten thousand bodies need 140 kB for a single sample.
"""

from __future__ import annotations

import statistics
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

from bench.costs import asked, bench, cost
from spook_tracker.engine.protocol import NotSupported
from tests.website.browser import MISSING, browser, programs

STATIC = Path(__file__).parent.parent / "site" / "static"
BODIES = 10_000
PATIENCE = 300.0  # s
FRAMES, WARM = 30, 5  # without a graphics card a picture of this many takes a good part of a second to draw
SCRIPTS = ("site.js", "three-scene.min.js", "scene-poses.js", "scene-marks.js", "scene-view.js", "player.js")
PAGE = '<!DOCTYPE html><meta charset="utf-8"><title>frames</title><figure style="width:480px"></figure>'
MOVIE = """
  const n = arguments[0], count = 60, position = new Float32Array(3 * n * count), orientation = new Float32Array(4 * n * count);
  for (let s = 0, i = 0; s < count; s += 1) {
    for (let b = 0; b < n; b += 1, i += 1) {
      position.set([b % 100 + 0.3 * Math.sin(0.1 * s + b), Math.floor(b / 100) + 0.3 * Math.cos(0.1 * s + b), 0.2 * Math.sin(0.2 * s)], 3 * i);
      const half = 0.05 * s + b, [x, y, z] = [0.6, 0, 0.8].map((v) => v * Math.sin(half));
      orientation.set([Math.cos(half), x, y, z], 4 * i);
    }
  }
  const solids = Array.from({ length: n }, (_, body) => ({ kind: body % 2 ? 'box' : 'sphere', size: body % 2 ? [0.8, 0.6, 0.4] : [0.4],
    position: [...position.slice(3 * body, 3 * body + 3)], orientation: [...orientation.slice(4 * body, 4 * body + 4)], fixed: false, body }));
  const movie = { step: 0.02, count, bodies: n, solids, links: [], rows: 0, gravity: [0, 0, -9.81], attractors: [], position, orientation };
  if (arguments[1]) { movie.ghost = { name: 'the night before', position: position.map((v) => v + 0.1), orientation }; }
"""
PLAYED = """
  const player = new Player(document.querySelector('figure'), movie, 't'), costs = [], [, , frames, warm] = arguments;
  let frame = 0;
  (function next() {
    player.seek((frame + 0.5) % (movie.count - 1));
    if (frame >= warm) { costs.push(player.cost); }
    frame += 1;
    if (frame < warm + frames) { requestAnimationFrame(next); } else { window.played = [costs, player.view.renderer.info.render.calls]; }
  })();
"""


def frames(driver: Any, page: Path, *, bodies: int, ghost: bool) -> tuple[list[float], int]:
    """Milliseconds of script of every frame, and how many draw calls one has."""
    driver.get(page.as_uri())
    driver.execute_script(MOVIE + PLAYED, bodies, ghost, FRAMES, WARM)
    from selenium.webdriver.support.ui import WebDriverWait

    costs, calls = WebDriverWait(driver, PATIENCE).until(lambda d: d.execute_script("return window.played"))
    return costs, calls


def played(ghost: bool) -> dict[str, float]:
    """Script a frame [ms], the median and what one in ten is above. NotSupported without a browser."""
    found = programs()
    if found is None:
        raise NotSupported(MISSING)
    with tempfile.TemporaryDirectory() as folder, browser(*found) as driver:
        driver.set_script_timeout(PATIENCE)
        page = Path(folder) / "frames.html"
        scripts = "".join(f'<script src="{(STATIC / name).as_uri()}"></script>' for name in SCRIPTS)
        page.write_text(PAGE + scripts, encoding="utf-8")
        costs, calls = frames(driver, page, bodies=BODIES, ghost=ghost)
    return {
        "frame": statistics.median(costs),
        "slow_frame": statistics.quantiles(costs, n=10)[-1],
        "draw_calls": calls,
    }


TESTS = {
    "replay": bench(
        "Replay",
        f"What does a frame of {BODIES} bodies cost in a browser?",
        *(
            asked(
                title,
                partial(played, ghost),
                cost("frame", "script of the median frame", limit, "half a frame of a screen", unit="ms"),
                cost("slow_frame", "one in ten is above", unit="ms"),
                cost("draw_calls", "of a frame"),
            )
            for title, ghost, limit in (("alone", False, 8.0), ("beside another night", True, None))
        ),
        beside="a frame of a screen, 16.7 ms",
    )
}
