"""The catalogue as an object: opened by URL, read and written in transactions of any number of processes."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from json import JSONDecodeError
from pathlib import Path
from traceback import walk_tb
from types import TracebackType
from typing import Any, Self

from sqlalchemy import URL, Connection, Engine, NullPool, create_engine, event
from sqlalchemy.exc import DBAPIError, OperationalError
from sqlalchemy.exc import TimeoutError as PoolTimeoutError

from daq.catalogue.location import catalogue_url
from daq.catalogue.migrations import bring_up_to_date, found_version
from daq.catalogue.schema import VERSION
from daq.catalogue.values import CatalogueError
from robots.errors import UserError, one_line
from robots.extras import install_command

BUSY_SECONDS = 30.0
"""How long a writer waits for the others. A transaction here takes milliseconds."""

_WRITES = "armhil_writes"


class Catalogue:
    """Runs, models, baselines, findings, checks and leases of arms.

    The functions of ``daq.catalogue.arms``, ``runs``, ``models`` and so on take one of these. Many processes
    may use the same catalogue at once; one object may be shared between threads.

    Args:
        url: a URL or a path; see :func:`daq.catalogue.location.catalogue_url`.

    Raises:
        CatalogueError: it cannot be opened, or a newer program made it.
    """

    def __init__(self, url: str | None = None) -> None:
        self.url: URL = catalogue_url(url)
        self._engine = _engine(self.url)
        try:
            with self.reading() as connection:
                current = found_version(connection) == VERSION
            if not current:
                with self.writing() as connection:
                    bring_up_to_date(connection)
        except BaseException:
            self.close()
            raise

    def __str__(self) -> str:
        name = self.url.database if self.url.drivername == "sqlite" else self.url.render_as_string()
        return f"catalogue {name}"

    @contextmanager
    def reading(self) -> Iterator[Connection]:
        """A transaction that sees one state of the catalogue.

        Raises:
            CatalogueError: the database does not answer.
        """
        with self._explained(), self._engine.connect() as connection:
            yield connection

    @contextmanager
    def writing(self) -> Iterator[Connection]:
        """A transaction that is kept whole or not at all; on SQLite it is the only writer from its start.

        Raises:
            CatalogueError: the database does not answer, or cannot be written.
        """
        with self._explained(), self._engine.connect() as connection:
            writer = connection.execution_options(**{_WRITES: True})
            with writer.begin():
                yield writer

    @contextmanager
    def _explained(self) -> Iterator[None]:
        try:
            yield
        except DBAPIError as error:
            if isinstance(error, OperationalError) or error.connection_invalidated or _is_access(error):
                raise CatalogueError(f"{self}: {_with_advice(one_line(str(error.orig)))}") from error
            raise
        except PoolTimeoutError as error:
            raise CatalogueError(
                f"{self}: all connections to it are taken ({one_line(str(error))[:80]}); try again in a while"
            ) from error
        except (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RecursionError) as error:
            if isinstance(error, UserError) or not _is_of_a_row(error):
                raise
            reason = one_line(str(error))[:120]
            raise CatalogueError(
                f"{self}: holds a value that no armhil wrote ({reason}): the file is damaged; put a backup"
                " in its place"
            ) from error

    def close(self) -> None:
        """Give back the connections."""
        self._engine.dispose()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


_ADVICE = (
    (
        "readonly",
        "may be read only: `chmod u+w` it and its folder, or name a copy of it in $ARMHIL_CATALOGUE",
    ),
    ("locked", "another program holds it: `fuser FILE` names that; end it, then do the same again"),
    ("malformed", "the file is damaged: put a backup in its place, or move it away and a new one is begun"),
    ("not a database", "name another in $ARMHIL_CATALOGUE, or move it away and a new one is begun"),
    (
        "unable to open",
        "allowed: a file that you may write, in a folder that you may write; $ARMHIL_CATALOGUE",
    ),
    ("no such table", "it is not armhil's: name another in $ARMHIL_CATALOGUE"),
    ("connection", "start that server, or name another catalogue in $ARMHIL_CATALOGUE"),
    ("permission denied", "have its owner grant that, or name another catalogue in $ARMHIL_CATALOGUE"),
    ("read-only transaction", "name the server that may be written in $ARMHIL_CATALOGUE"),
)
"""What the databases say of what is the matter, and what to do; the first that is in it."""


def _with_advice(reason: str) -> str:
    advice = next((advice for word, advice in _ADVICE if word in reason.lower()), "")
    return f"{reason}; {advice}" if advice else reason


def _is_of_a_row(error: Exception) -> bool:
    """Did reading a row raise it: no JSON, no UTF-8, no time, or another kind of value than stands there?"""
    if isinstance(error, JSONDecodeError | UnicodeDecodeError):
        return True
    frames = [(f.f_globals.get("__name__", ""), f.f_code.co_name) for f, _ in walk_tb(error.__traceback__)]
    reader = any(module.startswith("daq.catalogue.") and name.endswith("_of") for module, name in frames)
    return reader or (bool(frames) and frames[-1][0].startswith(("sqlalchemy.", "json.")))


def _is_access(error: DBAPIError) -> bool:
    """Is it the database that is the matter, not what it was asked?"""
    return type(error.orig).__name__ in ("InsufficientPrivilege", "DatabaseError", "NotADatabaseError")


def _engine(url: URL) -> Engine:
    if url.drivername != "sqlite":
        try:
            return create_engine(url, pool_pre_ping=True)
        except ModuleNotFoundError as error:
            raise CatalogueError(
                f"catalogue {url.render_as_string()}: {error.name} is not installed;"
                f" install it with: {install_command('postgresql')}"
            ) from error
    path = Path(str(url.database))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CatalogueError(
            f"catalogue {path}: cannot be made: {error.strerror}; name a file that can in $ARMHIL_CATALOGUE"
        ) from error
    # A connection of its own for each transaction: cheap, and safe for threads and after a fork.
    engine = create_engine(url, poolclass=NullPool, connect_args={"timeout": BUSY_SECONDS})
    event.listen(engine, "connect", _set_up_sqlite)
    event.listen(engine, "begin", _begin_sqlite)
    return engine


def _set_up_sqlite(connection: Any, record: object) -> None:
    """WAL, so that readers never wait for writers; the driver begins no transaction of its own."""
    connection.isolation_level = None
    connection.execute("PRAGMA foreign_keys = ON")
    connection.execute("PRAGMA synchronous = FULL")
    _use_wal(connection)


def _use_wal(connection: Any) -> None:
    """Switch to WAL once in the life of the file.

    The switch needs the file for itself and does not wait for it as everything else does, so it is tried
    again where other processes do the same.
    """
    deadline = time.monotonic() + BUSY_SECONDS
    while True:
        try:
            (mode,) = connection.execute("PRAGMA journal_mode").fetchone()
            if mode != "wal":
                connection.execute("PRAGMA journal_mode = WAL")
            return
        except connection.OperationalError as error:
            if "locked" not in str(error) or time.monotonic() > deadline:
                raise
        time.sleep(0.02)


def _begin_sqlite(connection: Connection) -> None:
    # Whoever reads first and writes later could find that somebody else has written meanwhile.
    immediate = connection.get_execution_options().get(_WRITES, False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if immediate else "BEGIN")
