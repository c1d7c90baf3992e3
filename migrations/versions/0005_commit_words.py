"""A commit is shown with its subject and its author; of runs recorded before both are unknown."""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

COLUMNS = {
    "subject": "first line of the commit's message; empty if unknown",
    "author": "author of the commit; empty if unknown",
}


def upgrade() -> None:
    for name, comment in COLUMNS.items():
        op.add_column("engine_version", sa.Column(name, sa.Text(), nullable=True, comment=comment))
    table = sa.table("engine_version", *(sa.column(name, sa.Text()) for name in COLUMNS))
    op.execute(sa.update(table).values(dict.fromkeys(COLUMNS, "")))
    with op.batch_alter_table("engine_version") as batch:
        for name, comment in COLUMNS.items():
            batch.alter_column(name, existing_type=sa.Text(), nullable=False, existing_comment=comment)


def downgrade() -> None:
    for name in COLUMNS:
        op.drop_column("engine_version", name)
