"""The command line in this process, and a small planned motion of the one-axis arm."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from daq.cli import entry


@dataclass(frozen=True)
class Answer:
    """What a call left behind."""

    code: int
    out: str
    err: str

    @property
    def refusal(self) -> str:
        """The one line of a refusal; fails where there is none or more."""
        lines = [line for line in self.err.splitlines() if line.startswith("armhil: ")]
        assert self.code == 2 and len(lines) == 1 and lines[0] == self.err.splitlines()[-1], self
        assert "Traceback" not in self.err
        return lines[0].removeprefix("armhil: ")


Plan = Callable[..., Answer]
SMALL = ("--evaluations", 60, "--searches", 1, "--workers", 1, "--duration", 4)


@pytest.fixture
def plan(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Plan:
    """Calls ``armhil plan`` inside an empty folder; a short search unless it says otherwise."""
    monkeypatch.chdir(tmp_path)

    def call(robot: object, *arguments: object) -> Answer:
        search = () if "--check" in arguments else SMALL
        monkeypatch.setattr(sys, "argv", ["armhil", "plan", *map(str, (robot, *search, *arguments))])
        capsys.readouterr()
        with pytest.raises(SystemExit) as leaving:
            entry.main()
        printed = capsys.readouterr()
        assert isinstance(leaving.value.code, int)
        return Answer(leaving.value.code, printed.out, printed.err)

    return call
