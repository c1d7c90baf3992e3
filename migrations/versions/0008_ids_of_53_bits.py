"""Ids of 53 bits: JSON readers, spreadsheets and JavaScript hold larger whole numbers only as rounded ones.

An id is the start of a hash of its content, so the new ones are the first 53 of the old 63 bits; only the id of a
series list hangs on the ids in the list and is made anew. Every id in every table moves; going down, the ids are
made again from the content. The functions here are frozen: what they compute is what those trackers computed.
"""

import hashlib
import json
from collections.abc import Iterator
from contextlib import contextmanager

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None

SHIFT = 10  # bits that go
IDS = {  # table: columns that hold ids, and of what
    "engine_version": {"id": "engine"},
    "machine": {"id": "machine"},
    "test_cards": {"id": "cards"},
    "series": {"id": "series"},
    "series_alias": {"series_id": "series"},
    "definition": {"id": "definition", "series_id": "series"},
    "series_list": {"id": "list"},
    "series_list_item": {"list_id": "list", "definition_id": "definition"},
    "run": {
        "key": "run", "engine_version_id": "engine", "machine_id": "machine", "test_cards_id": "cards",
        "series_list_id": "list",
    },
    "sample": {"run_key": "run", "series_id": "series", "definition_id": "definition"},
    "evidence": {"run_key": "run", "series_id": "series"},
    "timing": {"run_key": "run", "series_id": "series"},
    "figure": {"run_key": "run"},
    "stability_map": {"run_key": "run"},
    "trajectory": {"run_key": "run"},
}  # fmt: skip
ENGINE = (
    "name", "version", "git_hash", "dirty", "commit_time", "parents", "compiler", "flags", "subject", "author",
)  # fmt: skip
MACHINE = ("fingerprint", "processor", "cores", "operating_system", "float_environment")


def upgrade() -> None:
    with _references_set_aside():
        for table, columns in IDS.items():
            moves = [f'"{name}" = "{name}" >> {SHIFT}' for name, kind in columns.items() if kind != "list"]
            if moves:
                op.execute(f'UPDATE "{table}" SET {", ".join(moves)}')
        _move("list", dict(_lists(53)))


def downgrade() -> None:
    with _references_set_aside():
        for kind, contents in (
            ("engine", _engines()), ("machine", _machines()), ("cards", _rows("test_cards", "id", "body")),
            ("series", _rows("series", "id", "key")), ("definition", _rows("definition", "id", "body")),
            ("run", _rows("run", "key", "id")),
        ):  # fmt: skip
            _move(kind, {now: _identity(kind, content, 63) for now, content in contents})
        _move("list", dict(_lists(63)))


def _identity(kind: str, content: str, bits: int) -> int:
    digest = hashlib.sha256(f"{kind}\0{content}".encode()).digest()
    return int.from_bytes(digest[:8], "big") >> (64 - bits)


def _rows(table: str, number: str, content: str) -> list[tuple[int, str]]:
    found = op.get_bind().execute(sa.text(f'SELECT "{number}", "{content}" FROM "{table}"'))
    return [(row[0], row[1]) for row in found]


def _compact(parts: object) -> str:
    return json.dumps(parts, ensure_ascii=False, separators=(",", ":"))


def _engines() -> Iterator[tuple[int, str]]:
    columns = ", ".join(f'"{name}"' for name in ("id", *ENGINE))
    for number, *values in op.get_bind().execute(sa.text(f"SELECT {columns} FROM engine_version")).all():
        told = dict(zip(ENGINE, values, strict=True))
        told |= {"dirty": bool(told["dirty"]), "parents": json.loads(told["parents"])}
        kept = {name: value for name, value in told.items() if value or name not in ("subject", "author")}
        yield number, _compact(kept)


def _machines() -> Iterator[tuple[int, str]]:
    columns = ", ".join(f'"{name}"' for name in ("id", *MACHINE))
    for number, *values in op.get_bind().execute(sa.text(f"SELECT {columns} FROM machine")).all():
        yield number, _compact(dict(zip(MACHINE, values, strict=True)))


def _lists(bits: int) -> Iterator[tuple[int, int]]:
    """Id of each series list now, and the one that its definitions' ids give."""
    lists: dict[int, list[int]] = {number: [] for number, _ in _rows("series_list", "id", "length")}
    query = sa.text("SELECT list_id, definition_id FROM series_list_item ORDER BY list_id, position")
    for number, definition in op.get_bind().execute(query):
        lists[number].append(definition)
    for number, definitions in lists.items():
        yield number, _identity("series list", _compact(definitions), bits)


def _move(kind: str, moves: dict[int, int]) -> None:
    """Give every id of a kind its new number, wherever it stands."""
    if not moves:
        return
    connection = op.get_bind()
    connection.execute(sa.text("CREATE TEMPORARY TABLE moved (was BIGINT PRIMARY KEY, now BIGINT)"))
    rows = [{"was": was, "now": now} for was, now in moves.items()]
    connection.execute(sa.text("INSERT INTO moved VALUES (:was, :now)"), rows)
    for table, columns in IDS.items():
        for name, held in columns.items():
            if held == kind:
                new = f'SELECT now FROM moved WHERE was = "{table}"."{name}"'
                connection.execute(sa.text(f'UPDATE "{table}" SET "{name}" = ({new})'))
    connection.execute(sa.text("DROP TABLE moved"))


@contextmanager
def _references_set_aside() -> Iterator[None]:
    """References hold again at the end: SQLite looks at the commit, PostgreSQL makes them anew, which looks, too."""
    connection = op.get_bind()
    if connection.dialect.name == "sqlite":
        connection.execute(sa.text("PRAGMA defer_foreign_keys = ON"))
        yield
        return
    inspector = sa.inspect(connection)
    found = [(table, key) for table in IDS for key in inspector.get_foreign_keys(table)]
    for table, key in found:
        op.drop_constraint(str(key["name"]), table, type_="foreignkey")
    yield
    for table, key in found:
        op.create_foreign_key(
            key["name"], table, key["referred_table"], key["constrained_columns"], key["referred_columns"]
        )
