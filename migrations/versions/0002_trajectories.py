"""The motion of a scene in one run, for the replay."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "trajectory",
        sa.Column(
            "started_at",
            sa.DateTime(timezone=True),
            nullable=False,
            comment="start of the run, UTC; leads the key",
        ),
        sa.Column("run_key", sa.BigInteger(), nullable=False, comment="the run"),
        sa.Column("position", sa.BigInteger(), nullable=False, comment="place in the document, from 0"),
        sa.Column("test", sa.Text(), nullable=False, comment="scalar test"),
        sa.Column("name", sa.Text(), nullable=False, comment="slug of the trajectory"),
        sa.Column("body", sa.LargeBinary(), nullable=False, comment="zlib of the JSON of the trajectory"),
        sa.ForeignKeyConstraint(["run_key"], ["run.key"], name="fk_trajectory_run_key"),
        sa.PrimaryKeyConstraint("started_at", "run_key", "position", name="pk_trajectory"),
        comment="the motion of a scene in one run, for the replay",
    )


def downgrade() -> None:
    op.drop_table("trajectory")
