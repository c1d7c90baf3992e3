"""A red night on the website: one cause with its commit, what it hit and how badly, and the way to the moment."""

import hashlib
import json
import re
import xml.etree.ElementTree as ElementTree
from html.parser import HTMLParser

import msgspec
import pytest

import spook_tracker.tracker.measure.trajectory as motion
from spook_tracker.engine import simulate
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.tracker.document.wording import slug
from spook_tracker.tracker.judge.standing import worst
from spook_tracker.tracker.judge.vocabulary import Class
from spook_tracker.tracker.website.causes import causes_of, told
from spook_tracker.tracker.website.motions import SEEN, apart
from spook_tracker.tracker.website.nights import book
from spook_tracker.tracker.website.publish import publish
from tests.histories.synthetic import DocumentHistory, document
from tests.places import ROOT
from tests.website.browser import arrive, look, wait_for
from tests.website.test_motion import moved, shifted

SUBJECT, AUTHOR = "Fold <b>two</b> rods into one & save a step", "Dee O'Example"
BROKEN, TONIGHT = 9, 9


def nights(count=TONIGHT + 1, broken=BROKEN, motions=None, watched=-1):
    """Friction, a ladder of the chain and a companion of the door break with one commit; a beam drifts for good."""
    found = []
    for n in range(count):
        night = document(n, broken=broken)
        engine = night.engine
        if n == broken:
            engine = msgspec.structs.replace(engine, subject=SUBJECT, author=AUTHOR)
        night = msgspec.structs.replace(night, engine=engine)
        if n in (3, 4):  # two bad nights that came back
            samples = [
                msgspec.structs.replace(s, value=99.0, outcome="out_of_limit", passed=False)
                if s.series.startswith("beam/plain/deviation") else s
                for s in night.samples
            ]  # fmt: skip
            night = msgspec.structs.replace(night, samples=tuple(samples))
        if n == watched:  # worse, and inside its limit
            samples = [
                msgspec.structs.replace(s, value=2e-3)
                if s.series.startswith("door/half-step/energy_error")
                else s
                for s in night.samples
            ]
            night = msgspec.structs.replace(night, samples=tuple(samples))
        if motions is not None:
            night = msgspec.structs.replace(night, trajectories=(motions[n >= broken],))
        found.append(night)
    return DocumentHistory(found)


@pytest.fixture(scope="module")
def recorded():
    """A swinging pendulum that stands for the scene of the friction test, and the same gone wrong."""
    found = motion.trajectory("pendulum", CATALOGUE["pendulum"], simulate)
    sound = msgspec.structs.replace(found, test="friction")
    return sound, shifted(sound)


@pytest.fixture(scope="module")
def site(tmp_path_factory, recorded):
    out = tmp_path_factory.mktemp("red") / "public"
    publish(nights(motions=recorded), out)
    return out


class Words(HTMLParser):
    """Every text of a page, spaces closed up."""

    def __init__(self, page):
        super().__init__()
        self.parts = []
        self.feed(page.read_text())
        self.text = re.sub(r"\s+", " ", " ".join(self.parts))

    def handle_data(self, data):
        self.parts.append(data)


def test_the_first_page_tells_the_new_cause_with_commit_author_damage_tests_and_the_worst(site):
    text = Words(site / "index.html").text
    red = text.partition("What broke tonight")[2].partition("The limits of the thesis")[0]

    assert SUBJECT in red
    assert f"by {AUTHOR}" in red
    assert document(BROKEN).engine.git_hash[:10] in red
    assert f"good before, at {document(BROKEN - 1).engine.git_hash[:10]}" in red
    for damage in ("limit broken 1", "values lost 2", "worse, limits kept 1", "tests hit 3"):
        assert damage in red
    for test in ("Friction", "Door on hinges", "Chain of 26 spheres"):
        assert test in red
    assert "The worst: Friction" in red  # a limit before a rung that has no value


def test_what_broke_earlier_stands_apart_in_a_line(tmp_path):
    publish(nights(TONIGHT + 2), tmp_path / "public")
    text = Words(tmp_path / "public" / "index.html").text

    assert "What broke tonight" not in text
    assert "Nothing became worse tonight. One earlier cause is still red." in text
    assert SUBJECT in text.partition("Still red")[2]


def test_a_green_night_has_no_word_of_causes(tmp_path):
    publish(nights(2, broken=99), tmp_path / "public")
    text = Words(tmp_path / "public" / "index.html").text

    assert "What broke" not in text
    assert "Still red" not in text


def test_every_series_of_a_cause_has_a_line_of_its_own_words(site):
    """Rungs of one ladder say their time step: no two lines of a cause can be confused."""
    causes = causes_of(book(nights()))
    page = (site / "regressions.html").read_text()
    groups = re.findall(r'<details class="cause.*?</details>', page, re.DOTALL)

    assert len(groups) == len(causes)
    for group, cause in zip(groups, causes, strict=True):
        rows = re.findall(r'<th scope="row">(.*?)</th>', group, re.DOTALL)
        assert len(rows) == len(set(rows)) == len(cause.hits)
    assert "h = 0.1" in groups[0]


def test_a_version_stands_for_the_worst_of_its_night(tmp_path):
    """As each series is judged, whatever its limit: read here series by series, on the page from the red stretches."""
    publish(nights(watched=6), tmp_path)
    found = book(nights(watched=6))
    told: dict[int, list[Class]] = {}
    for test in found.tests:
        for trend in test.trends:
            for place, night in enumerate(trend.nights):
                told.setdefault(night, []).append(trend.state_at(place))
    page = (tmp_path / "versions.html").read_text()

    assert {"fail", "watch", "pass"} <= {worst(states) for states in told.values()}
    for night in found.nights:
        (row,) = re.findall(rf'<tr id="run-{slug(night.id)}">.*?</tr>', page, re.DOTALL)
        assert f"is-{worst(told[night.index])}" in row, night.label


def test_a_page_shows_what_is_wrong_once_and_over_its_whole_width(driver, site):
    opened(driver, site, "tests/friction.html", width=1400)
    cards = [
        card.text.split("FAIL")[0] + card.find_element("css selector", "p").text
        for card in driver.find_elements("css selector", ".gate")
    ]
    right, edges = driver.execute_script(
        "const box = document.querySelector('.gates.fill'), end = (e) => e.getBoundingClientRect().right;"
        " return [end(box), [...box.children].map(end)]"
    )

    assert cards and len(cards) == len(set(cards))
    assert max(edges) == pytest.approx(right, abs=1.0)


def test_causes_say_what_became_of_them(site):
    red, back = (told(cause, book(nights())) for cause in causes_of(book(nights())))

    assert (red.standing, red.state, red.new) == ("detected", "fail", True)
    assert (back.standing, back.state, back.new) == ("recovered", "pass", False)
    assert [night.index for night in back.ended] == [5, 5]
    page = Words(site / "regressions.html").text
    assert "RECOVERED" in page.partition("Recovered and accepted")[2]


def test_the_feed_has_one_entry_for_a_cause_and_one_for_its_end(site):
    names = {"a": "http://www.w3.org/2005/Atom"}
    entries = ElementTree.parse(site / "feed.xml").getroot().findall("a:entry", names)
    titles = [entry.findtext("a:title", "", names) for entry in entries]
    links = [entry.find("a:link", names).get("href") for entry in entries]

    assert [title.partition(":")[0] for title in titles] == ["red", "recovered", "red"]
    assert SUBJECT in titles[0]
    assert "(4 series of 3 tests)" in titles[0]
    page = (site / "regressions.html").read_text()
    assert all(f'id="{link.partition("#")[2]}"' in page for link in links)


def test_a_cause_keeps_its_place_when_a_night_is_added():
    before = {told(c, book(nights())).anchor for c in causes_of(book(nights()))}
    later = nights(TONIGHT + 3)
    after = {told(c, book(later)).anchor for c in causes_of(book(later))}

    assert before == after
    assert f"c-{hashlib.sha256(b'run-spook-0009').hexdigest()[:10]}" in before


def opened(driver, site, page, **how):
    look(driver, **how)
    driver.get("about:blank")
    arrive(driver, (site / page.partition("#")[0]).as_uri() + page[len(page.partition("#")[0]) :])


def test_cause_commit_tests_and_damage_are_in_the_first_900_pixels(driver, site):
    opened(driver, site, "index.html", width=1400)
    ends = driver.execute_script(
        "return ['h3', '.cause-by', '.damage', '.cause-worst', '.hit-tests', '.buttons']"
        ".map((s) => document.querySelector('.cause ' + s).getBoundingClientRect().bottom + scrollY)"
    )

    assert max(ends) <= 900


def test_one_click_leads_from_the_first_page_to_the_moment_it_goes_wrong(driver, site, recorded):
    opened(driver, site, "index.html", width=1400)
    link = driver.find_element("link text", "See it go wrong")
    driver.get(link.get_attribute("href"))
    wait_for(driver, "(document.getElementById('replay').player || {}).sample > 0")
    sample, top, against = driver.execute_script(
        "const box = document.getElementById('replay'); return [box.player.sample,"
        " box.querySelector('canvas').getBoundingClientRect().top, location.hash]"
    )

    assert sample == recorded[0].count // 2
    assert 0 <= top < 900
    assert "against=friction-" in against and "t=" in against


def test_what_leads_there_is_a_scene_in_which_it_can_be_seen(recorded):
    """The first test hit moves by a millimetre of a metre, the second by a quarter."""
    sound, wrong = recorded
    little = moved(sound, 1e-3)
    door = [msgspec.structs.replace(motion, test="door") for motion in (sound, wrong)]
    found = []
    for n, night in enumerate(nights().documents.values()):
        pair = (little, door[1]) if n >= BROKEN else (sound, door[0])
        found.append(msgspec.structs.replace(night, trajectories=pair))
    told_apart = book(DocumentHistory(found))
    red = told(causes_of(told_apart)[0], told_apart)

    assert red.tests[0].title == "Friction"
    assert red.replay.startswith("tests/door.html#against=door-")
    assert apart(sound, wrong) == pytest.approx(250 * apart(sound, little), rel=0.1)  # of quantised places
    assert apart(sound, little) < SEEN < apart(sound, wrong)
    assert apart(sound, msgspec.structs.replace(wrong, count=sound.count - 1)) == 0.0
    assert f"SEEN = {SEEN};" in (ROOT / "site" / "static" / "replay.js").read_text()


def test_subject_and_author_stand_wherever_a_version_is_chosen_or_listed(site):
    assert f"{SUBJECT} by {AUTHOR}" in Words(site / "versions.html").text
    (choices,) = re.findall(r'id="comparisons">(.*?)</script>', (site / "compare.html").read_text())
    labels = [label for _, label, _ in json.loads(choices)["nights"]]
    assert [SUBJECT in label and AUTHOR in label for label in labels] == [
        n == BROKEN for n in range(TONIGHT + 1)
    ]
    for name, night, subject, author in (
        ("nights", "run", "subject", "author"),
        ("regressions", "first_bad", "first_bad_subject", "first_bad_author"),
    ):
        lines = json.loads((site / "data" / f"{name}.json").read_text())
        told = {
            (line[subject], line[author])
            for line in lines
            if line[night] in (f"run-spook-{BROKEN:04d}", document(BROKEN).engine.git_hash)
        }
        assert told == {(SUBJECT, AUTHOR)}
        assert f"{subject},{author}" in (site / "data" / f"{name}.csv").read_text().splitlines()[0]


def test_the_list_is_searched_and_filtered_and_the_address_keeps_it(driver, site):
    shown = (
        "return [...document.querySelectorAll('details.cause')].filter((d) => !d.hidden).map((d) =>"
        " [d.dataset.state, d.open, [...d.querySelectorAll('tbody tr')].filter((r) => !r.hidden).length])"
    )
    opened(driver, site, "regressions.html#show=recovered")
    assert driver.execute_script(shown) == [["recovered", False, 1]]

    opened(driver, site, "regressions.html#q=door")
    assert driver.execute_script(shown) == [
        ["detected", True, 1]
    ]  # of four series the one that was asked for

    opened(driver, site, "regressions.html#q=dee+o%27ex")
    assert driver.execute_script(shown) == [["detected", True, 4]]

    opened(driver, site, "regressions.html#q=nowhere")
    assert driver.execute_script(shown) == []
    assert driver.execute_script("return document.getElementById('none-found').checkVisibility()")


def test_a_link_opens_its_cause(driver, site):
    fixed = next(c for c in (told(c, book(nights())) for c in causes_of(book(nights()))) if not c.new)
    opened(driver, site, f"regressions.html#{fixed.anchor}")
    wait_for(driver, f"document.getElementById('{fixed.anchor}').open")

    # The page glides there: wait for it to arrive.
    box = f"document.getElementById('{fixed.anchor}').getBoundingClientRect()"
    wait_for(driver, f"{box}.top >= 0 && {box}.top < window.innerHeight")
