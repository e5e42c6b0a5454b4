"""The tables of the catalogue; docs/how-to/catalogue.md says what they are for.

A change here needs a step in ``migrations`` and a higher ``VERSION``.
"""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

from sqlalchemy import (
    JSON,
    Boolean,
    CheckConstraint,
    Column,
    DateTime,
    Dialect,
    Float,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    String,
    Table,
    Text,
    UniqueConstraint,
    literal_column,
)
from sqlalchemy.types import TypeDecorator

VERSION = 6
"""Of the tables below."""

SHA256 = String(64)


class UtcTime(TypeDecorator[datetime]):
    """A time with its zone: SQLite keeps none, so everything in it is UTC."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError(f"{value}: a time in the catalogue has a zone")
        return value.astimezone(UTC)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


metadata = MetaData()


def _one_of(column: str, *allowed: str) -> CheckConstraint:
    return CheckConstraint(f"{column} IN ({', '.join(repr(word) for word in allowed)})")


def _id() -> Column[int]:
    return Column("id", Integer, primary_key=True, autoincrement=True)


def _arm(**options: Any) -> Column[int]:
    return Column("arm_id", ForeignKey("arms.id"), nullable=False, **options)


def _run(*, nullable: bool = False) -> Column[Any]:
    return Column("run_id", ForeignKey("runs.id"), nullable=nullable, index=True)


schema_version = Table(
    "schema_version",
    metadata,
    Column("id", Integer, primary_key=True, autoincrement=False),
    Column("version", Integer, nullable=False),
    CheckConstraint("id = 1"),
)

arms = Table(
    "arms",
    metadata,
    _id(),
    Column("label", String(200), nullable=False, unique=True),
    Column("name", String(200), nullable=False),
    Column("serials", String(500), nullable=False),
    Column("simulated", Boolean, nullable=False),
    Column("description_sha256", SHA256, nullable=False),
    Column("first_seen", UtcTime, nullable=False),
    UniqueConstraint("name", "serials", "simulated"),
    sqlite_autoincrement=True,
)

descriptions = Table(
    "descriptions",
    metadata,
    Column("sha256", SHA256, primary_key=True),
    Column("parts", JSON, nullable=False),
)

runs = Table(
    "runs",
    metadata,
    _id(),
    _arm(),
    Column("kind", String(20), nullable=False),
    Column("stage", String(40), nullable=False, default=""),
    Column("description_sha256", SHA256, nullable=False),
    Column("started", UtcTime, nullable=False),
    Column("finished", UtcTime),
    Column("who", String(200), nullable=False),
    Column("process", String(300), nullable=False, default=""),
    Column("capture", Text),
    Column("capture_sha256", SHA256, index=True),
    Column("trajectory", Text, nullable=False, default=""),
    Column("state", String(20), nullable=False),
    Column("outcome", String(20), nullable=False, default=""),
    Column("reason", Text, nullable=False, default=""),
    Column("facts", JSON, nullable=False, default=dict),
    Column("note", Text, nullable=False, default=""),
    _one_of("kind", "demo", "plan", "check", "commission", "import", "run"),
    _one_of("state", "running", "finished", "abandoned"),
    Index("runs_of_arm", "arm_id", "started"),
    Index("newest_run_of_arm", "arm_id", "id"),
    sqlite_autoincrement=True,
)
OWED = runs.c.process != literal_column("''")
"""Runs of which a process has still to say something. An index has no others; it needs the literal."""
Index("owed_runs", runs.c.id, postgresql_where=OWED, sqlite_where=OWED)

models = Table(
    "models",
    metadata,
    _id(),
    _arm(index=True),
    _run(),
    Column("created", UtcTime, nullable=False),
    Column("who", String(200), nullable=False),
    Column("method", String(20), nullable=False),
    Column("verdict", String(40), nullable=False),
    Column("recommendation", Text, nullable=False),
    Column("gates", JSON, nullable=False),
    Column("rows", Integer, nullable=False),
    Column("relative_error_percent", Float, nullable=False),
    Column("torque_rms", JSON, nullable=False),
    Column("effects", JSON, nullable=False),
    Column("found", JSON),
    Column("covariance_kind", Text, nullable=False),
    Column("covariance", LargeBinary),
    Column("settings", JSON, nullable=False),
    Column("sources", JSON, nullable=False),
    Column("description_sha256", SHA256, nullable=False),
    Column("armhil", String(40), nullable=False),
    Column("file", Text),
    Column("report", Text),
    sqlite_autoincrement=True,
)

parameters = Table(
    "parameters",
    metadata,
    Column("model_id", ForeignKey("models.id", ondelete="CASCADE"), primary_key=True),
    Column("place", Integer, primary_key=True, autoincrement=False),
    Column("name", String(100), nullable=False, index=True),
    Column("value", Float, nullable=False),
    Column("sigma", Float, nullable=False),
    Column("unit", String(40), nullable=False),
    Column("expression", Text, nullable=False),
)

baselines = Table(
    "baselines",
    metadata,
    _id(),
    _arm(index=True),
    Column("model_id", ForeignKey("models.id"), nullable=False),
    _run(),
    Column("state", String(20), nullable=False),
    Column("description_sha256", SHA256, nullable=False),
    Column("accepted", UtcTime, nullable=False),
    _one_of("state", "accepted", "rolled_back", "suspect"),
    sqlite_autoincrement=True,
)

baseline_events = Table(
    "baseline_events",
    metadata,
    _id(),
    Column("baseline_id", ForeignKey("baselines.id"), nullable=False, index=True),
    Column("state", String(20), nullable=False),
    Column("author", String(200), nullable=False),
    Column("reason", Text, nullable=False),
    Column("report", Text),
    Column("at", UtcTime, nullable=False),
    _one_of("state", "accepted", "rolled_back", "suspect"),
    sqlite_autoincrement=True,
)

findings = Table(
    "findings",
    metadata,
    _id(),
    _arm(index=True),
    _run(),
    Column("model_id", ForeignKey("models.id")),
    Column("created", UtcTime, nullable=False),
    Column("effect", String(100), nullable=False),
    Column("joints", JSON, nullable=False),
    Column("sentence", Text, nullable=False),
    Column("parameters", JSON, nullable=False),
    Column("p_value", Float, nullable=False),
    Column("gap_before", Float),
    Column("gap_after", Float),
    Column("held_out_gain", Float),
    sqlite_autoincrement=True,
)

checks = Table(
    "checks",
    metadata,
    _id(),
    _arm(),
    _run(),
    Column("model_id", ForeignKey("models.id")),
    Column("baseline_id", ForeignKey("baselines.id")),
    Column("created", UtcTime, nullable=False),
    Column("verdict", String(40), nullable=False),
    Column("sentence", Text, nullable=False),
    Column("details", JSON, nullable=False),
    Index("newest_check_of_arm", "arm_id", "id"),
    sqlite_autoincrement=True,
)

leases = Table(
    "leases",
    metadata,
    Column("arm_id", ForeignKey("arms.id"), primary_key=True, autoincrement=False),
    Column("holder", String(300), nullable=False),
    Column("taken", UtcTime, nullable=False),
    Column("expires", UtcTime, nullable=False),
)
