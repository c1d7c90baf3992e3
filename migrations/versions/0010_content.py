"""What was measured in a run gets a hash of its own: a run taken out and put back with other bits is told by it."""

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None

COMMENT = "hash of all samples and their definitions; empty for runs recorded before there was one"


def upgrade() -> None:
    op.add_column("run", sa.Column("content", sa.Text(), nullable=True, comment=COMMENT))
    op.execute(sa.update(sa.table("run", sa.column("content", sa.Text()))).values(content=""))
    with op.batch_alter_table("run") as batch:
        batch.alter_column("content", existing_type=sa.Text(), nullable=False, existing_comment=COMMENT)


def downgrade() -> None:
    op.drop_column("run", "content")
