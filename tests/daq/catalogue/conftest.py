"""Catalogues for the tests: every test runs on SQLite and, where it is installed, on PostgreSQL."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from itertools import count
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy

from daq.catalogue.database import Catalogue
from tests.daq.calls import Call
from tests.daq.catalogue.postgres import NoPostgres, server

_DATABASES = count()


@pytest.fixture(scope="session")
def new_database() -> Iterator[Callable[[], str]]:
    """Makes empty databases on a server that the first of them starts; skips where there is none."""
    pytest.importorskip("psycopg", reason="psycopg is not installed (extra postgresql)")
    with ExitStack() as stack:
        started: list[str] = []

        def make() -> str:
            if not started:
                try:
                    started.append(stack.enter_context(server()))
                except NoPostgres as reason:
                    pytest.skip(str(reason))
            name = f"catalogue{next(_DATABASES)}"
            url = started[0].replace("postgresql:", "postgresql+psycopg:").format("postgres")
            engine = sqlalchemy.create_engine(url, isolation_level="AUTOCOMMIT")
            with engine.connect() as connection:
                connection.exec_driver_sql(f"CREATE DATABASE {name}")
            engine.dispose()
            return started[0].format(name)

        yield make


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """Of a catalogue that does not exist yet."""
    if request.param == "sqlite":
        return f"sqlite:///{tmp_path / 'catalogue.db'}"
    made: str = request.getfixturevalue("new_database")()
    return made


@pytest.fixture
def catalogue(url: str) -> Iterator[Catalogue]:
    with Catalogue(url) as opened:
        yield opened


@pytest.fixture
def ask(armhil: Call) -> Callable[..., dict[str, Any]]:
    """Calls with --json: the object."""

    def call(*arguments: object) -> dict[str, Any]:
        code, out, err = armhil(*arguments, "--json")
        assert code == 0, err
        answer: dict[str, Any] = json.loads(out)
        return answer

    return call
