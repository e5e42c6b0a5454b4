"""The command line in this process, and a small planned motion of the one-axis arm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.daq.calls import Call


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
def plan(armhil: Call, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Plan:
    """Calls ``armhil plan`` inside an empty folder; a short search unless it says otherwise."""
    monkeypatch.chdir(tmp_path)

    def call(robot: object, *arguments: object) -> Answer:
        search = () if "--check" in arguments else SMALL
        return Answer(*armhil("plan", robot, *search, *arguments))

    return call
