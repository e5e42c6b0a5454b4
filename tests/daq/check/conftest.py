"""What the tests of checks share with those of the catalogue: databases on a PostgreSQL server."""

from __future__ import annotations

from tests.daq.catalogue.conftest import new_database, url

__all__ = ["new_database", "url"]
