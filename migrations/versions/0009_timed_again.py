"""A run time that seemed slower is taken once more the same night; what came of it is stored beside it."""

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None

COMMENT = "JSON object: the same timed once more that night; empty if it was not"


def upgrade() -> None:
    op.add_column("timing", sa.Column("again", sa.Text(), nullable=True, comment=COMMENT))
    op.execute(sa.update(sa.table("timing", sa.column("again", sa.Text()))).values(again=""))
    with op.batch_alter_table("timing", table_kwargs={"sqlite_with_rowid": False}) as batch:
        batch.alter_column("again", existing_type=sa.Text(), nullable=False, existing_comment=COMMENT)


def downgrade() -> None:
    op.drop_column("timing", "again")
