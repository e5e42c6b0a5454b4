"""``cell.toml``: what stands around an arm and what its tool may do (docs/reference/cell-toml.md)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from daq.files.toml_file import read_toml
from trajectories import Obstacle, Surroundings, Tool

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Point = tuple[Finite, Finite, Finite]


class CellFileError(ValueError):
    """A cell file that cannot be read; the text is one line for the user."""


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class CellTool(_Frozen):
    """The tool and its speed limit."""

    frame: str | None = Field(default=None, description="link of the URDF; the last one where absent")
    offset: Point = Field(default=(0.0, 0.0, 0.0), description="of the watched point in that frame, m")
    speed: Positive | None = Field(default=None, description="highest speed of the point, m/s")


class CellObstacle(_Frozen):
    """A box at rest."""

    name: Annotated[str, Field(min_length=1)]
    centre: Point = Field(description="in the base frame, m")
    size: tuple[Positive, Positive, Positive] = Field(description="edges along x, y, z before turning, m")
    turn: Finite = Field(default=0.0, description="about the vertical axis through the centre, rad")


class CellFile(_Frozen):
    """The surroundings of an arm."""

    format: Literal[1]
    floor: Finite | None = Field(default=None, description="height of the floor in the base frame, m")
    clearance: Positive = Field(default=0.01, description="smallest distance allowed, m")
    tool: CellTool = CellTool()
    obstacle: tuple[CellObstacle, ...] = ()

    @property
    def surroundings(self) -> Surroundings:
        """What the arm may not touch."""
        boxes = tuple(Obstacle(box.name, box.centre, box.size, box.turn) for box in self.obstacle)
        return Surroundings(self.floor, boxes, clearance=self.clearance)

    @property
    def watched_tool(self) -> Tool:
        """The point whose speed is watched."""
        return Tool(self.tool.frame, self.tool.offset)


def read_cell(path: Path) -> CellFile:
    """Read a cell file.

    Raises:
        CellFileError: one line with file, line, key and what is allowed.
    """
    return read_toml(path, CellFile, CellFileError, kind="a cell file (cell.toml)")
