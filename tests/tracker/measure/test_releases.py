"""Backfill: releases in order, what cannot be had is named, what changed is told with its release."""

from __future__ import annotations

import math
import re
import time
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import msgspec
import pytest
from click.testing import CliRunner

import spook_tracker.tracker.cli.releases as command
import spook_tracker.tracker.measure.releases as releases
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.run_document import DrawnSolid, SceneDrawing
from spook_tracker.tracker.judge.comparison_document import Change
from spook_tracker.tracker.judge.release_notes import read_changelog, visible
from spook_tracker.tracker.library import record
from tests.histories.documents import card, definition, engine, run, run_of, sample
from tests.places import ROOT

KEY = "falling_object/rk4/position_error/h=0.0166667"


def test_releases_come_oldest_first_and_unknown_ones_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def pip(*arguments: str) -> CompletedProcess[str]:
        assert arguments == ("index", "versions", "mujoco")
        return CompletedProcess([], 0, "mujoco (3.4.0)\nAvailable versions: 3.4.0, 3.3.7, 3.3.0\n", "")

    monkeypatch.setattr(releases, "_pip", pip)
    known = releases.released("mujoco")

    assert known == ("3.3.0", "3.3.7", "3.4.0")
    assert releases.choose(known, (), 2) == ("3.3.7", "3.4.0")
    assert releases.choose(known, ("3.4.0", "3.3.0"), None) == ("3.3.0", "3.4.0")
    with pytest.raises(releases.ReleaseError, match=r"no release '9\.9'.*newest is 3\.4\.0"):
        releases.choose(known, ("9.9",), None)
    with pytest.raises(releases.ReleaseError, match="not known"):
        releases.released("spook")


def test_releases_come_from_npm_too_without_those_that_are_tried_out(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked: list[tuple[str, ...]] = []
    starts = CompletedProcess([], 0, "", "")

    def npm(*arguments: str) -> CompletedProcess[str]:
        asked.append(arguments)
        return CompletedProcess([], 0, '["0.18.0", "0.19.0-alpha.1", "0.20.0"]', "")

    monkeypatch.setattr(releases, "_npm", npm)
    monkeypatch.setattr(releases, "_python", lambda *a, **o: starts)
    assert releases.released("cannon") == ("0.18.0", "0.20.0")

    place = releases.install("cannon", "0.18.0", tmp_path)
    assert place == tmp_path / "cannon-0.18.0"
    assert asked[-1][-3:] == ("--prefix", str(place), "cannon-es@0.18.0")
    assert releases.install("cannon", "0.18.0", tmp_path) == place
    assert len(asked) == 2, "what is there already is used again"

    starts = CompletedProcess([], 1, "", "ImportError: Node is not installed\n")
    with pytest.raises(
        releases.ReleaseError, match=r"cannon-es@0\.20\.0 is installed but does not start: ImportError: Node"
    ):
        releases.install("cannon", "0.20.0", tmp_path)
    assert not (tmp_path / "cannon-0.20.0").exists()


def test_a_release_from_npm_is_found_before_what_is_installed_here(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A made-up release beside the adapter's own search: the process that measures sees it first."""
    package = tmp_path / "cannon-9.9.9" / "node_modules" / "cannon-es"
    package.mkdir(parents=True)
    (package / "package.json").write_text('{"name": "cannon-es", "version": "9.9.9", "module": "none.js"}')
    monkeypatch.setenv("TRACKER_NODE_MODULES", str(tmp_path / "elsewhere"))
    monkeypatch.setattr("shutil.which", lambda name: f"/somewhere/{name}")
    program = (
        "import shutil; shutil.which = lambda name: name\n"
        "from spook_tracker.engine.find import find; print(find('cannon').build_info.version)"
    )
    told = releases._python(tmp_path / "cannon-9.9.9", "-c", program)

    assert told.stdout.strip() == "9.9.9", told.stderr


def test_a_release_that_cannot_be_installed_or_started_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(
        releases, "_pip", lambda *a: CompletedProcess([], 1, "", "x\nno wheel for this Python\n")
    )
    with pytest.raises(releases.ReleaseError, match=r"mujoco==1\.0 cannot be installed: no wheel"):
        releases.install("mujoco", "1.0", tmp_path)

    asked: list[tuple[str, ...]] = []

    def pip(*arguments: str) -> CompletedProcess[str]:
        asked.append(arguments)
        (tmp_path / "mujoco-1.0").mkdir(exist_ok=True)
        return CompletedProcess([], 0, "", "")

    monkeypatch.setattr(releases, "_pip", pip)
    monkeypatch.setattr(
        releases, "_python", lambda *a, **o: CompletedProcess([], 1, "", "ImportError: numpy\n")
    )
    with pytest.raises(releases.ReleaseError, match="does not start: ImportError: numpy"):
        releases.install("mujoco", "1.0", tmp_path)
    assert [arguments[-1] for arguments in asked] == ["mujoco==1.0", "numpy<2"]
    assert not (tmp_path / "mujoco-1.0").exists(), "what does not start is not kept"


def test_what_a_release_pins_comes_along_and_nothing_else(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """MuJoCo 4 is several packages of one version; NumPy and what is optional are no part of it."""
    asked: list[str] = []

    def pip(*arguments: str) -> CompletedProcess[str]:
        asked.extend(arguments[arguments.index(":all:") + 1 :])
        place = tmp_path / "mujoco-4.0" / "mujoco-4.0.dist-info"
        place.mkdir(parents=True, exist_ok=True)
        place.joinpath("METADATA").write_text(
            "Name: mujoco\nRequires-Dist: numpy\nRequires-Dist: mujoco-core==4.0\n"
            'Requires-Dist: mujoco-usd==4.0; extra == "usd"\n\nRequires-Dist: words==1.0 of the description\n'
        )
        return CompletedProcess([], 0, "", "")

    monkeypatch.setattr(releases, "_pip", pip)
    monkeypatch.setattr(releases, "_python", lambda *a, **o: CompletedProcess([], 0, "", ""))
    place = releases.install("mujoco", "4.0", tmp_path)

    assert asked == ["mujoco==4.0", "mujoco-core==4.0"]
    assert releases.install("mujoco", "4.0", tmp_path) == place
    assert len(asked) == 2, "what is there already is used again"
    assert releases.size(place) > 100


def release(version: str, day: int, values: dict[str, Any]) -> Any:
    built = engine("", name="other", version=version, commit_time="", parents=())
    started = f"2026-01-{day:02}T00:00:00+00:00"
    return run_of(values, engine=built, started=started, finished=started)


def asked(version: str, day: int, values: dict[str, float], unit: str = "m") -> Any:
    """Of a stack of three boxes of 1 m edge, and of one ball at rest or struck."""
    named = {key: key.split("/") for key in values}
    built = engine("", name="other", version=version, commit_time="", parents=())
    started = f"2026-01-{day:02}T00:00:00+00:00"
    floor = DrawnSolid(kind="plane", position=(0.0, 0.0, 0.0), size=(0.0, 0.0, 1.0), fixed=True)
    box = DrawnSolid(kind="box", position=(0.0, 0.0, 0.0), size=(1.0, 1.0, 1.0))
    ball = DrawnSolid(kind="sphere", position=(0.0, 0.0, 0.0), size=(0.5,))
    one = SceneDrawing(solids=(floor, ball))
    drawn = {"stack": SceneDrawing(solids=(floor, box, box, box)), "ball": one, "blow": one}
    facts = {"role": "reported", "limit": None, "set_point": None, "parameters": {}, "unit": unit}
    return run(
        engine=built,
        started=started,
        finished=started,
        tests=tuple(card(name=name, scene=scene) for name, scene in drawn.items()),
        series=tuple(
            definition(key, test=test, configuration=setting, metric=metric, **facts)
            for key, (test, setting, metric, *_) in named.items()
        ),
        samples=tuple(sample(key, value) for key, value in values.items()),
        id=f"{version}-{day}",
        idempotency_key=f"{version}-{day}",
    )


def told_between(tmp_path: Path, before: dict[str, float], after: dict[str, float]) -> list[str]:
    database = history(tmp_path, asked("1.0", 1, before), asked("1.1", 2, after))
    return CliRunner().invoke(main, ["releases", "other", "--db", database]).output.splitlines()[1:]


def test_one_body_comes_before_a_heap_however_much_the_heap_changed(tmp_path: Path) -> None:
    before = {"stack/a/drift": 1e-6, "ball/a/depth": 2e-4}
    told = told_between(tmp_path, before, {"stack/a/drift": 0.4, "ball/a/depth": 1e-4})

    assert [line.split()[1] for line in told] == ["ball/a/depth", "stack/a/drift"]


def test_of_tests_of_as_many_bodies_the_one_that_changed_most_comes_first(tmp_path: Path) -> None:
    """An error that is gone, before one of another body that fell by some per cent."""
    before = {"ball/a/depth": 0.066, "blow/a/depth": 0.12}
    told = told_between(tmp_path, before, {"ball/a/depth": 0.063, "blow/a/depth": 2e-5})

    assert [line.split()[1] for line in told] == ["blow/a/depth", "ball/a/depth"]


def test_a_collapse_is_told_once_and_as_one(tmp_path: Path) -> None:
    """A box 7 m from its place is no stack: what else was asked of that run is named, and of others it is told."""
    names = ["stack/a/drift", "stack/a/gain", "stack/a/overlap", "stack/b/overlap"]
    told = told_between(
        tmp_path, dict.fromkeys(names, 0.1), dict(zip(names, (7.0, 9e9, 0.2, 0.05), strict=True))
    )

    assert told == [
        "  collapses      stack/a/drift  0.1 → 7 m, and with it gain, overlap",
        "  improved       stack/b/overlap  0.1 → 0.05 m",
    ]
    back = told_between(tmp_path / "back", {"stack/a/drift": 7.0}, {"stack/a/drift": 0.1})
    assert back == ["  holds          stack/a/drift  7 → 0.1 m"]


def test_nothing_decisive_is_left_out_and_what_is_left_out_is_named(tmp_path: Path) -> None:
    """Each quantity is told for the worse and for the better; of one body all is told."""
    settings = [f"stack/{letter}/drift" for letter in "abcde"]
    before = dict.fromkeys([*settings, "stack/f/drift", "stack/f/overlap"], 0.01)
    after = {**dict.fromkeys(settings, 0.02), "stack/f/drift": 0.005, "stack/f/overlap": 0.005}
    told = told_between(tmp_path, before, after)

    assert [line.split()[1] for line in told[:-1]] == [*settings[:3], "stack/f/drift", "stack/f/overlap"]
    assert told[-1].strip() == "… and 2 more of stack: drift in d, e"

    balls = [f"ball/{letter}/depth" for letter in "abcdef"]
    every = told_between(tmp_path / "balls", dict.fromkeys(balls, 0.01), dict.fromkeys(balls, 0.02))
    assert [line.split()[1] for line in every] == balls


def test_the_rest_goes_on_when_a_release_fails_and_a_second_call_measures_only_what_is_missing(
    tmp_path: Path,
) -> None:
    database = f"sqlite:///{tmp_path}/history.db"
    measured: list[str] = []

    def measure(version: str) -> Any:
        measured.append(version)
        if version == "1.1":
            raise releases.ReleaseError("other==1.1 cannot be installed: no wheel")
        return release("1.3" if version == "1.2" else version, len(measured), {KEY: 0.5})

    lines = list(command.progress("other", ("1.0", "1.1", "1.2", "1.4"), measure, database, None))
    assert [line.partition(": ")[2][:30] for line in lines] == [
        "1 of 1 values in 0 s",
        "other==1.1 cannot be installed",
        "it reports version '1.3', so n",  # another release of it lies in the way
        "1 of 1 values in 0 s",
    ]

    measured.clear()
    again = list(command.progress("other", ("1.0", "1.4", "1.5"), measure, database, time.monotonic() - 1.0))
    assert measured == []
    assert "recorded already" in again[0] and "recorded already" in again[1]
    assert "time is up; run the same command again to go on" in again[2]


def history(tmp_path: Path, *runs: Any) -> str:
    tmp_path.mkdir(exist_ok=True)
    database = f"sqlite:///{tmp_path}/history.db"
    for one in runs:
        record(one, database)
    return database


def test_every_change_is_told_with_its_release(tmp_path: Path) -> None:
    """Measured in a wrong order, and with one that only rounding and one that a busy machine touched."""
    late = "falling_object/rk4/late/h=0.0166667"
    database = history(
        tmp_path,
        release("1.10", 1, {KEY: 0.25, late: 1.0}),
        release("1.9", 2, {KEY: 0.5 + 1e-9, late: 1.0}),
        release("1.8", 3, {KEY: 0.5, late: 1.0}),
    )
    told = CliRunner().invoke(main, ["releases", "other", "--db", database])

    assert told.exit_code == 0
    assert told.output.splitlines() == [
        "other 1.9 after 1.8: no changes",
        "other 1.10 after 1.9: 1 change",
        f"  improved       {KEY}  0.5 → 0.25 %",
    ]


def test_a_page_names_the_releases_it_was_made_of_and_every_quantity_that_changed(tmp_path: Path) -> None:
    """Three worse in four settings of one quantity do not hide another quantity of the same test."""
    many = [f"falling_object/{setting}/position_error/h=0.0166667" for setting in ("a", "b", "c", "d")]
    other = "falling_object/e/velocity_error/h=0.0166667"
    before, after = dict.fromkeys([*many, other], 0.5), {**dict.fromkeys(many, 50.0), other: 0.51}
    database = history(tmp_path, asked("1.9", 1, before, "J"), asked("1.10", 2, after, "J"))
    told = CliRunner().invoke(main, ["releases", "other", "--markdown", "--db", database]).output

    assert "tracker backfill --engine other 1.9 1.10 --limit 5 --test=falling_object" in " ".join(
        told.split()
    )
    assert f"| `{other}` | 0.5 | 0.51 |" in told
    assert "| … and 1 more of " in told


def test_a_changelog_is_found_missed_or_says_nothing(tmp_path: Path) -> None:
    other = "blow/rk4/change/h=0.0166667"
    database = history(
        tmp_path,
        release("1.0", 1, {KEY: 0.5, other: 1.0}),
        release("1.2", 2, {KEY: 0.25, other: 1.0}),
        release("1.3", 3, {KEY: 0.25, other: 2.0}),
        release("2.0", 4, {KEY: 0.125, other: 2.0}),
    )
    changelog = tmp_path / "changelog.toml"
    changelog.write_text(
        'source = "a list"\nreleases = ["1.0", "1.1", "1.2", "1.3"]\n'
        '[[entry]]\nrelease = "1.1"\nitem = 4\nsays = "falls are better"\nshows = ["falling_object/*"]\n'
        '[[entry]]\nrelease = "1.2"\nitem = 1\nsays = "blows are better"\nshows = ["blow/*"]\n'
    )
    asked = ["releases", "other", "--db", database, "--changelog", str(changelog)]

    page = CliRunner().invoke(main, [*asked, "--markdown"]).output
    assert (
        f"**Found: 1**\n\n- 1.1, item 4: falls are better. Seen in pendulum:\n  `{KEY}` 0.5 → 0.25 %." in page
    )
    assert "**Missed: 1**\n\n- 1.2, item 1: blows are better." in page
    assert f"**Not in the changelog: 1 release**\n\n- 1.3: `{other}` 1 → 2" in page
    assert "does not reach 2.0" in page
    assert f"| `{KEY}` | 0.25 | 0.125 | % |" in page

    text = CliRunner().invoke(main, asked).output
    assert "found   1.1 falls are better\n  missed  1.2 blows are better\n  unsaid  1.3: pendulum" in text

    changelog.write_text(f'blown_up = ["blow/*"]\n{changelog.read_text()}')
    page = CliRunner().invoke(main, [*asked, "--markdown"]).output
    assert "**Not in the changelog: no releases**" in page
    assert "(`blow/*`); their changes in 1.3 count for nothing here" in " ".join(page.split())

    changelog.write_text('releases = ["1.0"]\nsource = "x"\nentry = [{release = "9"}]\n')
    refused = CliRunner().invoke(main, asked)
    assert refused.exit_code == 2
    assert "is no changelog: 'item'" in refused.output


def test_one_release_alone_changes_nothing_and_says_how_to_go_on(tmp_path: Path) -> None:
    database = history(tmp_path, release("1.0", 1, {KEY: 0.5}))
    told = CliRunner().invoke(main, ["releases", "other", "--db", database])

    assert told.output == (
        "fewer than two releases of other are recorded; measure more: tracker backfill --engine other\n"
    )


@pytest.mark.parametrize(
    ("before", "after", "seen"),
    [
        (1.0, 1.0 + 1e-7, False),
        (1.0, 1.0 + 1e-5, True),
        (1e-14, -3e-13, False),
        (0.0, 1e-11, True),
        (math.nan, math.nan, False),
    ],
)
def test_rounding_is_no_change(before: float, after: float, seen: bool) -> None:
    change = Change(
        series=KEY, test="falling_object", metric="m", configuration="rk4", role="gate", kind="scalar",
        unit="m", word="changed", red=False, stands="none", name="", sentence="", before=before, after=after,
        before_outcome="value", after_outcome="value", limit=None,
    )  # fmt: skip
    assert visible(change) == seen
    assert not visible(msgspec.structs.replace(change, after_outcome="timed_out"))
    assert visible(msgspec.structs.replace(change, after_outcome="diverged"))


def test_the_changelog_of_mujoco_speaks_of_series_that_are_asked() -> None:
    changelog = read_changelog(ROOT / "docs" / "mujoco-changelog.toml")
    configurations = {"*", "rk4", "defaults", "equalities"}

    assert changelog.last == "3.12.0"
    for entry in changelog.entries:
        for pattern in entry.shows:
            test, configuration, *_ = pattern.split("/")
            assert test == "*" or test in CATALOGUE, pattern
            assert configuration in configurations, pattern


def test_the_page_of_mujoco_answers_every_entry_of_its_changelog() -> None:
    """The page is made from recorded runs; what it says of the changelog is about the one beside it."""
    docs = ROOT / "docs"
    page = (docs / "mujoco-releases.md").read_text(encoding="utf-8")

    told = re.findall(r"^- (\S+), item (\d+): (.+?)\.(?: Seen in|$)", page, re.MULTILINE)
    asked = read_changelog(docs / "mujoco-changelog.toml").entries
    assert sorted(told) == sorted((entry.release, str(entry.item), entry.says) for entry in asked)
