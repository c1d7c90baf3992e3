"""A team's colour: read in both themes, refused with a reason where it cannot be."""

from __future__ import annotations

import colorsys
import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.store.database import session_on
from spook_tracker.tracker.store.record import record
from spook_tracker.tracker.website.colours import DARK, LEAST, LIGHT, ColourError, accent, contrast
from spook_tracker.tracker.website.options import SiteOptions
from spook_tracker.tracker.website.publish import publish
from tests.histories.synthetic import DocumentHistory, document
from tests.places import ROOT
from tests.website.browser import CONTRAST, arrive, look, wait_for

HUES = [tuple(round(255 * c) for c in colorsys.hls_to_rgb(hue / 12, 0.3, 0.9)) for hue in range(12)]


@pytest.mark.parametrize(
    ("one", "other", "ratio"),
    [("#000000", "#ffffff", 21.0), ("#777777", "#ffffff", 4.48), ("#ff0000", "#ffffff", 4.0), ("#123456", "#123456", 1.0)],
)  # fmt: skip
def test_contrast_is_that_of_the_guidelines(one: str, other: str, ratio: float) -> None:
    """Well known values: black and white, the lightest grey that fails, pure red."""
    assert contrast(one, other) == pytest.approx(ratio, abs=0.005)
    assert contrast(other, one) == contrast(one, other)


@pytest.mark.parametrize(
    "colour", ["#000000", *(f"#{red:02x}{green:02x}{blue:02x}" for red, green, blue in HUES)]
)
def test_a_colour_is_readable_in_both_themes_or_refused(colour: str) -> None:
    try:
        made = accent(colour)
    except ColourError:
        assert min(contrast(colour, ground) for ground in LIGHT) < LEAST + 1.0
        return
    assert made is not None and made.light == colour
    assert min(contrast(made.light, ground) for ground in (*LIGHT, made.light_soft)) >= LEAST
    assert min(contrast(made.dark, ground) for ground in (*DARK, made.dark_soft)) >= LEAST


def test_the_grounds_are_those_of_the_style_sheet() -> None:
    style = (ROOT / "site" / "static" / "site.css").read_text()
    light, dark, *_ = re.findall(r"--paper: (#\w+); --ground: (#\w+); --raised: (#\w+);", style)

    assert set(light) == set(LIGHT)
    assert dark == DARK


@pytest.mark.parametrize(
    ("colour", "words"),
    [
        ("red", "'red' is no colour; write it as #rrggbb"),
        ("#ffee00", "its contrast is 1."),
        ("#fff}", "no colour"),
    ],
)
def test_what_cannot_be_read_is_refused_before_anything_is_done(
    tmp_path: Path, colour: str, words: str
) -> None:
    url = f"sqlite:///{tmp_path}/t.db"
    done = CliRunner().invoke(
        main, ["publish", "--out", str(tmp_path / "public"), "--db", url, "--colour", colour]
    )

    assert done.exit_code == 2
    assert words in done.output
    assert not (tmp_path / "public").exists()


def test_tracker_toml_says_the_colour_and_pages_wear_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tracker.toml").write_text('colour = "#7a1fa2"\n')
    with session_on("sqlite:///t.db") as session:
        record(session, document(0))
    done = CliRunner().invoke(main, ["publish", "--out", "public", "--db", "sqlite:///t.db"])

    assert done.exit_code == 0, done.output
    for page in ("index.html", "tests/pendulum.html", "data.html"):
        assert "--accent: #7a1fa2" in Path("public", page).read_text()


def test_a_browser_finds_every_text_readable_in_it(driver, tmp_path) -> None:  # type: ignore[no-untyped-def]
    publish(
        DocumentHistory([document(n, broken=1) for n in range(2)]),
        tmp_path / "public",
        options=SiteOptions(colour="#7a1fa2"),
    )
    made = accent("#7a1fa2")
    assert made is not None
    look(driver, dark=False)
    for page in ("index.html", "tests/pendulum.html"):
        arrive(driver, (tmp_path / "public" / page).as_uri())
        for dark, wanted in ((False, made.light), (True, made.dark)):
            look(driver, dark=dark)
            wait_for(
                driver, "document.documentElement.dataset.theme === arguments[0]", "dark" if dark else "light"
            )
            assert driver.execute_script(CONTRAST) == []
            worn = "return getComputedStyle(document.querySelector('.skip')).backgroundColor"
            rgb = ", ".join(str(int(wanted[i : i + 2], 16)) for i in (1, 3, 5))
            assert driver.execute_script(worn) == f"rgb({rgb})"
