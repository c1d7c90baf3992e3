"""A real browser for the tests of the website: headless Chromium, without a network.

A picture of any page, such as those that `make pictures` puts into docs/ (bench/pictures.py):

    python -m tests.website.browser public/tests/pendulum.html pendulum.png --most 620 --at "#error-time"
"""

from __future__ import annotations

import argparse
import ctypes
import os
import shutil
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.places import ROOT

MISSING = "no Chromium with its driver here; .ci/install-system installs both"
PATIENCE = 60.0  # s, on a machine whose cores are busy; a page that never gets there fails then
SEEN = """[...document.querySelectorAll('figure.chart')].every((box) => 'drawn' in box.dataset ||
  !box.checkVisibility() || box.getBoundingClientRect().top > innerHeight || box.getBoundingClientRect().bottom < 0)"""
STILL = """[...document.querySelectorAll('figure.replay, .live')].every((box) => box.player || box.page ||
  box.getBoundingClientRect().top > innerHeight || box.getBoundingClientRect().bottom < 0)"""
CONTRAST = """
const shades = [];
function parse(text) {
  const n = (text.match(/[\\d.]+/g) || []).map(Number);
  return text.startsWith('color(srgb') ? [n[0] * 255, n[1] * 255, n[2] * 255, n[3] ?? 1] : [n[0], n[1], n[2], n[3] ?? 1];
}
function over(top, bottom) { return top.slice(0, 3).map((v, i) => v * top[3] + bottom[i] * (1 - top[3])).concat(1); }
function ground(element) {
  const layers = [];
  for (let e = element; e; e = e.parentElement) { layers.push(parse(getComputedStyle(e).backgroundColor)); }
  return layers.reverse().reduce((below, layer) => over(layer, below), [255, 255, 255, 1]);
}
function light(c) {
  const [r, g, b] = c.slice(0, 3).map((v) => { v /= 255; return v <= .03928 ? v / 12.92 : ((v + .055) / 1.055) ** 2.4; });
  return .2126 * r + .7152 * g + .0722 * b;
}
const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
while (walker.nextNode()) {
  const node = walker.currentNode, element = node.parentElement;
  if (!node.textContent.trim() || !element.checkVisibility() || element.closest('script,.plot,.skip,template')) continue;
  const style = getComputedStyle(element), svg = element.closest('svg');
  const ink = parse(svg ? style.fill : style.color), paper = ground(svg ? svg.parentElement : element);
  const [a, b] = [light(over(ink, paper)), light(paper)];
  const ratio = (Math.max(a, b) + .05) / (Math.min(a, b) + .05);
  const large = parseFloat(style.fontSize) >= 24 || (parseFloat(style.fontSize) >= 18.66 && style.fontWeight >= 700);
  if (ratio < (large ? 3 : 4.5) && !element.closest('.letter')) shades.push(node.textContent.trim().slice(0, 40) + ' ' + ratio.toFixed(2));
}
return [...new Set(shades)];
"""
MODULE = ROOT / "site" / "static" / "live.wasm"
LIVE = ("live.html",) if MODULE.exists() else ()  # the pages that need it
CHROMES = ("chromium", "chromium-browser", "google-chrome")


def programs() -> tuple[str, str] | None:
    """Paths of the browser and of its driver, if both are installed."""
    chrome = next(filter(None, map(shutil.which, CHROMES)), None)
    driver = shutil.which("chromedriver")
    return (chrome, driver) if chrome and driver else None


def _with_its_parent() -> None:
    """In a driver before it begins: ends with the process that started it, however that ends."""
    die_with_parent = 1  # PR_SET_PDEATHSIG
    ctypes.CDLL(None).prctl(die_with_parent, int(signal.SIGKILL))


@contextmanager
def browser(chrome: str, driver: str, *, trace: str = "") -> Iterator[Any]:
    """A driver of a browser that cannot reach anything but files, and dies with the test.

    With categories of Chromium's `trace` its events stand in the log named performance.

    Also with one that is killed, on Linux: the driver by the system's word, and the browser because what it is
    told comes through the driver's pipe, which closes then.
    """
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = chrome
    for argument in (
        "--headless=new",
        "--disable-gpu",
        "--hide-scrollbars",
        "--disable-dev-shm-usage",
        "--remote-debugging-pipe",
    ):
        options.add_argument(argument)
    if hasattr(os, "geteuid") and os.geteuid() == 0:
        options.add_argument("--no-sandbox")
    logs = {"browser": "ALL"}
    if trace:
        logs["performance"] = "ALL"
        options.add_experimental_option("perfLoggingPrefs", {"traceCategories": trace})
    options.set_capability("goog:loggingPrefs", logs)
    # The word is given when the starting thread ends: of others than the first that may be long before the process.
    leashed = sys.platform == "linux" and threading.current_thread() is threading.main_thread()
    started = {"preexec_fn": _with_its_parent} if leashed else {}
    opened = webdriver.Chrome(options=options, service=Service(driver, popen_kw=started))
    try:
        _cut_off(opened)
        yield opened
    finally:
        opened.quit()


def _cut_off(driver: Any) -> None:
    """From every network."""
    driver.execute_cdp_cmd("Network.enable", {})
    nothing = {"offline": True, "latency": 0, "downloadThroughput": 0, "uploadThroughput": 0}
    driver.execute_cdp_cmd("Network.emulateNetworkConditions", nothing)


def new_tab(driver: Any) -> None:
    """One tab, as in a browser that was just started: nothing kept, nothing logged, no size or theme set."""
    old = driver.window_handles
    driver.switch_to.new_window("tab")
    new = driver.current_window_handle
    for handle in old:
        driver.switch_to.window(handle)
        driver.close()
    driver.switch_to.window(new)
    everything = {"origin": "file://", "storageTypes": "all"}
    driver.execute_cdp_cmd("Storage.clearDataForOrigin", everything)
    driver.get_log("browser")  # what was read is gone
    _cut_off(driver)


def look(driver: Any, *, width: int = 1280, height: int = 900, dark: bool = False) -> None:
    """Set the window's size and the system's theme."""
    size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    theme = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": theme})


def arrive(driver: Any, address: str) -> None:
    """Open a page and wait until it says that its scripts have run."""
    driver.get(address)
    there = "location.href.split('#')[0] === arguments[0] && 'ready' in document.documentElement.dataset"
    wait_for(driver, there, address.partition("#")[0])


def wait_for(driver: Any, condition: str, *arguments: Any) -> None:
    """Wait until a condition of JavaScript holds; a busy machine may take its time."""
    from selenium.webdriver.support.ui import WebDriverWait

    waiting = WebDriverWait(driver, PATIENCE, poll_frequency=0.02)
    waiting.until(lambda d: d.execute_script(f"return {condition};", *arguments), condition)


def photograph(
    page: str, picture: Path, *, width: int = 1280, most: int = 1500, dark: bool = False, at: str = ""
) -> None:
    """A picture of a page of the website (its view may follow after a #), from its top down to `most` pixels.

    `at` is a selector of what the picture begins with, if not the top.
    """
    found = programs()
    if found is None:
        raise SystemExit(MISSING)
    path, mark, view = page.partition("#")
    with browser(*found) as driver:
        look(driver, width=width, dark=dark)
        arrive(driver, Path(path).resolve().as_uri() + mark + view)
        tall = driver.execute_script("return document.documentElement.scrollHeight")
        look(driver, width=width, height=min(most, tall), dark=dark)
        for _ in range(3 if at else 1):  # what comes into view may push the rest down
            if at:
                show = "document.querySelector(arguments[0]).scrollIntoView({ behavior: 'instant' })"
                driver.execute_script(show, at)
            wait_for(driver, SEEN)  # charts are drawn as they come into view
            wait_for(driver, STILL)
        picture.parent.mkdir(parents=True, exist_ok=True)
        driver.save_screenshot(str(picture))


def main() -> None:
    reader = argparse.ArgumentParser(description="A picture of a page of the website.")
    reader.add_argument("page", help="such as public/index.html or public/live.html#scene=pile")
    reader.add_argument("picture", type=Path)
    reader.add_argument("--width", type=int, default=1280)
    reader.add_argument("--most", type=int, default=1500, help="pixels from the top")
    reader.add_argument("--at", default="", help="selector of what the picture begins with")
    reader.add_argument("--dark", action="store_true")
    photograph(**vars(reader.parse_args()))


if __name__ == "__main__":
    main()
