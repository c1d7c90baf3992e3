"""Files of numbers that are gone, cut short or not what they were, and a browser that cannot unpack: a sentence says so,
and the rest of the page works."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from spook_tracker.tracker.website.publish import publish
from spook_tracker.tracker.website.scripts import call
from tests.histories.synthetic import history, with_rival
from tests.website.browser import wait_for
from tests.website.test_browser import COMPARED, visit

DAMAGED = "a file of numbers is damaged; reload the page"
PAGE = "tests/pendulum.html"
NOTES = "return [...document.querySelectorAll('.chart-note')].map((n) => n.textContent).filter((t) => t.startsWith('This chart'))"
TOLD = NOTES.removeprefix("return ") + ".length > 0"
SOME_DRAWN = "document.querySelector('figure.chart[data-drawn]') !== null"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("whole") / "public"
    publish(with_rival(history(40, broken=36)), out)
    return out


@pytest.fixture
def site(whole: Path, tmp_path: Path) -> Path:
    return shutil.copytree(whole, tmp_path / "public")


@pytest.fixture(autouse=True)
def _quiet(driver: Any) -> Iterator[None]:
    yield
    driver.execute_script("localStorage.clear()")
    driver.get_log("browser")  # says what is missing


def chart_files(site: Path) -> list[Path]:
    """Of the charts of a page, from the top, without run times."""
    told = re.findall(r'data-file="\.\./(charts/[0-9a-f]+\.js)"', (site / PAGE).read_text("utf-8"))
    return [site / address for address in dict.fromkeys(told)]


def short(file: Path) -> None:
    file.write_bytes(file.read_bytes()[:-30])


def no_base64(file: Path) -> None:
    file.write_text(re.sub(r',"....', ',"!!!!', file.read_text("utf-8")), "utf-8")


def no_deflate(file: Path) -> None:
    file.write_text(re.sub(r'(,".{24}).{40}', rf"\1{'A' * 40}", file.read_text("utf-8")), "utf-8")


def other_numbers(file: Path) -> None:
    file.write_bytes(call("charted", file.stem, '{"x":1}'))


@contextmanager
def beforehand(driver: Any, source: str) -> Iterator[None]:
    """Pages that are opened meanwhile run a script before their own."""
    told = driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": source})
    yield
    driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", told)


def test_charts_that_cannot_be_read_say_so_and_the_others_are_drawn(driver: Any, site: Path) -> None:
    damages = (Path.unlink, short, no_base64, no_deflate, other_numbers)
    files = chart_files(site)
    assert len(files) > len(damages)
    for damage, file in zip(damages, files, strict=False):
        damage(file)
    visit(driver, site, PAGE, height=3000)
    wait_for(driver, f"{NOTES.removeprefix('return ')}.length >= {len(damages)}")
    wait_for(driver, SOME_DRAWN)

    reasons = [f"../charts/{files[0].name} could not be loaded; reload the page", *4 * [DAMAGED]]
    assert driver.execute_script(NOTES) == [f"This chart is not drawn: {reason}." for reason in reasons]
    for file in files[: len(damages)]:
        assert not driver.find_element("css selector", f"[data-key='{file.stem}'] .plot").is_displayed()
    driver.execute_script(
        "document.getElementById('theme').click()"
    )  # draws again what is drawn, and no more
    assert len(driver.execute_script(NOTES)) == len(damages)


def test_a_chart_over_nights_whose_days_are_cut_short_is_not_drawn_without_them(
    driver: Any, site: Path
) -> None:
    short(site / "charts" / "nights.js")
    visit(driver, site, PAGE)
    wait_for(driver, TOLD)

    assert set(driver.execute_script(NOTES)) == {f"This chart is not drawn: {DAMAGED}."}


def test_without_the_script_of_tonight_charts_are_drawn_and_the_page_says_what_lacks(
    driver: Any, site: Path
) -> None:
    (site / "tonight.js").unlink()
    visit(driver, site, "error-time.html")
    wait_for(driver, SOME_DRAWN)

    assert "tonight.js could not be loaded" in driver.find_element("id", "measured-when").text
    assert not driver.find_element("id", "earlier").is_displayed(), "no night is known to lay beside"


def test_run_times_that_cannot_be_read_are_a_sentence(driver: Any, site: Path) -> None:
    for file in site.glob("charts/tonight-*.js"):
        short(file)
    visit(driver, site, PAGE)
    wait_for(driver, "document.getElementById('run-times').textContent.includes('not shown')")

    assert (
        driver.find_element("id", "run-times").get_attribute("textContent")
        == f"The run times are not shown: {DAMAGED}."
    )


@pytest.mark.parametrize(
    ("file", "damage", "reason"),
    [
        ("nights-0", short, DAMAGED),
        ("nights-0", Path.unlink, "compare/nights-0.js could not be loaded; reload the page"),
        ("newest", short, DAMAGED),
        ("newest", no_deflate, DAMAGED),
    ],
)
def test_nights_that_cannot_be_compared_are_one_sentence_and_other_choices_work(
    driver: Any, site: Path, file: str, damage: Callable[[Path], None], reason: str
) -> None:
    damage(site / "compare" / f"{file}.js")
    visit(driver, site, "compare.html#after=run-spook-0030&before=run-spook-0003")
    wait_for(driver, "document.getElementById('told').textContent.includes('cannot be compared')")
    assert driver.find_element("id", "told").text == f"These two cannot be compared: {reason}."

    if file == "nights-0":
        driver.execute_script("location.hash = '#after=run-spook-0039&before=run-spook-0038'")
        wait_for(driver, COMPARED, "38,39")
        assert "cannot be compared" not in driver.find_element("id", "told").text


def test_a_choice_that_fails_late_does_not_overrule_the_one_after_it(driver: Any, site: Path) -> None:
    visit(driver, site, "compare.html")
    wait_for(driver, COMPARED, "38,39")
    driver.execute_script(
        "const real = script; window.script = (address) => address.includes('nights-0')"
        " ? new Promise((_, no) => { window.late = () => no(new Error('late')); }) : real(address);"
    )
    driver.execute_script("location.hash = '#after=run-spook-0030&before=run-spook-0003'")
    wait_for(driver, "'late' in window")
    driver.execute_script("location.hash = '#after=run-spook-0039&before=run-spook-0037'")
    wait_for(driver, COMPARED, "37,39")
    driver.execute_async_script("late(); setTimeout(arguments[0], 50);")

    assert "late" not in driver.find_element("id", "told").text


def test_a_browser_that_cannot_unpack_is_told_what_lacks(driver: Any, site: Path) -> None:
    lacking = "this browser has no DecompressionStream"
    with beforehand(driver, "delete window.DecompressionStream;"):
        visit(driver, site, PAGE)
        wait_for(driver, "document.getElementById('run-times').textContent.includes('not shown')")
        wait_for(driver, TOLD)
        assert all(lacking in note for note in driver.execute_script(NOTES))
        assert lacking in driver.find_element("id", "run-times").get_attribute("textContent")
        visit(driver, site, "compare.html")
        wait_for(driver, "document.getElementById('told').textContent.includes(arguments[0])", lacking)


def test_what_a_reader_chooses_while_a_chart_is_unpacked_holds(driver: Any, site: Path) -> None:
    slow = """
      const held = [], json = Response.prototype.json;
      Response.prototype.json = async function () { await new Promise((go) => held.push(go)); return json.call(this); };
      window.release = () => held.splice(0).forEach((go) => go());
    """
    with beforehand(driver, slow):
        visit(driver, site, PAGE, height=6000)
        wait_for(driver, "document.querySelectorAll('script[src*=\"charts/\"]').length > 3")
        driver.execute_script(
            "const s = document.getElementById('night'); s.value = 'week'; s.dispatchEvent(new Event('change'));"
            "document.getElementById('theme').click();"
        )
        assert not driver.execute_script(f"return {SOME_DRAWN}")
        driver.execute_script("setInterval(release, 20)")
        ladder = "document.querySelector('[id^=\"l-length-seconds\"]')"
        wait_for(driver, f"'drawn' in {ladder}.dataset")
        shown, paint = driver.execute_script(
            f"const plot = {ladder}.querySelector('.plot');"
            "return [plot.data.filter((t) => t.meta.night && t.visible !== false).map((t) => t.name.split(', ').pop()),"
            " plot.layout.font.color === colour('--ink-2')]"
        )

    assert set(shown) == {"a week before"}
    assert paint, "in the theme chosen meanwhile"


def test_data_that_two_ask_for_at_once_are_unpacked_once_and_a_text_stays_one(
    driver: Any, site: Path
) -> None:
    packed = [re.findall('"([^"]*)"', call("f", "k", text).decode())[1] for text in ('"words"', '{"a":[1]}')]
    visit(driver, site, "index.html")

    same, text, again = driver.execute_async_script(
        """const [words, data, done] = arguments, files = new Handed([["words", words], ["data", data]]);
        (async () => {
          const [one, other] = await Promise.all([files.read("data"), files.read("data")]);
          done([one === other && one.a[0] === 1, await files.read("words"), await files.read("words")]);
        })();""",
        *packed,
    )
    assert (same, text, again) == (True, "words", "words")
