"""A password is never printed and never becomes the name of a file, in whatever form a database is named."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.errors import DatabaseError
from spook_tracker.tracker.store.connection import database_url, shown

SECRET = "s3cr3t"
REFUSED = [
    f"host=localhost password={SECRET} dbname=nights",
    f"dbname=nights user=u password = {SECRET}",
    f"Server=localhost;Database=nights;Password={SECRET}",
    f"Data Source=nights;uid=u;pwd={SECRET}",
    f"service=x passfile={SECRET}",
    f"PGPASSWORD={SECRET} psql nights",
    f"psql --password {SECRET} nights",
    f"{{'host': 'localhost', 'password': '{SECRET}'}}",
    f"localhost:5432:nights:u:{SECRET}",
    f"u%3A{SECRET}%40localhost/nights",
    f"password%3D{SECRET} host%3Dlocalhost",
    f"u/{SECRET}@localhost:5432/nights",
    f"postgresql:/u:{SECRET}@localhost/nights",
    f"postgresql:u:{SECRET}@localhost/nights",
    f"postgres:{SECRET}@localhost",
    f"u:{SECRET}@localhost:5432/nights",
    f"sqlite:///u:{SECRET}@localhost/nights",
    f"sqlite:///host=localhost password={SECRET}",
    f"sqlite://u:{SECRET}@localhost/nights",
    f"postgres://u:{SECRET}@localhost/nights",
    f"mysql://u:{SECRET}@localhost/nights",
    f"postgresql://u:{SECRET}@{SECRET}@localhost/nights",
    f"postgresql://localhost/dbname=nights password={SECRET}",
]
SHOWN = [
    f"postgresql://u:12/{SECRET}@localhost/nights",
    f"postgresql://u:5?{SECRET}@localhost/nights",
    f"postgresql://u:5?x={SECRET}@localhost/nights",
    f"postgresql://u:{SECRET}/5@localhost/nights",
    f"postgresql://u:{SECRET}@localhost:5432/nights",
    f"postgresql://u@localhost/nights?password={SECRET}",
    f"postgresql://u@localhost/nights?PASSWORD={SECRET}",
    f"postgresql://u@localhost/nights?options=-c%20x.password%3D{SECRET}",
    f"postgresql://localhost/nights?sslpassword={SECRET}&passfile={SECRET}",
]


@pytest.mark.parametrize("url", REFUSED)
def test_what_is_no_url_is_refused_unrepeated_and_makes_no_file(
    url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)

    done = CliRunner().invoke(main, ["db", "upgrade", "--db", url], prog_name="tracker")

    assert done.exit_code == 2
    assert SECRET not in done.output
    assert not list(tmp_path.iterdir())
    with pytest.raises(DatabaseError):
        database_url(url)


@pytest.mark.parametrize("url", SHOWN)
def test_of_a_database_only_its_place_is_shown(url: str) -> None:
    printed = shown(database_url(url))

    assert SECRET not in printed
    assert printed.startswith("postgresql://localhost")
    assert printed.endswith("/nights")


@pytest.mark.parametrize(
    "name", ["passwords.db", "my passages.db", "a:b.db", "nights@desk.db", "pg 16/user.db"]
)
def test_a_name_that_only_sounds_like_it_is_a_file(name: str) -> None:
    assert shown(database_url(name)) == name


def test_a_file_that_is_there_is_that_file_whatever_its_name(tmp_path: Path) -> None:
    odd = tmp_path / "host=a b@c.db"
    odd.touch()

    assert database_url(str(odd)).database == str(odd)
    assert database_url("runs/year=2026/nights.db").database == "runs/year=2026/nights.db"
