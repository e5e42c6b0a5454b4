"""What the tests of daq share."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from typing import Any

import pytest

import robots
from daq.catalogue import database
from daq.cli import entry as cli
from robots import Robot
from tests.daq.calls import COMMAND, SEE, Call


@pytest.fixture(scope="session")
def tx40() -> Robot:
    return robots.load("tx40")


@pytest.fixture(scope="session")
def emps() -> Robot:
    return robots.load("emps")


SetUp = Callable[[Any, object], None]


@pytest.fixture(scope="session", autouse=True)
def sqlite_set_up() -> Iterator[SetUp]:
    """How connections to SQLite are set up where users are; it waits for the disk in each transaction.

    Only a machine that loses power would show the difference, so the catalogues that the tests open in their
    own process do not wait. test_database.py sees that all others do.
    """
    as_shipped: SetUp = database._set_up_sqlite

    def without_waiting(connection: Any, record: object) -> None:
        as_shipped(connection, record)
        connection.execute("PRAGMA synchronous = OFF")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(database, "_set_up_sqlite", without_waiting)
        yield as_shipped


@pytest.fixture
def armhil(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Call:
    """Calls the command line in this process: exit code, stdout, stderr.

    Each refusal has to name a whole command; where it is but the help of what was called, that is taken off.
    """

    def call(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["armhil", *map(str, arguments)])
        capsys.readouterr()
        with pytest.raises(SystemExit) as leaving:
            cli.main()
        printed = capsys.readouterr()
        assert "Traceback" not in printed.out + printed.err
        assert isinstance(leaving.value.code, int)
        if leaving.value.code == 2 and not printed.out and printed.err.startswith("armhil: "):
            assert COMMAND.search(printed.err), f"no command to go on with: {printed.err}"
        return leaving.value.code, printed.out, SEE.sub("", printed.err)

    return call
