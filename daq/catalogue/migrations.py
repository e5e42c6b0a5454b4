"""Bring a catalogue to the version of this program: made anew, or step by step from the one it has.

Data is only ever carried forward. A catalogue of a newer program is refused, and so nothing is lost to an
older one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from sqlalchemy import JSON, Connection, Integer, column, insert, inspect, select, table, text, update

from daq.catalogue import schema
from daq.catalogue.seals import seal_kept_in
from daq.catalogue.values import CatalogueError
from robots.errors import shown

Migration = Callable[[Connection], None]


def _whole_covariance_kinds(connection: Connection) -> None:
    """What a covariance assumes is said in a sentence; PostgreSQL took 40 letters of it, SQLite all."""
    if connection.dialect.name == "postgresql":
        connection.execute(text("ALTER TABLE models ALTER COLUMN covariance_kind TYPE TEXT"))


def _found_effects(connection: Connection) -> None:
    """A model holds the effects that were found; those of a diagnosis stood among its findings."""
    connection.execute(text("ALTER TABLE models ADD COLUMN found JSON"))
    models = table("models", column("id", Integer), *(column(name, JSON) for name in ("effects", "found")))
    findings = table(
        "findings",
        *(column(name, Integer) for name in ("id", "model_id")),
        column("effect"),
        *(column(name, JSON) for name in ("joints", "parameters")),
    )
    wanted = select(findings).where(findings.c.model_id.is_not(None)).order_by(findings.c.id)
    of_model: dict[int, list[dict[str, object]]] = {}
    for row in connection.execute(wanted):
        shape = {p["name"]: p["value"] for p in row.parameters if p.get("shape")}
        entry = {"effect": row.effect, "joints": row.joints, "shape": shape}
        of_model.setdefault(row.model_id, []).append(entry)
    for number, found in of_model.items():
        mine = models.c.id == number
        effects = connection.execute(select(models.c.effects).where(mine)).scalar_one()
        names = [entry["effect"] for entry in found]
        twice = effects[-2 * len(names) :] == [*names, *names]
        kept = effects[: -len(names)] if twice else effects
        connection.execute(update(models).where(mine).values(found=found, effects=kept))


def _parts_of_descriptions(connection: Connection) -> None:
    """A description is robot.toml, URDF and meshes; until now it was known by robot.toml's text alone.

    What was kept of it says so from now on: nobody can tell from it whether the URDF was the same.
    """
    columns = "sha256 VARCHAR(64) NOT NULL PRIMARY KEY, parts JSON NOT NULL"
    connection.execute(text(f"CREATE TABLE IF NOT EXISTS descriptions ({columns})"))
    kept = table("descriptions", column("sha256"), column("parts", JSON))
    known: set[str] = set()
    for name in ("arms", "runs", "models", "baselines"):
        rows = table(name, column("description_sha256"))
        known |= set(connection.execute(select(rows.c.description_sha256).distinct()).scalars())
    known -= set(connection.execute(select(kept.c.sha256)).scalars())
    for sha256 in sorted(known):
        connection.execute(insert(kept).values(sha256=sha256, parts={"text of robot.toml": sha256}))


def _newest_without_all(connection: Connection) -> None:
    """The newest of each arm, and runs that nobody has settled, are found without reading years of nights.

    The process of a run is named as long as it has still to say something of it.
    """
    connection.execute(text("DROP INDEX IF EXISTS ix_checks_arm_id"))
    for index in (
        "newest_run_of_arm ON runs (arm_id, id)",
        "newest_check_of_arm ON checks (arm_id, id)",
        "owed_runs ON runs (id) WHERE process <> ''",
    ):
        connection.execute(text(f"CREATE INDEX IF NOT EXISTS {index}"))
    connection.execute(
        text(
            "UPDATE runs SET process = '' WHERE state <> 'running' AND NOT"
            " (kind = 'check' AND stage = '' AND state = 'finished' AND outcome = 'completed' AND reason = ''"
            " AND NOT EXISTS (SELECT 1 FROM checks WHERE checks.run_id = runs.id))"
        )
    )


MIGRATIONS: Mapping[int, Migration] = {
    2: _whole_covariance_kinds,
    3: _found_effects,
    4: _parts_of_descriptions,
    5: seal_kept_in,
    6: _newest_without_all,
}
"""Version → the step that makes it out of the version before; version 1 is where the tables began."""

_LOCK = 0x61726D68
"""Of PostgreSQL's advisory lock: any number that nobody else uses."""


def bring_up_to_date(
    connection: Connection,
    version: int = schema.VERSION,
    migrations: Mapping[int, Migration] = MIGRATIONS,
) -> None:
    """Create the tables, or apply the steps that are missing; inside the caller's transaction.

    Args:
        connection: to the catalogue, in a transaction that holds the right to write.
        version: wanted.
        migrations: the steps.

    Raises:
        CatalogueError: a newer program made it, or none did.
    """
    if connection.dialect.name == "postgresql":
        connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": _LOCK})
    found = found_version(connection)
    if found is None:
        schema.metadata.create_all(connection)
        connection.execute(insert(schema.schema_version).values(id=1, version=version))
        return
    if found > version:
        raise CatalogueError(
            f"catalogue {connection.engine.url.render_as_string()}: has version {found} of a newer armhil;"
            f" allowed: up to {version}; install that newer one, or name another in $ARMHIL_CATALOGUE"
        )
    for step in range(found + 1, version + 1):
        migrations[step](connection)
        connection.execute(update(schema.schema_version).values(version=step))


def found_version(connection: Connection) -> int | None:
    """The version that a catalogue has; None where there is none yet.

    Raises:
        CatalogueError: it has one that is none.
    """
    if not inspect(connection).has_table(schema.schema_version.name):
        return None
    version: Any = connection.execute(select(schema.schema_version.c.version)).scalar_one_or_none()
    if version is None:
        return None
    if not isinstance(version, int) or version < 1:
        raise CatalogueError(
            f"catalogue {connection.engine.url.render_as_string()}: has version {shown(version)}, which no"
            " armhil wrote: the file is damaged; put a backup in its place"
        )
    return version
