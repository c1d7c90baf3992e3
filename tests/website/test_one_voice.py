"""No two sentences of a website contradict each other: sign against conclusion, worst against table, lead against lead."""

import json
import random
import re
from html import unescape
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.library import record
from spook_tracker.tracker.website.nights import book
from spook_tracker.tracker.website.publish import publish
from tests.histories.synthetic import history

TODAY = 6


@pytest.fixture(scope="module", params=["red", "green"])
def nights(request):
    return history(TODAY, broken={"red": TODAY - 1, "green": 10**9}[request.param])


@pytest.fixture(scope="module")
def site(tmp_path_factory, nights):
    out = tmp_path_factory.mktemp("told") / "public"
    publish(nights, out)
    return out


@pytest.fixture(scope="module")
def judged(nights):
    """The record that every sentence has to be made from."""
    told = book(nights)
    return SimpleNamespace(tests=told.tests, documents=nights.documents.values())


def plain(html: str) -> str:
    return re.sub(r"\s+", " ", unescape(re.sub(r"<[^>]*>", " ", html))).strip()


def read(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def sign_of(page: str) -> str:
    """The word of the sign beside the title of a page."""
    return plain(re.search(r'<div class="title-row"><h1>.*?</h1>(.*?)</div>', page, re.DOTALL)[1])


def test_a_conclusion_says_what_the_sign_beside_the_title_says(site):
    said = set()
    for path in (site / "tests").glob("*.html"):
        page = read(path)
        concluded = page.partition('id="conclusion"')[2]
        for words, sign in (("It passed tonight", "PASS"), ("It failed tonight", "FAIL")):
            if words in concluded:
                assert sign_of(page) == sign, path.name
                said.add(sign)
    assert "PASS" in said


def test_a_page_opens_with_what_is_broken_and_only_where_something_is(site):
    for path in (site / "tests").glob("*.html"):
        page = read(path)
        assert ('id="broken"' in page) == (sign_of(page) in ("FAIL", "WATCH")), path.name
        if 'id="broken"' in page:
            assert page.index('id="broken"') < page.index('id="scene"'), path.name


def factors(html: str) -> list[float]:
    """Every "n × its limit" as a number."""
    digits = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻−", "0123456789--")
    found = []
    for mantissa, power in re.findall(r"([\d.]+)(?:×10([⁻⁰-⁹²³¹]+))? × its limit", plain(html)):
        found.append(float(mantissa) * 10.0 ** float(power.translate(digits) or 0))
    return found


def test_the_worst_of_a_cause_is_the_worst_of_its_table(site):
    page = read(site / "regressions.html")
    for cause in re.findall(r'<details class="cause.*?</details>', page, re.DOTALL):
        summary, _, table = cause.partition("</summary>")
        if rows := factors(table):
            assert factors(summary) == [max(rows)]


def test_first_page_report_and_badge_count_the_same(site):
    index, report = read(site / "index.html"), read(site / "document.html")
    headline = plain(re.search(r"<h1>(.*?)</h1>", index)[1])
    summary = plain(re.search(r"</h1><p>(.*?)</p>", index)[1])
    assert headline in plain(report) and summary in plain(report)
    kept, of = re.search(r"Limits kept (\d+) of (\d+)", plain(index)).groups()
    badge = plain(read(site / "badge.svg"))
    assert f"{kept} of {of} limits kept" in badge
    assert json.loads(read(site / "badge.json"))["message"] == f"{kept} of {of} limits kept"
    if kept == of:
        assert headline.startswith("Every limit is kept")
    else:
        broken = {"One limit is broken tonight": 1}.get(headline) or int(headline.split()[0])
        assert broken == int(of) - int(kept)


def test_the_report_says_first_what_the_first_page_says_broke(site):
    index, report = read(site / "index.html"), read(site / "document.html")
    for part in ("What broke tonight", "Still red"):
        assert (part in plain(index)) == (part in plain(report))
    first = re.findall(r'<h2 id="t-[^"]*">(.*?)</h2>', report, re.DOTALL)
    signs = [plain(title).rsplit(" ", 1)[-1] for title in first]
    red = [sign in ("FAIL", "WATCH") for sign in signs]
    assert red == sorted(red, reverse=True)


def signs_by_test(page: str) -> list[tuple[str, str]]:
    """Every line of a table or a list that links to the page of a test, with each sign that stands in the line."""
    lines = [line for line, _ in re.findall(r"(<(tr|li)\b.*?</\2>)", page, re.DOTALL)]
    found = []
    for line in lines:
        tests = re.findall(r'href="(?:\.\./)?tests/([^"#]+)\.html', line)
        found += [(test, sign) for test in tests for sign in re.findall(r'class="verdict is-(\w+)', line)]
    return found


def test_no_page_gives_a_test_a_worse_sign_than_its_own_page_which_has_the_judges(site, judged):
    """Walks every page, the report among them; an entry of what is over (recovered, accepted) has a sign of its own."""
    states = {test.name: test.state for test in judged.tests}
    own = {path.stem: sign_of(read(path)).lower() for path in (site / "tests").glob("*.html")}
    assert own == states
    failed, walked = {name for name, state in states.items() if state == "fail"}, 0
    for path in site.rglob("*.html"):
        for test, sign in signs_by_test(read(path)):
            walked += 1
            assert sign != "fail" or test in failed, f"{path.name} says FAIL of {test}"
            assert sign != "watch" or states[test] in ("fail", "watch"), f"{path.name} says WATCH of {test}"
    assert walked > len(states)
    shown = {test for test, sign in signs_by_test(read(site / "regressions.html")) if sign == "fail"}
    assert shown == failed, "what fails stands among the regressions"


def test_no_sentence_calls_all_well_where_the_judge_does_not_nor_the_other_way(site, judged):
    whole = all(test.state == "pass" for test in judged.tests)
    good = ("Every limit is kept", "Nothing became worse", "No open regressions")
    bad = (
        "is broken tonight",
        "are broken tonight",
        "What broke tonight",
        "What is wrong tonight",
        "It failed tonight",
    )
    states = {f"{test.name}.html": test.state for test in judged.tests}
    for path in (*site.rglob("*.html"), site / "feed.xml", site / "badge.svg"):
        words = plain(read(path))
        well = whole or states.get(path.name) == "pass"
        assert not [said for said in bad if well and said in words], path.name
        assert not [said for said in good if not whole and said in words], path.name


def test_feed_page_of_regressions_and_command_count_a_cause_alike(site, judged, tmp_path):
    causes = re.findall(r'<details class="cause.*?</summary>', read(site / "regressions.html"), re.DOTALL)
    entries = re.findall(
        r"<title>red: \w+: (.*?) \((\d+ series of \d+ tests?)\)</title>", read(site / "feed.xml")
    )
    assert len(causes) == len(entries) == (0 if all(t.state == "pass" for t in judged.tests) else 1)
    for cause, (damage, _) in zip(causes, entries, strict=True):
        assert f": {damage} in " in plain(cause)
    url = f"sqlite:///{tmp_path}/x.db"
    for document in judged.documents:
        record(document, url)
    told = CliRunner().invoke(main, ["judge", "latest", "--db", url]).output
    for _, series in entries:
        assert f"  {series}; first bad commit" in told
    fails = re.findall(r"^✗ (\w+)/.*see tests/", told, re.MULTILINE)
    assert {test.name for test in judged.tests if test.state != "pass"} == set(fails)


def test_what_is_told_first_tonight_is_new_for_the_judge_and_on_the_page(tmp_path: Path) -> None:
    """A run time is told by a second slow night: it began last night, and is news of tonight in every output."""
    draw, entries = random.Random(4), []
    for night in range(32):
        seconds = (1e-3 if night < 30 else 1.2e-3) * (1.0 + 0.003 * draw.gauss(0.0, 1.0))
        commit = {"id": f"{night:04}" + "c" * 36, "timestamp": "2025-01-01T00:00:00Z"}
        benches = [{"name": "step", "value": seconds, "unit": "s"}]
        entries.append(
            {"commit": commit, "date": 1735689600000 + night * 86400000, "tool": "go", "benches": benches}
        )
    said = {"lastUpdate": 0, "repoUrl": "https://example.org/r", "entries": {"gravel": entries}}
    (tmp_path / "data.js").write_text("window.BENCHMARK_DATA = " + json.dumps(said))
    kept = ("--db", f"sqlite:///{tmp_path}/x.db")
    for words in (["import", str(tmp_path / "data.js")], ["publish", "--out", str(tmp_path / "public")]):
        assert CliRunner().invoke(main, [*words, *kept]).exit_code == 0

    judged = CliRunner().invoke(main, ["judge", "latest", *kept]).output
    page = (tmp_path / "public" / "index.html").read_text(encoding="utf-8")

    assert judged.startswith("✗ 1 worse than the history, 1 new tonight")
    assert "One series is red" in page and "1 test ran on gravel" in page  # nothing has a limit
    assert "One commit made one series worse tonight." in page
    assert "Nothing became worse tonight" not in page
