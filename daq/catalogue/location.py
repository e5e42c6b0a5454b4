"""Where the catalogue is: the URL in $ARMHIL_CATALOGUE, else a file in the user's data directory."""

from __future__ import annotations

import os
from pathlib import Path

from sqlalchemy import URL, make_url
from sqlalchemy.exc import ArgumentError

from daq.catalogue.values import CatalogueError

VARIABLE = "ARMHIL_CATALOGUE"
ALLOWED = "allowed: a path, sqlite:///<path>, or postgresql://<user>@<host>/<database>"


def catalogue_url(given: str | None = None) -> URL:
    """The catalogue that is meant: what is given, else $ARMHIL_CATALOGUE, else the user's own file.

    The user's own file is ``armhil/catalogue.db`` in $XDG_DATA_HOME, or in ~/.local/share (XDG Base
    Directory Specification).

    Args:
        given: a URL or a path.

    Raises:
        CatalogueError: no such kind of database.
    """
    text = given or os.environ.get(VARIABLE) or str(_data_home() / "armhil" / "catalogue.db")
    if "://" not in text:
        return URL.create("sqlite", database=str(Path(text).expanduser().absolute()))
    try:
        url = make_url(text)
    except (ArgumentError, ValueError):
        raise CatalogueError(f"catalogue {_without_password(text)}: is no URL; {ALLOWED}") from None
    if url.drivername in ("postgresql", "postgres"):
        return url.set(drivername="postgresql+psycopg")
    if url.drivername not in ("sqlite", "postgresql+psycopg"):
        raise CatalogueError(f"catalogue: databases of kind {url.drivername} are not supported; {ALLOWED}")
    if url.drivername == "sqlite" and url.database in (None, "", ":memory:"):
        raise CatalogueError(f"catalogue {url}: names no file, and is shared by processes; {ALLOWED}")
    return url


def _without_password(text: str) -> str:
    scheme, _, rest = text.partition("://")
    return f"{scheme}://{rest.rpartition('@')[2]}"


def _data_home() -> Path:
    home = os.environ.get("XDG_DATA_HOME", "")
    # The specification says to ignore a relative path.
    return Path(home) if Path(home).is_absolute() else Path.home() / ".local" / "share"
