"""The first tables: engine versions, machines, series, runs and what they measured."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "engine_version",
        sa.Column(
            "id", sa.BigInteger(), autoincrement=False, nullable=False, comment="identity of all that follows"
        ),
        sa.Column("name", sa.Text(), nullable=False, comment="engine, such as spook"),
        sa.Column("version", sa.Text(), nullable=False, comment="version as the build says it, from git"),
        sa.Column(
            "git_hash",
            sa.Text(),
            nullable=False,
            comment="full hash of the commit; empty for engines without one",
        ),
        sa.Column(
            "dirty", sa.Boolean(), nullable=False, comment="built from a tree with uncommitted changes"
        ),
        sa.Column("commit_time", sa.Text(), nullable=False, comment="ISO 8601; empty if unknown"),
        sa.Column(
            "parents",
            sa.Text(),
            nullable=False,
            comment="JSON list of the hashes of the parent commits; gives the commit order",
        ),
        sa.Column("compiler", sa.Text(), nullable=False, comment="compiler and its version"),
        sa.Column("flags", sa.Text(), nullable=False, comment="compiler flags"),
        sa.PrimaryKeyConstraint("id", name="pk_engine_version"),
        comment="a build of an engine",
    )
    op.create_index("ix_engine_version_git_hash", "engine_version", ["git_hash"])
    op.create_table(
        "machine",
        sa.Column(
            "id", sa.BigInteger(), autoincrement=False, nullable=False, comment="identity of all that follows"
        ),
        sa.Column(
            "fingerprint", sa.Text(), nullable=False, comment="equal fingerprints: run times may be compared"
        ),
        sa.Column("processor", sa.Text(), nullable=False, comment="processor model"),
        sa.Column("cores", sa.BigInteger(), nullable=False, comment="processor cores usable by the run"),
        sa.Column("operating_system", sa.Text(), nullable=False, comment="operating system and version"),
        sa.Column(
            "float_environment",
            sa.Text(),
            nullable=False,
            comment="hash of the bits of a few library functions",
        ),
        sa.PrimaryKeyConstraint("id", name="pk_machine"),
        comment="a machine in one state of its software",
    )
    op.create_table(
        "series",
        sa.Column("id", sa.BigInteger(), autoincrement=False, nullable=False, comment="identity of key"),
        sa.Column("key", sa.Text(), nullable=False, comment="unique name: test/configuration/metric/h=..."),
        sa.PrimaryKeyConstraint("id", name="pk_series"),
        sa.UniqueConstraint("key", name="uq_series_key"),
        comment="a metric of a test in one configuration",
    )
    op.create_table(
        "series_list",
        sa.Column(
            "id",
            sa.BigInteger(),
            autoincrement=False,
            nullable=False,
            comment="identity of the list of definitions",
        ),
        sa.Column("length", sa.BigInteger(), nullable=False, comment="number of definitions"),
        sa.PrimaryKeyConstraint("id", name="pk_series_list"),
        comment="the definitions of a run, shared by runs with the same ones",
    )
    op.create_table(
        "test_cards",
        sa.Column("id", sa.BigInteger(), autoincrement=False, nullable=False, comment="identity of body"),
        sa.Column(
            "body", sa.Text(), nullable=False, comment="JSON list of test cards, as in the run document"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_test_cards"),
        comment="wording of all tests of a run, shared by runs with the same wording",
    )
    op.create_table(
        "definition",
        sa.Column("id", sa.BigInteger(), autoincrement=False, nullable=False, comment="identity of body"),
        sa.Column("series_id", sa.BigInteger(), nullable=False, comment="the series defined"),
        sa.Column("test", sa.Text(), nullable=False, comment="scalar test"),
        sa.Column("configuration", sa.Text(), nullable=False, comment="configuration of the method"),
        sa.Column("metric", sa.Text(), nullable=False, comment="metric of the test"),
        sa.Column("unit", sa.Text(), nullable=False, comment="unit of the value"),
        sa.Column(
            "role", sa.Text(), nullable=False, comment="gate decides green or red; companion; reported"
        ),
        sa.Column(
            "better", sa.Text(), nullable=False, comment="smaller_magnitude, larger, smaller or inside"
        ),
        sa.Column("kind", sa.Text(), nullable=False, comment="scalar, ladder, order, time or break_point"),
        sa.Column("time_step", sa.Double(), nullable=True, comment="time step, s"),
        sa.Column("limit_low", sa.Double(), nullable=True, comment="lower end of the limit; NULL: none"),
        sa.Column("limit_high", sa.Double(), nullable=True, comment="upper end of the limit; NULL: none"),
        sa.Column(
            "test_version",
            sa.Text(),
            nullable=False,
            comment="hash of the definition: values compare only where it is equal",
        ),
        sa.Column(
            "body", sa.Text(), nullable=False, comment="JSON of the whole definition, as in the run document"
        ),
        sa.ForeignKeyConstraint(["series_id"], ["series.id"], name="fk_definition_series_id"),
        sa.PrimaryKeyConstraint("id", name="pk_definition"),
        comment="a series as defined in one or more runs",
    )
    op.create_index("ix_definition_series_id", "definition", ["series_id"])
    op.create_table(
        "run",
        sa.Column("key", sa.BigInteger(), autoincrement=False, nullable=False, comment="identity of id"),
        sa.Column("id", sa.Text(), nullable=False, comment="UUID made by the application"),
        sa.Column("idempotency_key", sa.Text(), nullable=False, comment="the same run is never stored twice"),
        sa.Column("started_at", sa.DateTime(timezone=True), nullable=False, comment="start, UTC"),
        sa.Column("started", sa.Text(), nullable=False, comment="start as the document words it, ISO 8601"),
        sa.Column("finished", sa.Text(), nullable=False, comment="end as the document words it, ISO 8601"),
        sa.Column("trigger", sa.Text(), nullable=False, comment="manual, nightly, import or test"),
        sa.Column(
            "tracker_version", sa.Text(), nullable=False, comment="version of the tracker that measured"
        ),
        sa.Column("ci_address", sa.Text(), nullable=False, comment="address of the CI job; empty if none"),
        sa.Column("schema_version", sa.BigInteger(), nullable=False, comment="schema of the run document"),
        sa.Column("engine_version_id", sa.BigInteger(), nullable=False, comment="which engine"),
        sa.Column("machine_id", sa.BigInteger(), nullable=False, comment="where"),
        sa.Column("test_cards_id", sa.BigInteger(), nullable=False, comment="wording of the tests"),
        sa.Column("series_list_id", sa.BigInteger(), nullable=False, comment="definitions used"),
        sa.Column("gates", sa.BigInteger(), nullable=False, comment="number of gate samples"),
        sa.Column(
            "gates_passed",
            sa.BigInteger(),
            nullable=False,
            comment="gate samples inside their limit that night",
        ),
        sa.ForeignKeyConstraint(
            ["engine_version_id"], ["engine_version.id"], name="fk_run_engine_version_id"
        ),
        sa.ForeignKeyConstraint(["machine_id"], ["machine.id"], name="fk_run_machine_id"),
        sa.ForeignKeyConstraint(["series_list_id"], ["series_list.id"], name="fk_run_series_list_id"),
        sa.ForeignKeyConstraint(["test_cards_id"], ["test_cards.id"], name="fk_run_test_cards_id"),
        sa.PrimaryKeyConstraint("key", name="pk_run"),
        sa.UniqueConstraint("id", name="uq_run_id"),
        sa.UniqueConstraint("idempotency_key", name="uq_run_idempotency_key"),
        comment="one run of the tests",
    )
    op.create_index("ix_run_engine_version_id", "run", ["engine_version_id"])
    op.create_index("ix_run_started_at", "run", ["started_at"])
    op.create_table(
        "series_alias",
        sa.Column("alias", sa.Text(), nullable=False, comment="earlier key"),
        sa.Column("series_id", sa.BigInteger(), nullable=False, comment="the series it is called today"),
        sa.ForeignKeyConstraint(["series_id"], ["series.id"], name="fk_series_alias_series_id"),
        sa.PrimaryKeyConstraint("alias", "series_id", name="pk_series_alias"),
        comment="earlier names of series",
    )
    op.create_table(
        "evidence",
        sa.Column(
            "started_at",
            sa.DateTime(timezone=True),
            nullable=False,
            comment="start of the run, UTC; leads the key",
        ),
        sa.Column("run_key", sa.BigInteger(), nullable=False, comment="the run"),
        sa.Column("series_id", sa.BigInteger(), nullable=False, comment="the series"),
        sa.Column(
            "failure",
            sa.Text(),
            nullable=False,
            comment="one sentence where there is no value; empty otherwise",
        ),
        sa.Column(
            "state_hash",
            sa.Text(),
            nullable=False,
            comment="hash of the bits of the final state; empty if not taken",
        ),
        sa.Column("counters", sa.Text(), nullable=False, comment="JSON object of exact work counters"),
        sa.ForeignKeyConstraint(["run_key"], ["run.key"], name="fk_evidence_run_key"),
        sa.ForeignKeyConstraint(["series_id"], ["series.id"], name="fk_evidence_series_id"),
        sa.PrimaryKeyConstraint("started_at", "run_key", "series_id", name="pk_evidence"),
        comment="what stands behind a sample",
        sqlite_with_rowid=False,
    )
    op.create_table(
        "figure",
        sa.Column(
            "started_at",
            sa.DateTime(timezone=True),
            nullable=False,
            comment="start of the run, UTC; leads the key",
        ),
        sa.Column("run_key", sa.BigInteger(), nullable=False, comment="the run"),
        sa.Column("position", sa.BigInteger(), nullable=False, comment="place in the document, from 0"),
        sa.Column("test", sa.Text(), nullable=False, comment="scalar test"),
        sa.Column("name", sa.Text(), nullable=False, comment="slug of the figure"),
        sa.Column("body", sa.LargeBinary(), nullable=False, comment="zlib of the JSON of the figure"),
        sa.ForeignKeyConstraint(["run_key"], ["run.key"], name="fk_figure_run_key"),
        sa.PrimaryKeyConstraint("started_at", "run_key", "position", name="pk_figure"),
        comment="data of a figure drawn from one run",
    )
    op.create_table(
        "sample",
        sa.Column(
            "started_at",
            sa.DateTime(timezone=True),
            nullable=False,
            comment="start of the run, UTC; leads the key",
        ),
        sa.Column("run_key", sa.BigInteger(), nullable=False, comment="the run"),
        sa.Column("series_id", sa.BigInteger(), nullable=False, comment="the series"),
        sa.Column(
            "definition_id", sa.BigInteger(), nullable=False, comment="the series as defined in this run"
        ),
        sa.Column("position", sa.BigInteger(), nullable=False, comment="place in the document, from 0"),
        sa.Column("value", sa.Double(), nullable=True, comment="the float64; NULL if it is not finite"),
        sa.Column(
            "special",
            sa.Text(),
            nullable=True,
            comment="nan, inf, -inf or -0.0 where the value is one of these",
        ),
        sa.Column(
            "outcome",
            sa.Text(),
            nullable=False,
            comment="class: value, out_of_limit, not_finite, diverged, timed_out, crashed, missing",
        ),
        sa.Column("passed", sa.Boolean(), nullable=False, comment="inside the limit of that night"),
        sa.Column("set_point_held", sa.Boolean(), nullable=False, comment="inside the band theory expects"),
        sa.CheckConstraint(
            "(value IS NULL) = (coalesce(special, '') IN ('nan', 'inf', '-inf'))", name="ck_sample_value"
        ),
        sa.CheckConstraint(
            "outcome IN ('value', 'out_of_limit', 'not_finite', 'diverged', 'timed_out', 'crashed', "
            "'missing')",
            name="ck_sample_outcome",
        ),
        sa.CheckConstraint(
            "special IS NULL OR special IN ('nan', 'inf', '-inf', '-0.0')", name="ck_sample_special"
        ),
        sa.ForeignKeyConstraint(["definition_id"], ["definition.id"], name="fk_sample_definition_id"),
        sa.ForeignKeyConstraint(["run_key"], ["run.key"], name="fk_sample_run_key"),
        sa.ForeignKeyConstraint(["series_id"], ["series.id"], name="fk_sample_series_id"),
        sa.PrimaryKeyConstraint("started_at", "run_key", "series_id", name="pk_sample"),
        comment="one value of one series in one run",
        sqlite_with_rowid=False,
    )
    op.create_index("ix_sample_series_id", "sample", ["series_id", "started_at"])
    op.create_table(
        "series_list_item",
        sa.Column("list_id", sa.BigInteger(), nullable=False, comment="the list"),
        sa.Column("position", sa.BigInteger(), nullable=False, comment="place, from 0"),
        sa.Column("definition_id", sa.BigInteger(), nullable=False, comment="the definition at this place"),
        sa.ForeignKeyConstraint(
            ["definition_id"], ["definition.id"], name="fk_series_list_item_definition_id"
        ),
        sa.ForeignKeyConstraint(["list_id"], ["series_list.id"], name="fk_series_list_item_list_id"),
        sa.PrimaryKeyConstraint("list_id", "position", name="pk_series_list_item"),
        comment="one place of a series list",
    )
    op.create_table(
        "stability_map",
        sa.Column(
            "started_at",
            sa.DateTime(timezone=True),
            nullable=False,
            comment="start of the run, UTC; leads the key",
        ),
        sa.Column("run_key", sa.BigInteger(), nullable=False, comment="the run"),
        sa.Column("position", sa.BigInteger(), nullable=False, comment="place in the document, from 0"),
        sa.Column("test", sa.Text(), nullable=False, comment="scalar test"),
        sa.Column("name", sa.Text(), nullable=False, comment="slug of the map"),
        sa.Column("body", sa.LargeBinary(), nullable=False, comment="zlib of the JSON of the map"),
        sa.ForeignKeyConstraint(["run_key"], ["run.key"], name="fk_stability_map_run_key"),
        sa.PrimaryKeyConstraint("started_at", "run_key", "position", name="pk_stability_map"),
        comment="a stability map of one run",
    )
    op.create_table(
        "timing",
        sa.Column(
            "started_at",
            sa.DateTime(timezone=True),
            nullable=False,
            comment="start of the run, UTC; leads the key",
        ),
        sa.Column("run_key", sa.BigInteger(), nullable=False, comment="the run"),
        sa.Column("series_id", sa.BigInteger(), nullable=False, comment="the series"),
        sa.Column(
            "seconds",
            sa.Text(),
            nullable=False,
            comment="JSON list: seconds of one simulation, a number for each repeat",
        ),
        sa.Column("runs_per_repeat", sa.BigInteger(), nullable=False, comment="simulations in one repeat"),
        sa.Column("instructions", sa.BigInteger(), nullable=True, comment="retired; NULL if not counted"),
        sa.Column(
            "stage_seconds", sa.Text(), nullable=False, comment="JSON object: seconds by stage of the step"
        ),
        sa.ForeignKeyConstraint(["run_key"], ["run.key"], name="fk_timing_run_key"),
        sa.ForeignKeyConstraint(["series_id"], ["series.id"], name="fk_timing_series_id"),
        sa.PrimaryKeyConstraint("started_at", "run_key", "series_id", name="pk_timing"),
        comment="run time behind a sample",
        sqlite_with_rowid=False,
    )


def downgrade() -> None:
    op.drop_table("timing")
    op.drop_table("stability_map")
    op.drop_table("series_list_item")
    op.drop_table("sample")
    op.drop_table("figure")
    op.drop_table("evidence")
    op.drop_table("series_alias")
    op.drop_table("run")
    op.drop_table("definition")
    op.drop_table("test_cards")
    op.drop_table("series_list")
    op.drop_table("series")
    op.drop_table("machine")
    op.drop_table("engine_version")
