"""Descriptions of arms by their checksums: of which parts one is made, and in which two differ.

Until version 4 of the catalogue an arm was known by the text of its robot.toml alone. What was kept then
still says so: a baseline or a stage of that time does not count for an arm whose URDF nobody compared.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from sqlalchemy import Connection, select

from daq.catalogue.database import Catalogue
from daq.catalogue.inserting import insert_unless_there
from daq.catalogue.schema import descriptions
from robots.identity import differing

OLD = "text of robot.toml"
"""The only part of a description that was kept before version 4."""


@dataclass(frozen=True)
class Description:
    """A description with its parts: ``robots.identity.PARTS`` → checksum."""

    sha256: str
    parts: Mapping[str, str]


def keep(catalogue: Catalogue, description: Description) -> None:
    """Keep of what parts a description is made."""
    with catalogue.writing() as connection:
        keep_in(connection, description)


def keep_in(connection: Connection, description: Description) -> None:
    """As :func:`keep`, inside a transaction."""
    if description.parts and find_in(connection, description.sha256) is None:
        values = {"sha256": description.sha256, "parts": dict(description.parts)}
        insert_unless_there(connection, descriptions, values)


def find_in(connection: Connection, sha256: str) -> Mapping[str, str] | None:
    """The parts of a description; None where they were not kept."""
    wanted = select(descriptions.c.parts).where(descriptions.c.sha256 == sha256)
    parts: Mapping[str, str] | None = connection.execute(wanted).scalar_one_or_none()
    return parts


def difference(catalogue: Catalogue, then_sha256: str, now: Description) -> str:
    """In which parts a description of the past differs from the one in use; empty where it is the same.

    Args:
        catalogue: where their parts are kept.
        then_sha256: of the description of the past.
        now: in use.
    """
    if then_sha256 == now.sha256:
        return ""
    with catalogue.reading() as connection:
        then = find_in(connection, then_sha256)
    if then is None:
        return "its parts were not kept"
    if OLD in then:
        return "an earlier armhil knew it by the text of robot.toml alone, so the URDF was not compared"
    return f"{differing(then, now.parts) or 'the order of its parts'} changed since"
