"""Arms, captures and motions that ``armhil plan`` is given."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from daq.cli.entry import __file__ as entry_file
from robots import Robot
from robots.arrays import FloatArray
from tests.daq.captures import BATCH, record, samples

ROOT = Path(entry_file).parents[2]
PAGE = ROOT / "docs" / "reference" / "json.md"


def edited(folder: Path, arm: str, *edits: tuple[str, str]) -> Path:
    """A copy of a shipped arm with changes to its robot.toml."""
    source = ROOT / "robots" / arm
    folder.mkdir()
    for file in source.iterdir():
        if file.is_file():
            (folder / file.name).write_bytes(file.read_bytes())
    text = (folder / "robot.toml").read_text(encoding="utf-8")
    for pattern, instead in edits:
        text, count = re.subn(pattern, instead, text, count=1, flags=re.MULTILINE)
        assert count == 1, pattern
    (folder / "robot.toml").write_text(text, encoding="utf-8")
    return folder


def recorded(
    path: Path, robot: Robot, reference: FloatArray, patch: pytest.MonkeyPatch, *others: FloatArray
) -> None:
    """A capture of a reference at the arm's cycle, with positions and control signals where given."""
    names = ("reference", "position", "control_signal")
    batches = []
    for first in range(0, len(reference), BATCH):
        part = samples(first, min(BATCH, len(reference) - first), robot.n, robot.bus.cycle_time)
        for name, values in zip(names, (reference, *others), strict=False):
            getattr(part, name)[:] = values[first : first + BATCH]
        batches.append(part)
    record(path, robot, batches, patch, robot.bus.cycle_time)


def write_swing(path: Path, amplitude: float, seconds: float = 4.0, kick: float = 0.0) -> None:
    """Half a cosine there and back for the one-axis arm, from 0 to rest at 0."""
    t = np.arange(0.0, seconds + 5e-4, 1e-3)
    q = amplitude * 0.5 * (1 - np.cos(2 * np.pi * t / seconds)) + kick * t
    path.write_text(
        "t,carriage\n" + "\n".join(f"{a!r},{b!r}" for a, b in zip(t.tolist(), q.tolist(), strict=True))
    )
