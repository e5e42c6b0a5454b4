"""A robot folder that a test may break: a copy of the shipped TX40-like arm."""

from __future__ import annotations

import re
import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import settings

import robots

# A loaded machine must not fail a test.
settings.register_profile("unhurried", deadline=None)
settings.load_profile("unhurried")

SHIPPED = Path(robots.__file__).parent


@dataclass(frozen=True)
class RobotFolder:
    """A copy of a shipped arm; edits return the line that they changed."""

    path: Path

    @property
    def toml(self) -> Path:
        return self.path / "robot.toml"

    @property
    def urdf(self) -> Path:
        return self.path / "tx40.urdf"

    def edit(self, file: Path, old: str | re.Pattern[str], new: str, occurrence: int = 1) -> int:
        """Replace the given occurrence of ``old``; returns its line, counted from 1.

        Figures that are tuned from time to time are given as a pattern.
        """
        text = file.read_text("utf-8")
        pattern = re.compile(re.escape(old)) if isinstance(old, str) else old
        match = list(pattern.finditer(text))[occurrence - 1]
        file.write_text(text[: match.start()] + new + text[match.end() :], "utf-8")
        return text.count("\n", 0, match.start()) + 1


@pytest.fixture
def folder(tmp_path: Path) -> RobotFolder:
    copy = tmp_path / "arm"
    shutil.copytree(SHIPPED / "tx40", copy)
    return RobotFolder(copy)
