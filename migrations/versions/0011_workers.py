"""A run whose values were measured by an executor says on which machines."""

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None

COMMENT = "JSON list: machines of an executor and their pieces; empty: this one's own"


def upgrade() -> None:
    op.add_column("run", sa.Column("workers", sa.Text(), nullable=True, comment=COMMENT))
    op.execute(sa.update(sa.table("run", sa.column("workers", sa.Text()))).values(workers=""))
    with op.batch_alter_table("run") as batch:
        batch.alter_column("workers", existing_type=sa.Text(), nullable=False, existing_comment=COMMENT)


def downgrade() -> None:
    op.drop_column("run", "workers")
