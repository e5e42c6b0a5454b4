"""A row that several processes may add at once: one of them does, and the others find it there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sqlalchemy import Connection, Table
from sqlalchemy.dialects import postgresql, sqlite


def insert_unless_there(connection: Connection, table: Table, values: Mapping[str, Any]) -> bool:
    """Add a row unless one with its key is there, even if another transaction adds it at this moment.

    Looking first is not enough: on PostgreSQL nobody sees the row of a transaction that is still under way.

    Returns:
        whether it was added.
    """
    dialect: Any = postgresql if connection.dialect.name == "postgresql" else sqlite
    unless_there = dialect.insert(table).values(values).on_conflict_do_nothing()
    # A count of rows is -1 where the database was asked for a number that it has given.
    return connection.execute(unless_there.returning(*table.primary_key)).first() is not None
