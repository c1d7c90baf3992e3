"""The website in a real browser, opened from a file with the network off."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from spook_tracker.tracker.judge.compare import ComparedRun, compare_in, side_of
from spook_tracker.tracker.judge.judged import commit_of
from spook_tracker.tracker.judge.work import with_work
from spook_tracker.tracker.website.publish import publish
from tests.histories.synthetic import SEVEN, history
from tests.website.browser import SEEN, arrive, look, wait_for

COMPARED = "document.getElementById('told').dataset.shown === arguments[0]"
DRAWN = """
const [done] = arguments;
const boxes = [...document.querySelectorAll('figure.chart')].filter((b) => b.checkVisibility());
let i = 0;
(function next() {
  if (i === boxes.length) { done(boxes.map((b) => b.querySelectorAll('.main-svg .trace, .main-svg .heatmaplayer image').length)); return; }
  boxes[i].scrollIntoView();
  (function wait() {  // as long as the script may take: the page says when it has drawn
    if ('drawn' in boxes[i].dataset) { i += 1; next(); } else { setTimeout(wait, 20); }
  })();
})();
"""


def draw(driver: Any, chart: str) -> None:
    """Scroll to a chart and wait until it is drawn: those above it may push it away as they come."""
    driver.execute_async_script(
        """const [chart, done] = arguments;
        (function look() {
          const box = document.querySelector(chart);
          box.scrollIntoView({ behavior: 'instant' });
          if ('drawn' in box.dataset) { done(); } else { setTimeout(look, 20); }
        })();""",
        chart,
    )


@pytest.fixture(scope="module")
def nights() -> Any:
    return history(24, broken=20, hostile=True)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory, nights: Any) -> Path:
    out = tmp_path_factory.mktemp("browsed") / "public"
    publish(nights, out)
    return out


def visit(driver: Any, site: Path, page: str, *, scripts: bool = True, **how: Any) -> None:
    """Open a page afresh, with a clean log."""
    look(driver, **how)
    driver.get("about:blank")
    driver.get_log("browser")
    address = (site / page.partition("#")[0]).resolve().as_uri() + page[len(page.partition("#")[0]) :]
    if scripts:
        arrive(driver, address)
    else:
        driver.get(address)


def complaints(driver: Any) -> list[str]:
    """What the browser logged, but for its remarks on drawing scenes without a graphics card."""
    messages = [entry["message"] for entry in driver.get_log("browser")]
    return [m for m in messages if "GL Driver Message" not in m and "software WebGL" not in m]


def test_hostile_names_and_versions_show_as_text(driver: Any, site: Path) -> None:
    hostile = next(path.name for path in (site / "tests").iterdir() if path.stem not in SEVEN)
    for page in ("index.html", f"tests/{hostile}", "compare.html", "versions.html", "document.html"):
        visit(driver, site, page)
        if page == "compare.html":
            wait_for(driver, COMPARED, "22,23")
        if page.startswith("tests/"):
            driver.execute_async_script(DRAWN)
        assert (
            driver.execute_script(
                "return document.querySelectorAll('main img:not([src=\"badge.svg\"]), main b').length"
            )
            == 0
        )
        assert "<img src=x onerror=alert(1)>" in driver.execute_script("return document.body.innerText")
        assert complaints(driver) == []  # an alert that was opened would have failed the script


def test_compare_shows_the_verdicts_of_the_command(driver: Any, site: Path, nights: Any) -> None:
    runs = nights.runs()
    for before, after in (
        (15, 23),
        (23, 15),
        (22, 23),
        (2, 23),
        (21, 3),
    ):  # the last two are judged in the page
        sides = [
            (
                run,
                ComparedRun(
                    side=side_of(run),
                    samples=with_work(nights.samples(run.id), run.engine),
                    maps=nights.maps(run.id),
                ),
            )
            for run in (runs[before], runs[after])
        ]
        told = compare_in(nights, *sides)
        visit(driver, site, f"compare.html#before={runs[before].id}&after={runs[after].id}")
        wait_for(driver, COMPARED, f"{before},{after}")

        text = driver.execute_script("return document.getElementById('told').innerText")
        words = driver.execute_script(
            "return [...document.querySelectorAll('#told tr[data-word]')].map((r) => r.dataset.word)"
        )
        assert f"EXIT CODE {told.exit_code}" in text
        here = [c for c in told.changes if (before > 13 and after > 13) or c.kind not in ("map", "run_time")]
        assert sorted(words) == sorted(
            c.word for c in here if c.word not in ("identical", "same", "not_measured")
        )
    assert commit_of(runs[0])


def test_choosing_versions_changes_the_address_and_the_address_restores_the_choice(
    driver: Any, site: Path
) -> None:
    visit(driver, site, "compare.html")
    driver.execute_script(
        "const s = document.getElementById('before'); s.value = 'run-spook-0015'; s.dispatchEvent(new Event('change'));"
    )
    wait_for(driver, COMPARED, "15,23")
    address = driver.current_url
    text = driver.execute_script("return document.getElementById('told').innerText")

    driver.get("about:blank")
    arrive(driver, address)
    wait_for(driver, COMPARED, "15,23")

    assert "before=run-spook-0015" in address
    assert "REGRESSED" in text.upper()
    assert driver.execute_script("return document.getElementById('told').innerText") == text


def test_a_link_restores_the_zoom_of_a_chart(driver: Any, site: Path) -> None:
    visit(driver, site, "tests/pendulum.html")
    name = "f-deviation-against-time"
    draw(driver, f"#{name}")
    driver.execute_async_script(
        f"const done = arguments[0]; Plotly.relayout(document.querySelector('#{name} .plot'),"
        " {'xaxis.range': [1, 2], 'yaxis.range': [0, 0.3]}).then(() => done());"
    )
    address = driver.current_url

    driver.get("about:blank")
    arrive(driver, address)
    draw(driver, f"#{name}")

    assert f"z.{name}=1" in address
    ranges = driver.execute_script(
        f"const l = document.querySelector('#{name} .plot').layout; return [l.xaxis.range, l.yaxis.range];"
    )
    assert ranges == [[1, 2], [0, 0.3]]


def test_a_value_that_stands_still_is_drawn_on_to_tonight(driver: Any, site: Path) -> None:
    """Its file ends where it last changed; the axis ends tonight, with the days of the nights."""
    visit(driver, site, "tests/friction.html")
    draw(driver, "#broken figure.chart")
    kept, drawn, days, table = driver.execute_script("""
        const box = document.querySelector('#broken figure.chart'), data = chartData.get(box.dataset.key);
        const plot = box.querySelector('.plot');
        box.querySelector('details').open = true;
        return [data.data[0].x.at(-1), plot.data[0].x.at(-1), plot.layout.xaxis.ticktext, box.querySelector('summary').textContent];
    """)

    assert kept < drawn == 23
    assert days[-1] == "2025-10-24"[5:]
    assert table == "Data table"
    rows = driver.find_elements("css selector", "#broken figure.chart tbody tr")
    assert [rows[0].text.split()[0], "2025-10-01" in rows[0].text] == ["measured", True]


@pytest.mark.parametrize("width", [360, 1400])
def test_stages_left_out_are_folded_after_those_kept_and_open_by_keyboard(
    driver: Any, site: Path, width: int
) -> None:
    """What shows before and after the key: every stage kept from the start, every other with its reason."""
    from selenium.webdriver.common.keys import Keys

    visit(driver, site, "tests/pendulum.html", width=width)
    shown = """return [...document.querySelectorAll('#stages li')].filter((e) => e.checkVisibility())
        .sort((a, b) => a.getBoundingClientRect().top - b.getBoundingClientRect().top).map((e) => e.className)"""
    before = driver.execute_script(shown)
    fold = driver.find_element("css selector", "#stages summary")
    fold.send_keys(Keys.ENTER)
    after = driver.execute_script(shown)

    assert set(before) == {"in"}
    assert after == [*before, *["out"] * (len(after) - len(before))]
    assert fold.text == f"{len(after) - len(before)} left out, and why" and len(after) > len(before)
    assert driver.switch_to.active_element == fold
    for reason in driver.find_elements("css selector", "#stages li span:last-child"):
        assert reason.rect["x"] + reason.rect["width"] <= width and reason.rect["width"] >= 150


LADDER = '[id^="l-length-seconds"]'


def test_a_ladder_stands_beside_the_night_that_the_reader_chooses(driver: Any, site: Path) -> None:
    visit(driver, site, "tests/pendulum.html")
    draw(driver, LADDER)
    shown = """return [...new Set([...document.querySelector('[id^="l-length-seconds"] .plot').data]
        .filter((t) => t.meta.night && t.visible !== false).map((t) => t.name.split(', ').pop()))]"""
    assert driver.execute_script(shown) == ["the night before"]

    driver.execute_script(
        "const s = document.getElementById('night'); s.value = 'week'; s.dispatchEvent(new Event('change'));"
    )
    assert driver.execute_script(shown) == ["a week before"]
    address = driver.current_url
    driver.get("about:blank")
    arrive(driver, address)
    draw(driver, LADDER)
    assert "night=week" in address
    assert driver.execute_script(shown) == ["a week before"]

    driver.execute_script("location.hash = '#night=none'")
    wait_for(driver, "document.getElementById('night').value === 'none'")
    assert driver.execute_script(shown) == []


def test_the_filter_of_the_index_is_kept_in_the_address(driver: Any, site: Path) -> None:
    visit(driver, site, "index.html#show=fail")
    hidden = "return [...document.querySelectorAll('#filter ~ div tbody tr')].map((r) => r.hidden)"

    assert driver.execute_script(hidden) == [True]
    driver.execute_script("location.hash = '#q=img'")
    wait_for(driver, "document.getElementById('search').value === 'img'")  # the page has taken it over
    assert driver.execute_script(hidden) == [False]


def test_error_and_run_time_can_be_seen_against_work(driver: Any, site: Path) -> None:
    visit(driver, site, "error-time.html#cost=work")
    driver.execute_async_script(DRAWN)

    labels = driver.execute_script(
        "return [...document.querySelectorAll('figure.chart')].filter((b) => b.checkVisibility())"
        ".map((b) => b.querySelector('.plot').layout.xaxis.title.text)"
    )
    assert len(labels) == len(SEVEN)
    assert set(labels) == {"work [operations counted]"}


def test_charts_of_an_overview_are_loaded_as_they_are_seen(driver: Any, site: Path) -> None:
    visit(driver, site, "error-time.html", height=500)
    wait_for(driver, SEEN)
    counts = """const boxes = [...document.querySelectorAll('figure.chart')].filter((b) => b.checkVisibility());
      return [boxes.length, boxes.filter((b) => b.classList.contains('drawn')).length]"""

    whole, first = driver.execute_script(counts)
    assert 0 < first < whole

    drawn = driver.execute_async_script(DRAWN)
    assert len(drawn) == whole
    assert all(drawn)
    assert driver.execute_script(counts) == [whole, whole]


def test_a_chart_whose_file_is_gone_says_so(driver: Any, site: Path, tmp_path: Path) -> None:
    whole = shutil.copytree(site, tmp_path / "public")
    shutil.rmtree(whole / "charts")
    visit(driver, whole, "stability.html")
    wait_for(driver, "scripts.size === 0 && document.querySelectorAll('script[src*=\"charts/\"]').length > 0")

    notes = driver.find_elements("css selector", "figure.chart .chart-note")
    assert any("could not be loaded" in note.text for note in notes)
    assert not driver.find_element("css selector", "figure.chart .plot").is_displayed()
    driver.get_log("browser")  # says that files are missing


def test_the_reader_chooses_light_or_dark_and_keeps_it(driver: Any, site: Path) -> None:
    visit(driver, site, "tests/pendulum.html")
    draw(driver, "figure.chart")
    driver.execute_script("document.getElementById('theme').click()")
    arrive(driver, (site / "index.html").as_uri())

    assert driver.execute_script("return document.documentElement.dataset.theme") == "dark"
    driver.execute_script("localStorage.clear()")


def test_the_keyboard_reaches_content_links_and_buttons(driver: Any, site: Path) -> None:
    from selenium.webdriver.common.keys import Keys

    visit(driver, site, "index.html")
    body = driver.find_element("tag name", "body")
    body.send_keys(Keys.TAB)
    skip = driver.switch_to.active_element
    assert skip.text == "Skip to the content"
    skip.send_keys(Keys.ENTER)
    assert driver.switch_to.active_element.get_attribute("id") == "content"
    reached = set()
    for _ in range(30):
        driver.switch_to.active_element.send_keys(Keys.TAB)
        reached.add(driver.switch_to.active_element.accessible_name)
    assert {"Beam on two piles", "Friction", "Planetarium"} <= reached


def test_without_scripts_tables_remain_and_the_page_says_where_the_pictures_are(
    driver: Any, site: Path
) -> None:
    driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
    try:
        visit(driver, site, "tests/pendulum.html", scripts=False)
        assert "report has the pictures" in driver.find_element("css selector", "noscript").text
        assert driver.find_element("css selector", "#data tbody td").is_displayed()
        visit(driver, site, "document.html", scripts=False)
        pictures = driver.find_elements("css selector", "main figure.chart .static svg")
        assert len(pictures) > 6
        assert all(picture.is_displayed() for picture in pictures[:3])
        visit(driver, site, "compare.html", scripts=False)
        assert "→" in driver.find_element("id", "told").text
    finally:
        driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})


def test_a_printed_page_hides_what_cannot_be_printed(driver: Any, site: Path) -> None:
    visit(driver, site, "tests/pendulum.html")
    draw(driver, "figure.chart")
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    try:
        shown = driver.execute_script(
            "return ['.bar', '.theme', '.plot'].map((s) => document.querySelector(s).checkVisibility())"
        )
    finally:
        driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})
    assert shown == [False, False, True]


def test_a_long_list_shows_its_first_and_the_rest_on_request_or_when_one_is_meant(
    driver: Any, site: Path
) -> None:
    """Five cards on a telephone; a search, and an address that names one, show what they mean."""
    visit(driver, site, "index.html", width=360)
    shown = (
        "return [...document.querySelectorAll('#nights, tbody tr')].filter((e) => e.checkVisibility()).length"
    )
    folded = driver.execute_script(shown)
    driver.execute_script("document.querySelector('.fold-more button').click()")
    whole = driver.execute_script(shown)

    assert driver.execute_script("return document.querySelectorAll('tbody tr').length") > 6
    assert folded < whole
    assert driver.execute_script("return document.activeElement.closest('tr') !== null"), (
        "reading goes on there"
    )


@pytest.mark.parametrize(("words", "found"), [("run,  FRICTION", True), ("no such test", False)])
def test_find_takes_words_in_any_order_and_says_when_nothing_fits(
    driver: Any, site: Path, words: str, found: bool
) -> None:
    visit(driver, site, "error-time.html")
    driver.find_element("id", "search").send_keys(words)

    fit = driver.execute_script(
        "return [...document.querySelectorAll('.charts .cell')].filter((c) => c.checkVisibility()).map((c) => c.textContent)"
    )
    told = driver.execute_script("return document.getElementById('none-found').checkVisibility()")
    assert bool(fit) == found and told != found
    assert all("riction" in text for text in fit)
