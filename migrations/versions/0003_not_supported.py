"""A sample may say that the engine cannot be asked this question."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None

BEFORE = ("value", "out_of_limit", "not_finite", "diverged", "timed_out", "crashed", "missing")
AFTER = (*BEFORE, "not_supported")


def upgrade() -> None:
    _allow(AFTER, BEFORE)


def downgrade() -> None:
    op.execute("DELETE FROM sample WHERE outcome = 'not_supported'")
    _allow(BEFORE, AFTER)


def _outcome(words: tuple[str, ...]) -> str:
    return "outcome IN (" + ", ".join(f"'{word}'" for word in words) + ")"


def _comment(words: tuple[str, ...]) -> str:
    return f"class: {', '.join(words)}"


def _allow(words: tuple[str, ...], before: tuple[str, ...]) -> None:
    if op.get_bind().dialect.name != "sqlite":
        op.drop_constraint("ck_sample_outcome", "sample", type_="check")
        op.create_check_constraint("ck_sample_outcome", "sample", sa.text(_outcome(words)))
        op.alter_column(
            "sample",
            "outcome",
            existing_type=sa.Text(),
            existing_nullable=False,
            comment=_comment(words),
            existing_comment=_comment(before),
        )
        return
    # SQLite changes no constraint in place, and reflection does not see CHECKs: the copy is given them all.
    checks = (
        sa.CheckConstraint(
            "(value IS NULL) = (coalesce(special, '') IN ('nan', 'inf', '-inf'))", name="ck_sample_value"
        ),
        sa.CheckConstraint(_outcome(words), name="ck_sample_outcome"),
        sa.CheckConstraint(
            "special IS NULL OR special IN ('nan', 'inf', '-inf', '-0.0')", name="ck_sample_special"
        ),
    )
    with op.batch_alter_table(
        "sample", recreate="always", table_args=checks, table_kwargs={"sqlite_with_rowid": False}
    ):
        pass
