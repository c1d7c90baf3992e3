"""A definition says whose its limit and its set point are: physical, or the method's own."""

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None

COMMENTS = {
    "limit_kind": "of the limit: physical, or the method's own",
    "set_point_kind": "of the set point: physical, or the method's own",
}


def upgrade() -> None:
    for name, comment in COMMENTS.items():
        op.add_column("definition", sa.Column(name, sa.Text(), nullable=True, comment=comment))
        op.execute(sa.update(sa.table("definition", sa.column(name, sa.Text()))).values({name: "method"}))
    with op.batch_alter_table("definition") as batch:
        for name, comment in COMMENTS.items():
            batch.alter_column(name, existing_type=sa.Text(), nullable=False, existing_comment=comment)


def downgrade() -> None:
    for name in COMMENTS:
        op.drop_column("definition", name)
