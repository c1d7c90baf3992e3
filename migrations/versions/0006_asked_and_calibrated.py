"""A run stores what it was asked for; a timing stores processor time and what the calibration kernel took.

Of runs recorded before neither is known: what they were asked for is told from what they answered.
"""

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None

COLUMNS = {
    "run": {"asked": "JSON of the tests and families asked for; empty if unknown"},
    "timing": {
        "cpu_seconds": "JSON list: processor time of each repeat, s; empty if not taken",
        "calibration": "JSON list: seconds of the calibration kernel beside each repeat; empty if not taken",
    },
}
STORAGE = {"run": {}, "timing": {"sqlite_with_rowid": False}}


def upgrade() -> None:
    for table, columns in COLUMNS.items():
        for name, comment in columns.items():
            op.add_column(table, sa.Column(name, sa.Text(), nullable=True, comment=comment))
        stored = sa.table(table, *(sa.column(name, sa.Text()) for name in columns))
        op.execute(sa.update(stored).values(dict.fromkeys(columns, "")))
        with op.batch_alter_table(table, table_kwargs=STORAGE[table]) as batch:
            for name, comment in columns.items():
                batch.alter_column(name, existing_type=sa.Text(), nullable=False, existing_comment=comment)


def downgrade() -> None:
    for table, columns in COLUMNS.items():
        for name in columns:
            op.drop_column(table, name)
