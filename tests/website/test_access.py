"""Every kind of page, at four widths, light and dark: nothing complains, is cut or overlaps, charts are drawn, axe finds nothing.

How a page is laid out is asked at every width, and in the dark at one, as colours move nothing. Axe takes its time: each
page meets it in one look, in turn, so that all eight come up; with SPOOK_TEST_EVERY_LOOK (`make looks`, weekly) all of all.
"""

import os
from importlib.resources import files

import pytest

from spook_tracker.tracker.website import page_test
from spook_tracker.tracker.website.options import SiteOptions
from spook_tracker.tracker.website.publish import publish
from tests.histories.synthetic import DocumentHistory, with_rival
from tests.places import ROOT
from tests.website.browser import CONTRAST, LIVE, SEEN, STILL, look, wait_for
from tests.website.test_browser import DRAWN, complaints, visit
from tests.website.test_causes import nights
from tests.website.test_causes import recorded as recorded  # a fixture

PAGES = (
    "index.html", "tests/friction.html", "error-time.html", "stability.html", *LIVE, "compare.html",
    "regressions.html", "versions.html", "data.html", "document.html", "engines.html", "engines/rival.html",
    "mutants.html", "tests/door.html", "../empty/index.html",
)  # fmt: skip
WIDTHS = (360, 768, 1400, 2200)
RECORD = ROOT / "bench" / "mutants.json"
OPENED = """
document.documentElement.style.scrollBehavior = 'auto';
document.querySelectorAll('details').forEach((box) => { box.open = true; });
document.querySelector('figure.replay')?.scrollIntoView();
"""
AXE = """
const done = arguments[arguments.length - 1];
axe.run(document, { resultTypes: ['violations'], iframes: false, preload: false }).then(
  (found) => done(found.violations.flatMap((v) => v.nodes.map((n) => `${v.id} (${v.impact}): ${n.target.join(' ')}`))));
"""
LAID_OUT = """
const inside = (e) => e.closest('.scroll, .bar nav, svg, .plot, .visually-hidden, .skip, template, script, canvas, math, .js-plotly-plot');
const told = [];
const wide = innerWidth;
if (document.documentElement.scrollWidth > wide) { told.push('the page scrolls sideways'); }
const texts = [];
const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
while (walker.nextNode()) {
  const node = walker.currentNode, element = node.parentElement;
  if (!node.textContent.trim() || !element.checkVisibility({ visibilityProperty: true }) || inside(element) || element.closest('header.bar, option')) continue;
  const range = document.createRange();
  range.selectNodeContents(node);
  for (const box of range.getClientRects()) {
    if (box.width < 2 || box.height < 2) continue;
    if (box.right > wide + 1 || box.left < -1) { told.push(`cut: ${node.textContent.trim().slice(0, 40)}`); }
    texts.push({ top: box.top + 0.2 * box.height, bottom: box.bottom - 0.2 * box.height, left: box.left + 1, right: box.right - 1, text: node.textContent.trim().slice(0, 40), element });
  }
}
texts.sort((a, b) => a.top - b.top);
for (let i = 0; i < texts.length; i += 1) {
  for (let j = i + 1; j < texts.length && texts[j].top < texts[i].bottom; j += 1) {
    const a = texts[i], b = texts[j];
    if (a.left < b.right && b.left < a.right && a.element !== b.element) { told.push(`overlap: ${a.text} / ${b.text}`); }
  }
}
for (const box of document.querySelectorAll('main *')) {
  const style = getComputedStyle(box);
  if (inside(box) && !box.matches('.scroll')) continue;
  if (style.overflowX === 'hidden' && box.scrollWidth > box.clientWidth + 1 && box.checkVisibility()) { told.push(`hidden: ${box.className}`); }
}
return [...new Set(told)].slice(0, 20);
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory, recorded):
    """One of its pages cannot be made, and beside it is one of a history without a night."""
    out = tmp_path_factory.mktemp("seen") / "public"
    whole = page_test.test_page

    def broken(book, test, *more):
        if test.name == "door":
            raise ValueError("a word_that_goes_on_and_on_" + 8 * "without_a_space_")
        return whole(book, test, *more)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("spook_tracker.tracker.website.pages.test_page", broken)
        report = publish(with_rival(nights(motions=recorded)), out, options=SiteOptions(mutants=RECORD))
    assert [line.partition(":")[0] for line in report.failed] == ["tests/door.html"]
    publish(DocumentHistory([]), out.parent / "empty")
    return out


@pytest.fixture(scope="module")
def axe():
    pytest.importorskip("selenium_axe_python")
    return (files("selenium_axe_python") / "axe-core" / "axe.min.js").read_text(encoding="utf-8")


def settle(driver):
    """What the window shows is drawn, and two frames are over since."""
    wait_for(driver, SEEN)
    wait_for(driver, STILL)
    driver.execute_async_script(
        "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(() => done()))"
    )


def looks(place):
    """The looks in which a page is seen, and whether by axe, too: all eight of them in any eight pages."""
    every = bool(os.environ.get("SPOOK_TEST_EVERY_LOOK"))
    width, theme = WIDTHS[place % 4], place // 4 % 2 == 1
    dark = WIDTHS if every else (width,)
    return [
        *((w, False, every or (w == width and not theme)) for w in WIDTHS),
        *((w, True, every or theme) for w in dark),
    ]


@pytest.mark.parametrize("page", PAGES)
def test_a_page_is_accessible_at_every_width(driver, site, axe, page):
    """With all that unfolds unfolded, and a replay or a run in view that has begun."""
    visit(driver, site, page, width=WIDTHS[0], dark=False)
    driver.execute_script(axe)
    driver.execute_script(OPENED)
    found, shown = [], None
    for width, dark, by_axe in looks(PAGES.index(page)):
        look(driver, width=width, dark=dark)
        where = f"{page} {width} px {'dark' if dark else 'light'}"
        if dark != shown:
            theme = "dark" if dark else "light"
            wait_for(driver, "document.documentElement.dataset.theme === arguments[0]", theme)
            found += [f"{where}: pale: {text}" for text in driver.execute_script(CONTRAST)]
            shown = dark
        settle(driver)
        found += [f"{where}: {told}" for told in driver.execute_script(LAID_OUT)]
        if by_axe:
            found += [f"{where}: {told}" for told in driver.execute_async_script(AXE)]
    drawn = driver.execute_async_script(DRAWN) if page != "document.html" else []

    assert found == []
    assert [place for place, traces in enumerate(drawn) if traces == 0] == []
    assert complaints(driver) == []


def test_in_turn_the_pages_meet_axe_in_every_look():
    met = {(width, dark) for place in range(8) for width, dark, by_axe in looks(place) if by_axe}
    assert met == {(width, dark) for width in WIDTHS for dark in (False, True)}


def test_axe_and_the_measure_of_texts_find_what_is_wrong(driver, site, axe):
    """Both can fail: a picture without a name, text over text, text beyond the edge."""
    visit(driver, site, "data.html", width=360)
    driver.execute_script(axe)
    driver.execute_script(
        "document.querySelector('main').insertAdjacentHTML('beforeend', '<img src=\"badge.svg\">"
        '<p style="position:relative"><span style="position:absolute">one text</span><b>another</b></p>'
        '<p style="white-space:nowrap">a line that does not end before the edge of a telephone is reached</p>\')'
    )
    told = driver.execute_script(LAID_OUT)

    assert any(line.startswith("overlap") for line in told)
    assert any(line.startswith("cut") for line in told)
    assert any(line.startswith("image-alt") for line in driver.execute_async_script(AXE))
