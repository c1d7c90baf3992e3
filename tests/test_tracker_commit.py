"""A run says whose commit it measured and what the commit's first line says, as far as a repository knows."""

import subprocess

import pytest

from spook_tracker.tracker.document.run_document import EngineVersion
from spook_tracker.tracker.measure.commit import subject_and_author
from spook_tracker.tracker.store.rows import engine_of, engine_row
from tests.synthetic_history import engine

SUBJECT = "Fold <b>two</b> rods; $(rm -rf /) ‮ 🚀"


@pytest.fixture
def repository(tmp_path):
    def git(*arguments):
        who = ("-c", 'user.name=Émilie "Em" O\'Neil', "-c", "user.email=e@example.org")
        told = subprocess.run(
            ["git", *who, "-C", tmp_path, *arguments], capture_output=True, text=True, check=True
        )
        return told.stdout.strip()

    git("init", "-q")
    git("commit", "-q", "--allow-empty", "-m", f"{SUBJECT}\n\nA body that is left out.")
    return tmp_path, git("rev-parse", "HEAD")


def test_subject_and_author_come_from_the_repository_that_knows_the_commit(repository, tmp_path_factory):
    folder, commit = repository
    nowhere = tmp_path_factory.mktemp("nowhere")

    assert subject_and_author(commit, [nowhere / "gone", nowhere, folder]) == (SUBJECT, 'Émilie "Em" O\'Neil')


@pytest.mark.parametrize("name", ["", "HEAD", "--output=x", "0" * 40])
def test_what_is_no_known_commit_has_neither(repository, name):
    assert subject_and_author(name, [repository[0]]) == ("", "")


def test_both_are_stored_and_a_build_without_them_keeps_the_identity_it_had():
    bare = engine(3)
    told = EngineVersion(
        **{f: getattr(bare, f) for f in bare.__struct_fields__} | {"subject": SUBJECT, "author": "Em"}
    )

    assert engine_of(engine_row(told)) == told
    assert engine_row(bare)["id"] != engine_row(told)["id"]
    assert engine_row(bare)["id"] == 2568089939234907106
