"""Reading: runs in the order of commits, names that stand for runs, series over versions."""

from __future__ import annotations

import math
import subprocess

import pytest

from spook_tracker.tracker.judge.judged import BY_TIME, blame
from spook_tracker.tracker.store.ancestry import commit_order, lineages
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.record import record
from tests.histories.documents import KEY, definition, engine, run, run_of, sample

A, B, C, D = ("1a" * 20, "2b" * 20, "3c" * 20, "4d" * 20)


@pytest.fixture
def nowhere(tmp_path):
    """A folder that is no git repository."""
    folder = tmp_path / "nowhere"
    folder.mkdir()
    return folder


def commit(git_hash, *parents, version=None, time="2026-11-20T10:00:00+00:00", **changes):
    version = version or f"1.0.dev{git_hash[0]}"
    return engine(git_hash, parents=parents, version=version, commit_time=time, **changes)


def history_of(session, folder, *engines, **changes) -> History:
    for version in engines:
        record(session, run(engine=version, **changes))
    return History(session, folder)


def hashes(history):
    return [run.engine.git_hash for run in history.runs()]


def test_ancestry_gives_the_order_whatever_was_recorded_first(session, nowhere):
    history = history_of(session, nowhere, commit(C, B), commit(A), commit(B, A))

    assert hashes(history) == [A, B, C]


def test_ancestry_beats_a_clock_that_went_backwards(session, nowhere):
    history = history_of(
        session, nowhere, commit(B, A, time="2020-01-01T00:00:00Z"), commit(A, time="2026-01-01T00:00:00Z")
    )

    assert hashes(history) == [A, B]


def test_commit_time_decides_where_ancestry_is_silent(session, nowhere):
    history = history_of(
        session,
        nowhere,
        commit(B, time="2026-01-02T00:00:00+00:00"),
        commit(A, time="2026-01-02T00:30:00+01:00"),
    )

    assert hashes(history) == [A, B]


def test_dirty_and_unversioned_builds_come_last(session, nowhere):
    history = history_of(
        session, nowhere, commit(A, dirty=True), commit("", version="9"), commit(B, A), commit(A)
    )

    assert hashes(history) == [A, B, A, ""]
    assert [run.ordered for run in history.runs()] == [True, True, False, False]


def test_a_forged_circle_of_parents_does_not_hang(session, nowhere):
    history = history_of(session, nowhere, commit(A, B), commit(B, A))

    assert sorted(hashes(history)) == [A, B]


def test_git_knows_the_order_of_commits_between_which_nothing_ran(session, tmp_path, nowhere):
    repository, (first, _, last) = repository_of_three(tmp_path)
    given = (
        commit(last, "0" * 40, time="2020-01-01T00:00:00Z"),
        commit(first, time="2026-01-01T00:00:00Z"),
    )

    assert hashes(history_of(session, repository, *given)) == [first, last]
    assert hashes(History(session, nowhere)) == [last, first]  # without git, only the clocks speak


def test_blame_says_that_time_alone_orders_commits_of_which_no_ancestry_is_known(session, tmp_path, nowhere):
    repository, (first, _, last) = repository_of_three(tmp_path)
    known = history_of(session, repository, commit(first), commit(last, "0" * 40)).runs()
    unknown = History(session, nowhere).runs()
    every = history_of(session, nowhere, commit(A), commit(B, A), commit(C, B)).runs()
    chain = [run for run in every if run.engine.git_hash in (A, B, C)]

    assert BY_TIME not in blame(known[1], known[0])
    assert blame(unknown[1], unknown[0]).endswith(BY_TIME)
    assert [BY_TIME in blame(chain[2], bad) for bad in chain[:2]] == [False, False]


def test_a_lineage_is_what_parents_or_git_tie_together():
    tied = lineages("abcdxy", {"b": "a", "c": "b", "y": "-"}, known="xd")

    assert len({tied[commit] for commit in "abc"}) == len({tied[commit] for commit in "xd"}) == 1
    assert len(set(tied.values())) == 3  # y is alone: its parent was never measured


def repository_of_three(tmp_path):
    folder = tmp_path / "repository"
    folder.mkdir()
    git = ["git", "-C", str(folder), "-c", "user.name=A", "-c", "user.email=a@example.org"]
    subprocess.run([*git, "init", "-q"], check=True)
    made = []
    for number in range(3):
        subprocess.run([*git, "commit", "-q", "--allow-empty", "-m", str(number)], check=True)
        made.append(subprocess.check_output([*git, "rev-parse", "HEAD"], text=True).strip())
    subprocess.run([*git, "tag", "-a", "v1.0", "-m", "one", made[0]], check=True)
    return folder, made


def test_order_of_a_merge_is_stable():
    order = commit_order("dbca", {"d": "bc", "b": "a", "c": "a"}, age=lambda commit: (commit,))

    assert order == list("abcd")


def test_a_tag_is_named_where_git_knows_it(session, tmp_path):
    repository, (first, _, last) = repository_of_three(tmp_path)
    history = history_of(session, repository, commit(first), commit(last))

    assert history.resolve("v1.0").engine.git_hash == first
    assert history.resolve("HEAD").engine.git_hash == last


def test_the_last_green_run_has_gates_and_all_of_them_passed(session, nowhere):
    record(session, run(engine=commit(A)))
    record(session, run(engine=commit(B, A), samples=(sample(passed=False, outcome="out_of_limit"),)))
    record(session, run(engine=commit(C, B), series=(), samples=()))

    assert History(session, nowhere).resolve("last-green").engine.git_hash == A


def test_what_an_engine_does_not_support_keeps_no_run_from_being_green(session, nowhere):
    lacking = sample("other", math.nan, passed=False, outcome="not_supported")
    whole = (definition(), definition("other"))
    record(session, run(engine=commit(A)))
    record(session, run(engine=commit(B, A), series=whole, samples=(sample(), lacking)))
    record(session, run(engine=commit(C, B), series=whole[1:], samples=(lacking,)))

    assert History(session, nowhere).resolve("last-green").engine.git_hash == B


def test_a_series_over_versions(session, nowhere):
    record(session, run_of({KEY: 2.0, "other": 0.0}, engine=commit(B, A)))
    record(session, run_of({KEY: 1.0}, engine=commit(A)))

    history = History(session, nowhere).series()

    assert list(history) == ["other", KEY]
    assert [point.sample.value for point in history[KEY].points] == [1.0, 2.0]
    assert [point.test_version for point in history[KEY].points] == ["v1", "v1"]


def test_the_definition_of_a_history_is_the_newest(session, nowhere):
    record(session, run(engine=commit(B, A), series=(definition(limit=9.0, test_version="v2"),)))
    record(session, run(engine=commit(A)))

    found = History(session, nowhere).series([KEY])[KEY]

    assert found.definition.limit == 9.0
    assert [point.test_version for point in found.points] == ["v1", "v2"]


def test_only_the_series_asked_for_are_read(session, nowhere):
    record(session, run_of({"a": 1.0, "b": 2.0}))

    assert list(History(session, nowhere).series(["b", "unknown"])) == ["b"]
    assert History(session, nowhere).series([]) == {}


def test_a_renamed_series_goes_on_under_its_new_name(session, nowhere):
    record(session, run_of({"old": 1.0}, engine=commit(A)))
    new = definition("new", aliases=("old", "older"))
    record(session, run(engine=commit(B, A), series=(new,), samples=(sample("new", 2.0),)))

    history = History(session, nowhere)

    assert [point.sample.value for point in history.series(["new"])["new"].points] == [1.0, 2.0]
    assert history.series(["old"]) == history.series(["new"]) == history.series()
    assert list(history.samples(history.runs()[0].id)) == ["new"]
    assert history.document(history.runs()[0].id).series[0].key == "old"


def test_a_renaming_twice_and_in_a_circle_ends(session, nowhere):
    for key, aliases in (("a", ("c",)), ("b", ("a",)), ("c", ("b",))):
        record(session, run(series=(definition(key, aliases=aliases),), samples=(sample(key),)))

    assert sum(len(found.points) for found in History(session, nowhere).series().values()) == 3


def test_history_without_evidence_has_the_same_values(session, nowhere):
    record(session, run_of({KEY: "nan", "other": -0.0}))

    full = History(session, nowhere).series()
    bare = History(session, nowhere).series(evidence=False)

    assert [h.points[0].sample.value for h in full.values()] == [
        h.points[0].sample.value for h in bare.values()
    ]
    assert full[KEY].points[0].sample.counters
    assert not bare[KEY].points[0].sample.counters


def test_samples_of_some_tests_over_some_runs_are_those_of_each_run(session, nowhere):
    record(session, run_of({"t/a": 1.0, "u/a": 2.0}, engine=commit(A)))
    record(session, run_of({"t/a": 3.0, "t/b": 4.0, "u/a": "nan"}, engine=commit(B, A)))
    history = History(session, nowhere)
    ids = [found.id for found in history.runs()]

    some = history.samples_of(ids, {"t"})

    for run_id in ids:
        whole = history.samples(run_id)
        assert some[run_id] == {key: pair for key, pair in whole.items() if key.startswith("t/")}
        assert history.samples_of([run_id])[run_id] == whole
        assert history.answered(ids)[run_id] == {(d.test, d.kind) for d, _ in whole.values()} != set()
