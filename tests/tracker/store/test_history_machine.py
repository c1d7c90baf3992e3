"""Any sequence of recording, exporting, importing, copying, upgrading and dropping figures keeps what a
dictionary keeps.
"""

from __future__ import annotations

import shutil
import tempfile
from contextlib import ExitStack
from pathlib import Path

import msgspec
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)
from sqlalchemy.orm import Session

from spook_tracker.tracker.document.json_form import Number
from spook_tracker.tracker.store.database import open_database, upgrade
from spook_tracker.tracker.store.database_check import check
from spook_tracker.tracker.store.database_copy import copy_database
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.record import record
from spook_tracker.tracker.store.retention import drop_old_figures
from spook_tracker.tracker.store.revisions import revert
from spook_tracker.tracker.store.transfer import export_runs, import_files
from tests.histories.documents import engine, run_of

COMMITS = [f"{number:x}" * 40 for number in range(1, 7)]  # each the parent of the next
KEYS = ["a", "b", "c"]


class Storage(RuleBasedStateMachine):
    """The database beside a dictionary of run id → document."""

    def __init__(self, template, server=None, server_template="") -> None:
        """`server` makes databases of PostgreSQL, every other one that is moved into; without one all are files. New
        ones are copies of the templates: migrating is what upgrading asks."""
        super().__init__()
        self.folder, self.template, self.server_template = Path(tempfile.mkdtemp()), template, server_template
        self.server, self.databases = server, ExitStack()
        self.copies = 0
        self.expected = {}
        self.open(self.new())

    def new(self):
        """The URL of an empty database."""
        if self.server is not None and self.copies % 2 == 0:
            return self.databases.enter_context(self.server.new_database(copied=self.server_template))
        file = self.folder / f"{self.copies}.db"
        return f"sqlite:///{shutil.copyfile(self.template, file)}"

    def open(self, url):
        self.url = url
        self.engine = open_database(url)
        self.session = Session(self.engine)

    def close(self):
        self.session.close()
        self.engine.dispose()

    def teardown(self):
        self.session.close()
        faults = check(self.engine)
        self.close()
        self.databases.close()
        shutil.rmtree(self.folder)
        assert faults == ()

    def history(self):
        return History(self.session, self.folder)

    @rule(
        commit=st.sampled_from(range(len(COMMITS))),
        values=st.dictionaries(st.sampled_from(KEYS), st.floats().map(Number), min_size=1),
        dirty=st.booleans(),
    )
    def records_a_run(self, commit, values, dirty):
        parents = (COMMITS[commit - 1],) if commit else ()
        time = f"2026-01-{commit + 1:02}T00:00:00Z"
        given = run_of(values, engine=engine(COMMITS[commit], parents=parents, dirty=dirty, commit_time=time))
        assert record(self.session, given)
        self.expected[given.id] = given

    @precondition(lambda self: self.expected)
    @rule(number=st.integers(0, 1000))
    def records_a_run_again(self, number):
        again = list(self.expected.values())[number % len(self.expected)]
        assert not record(self.session, again)

    @precondition(lambda self: self.expected)
    @rule()
    def moves_by_files(self):
        files = export_runs(self.history(), self.folder / f"files {self.copies}")
        self.close()
        self.copies += 1
        self.open(self.new())
        assert len(import_files(self.session, reversed(files)).stored) == len(self.expected)

    @rule()
    def moves_by_copy(self):
        self.close()
        self.copies += 1
        target = self.new()
        copy_database(self.url, target)
        self.open(target)

    @precondition(lambda self: self.expected)
    @rule()
    def drops_old_figures(self):
        drop_old_figures(self.session, self.history())
        for run_id in self.expected:
            stored = self.history().document(run_id)
            kept = msgspec.structs.replace(
                self.expected[run_id],
                figures=stored.figures,
                maps=stored.maps,
                trajectories=stored.trajectories,
            )
            assert stored == kept
            assert set(stored.figures) <= set(self.expected[run_id].figures)
            self.expected[run_id] = kept
        assert any(run.figures for run in self.expected.values())

    @precondition(lambda self: not self.expected)
    @rule()
    def goes_all_the_way_down_and_up(self):
        self.session.rollback()
        with self.engine.begin() as connection:
            revert(connection, "base")
        upgrade(self.engine)

    @precondition(lambda self: self.expected)
    @rule(revision=st.sampled_from(["0008", "0007"]))
    def goes_down_and_up_with_its_runs(self, revision):
        """Over the revision that moves every id, and over those above it."""
        self.session.rollback()
        with self.engine.begin() as connection:
            revert(connection, revision)
        upgrade(self.engine, keep_copy=False)

    @invariant()
    def holds_what_was_given(self):
        history = self.history()
        assert {run.id: history.document(run.id) for run in history.runs()} == self.expected
        self.session.rollback()

    @invariant()
    def keeps_commits_in_order(self):
        hashes = [run.engine.git_hash for run in self.history().runs() if run.ordered]
        assert hashes == sorted(hashes)
        self.session.rollback()


SETTINGS = settings(
    max_examples=6, stateful_step_count=6, deadline=None, suppress_health_check=list(HealthCheck)
)


def test_storage_keeps_what_a_dictionary_keeps_in_files(sqlite_template):
    run_state_machine_as_test(lambda: Storage(sqlite_template), settings=SETTINGS)


def test_storage_keeps_what_a_dictionary_keeps_on_a_server_and_between_both(
    sqlite_template, postgresql_server, postgresql_template
):
    few = settings(SETTINGS, max_examples=3)
    templates = (sqlite_template, postgresql_server, postgresql_template)
    run_state_machine_as_test(lambda: Storage(*templates), settings=few)
