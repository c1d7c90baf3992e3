"""A sample may say that a solve behind its value was left unsettled.

On SQLite this also drops what 0003 leaves behind where reflection sees CHECKs (SQLAlchemy 2.1, Alembic 1.20): the
old constraint on the outcome under a second name, which refused "not_supported".
"""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None

BEFORE = (
    "value", "out_of_limit", "not_finite", "diverged", "timed_out", "crashed", "missing", "not_supported",
)  # fmt: skip
AFTER = ("value", "unsettled", *BEFORE[1:])


def upgrade() -> None:
    _allow(AFTER, BEFORE)


def downgrade() -> None:
    # The nearest class there was before: the value is kept, and still does not pass.
    op.execute("UPDATE sample SET outcome = 'out_of_limit' WHERE outcome = 'unsettled'")
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
    # SQLite changes no constraint in place: the copy is given all CHECKs anew, whatever reflection saw of the old.
    table = sa.Table("sample", sa.MetaData(), autoload_with=op.get_bind())
    for check in [one for one in table.constraints if isinstance(one, sa.CheckConstraint)]:
        table.constraints.remove(check)
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
        "sample",
        copy_from=table,
        recreate="always",
        table_args=checks,
        table_kwargs={"sqlite_with_rowid": False},
    ):
        pass
