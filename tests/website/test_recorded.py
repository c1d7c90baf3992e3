"""A recorded night of all engines beside tonight's own: whose times compare, what is left out, which releases changed what."""

from __future__ import annotations

import lzma
from pathlib import Path
from typing import Any

import msgspec
import pytest

from bench import recorded as bench
from spook_tracker.tracker.store.documents import DocumentHistory
from spook_tracker.tracker.store.months import read_runs, write_runs
from spook_tracker.tracker.website.options import SiteOptions
from spook_tracker.tracker.website.publish import publish
from spook_tracker.tracker.website.recorded import NIGHT, OCCASION, RELEASES, RecordedError
from tests.histories.synthetic import MACHINE, document, history, rival
from tests.website.test_engines import check_totals, lines, table

ELSEWHERE = msgspec.structs.replace(MACHINE, fingerprint="another", processor="a processor far away")
TEN_LOADED = b'[{"engine": "rival", "started": "2026-01-01T00:00:00Z", "seconds": 90, "load": [1.5, 3.2], "limit": 0.5}]'


def of_there(run: Any) -> Any:
    return msgspec.structs.replace(run, machine=ELSEWHERE, trigger="manual")


def recorded(folder: Path, *runs: Any, releases: tuple[Any, ...] = ()) -> Path:
    """The folder as `make recorded` writes it, of these runs."""
    folder.mkdir(parents=True)
    write_runs(folder / NIGHT, [of_there(run) for run in runs])
    write_runs(folder / RELEASES, [of_there(run) for run in releases])
    (folder / OCCASION).write_bytes(TEN_LOADED)
    return folder


def published(out: Path, told: Any, folder: Path) -> Path:
    report = publish(told, out, options=SiteOptions(recorded=folder))
    assert report.failed == ()
    return out


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three nights of ours alone, and a recorded night of two engines."""
    place = tmp_path_factory.mktemp("recorded")
    folder = recorded(
        place / "files", document(0), rival("3.3"), releases=(rival("3.10"), rival("3.9", door=0.25))
    )
    return published(place / "public", history(3), folder)


def test_the_totals_of_the_recorded_engines_and_of_tonight_are_those_of_their_columns(site: Path) -> None:
    check_totals(site)


def test_a_site_of_ours_alone_shows_the_recorded_engines_and_says_when_and_where(site: Path) -> None:
    text = (site / "engines.html").read_text(encoding="utf-8")

    assert "A recorded night, not tonight’s: 2 engines, measured" in text
    assert "a processor far away" in text
    assert "at a load of 1.5 to 3.2" in text.replace("\u202f", " ")
    assert "Errors compare across machines; run times compare within one machine only" in text


def test_recorded_run_times_are_set_beside_recorded_ones_alone(site: Path) -> None:
    """Ours of that machine and the rival's compare; tonight's times are not drawn among them, its errors are."""
    times = table(site, "engines.html", "Run time to an error of 10⁻²")
    errors = table(site, "engines.html", "Error at h = 1/60")

    assert times["Scene"] == ["spook 0.1.0", "rival 3.3", "spook 0.1.2 tonight"]
    assert times["Pendulum length [%]"] == ["40 µs", "200 µs 5 times the best", "another machine"]
    gates = table(site, "engines.html", "A line for each gate")["Door on hinges Largest door deviation"]
    assert gates[1] == gates[3] != "not asked"
    assert errors["Scene"] == times["Scene"]
    assert "Where another engine is ahead of spook 0.1.0<" in (site / "engines.html").read_text()


def test_another_night_of_the_same_machine_is_not_set_beside_tonights_times(tmp_path: Path) -> None:
    folder = recorded(tmp_path / "files", document(0), rival("3.3"))
    write_runs(folder / NIGHT, [document(0), msgspec.structs.replace(rival("3.3"), trigger="manual")])
    site = published(tmp_path / "public", history(3), folder)

    times = table(site, "engines.html", "Run time to an error of 10⁻²")
    assert times["Pendulum length [%]"] == ["40 µs", "200 µs 5 times the best", "another night"]


def test_the_page_of_a_recorded_engine_names_the_recorded_release_of_a_change(site: Path) -> None:
    releases = table(site, "recorded/rival.html", "The newest first")

    assert releases["3.10"][1] == "2"
    assert "0.25 % to 0.5 %" in releases["3.10"][2] or "door" in releases["3.10"][2]
    assert releases["3.9"][1] == "the first"
    assert "Recorded, not asked tonight" in (site / "recorded" / "rival.html").read_text(encoding="utf-8")


def test_engines_that_were_asked_tonight_stand_first_and_the_recorded_night_beside(tmp_path: Path) -> None:
    folder = recorded(tmp_path / "files", document(0), rival("3.2"))
    asked = DocumentHistory([*history(2).documents.values(), rival("3.3")])
    site = published(tmp_path / "public", asked, folder)

    assert table(site, "engines.html", "A line for each gate")["Test"] == [
        "Limit",
        "spook 0.1.1",
        "rival 3.3",
    ]
    assert 'href="recorded.html"' in (site / "engines.html").read_text(encoding="utf-8")
    assert lines(site, "recorded.html", "A line for each gate")[0][2:4] == ["spook 0.1.0", "rival 3.2"]
    assert 'href="../recorded.html"' in (site / "recorded" / "rival.html").read_text(encoding="utf-8")


def test_a_recorded_night_without_our_engine_puts_no_other_in_its_place(tmp_path: Path) -> None:
    """Only ours is held to limits, and it is behind or ahead only where it was timed."""
    folder = recorded(tmp_path / "files", rival("3.3"))
    site = published(tmp_path / "public", history(2), folder)
    text = (site / "engines.html").read_text(encoding="utf-8")

    assert "only spook 0.1.1 tonight is held to any" in text
    assert "is ahead of" not in text


def test_a_test_that_is_asked_otherwise_by_now_is_left_out_by_name(tmp_path: Path) -> None:
    """Other answers to another question are not compared: the door's changed, and everything else stays."""
    then = document(0)
    changed = msgspec.structs.replace(
        then,
        series=tuple(
            msgspec.structs.replace(d, test_version="before") if d.test == "door" else d for d in then.series
        ),
    )
    site = published(tmp_path / "public", history(2), recorded(tmp_path / "files", changed, rival("3.3")))

    gates = table(site, "engines.html", "A line for each gate")
    alone = table(site, "engines.html", "The value of ours, and whether the limit is kept")
    assert "Door on hinges Largest door deviation" not in gates, "none of the others was asked that"
    assert alone["Door on hinges Largest door deviation"][1:] == ["not asked", "kept: 0.009 %"]
    assert gates["Pendulum Largest pendulum deviation"][1] == "kept: 9.3×10⁻⁴ %"
    assert "left out: door." in (site / "engines.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("content", [b"", b"no archive", lzma.compress(b"")])
def test_files_that_are_none_are_refused_with_the_command_that_writes_them(
    tmp_path: Path, content: bytes
) -> None:
    folder = recorded(tmp_path / "files", document(0))
    (folder / NIGHT).write_bytes(content)

    with pytest.raises(RecordedError, match="`make recorded` writes"):
        published(tmp_path / "public", history(1), folder)


def test_what_is_written_is_read_again_without_drawings_and_motions(tmp_path: Path) -> None:
    run = document(0)
    write_runs(tmp_path / NIGHT, [run])
    (again,) = read_runs(tmp_path / NIGHT)

    assert run.figures and run.trajectories is not None
    assert (again.figures, again.maps, again.trajectories) == ((), (), ())
    assert again.samples == run.samples


def test_the_newest_answer_to_every_test_is_kept_once() -> None:
    """A night, then the door alone again: of the night all but its door stays."""
    whole = rival("3.3")
    alone = msgspec.structs.replace(
        whole,
        id="later",
        series=tuple(d for d in whole.series if d.test == "door"),
        samples=tuple(s for s in whole.samples if s.series.startswith("door/")),
    )
    later, earlier = bench.newest_answers([alone, whole])

    assert {d.test for d in later.series} == {"door"}
    assert "door" not in {d.test for d in earlier.series}
    assert len(later.samples) + len(earlier.samples) == len(whole.samples)
