"""Names that stand for runs, and what is said about a name that stands for none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from spook_tracker.tracker.document.errors import UnknownName
from spook_tracker.tracker.judge.lane import lines
from spook_tracker.tracker.store.versions import RunInfo, resolve
from tests.histories.documents import engine, machine

SHOWN = ("mujoco", "rapier", "zeta", "alpha")  # engines without gates of their own
A, B, C = "1a" * 20, "2b" * 20, "3c" * 20


def commit(git_hash, **changes):
    return engine(git_hash, **{"version": f"1.0.dev{git_hash[:1]}"} | changes)


def runs_of(*versions) -> list[RunInfo]:
    """A run of each version, in this order in time and in the order of commits."""
    gates = [int(version.name not in SHOWN) for version in versions]
    return [
        RunInfo(
            id=f"{number:08x}-0000-7000-8000-000000000000", started="", finished="", trigger="test", engine=version,
            machine=machine(), tracker_version="", ci_address="", key=number, gates=asked, gates_passed=asked,
            started_at=datetime(2026, 11, 21, tzinfo=UTC) + timedelta(days=number),
        )
        for number, (version, asked) in enumerate(zip(versions, gates, strict=True), start=1)
    ]  # fmt: skip


def found(runs: Sequence[RunInfo], name: str, **commits: str) -> RunInfo:
    """What `name` stands for where git knows `commits` by name."""
    return resolve(runs, name, commits.get)


def other(name: str, version: str = "3.0", git_hash: str = ""):
    return commit(git_hash, name=name, version=version)


THREE = commit(A), commit(B), commit(C)
DIRTY, ONLY, PEERS = (
    commit(A, dirty=True),
    commit(A),
    [other("zeta", "1", A), other("alpha", "1", B), other("zeta", "1", C)],
)
MIXED = other("spook", git_hash=A), other("mujoco"), other("rapier", "0.3")
STANDS_FOR = [  # versions in the order of time, a name, and the place of the one it stands for
    (THREE, "latest", 2), (THREE, "previous", 1), (THREE, "last-green", 2), (THREE, "1.0.dev2", 1), (THREE, "1a1a", 0),
    (THREE, A, 0), (THREE, "2B2B2B", 1), (THREE, "spook@1.0.dev1", 0), (THREE, "spook@latest", 2),
    (THREE, "00000001-0000-7000-8000-000000000000", 0), (THREE, "00000001-000", 0),
    # our own engine, unless another is named; words are of one engine
    (MIXED, "latest", 0), (MIXED, "3.0", 0), (MIXED, "spook@3.0", 0), (MIXED, "mujoco@3.0", 1), (MIXED, "0.3", 2), (PEERS, "previous", 0),
    ([commit(C), *PEERS[:2]], "latest", 0),
    # without commits they follow in time
    ([other("mujoco", v) for v in ("3.1", "3.2", "3.3")], "mujoco@latest", 2),
    ([other("mujoco", v) for v in ("3.1", "3.2", "3.3")], "mujoco@previous", 1),
    # of several runs the last clean one; a build with local changes is the latest until something else has run
    ([ONLY, ONLY, DIRTY], A, 1), ([ONLY, DIRTY], "latest", 1), ([ONLY, DIRTY], "previous", 0),
]  # fmt: skip
STANDS_FOR_NOTHING = [
    *((THREE, name, r"no run of a(n engine| version)") for name in ("nothing", "", "1a", "--help", "a\0b", "deadbeef", "unreal@latest", "💥" * 500, "un" * 200 + "@latest")),
    (THREE, "1.0.dev9", r"did you mean 1\.0\.dev"),
    ([commit("abcd1" + "0" * 35), commit("abcd2" + "0" * 35)], "abcd", "could be abcd10000000, abcd20000000"),
    ([], "latest", "no runs are stored yet; record one with: tracker run"),
    ([ONLY], "previous", "there is only one run, and so no previous one"), ([commit(C), *PEERS[:2]], "previous", "only one run"),
]  # fmt: skip


@pytest.mark.parametrize(("versions", "name", "place"), STANDS_FOR)
def test_a_name_stands_for_a_run(versions, name, place):
    runs = runs_of(*versions)

    assert found(runs, name) == runs[place]


@pytest.mark.parametrize(("versions", "name", "words"), STANDS_FOR_NOTHING)
def test_a_name_of_none_says_so_and_names_what_there_is(versions, name, words):
    with pytest.raises(UnknownName, match=words) as caught:
        found(runs_of(*versions), name)

    assert caught.value.exit_code == 2
    assert len(str(caught.value)) < 300
    assert caught.value.near or "no run of" not in words


def test_runs_of_local_changes_stand_behind_those_of_commits_however_old_they_are():
    dirty, first, last = runs_of(DIRTY, commit(A), commit(B))

    assert found([first, last, dirty], "latest") == last
    assert found([first, last, dirty], "previous") == first
    with pytest.raises(UnknownName, match=r"'v9'; the newest is 1\.0\.dev2"):
        found([last, dirty], "v9")


def test_git_is_asked_last():
    assert found(runs_of(*THREE), "release", release=B).engine.git_hash == B
    assert found(runs_of(*THREE), "1.0.dev1", **{"1.0.dev1": C}).engine.git_hash == A


def test_an_engine_that_is_only_shown_never_takes_our_place() -> None:
    """Asked after the night, without gates: commands and website still tell of the engine that has them."""
    ours, theirs, brought = runs_of(
        commit(A, name="pebble"), commit("", name="mujoco"), commit(B, name="bullet")
    )
    runs = [replace(ours, gates=3), replace(theirs, gates=0), replace(brought, gates=5, trigger="import")]

    assert found(runs, "latest").engine.name == "pebble"
    assert [line[0].engine.name for line in lines(runs)] == ["pebble", "mujoco", "bullet"]
    assert found(runs[1:], "latest").engine.name == "mujoco", "where none has gates, the newest"
    assert found([replace(runs[1], gates=1), *runs[:1]], "latest").engine.name == "mujoco", (
        "gating, and newer"
    )


def test_an_imported_engine_is_not_the_one_a_word_means_while_another_was_measured():
    ours, theirs = runs_of(commit(A, name="ours"), commit(B, name="theirs"))

    assert found([ours, replace(theirs, trigger="import")], "latest").engine.git_hash == A


def test_a_version_as_pages_print_it_is_one_commits_or_refused() -> None:
    """A clone without tags calls its versions 0.1.dev1352+g381feb610, and pages leave out what follows the plus sign."""
    whole = ("0.1.dev7+g1a1a1a1", "0.1.dev8+g2b2b2b2", "0.1.dev8+g3c3c3c3")
    runs = runs_of(*(commit(git_hash, version=name) for git_hash, name in zip((A, B, C), whole, strict=True)))

    assert found(runs, "0.1.dev7").engine.git_hash == A
    with pytest.raises(
        UnknownName, match=r"could be 0\.1\.dev8\+g2b2b2b2, 0\.1\.dev8\+g3c3c3c3; write it whole"
    ):
        found(runs, "0.1.dev8")
