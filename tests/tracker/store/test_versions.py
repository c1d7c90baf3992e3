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
    return [
        RunInfo(
            id=f"{number:08x}-0000-7000-8000-000000000000",
            started="",
            finished="",
            trigger="test",
            engine=version,
            machine=machine(),
            tracker_version="",
            ci_address="",
            key=number,
            started_at=datetime(2026, 11, 21, tzinfo=UTC) + timedelta(days=number),
            gates=int(version.name not in SHOWN),
            gates_passed=int(version.name not in SHOWN),
        )
        for number, version in enumerate(versions, start=1)
    ]


def found(runs: Sequence[RunInfo], name: str, **commits: str) -> RunInfo:
    """What `name` stands for where git knows `commits` by name."""
    return resolve(runs, name, commits.get)


@pytest.fixture
def three() -> list[RunInfo]:
    return runs_of(commit(A), commit(B), commit(C))


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("latest", C), ("previous", B), ("last-green", C),
        ("1.0.dev2", B), ("1a1a", A), (A, A), ("2B2B2B", B),
        ("spook@1.0.dev1", A), ("spook@latest", C),
    ],
)  # fmt: skip
def test_names_of_a_version(three, name, expected):
    assert found(three, name).engine.git_hash == expected


def test_a_run_is_named_by_its_id_or_the_start_of_it(three):
    first = three[0]

    assert found(three, first.id) == first
    assert found(three, first.id[:12]) == first


@pytest.mark.parametrize(
    "name", ["nothing", "", "1a", "--help", "a\0b", "deadbeef", "unreal@latest", "💥" * 500]
)
def test_an_unknown_name_says_so_and_names_what_there_is(three, name):
    with pytest.raises(UnknownName, match=r"no run of a(n engine| version)") as caught:
        found(three, name)

    assert caught.value.exit_code == 2
    assert caught.value.near
    assert len(str(caught.value)) < 300


def test_a_typing_error_is_answered_with_the_version_meant(three):
    with pytest.raises(UnknownName, match=r"did you mean 1\.0\.dev"):
        found(three, "1.0.dev9")


def test_an_ambiguous_hash_is_refused():
    runs = runs_of(commit("abcd1" + "0" * 35), commit("abcd2" + "0" * 35))

    with pytest.raises(UnknownName, match="could be abcd10000000, abcd20000000"):
        found(runs, "abcd")


def test_our_own_engine_is_meant_unless_another_is_named():
    runs = runs_of(
        commit(A, version="3.0"),
        commit("", name="mujoco", version="3.0"),
        commit("", name="rapier", version="0.3"),
    )

    assert found(runs, "latest").engine.name == "spook"
    assert found(runs, "3.0").engine.name == "spook"
    assert found(runs, "mujoco@3.0").engine.name == "mujoco"
    assert found(runs, "0.3").engine.name == "rapier"


def test_an_engine_that_is_only_shown_never_takes_our_place() -> None:
    """Asked after the night, without gates: commands and website still tell of the engine that has them."""
    ours, theirs, imported = runs_of(
        commit(A, name="pebble"), commit("", name="mujoco"), commit(B, name="bullet")
    )
    runs = [
        replace(ours, gates=3),
        replace(theirs, gates=0),
        replace(imported, gates=5, trigger="import"),
    ]

    assert found(runs, "latest").engine.name == "pebble"
    assert [line[0].engine.name for line in lines(runs)] == ["pebble", "mujoco", "bullet"]
    assert found(runs[1:], "latest").engine.name == "mujoco", "where none has gates, the newest"
    assert found([replace(runs[1], gates=1), *runs[:1]], "latest").engine.name == "mujoco", (
        "gating, and newer"
    )


def test_the_newest_version_that_a_refusal_names_is_the_latest():
    """Runs of local changes stand behind those of commits, however old they are."""
    dirty, clean = runs_of(commit(A, dirty=True), commit(B))

    with pytest.raises(UnknownName, match=r"'v9'; the newest is 1\.0\.dev2"):
        found([clean, dirty], "v9")


def test_a_dirty_build_is_the_latest_until_something_else_has_run():
    runs = runs_of(commit(A), commit(A, dirty=True))
    assert found(runs, "latest").engine.dirty
    assert not found(runs, "previous").engine.dirty

    first, dirty, last = runs_of(commit(A), commit(A, dirty=True), commit(B))
    assert found([first, last, dirty], "latest") == last  # dirty builds come last in the commit order
    assert found([first, last, dirty], "previous") == first


def test_an_engine_without_commits_has_a_latest_and_a_previous_run():
    runs = runs_of(*(commit("", name="mujoco", version=version) for version in ("3.1", "3.2", "3.3")))

    assert found(runs, "mujoco@latest").engine.version == "3.3"
    assert found(runs, "mujoco@previous").engine.version == "3.2"


def test_no_runs_at_all_are_explained():
    with pytest.raises(UnknownName, match="no runs are stored yet; record one with: tracker run"):
        found([], "latest")


def test_one_run_has_no_previous_one():
    with pytest.raises(UnknownName, match="there is only one run, and so no previous one"):
        found(runs_of(commit(A)), "previous")


def test_git_is_asked_last(three):
    assert found(three, "release", release=B).engine.git_hash == B
    assert found(three, "1.0.dev1", **{"1.0.dev1": C}).engine.git_hash == A


def test_of_several_runs_of_a_version_the_last_clean_one_is_meant():
    runs = runs_of(commit(A), commit(A), commit(A, dirty=True))

    assert found(runs, A) == runs[1]


def test_words_are_of_one_engine():
    peers = [commit(A, name="zeta"), commit(B, name="alpha"), commit(C, name="zeta")]

    assert found(runs_of(*peers), "previous").engine.git_hash == A
    assert found(runs_of(commit(C), *peers[:2]), "latest").engine.git_hash == C
    with pytest.raises(UnknownName, match="only one run"):
        found(runs_of(commit(C), *peers[:2]), "previous")


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
