"""Which motions a website offers: those whose files it has, each once, whatever the budget."""

import re
from pathlib import Path

import msgspec
import pytest

import spook_tracker.tracker.measure.trajectory as motion
from spook_tracker.engine import Particle, Scene, simulate
from spook_tracker.scalar_tests.case import Example
from spook_tracker.tracker.resources import resource
from spook_tracker.tracker.website import motions
from spook_tracker.tracker.website.causes import causes_of, told
from spook_tracker.tracker.website.nights import book
from spook_tracker.tracker.website.publish import publish
from spook_tracker.tracker.website.replays import replay
from tests.histories.synthetic import DocumentHistory, document
from tests.website.browser import look, wait_for

SAMPLES = 20  # of a motion


def fall(gravity, test):
    """The motion of a falling ball, recorded under the name of a test."""
    ball = Particle(name="ball", position=(0.0, 0.0, 0.0), mass=1.0)
    scene = Scene(bodies=(ball,), gravity=(0.0, 0.0, -gravity))

    class Asked:
        example = staticmethod(lambda: Example(scene=scene, time_step=0.01, duration=0.01 * SAMPLES))

    return motion.trajectory(test, Asked, simulate)


def nights(*gravities, tests=("friction",), broken=10**9):
    """One night for each gravity, under which the balls of all tests fall."""
    found = []
    for n, gravity in enumerate(gravities):
        moved = tuple(fall(gravity + place, test) for place, test in enumerate(tests))
        found.append(msgspec.structs.replace(document(n, broken=broken), trajectories=moved))
    return DocumentHistory(found)


def offered(history, test="friction"):
    found = replay(book(history).motions[test])
    return [] if found is None else [source["label"][:10] for source in found.sources]


def test_a_motion_is_offered_once_however_many_nights_had_it():
    assert offered(nights(1.0, 2.0, 2.0, 1.0, 3.0, 3.0)) == ["", "2025-10-04", "2025-10-03"]


def test_a_model_begins_over_what_the_version_before_did():
    """Two nights of version 1, then two of version 2: tonight lies over the newest motion of version 1."""
    found = []
    for n, version in enumerate("1122"):
        asked = document(n)
        moved, engine = fall(1.0 + n, "friction"), msgspec.structs.replace(asked.engine, version=version)
        found.append(msgspec.structs.replace(asked, trajectories=(moved,), engine=engine))
    motions_of = book(DocumentHistory(found)).motions["friction"]

    assert replay(motions_of, over_another_version=True).against == motions_of[2].key
    assert replay(motions_of).against == ""


@pytest.mark.parametrize("files", [0, 1, 2, 3, 6])
def test_what_the_budget_leaves_out_is_neither_written_nor_offered(monkeypatch, tmp_path, files):
    """Two tests, three nights: tonight's two whatever they weigh, then the newest that fit."""
    both = ("friction", "pendulum")
    history = nights(1.0, 5.0, 9.0, tests=both, broken=2)
    every = [m.script for of_test in book(history).motions.values() for m in of_test]
    monkeypatch.setattr(motions, "SITE_BYTES", files * max(map(len, every)))

    publish(history, tmp_path / "public")
    written = {path.name for path in (tmp_path / "public" / "replay").iterdir()}
    asked = set()
    for test in both:
        page = (tmp_path / "public" / "tests" / f"{test}.html").read_text()
        asked |= set(re.findall(r"replay/([^\"]+\.js)", page))

    assert asked == written
    assert len(written) == max(2, files)
    cause = told(causes_of(book(history))[0], book(history))
    against = re.search("against=([^&]+)", cause.replay)
    assert (against is not None) == (files >= 3)
    assert against is None or f"{against[1]}.js" in written


def test_a_night_whose_file_is_gone_says_so_and_tonight_stays(driver, tmp_path):
    history = nights(1.0, 9.0)
    publish(history, tmp_path / "public")
    _, older = book(history).motions["friction"]
    (tmp_path / "public" / older.address).unlink()

    look(driver)
    driver.get((tmp_path / "public" / "tests" / "friction.html").as_uri())
    driver.execute_script("document.getElementById('replay').scrollIntoView()")
    wait_for(driver, "!!document.getElementById('replay').player")
    driver.execute_script(
        "const s = document.querySelector('#replay label select'); s.selectedIndex = 1; s.dispatchEvent(new Event('change'))"
    )
    wait_for(driver, "document.querySelector('#replay .replay-note').textContent.includes('cannot be shown')")
    driver.execute_script("document.getElementById('replay').player.seek(5)")

    assert driver.execute_script("return document.getElementById('replay').player.sample") == 5


@pytest.mark.parametrize("damage", [Path.unlink, lambda file: file.write_bytes(file.read_bytes()[:200])])
def test_a_motion_of_tonight_that_cannot_be_read_says_why_and_not_that_webgl_lacks(driver, tmp_path, damage):
    history = nights(1.0)
    publish(history, tmp_path / "public")
    (tonight,) = book(history).motions["friction"]
    damage(tmp_path / "public" / tonight.address)

    look(driver)
    driver.get((tmp_path / "public" / "tests" / "friction.html").as_uri())
    driver.execute_script("document.getElementById('replay').scrollIntoView()")
    note = "document.querySelector('#replay .replay-note').textContent"
    wait_for(driver, f"{note}.includes('picture shows the start')")

    said = driver.execute_script(f"return {note}")
    assert re.search("could not be loaded|numbers is damaged", said)
    assert "WebGL" not in said
    driver.get_log("browser")  # says what is missing


def test_without_webgl_the_picture_stays_with_a_sentence_and_the_curves(driver, tmp_path):
    """Neither an empty box with a dead button, nor a second night beside the first that nothing can draw."""
    publish(nights(1.0, 9.0), tmp_path / "public")
    source = "HTMLCanvasElement.prototype.getContext = () => null;"
    planted = driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": source})
    try:
        look(driver)
        driver.get((tmp_path / "public" / "tests" / "friction.html").as_uri() + "#beside=1")
        driver.execute_script("document.getElementById('replay').scrollIntoView()")
        wait_for(driver, "document.querySelectorAll('#replay label select').length > 1")
        driver.execute_script(
            "const s = document.querySelector('#replay label select'); s.selectedIndex = 1; s.dispatchEvent(new Event('change'))"
        )
        wait_for(driver, "document.querySelectorAll('#replay .curve path.line').length > 1")
        driver.execute_script("document.getElementById('replay').player.seek(5)")
        stage, picture, clock, note = driver.execute_script(
            "const box = document.getElementById('replay'); return [box.querySelector('.stage').textContent,"
            " box.querySelector('svg.scenery').checkVisibility(), box.querySelector('.clock').textContent,"
            " box.querySelector('.replay-note').textContent]"
        )
    finally:
        driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", planted)
        driver.get_log("browser")

    assert stage.startswith("This browser has no WebGL, so the scene is not drawn")
    assert picture and not note
    assert float(clock.split()[0]) > 0.0


def test_an_engine_whose_module_cannot_be_read_answers_that_it_cannot_start(driver):
    static = resource("site") / "static"
    worker = "".join((static / name).read_text("utf-8") for name in ("packed.js", "live-engine.js"))
    driver.get("about:blank")
    for before, lacking in (("", ""), ("delete self.DecompressionStream;", "no DecompressionStream")):
        told = driver.execute_async_script(
            """const [source, done] = arguments, worker = new Worker(URL.createObjectURL(new Blob([source])));
            worker.onmessage = ({ data }) => done(data);
            worker.postMessage({ packed: "AAAA" });""",
            before + worker,
        )
        assert told["failed"] and lacking in told["failed"]
