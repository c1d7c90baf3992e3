"""A run that was interrupted says so; every run recorded before was whole."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None


COMMENT = "interrupted: only what was finished by then"


def upgrade() -> None:
    op.add_column("run", sa.Column("partial", sa.Boolean(), nullable=True, comment=COMMENT))
    op.execute(sa.update(sa.table("run", sa.column("partial", sa.Boolean()))).values(partial=sa.false()))
    with op.batch_alter_table("run") as batch:
        batch.alter_column("partial", existing_type=sa.Boolean(), nullable=False, existing_comment=COMMENT)


def downgrade() -> None:
    op.drop_column("run", "partial")
