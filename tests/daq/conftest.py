"""What the tests of daq share."""

from __future__ import annotations

import sys

import pytest

import robots
from daq.cli import entry as cli
from robots import Robot
from tests.daq.calls import Call


@pytest.fixture(scope="session")
def tx40() -> Robot:
    return robots.load("tx40")


@pytest.fixture(scope="session")
def emps() -> Robot:
    return robots.load("emps")


@pytest.fixture
def armhil(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Call:
    """Calls the command line in this process: exit code, stdout, stderr."""

    def call(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["armhil", *map(str, arguments)])
        capsys.readouterr()
        with pytest.raises(SystemExit) as leaving:
            cli.main()
        printed = capsys.readouterr()
        assert "Traceback" not in printed.out + printed.err
        assert isinstance(leaving.value.code, int)
        return leaving.value.code, printed.out, printed.err

    return call
