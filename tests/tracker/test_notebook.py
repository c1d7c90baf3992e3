"""What a notebook shows: the replay of scenes and runs, traces and histories as Plotly's figures."""

from __future__ import annotations

import html
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest

from spook_tracker import tracker
from spook_tracker.engine import (
    Energy,
    EngineError,
    Final,
    Material,
    Particle,
    Position,
    Result,
    RigidBody,
    Scene,
    Trace,
    simulate,
    start,
)
from spook_tracker.engine.shapes import Box, Plane
from spook_tracker.tracker.document.errors import TrackerError, UnknownName
from tests.website.browser import arrive, wait_for
from tests.website.scripts import handed_over

BOX = RigidBody(
    name="box", mass=1.0, shape=Box(size=(1.0, 1.0, 1.0)), position=(0.0, 0.0, 2.0),
    orientation=(0.9, 0.3, 0.1, 0.0), material=Material(friction=0.5),
)  # fmt: skip
GROUND = RigidBody(
    name="ground", shape=Plane(normal=(0.0, 0.0, 1.0)), motion="static", position=(0.0, 0.0, 0.0)
)
SCENE = Scene(bodies=(GROUND, BOX), gravity=(0.0, 0.0, -9.81))


@pytest.fixture(scope="module")
def fallen() -> Result:
    observe = {"place": Trace(quantity=Position("box")), "energy": Trace(quantity=Energy(), every=10)}
    return simulate(SCENE, time_step=1 / 120, duration=2.0, observe=observe)


def test_a_run_is_replayed_in_a_browser_without_any_other_file(
    fallen: Result, driver: Any, tmp_path: Path
) -> None:
    """Offline, from one file: the box ends where the engine's own trace has it, to the digits that are stored."""
    shown = fallen.show()
    shown.save(tmp_path / "run.html")

    arrive(driver, (tmp_path / "run.html").as_uri())
    wait_for(driver, "!!document.querySelector('figure.replay').player")
    movie = "document.querySelector('figure.replay').player.movie"
    ends = driver.execute_script(f"return Array.from({movie}.position.slice(-3))")
    severe = [entry for entry in driver.get_log("browser") if entry["level"] == "SEVERE"]

    assert ends == pytest.approx(fallen["place"][-1], abs=2.0 / 65534)
    assert driver.execute_script(f"return {movie}.step * ({movie}.count - 1)") == pytest.approx(2.0)
    assert driver.execute_script("return document.querySelectorAll('canvas').length") >= 1
    assert severe == []
    assert not re.search(r'(?:src|href)="', shown.html), "nothing is loaded from elsewhere"
    assert len(shown.html) < 400_000


def test_what_a_cell_ends_with_stands_in_a_frame_of_its_own(
    fallen: Result, driver: Any, tmp_path: Path
) -> None:
    """A scene at its start, and a run; a notebook's page holds both, and its own style is left alone."""
    page = f"<!doctype html><p id=own>ours</p>{SCENE._repr_html_()}{fallen._repr_html_()}"
    (tmp_path / "page.html").write_text(page, encoding="utf-8")

    driver.get((tmp_path / "page.html").as_uri())
    frames = driver.find_elements("css selector", "iframe")
    for frame in frames:
        driver.switch_to.frame(frame)
        driver.execute_script("document.querySelector('figure.replay').scrollIntoView()")
        wait_for(driver, "!!document.querySelector('figure.replay').player")
        bodies = driver.execute_script("return document.querySelector('figure.replay').player.movie.bodies")
        driver.switch_to.default_content()
        assert bodies == 2

    assert len(frames) == 2
    assert driver.execute_script("return getComputedStyle(document.getElementById('own')).fontFamily") != (
        driver.execute_script("return getComputedStyle(document.documentElement).getPropertyValue('--sans')")
    )


def test_a_document_says_nothing_that_could_end_its_frame() -> None:
    scene = Scene(bodies=(Particle(name='"></iframe><script>', mass=1.0, position=(0.0, 0.0, 0.0)),))
    shown = scene._repr_html_()

    assert shown.count("<iframe") == shown.count("</iframe>") == 1
    inside = re.fullmatch(r'<iframe srcdoc="([^"]*)"[^>]*></iframe>', shown)
    assert inside
    assert html.unescape(inside[1]).startswith("<!doctype html>")


def test_a_long_run_is_not_run_again_because_a_cell_ends_with_it(
    fallen: Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: pytest.fail("it was drawn"))

    assert "<iframe" not in replace(fallen, seconds=2.1)._repr_html_()
    assert "<table>" in replace(fallen, seconds=2.1)._repr_html_()


def test_a_cell_that_ends_with_what_cannot_be_drawn_is_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """A run that ended in its first step is a table; where nothing that draws is installed, a scene is its text."""
    pulled = Scene(bodies=SCENE.bodies, gravity=(0.0, 0.0, -1e308))
    shown = simulate(pulled, time_step=0.1, steps=9)._repr_html_()
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: ())

    assert "ran away" in shown and "<iframe" not in shown
    assert SCENE._repr_html_() is None


def test_traces_are_a_figure_with_the_columns_of_the_table(fallen: Result) -> None:
    figure, table = fallen.plot(), fallen.to_dataframe()

    assert isinstance(figure, go.Figure)
    assert [trace.name for trace in figure.data] == list(table.columns)
    for trace in figure.data:
        column = table[trace.name].dropna()
        np.testing.assert_allclose(trace.x, column.index, atol=2e-5)
        np.testing.assert_allclose(trace.y, column, atol=1e-5 * (table.max(axis=None) - table.min(axis=None)))
    assert [trace.name for trace in fallen.plot("energy").data] == ["energy"]


def test_what_cannot_be_drawn_is_said_in_a_sentence(fallen: Result, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(EngineError, match="'speed' was not traced; there are place, energy"):
        fallen.plot("speed")
    with pytest.raises(EngineError, match="nothing was traced"):
        simulate(SCENE, time_step=0.01, steps=2, observe={"end": Final(quantity=Energy())}).plot()
    with start(SCENE, time_step=0.01) as run, pytest.raises(EngineError, match="only what simulate"):
        run.result().show()
    with monkeypatch.context() as without:
        without.setitem(sys.modules, "plotly.graph_objects", None)
        with pytest.raises(TrackerError, match=re.escape("pip install 'spook-tracker[standard]'")):
            fallen.plot()
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: ())
    with pytest.raises(EngineError, match="nothing that draws is installed"):
        fallen.show()


@pytest.fixture(scope="module")
def database(tmp_path_factory: pytest.TempPathFactory) -> str:
    url = f"sqlite:///{tmp_path_factory.mktemp('nights')}/nights.db"
    for _ in range(2):
        document = tracker.run(["falling_object", "near_miss"], sweep=True, workers=0, repeats=1, apart=False)
        tracker.record(document, url)
    return url


def test_a_history_is_drawn_with_the_traces_of_the_website(database: str, tmp_path: Path) -> None:
    with tracker.History.open(database) as history:
        tracker.publish(history, tmp_path / "public")
        ladder = history.plot("falling_object", ladder=True)
        trend = history.plot("falling_object")
    charts = handed_over((tmp_path / "public" / "charts").glob("*.js"), "charted")
    (site,) = (data for key, data in charts.items() if re.fullmatch(r"falling_object/l-[\w-]+-seconds", key))

    assert isinstance(ladder, go.Figure)
    assert [(t.name, list(t.x), list(t.y)) for t in ladder.data] == [
        (t["name"], t["x"], t["y"]) for t in site["data"]
    ]
    assert ladder.layout.xaxis.type == ladder.layout.yaxis.type == "log"
    assert trend.data[0].name == "measured"
    assert any(trace.name.startswith("limit 4.90") for trace in trend.data)


def test_of_a_history_one_test_is_read(database: str) -> None:
    with tracker.History.open(database) as history:
        with pytest.raises(UnknownName, match="falling_object has no metric 'hight'; there are "):
            history.plot("falling_object", "hight")
        with pytest.raises(UnknownName, match=r"no metric 'positon_error'; did you mean 'position_error'"):
            history.plot("falling_object", "positon_error")
        with pytest.raises(UnknownName, match="nothing is recorded of a test 'door'; `tracker db stats`"):
            history.plot("door")
        with pytest.raises(UnknownName, match="'near_mis'; did you mean near_miss"):
            history.plot("near_mis")
        with pytest.raises(UnknownName, match="tracker run near_miss --sweep"):
            history.plot("near_miss", ladder=True)
        assert len(history.to_dataframe().query("test == 'falling_object'")) > 0
