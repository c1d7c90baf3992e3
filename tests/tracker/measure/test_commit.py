"""A run says whose commit it measured and what the commit's first line says, as far as a repository knows."""

import subprocess
from types import SimpleNamespace

import msgspec
import pytest

from spook_tracker.engine.build_info import BuildInfo
from spook_tracker.tracker.document.run_document import EngineVersion
from spook_tracker.tracker.measure.cards import engine_version
from spook_tracker.tracker.measure.commit import subject_and_author
from spook_tracker.tracker.store.rows import engine_of, engine_row
from tests.histories.synthetic import engine

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


@pytest.mark.parametrize(
    "version, edited", [("0.1.dev7+g0123", "0.1.dev7+g0123.dirty"), ("1.4", "1.4+dirty")]
)
def test_a_tree_edited_after_the_build_is_not_recorded_as_the_commit_that_was_built(
    repository, version, edited
):
    folder, _ = repository
    module = folder / "engine" / "scene.py"
    module.parent.mkdir()
    module.write_text("gravity = 9.82")

    def git(*arguments):
        who = ("-c", "user.name=a", "-c", "user.email=a@example.org")
        told = subprocess.run(
            ["git", *who, "-C", folder, *arguments], check=True, capture_output=True, text=True
        )
        return told.stdout.strip()

    git("add", ".")
    git("commit", "-qm", "Built here")
    built = BuildInfo("spook", version, git("rev-parse", "HEAD"), False, "", (), "", "")
    package = SimpleNamespace(build_info=built, __path__=[str(module.parent)])

    def recorded():
        found = engine_version(package)
        return found.version, found.dirty

    (folder / "README").write_text("elsewhere")
    git("add", ".")
    git("commit", "-qm", "Another commit, the same engine")
    assert recorded() == (version, False)

    module.write_text("gravity = 9.81")
    assert recorded() == (edited, True)
    git("commit", "-qam", "Committed, and not built")
    assert recorded() == (edited, True)


def test_both_are_stored_and_a_build_without_them_keeps_the_identity_it_had():
    bare = msgspec.structs.replace(engine(3), commit_time="2026-10-03T22:17:00+00:00")
    told = EngineVersion(
        **{f: getattr(bare, f) for f in bare.__struct_fields__} | {"subject": SUBJECT, "author": "Em"}
    )

    assert engine_of(engine_row(told)) == told
    assert engine_row(bare)["id"] != engine_row(told)["id"]
    assert engine_row(bare)["id"] == 2568089939234907106 >> 10
