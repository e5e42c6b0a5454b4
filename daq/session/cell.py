"""The cell of a session: what its motions keep clear of, and by what the file that says so is known."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

from daq.files.cell_file import read_cell
from trajectories import Conditions, Margins

_ALL_ALLOWED = Margins(position=0.0, velocity=1.0, torque=1.0)
"""What is driven is held to the limits themselves; only a plan keeps a distance from them."""


@dataclass(frozen=True)
class Cell:
    """What stands around an arm.

    Attributes:
        conditions: of every motion of the session; with the arm's own limits, none of them kept away from.
        file: None where there is none.
        sha256: of the file; empty where there is none.
        words: for people; empty where there is none.
    """

    conditions: Conditions = field(default_factory=lambda: Conditions(margins=_ALL_ALLOWED))
    file: Path | None = None
    sha256: str = ""
    words: str = ""

    @property
    def for_plans(self) -> Conditions:
        """The same, with a plan's distance from the limits."""
        return replace(self.conditions, margins=Margins())


def cell_of(path: Path | None) -> Cell:
    """The cell of a file; nothing but the arm itself where None.

    Raises:
        CellFileError: one line with file, line, key and what is allowed.
    """
    if path is None:
        return Cell()
    found = read_cell(path)
    conditions = Conditions(
        margins=_ALL_ALLOWED,
        surroundings=found.surroundings,
        tool=found.watched_tool,
        tool_speed=found.tool.speed,
    )
    parts = ["no floor" if found.floor is None else f"floor at {found.floor:g} m"]
    parts += [box.name for box in found.obstacle]
    parts += [] if found.tool.speed is None else [f"tool up to {found.tool.speed:g} m/s"]
    return Cell(conditions, path, found.sha256, f"{path}: {', '.join(parts)}")
