"""``cell.toml``: what stands around an arm and what its tool may do (docs/reference/cell-toml.md)."""

from __future__ import annotations

import json
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from daq.files.toml_file import read_toml
from robots.errors import UserError, ValueNotAllowed
from trajectories import Obstacle, Surroundings, Tool

Coordinate = Annotated[float, Field(ge=-100, le=100, allow_inf_nan=False)]
Edge = Annotated[float, Field(ge=1e-3, le=200, allow_inf_nan=False)]
Point = tuple[Coordinate, Coordinate, Coordinate]


class CellFileError(UserError, ValueError):
    """A cell file that cannot be read; the text is one line for the user."""


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class CellTool(_Frozen):
    """The tool and its speed limit."""

    frame: str | None = Field(default=None, description="link of the URDF; the last one where absent")
    offset: Point = Field(default=(0.0, 0.0, 0.0), description="of the watched point in that frame, m")
    speed: float | None = Field(default=None, ge=1e-3, le=20, description="highest speed of the point, m/s")


class CellObstacle(_Frozen):
    """A box at rest."""

    name: Annotated[str, Field(min_length=1)]
    centre: Point = Field(description="in the base frame, m")
    size: tuple[Edge, Edge, Edge] = Field(description="edges along x, y, z before turning, m")
    turn: float = Field(
        default=0.0, ge=-7, le=7, description="about the vertical axis through the centre, rad"
    )


class CellFile(_Frozen):
    """The surroundings of an arm."""

    format: Literal[1]
    floor: float | None = Field(
        default=None, ge=-100, le=100, description="height of the floor in the base frame, m"
    )
    clearance: float = Field(default=0.01, ge=1e-4, le=1, description="smallest distance allowed, m")
    tool: CellTool = CellTool()
    obstacle: tuple[CellObstacle, ...] = ()

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        names = [box.name for box in self.obstacle]
        for k, name in enumerate(names):
            if name == "floor" or name in names[:k]:
                raise ValueNotAllowed(
                    ("obstacle", k, "name"), "names something else already", "a name of its own"
                )
        return self

    @property
    def sha256(self) -> str:
        """Checksum of what the file says; not how it is written."""
        said = _without_signs_of_zeros(self.model_dump(mode="json", exclude_defaults=True))
        return sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()

    @property
    def surroundings(self) -> Surroundings:
        """What the arm may not touch."""
        boxes = tuple(Obstacle(box.name, box.centre, box.size, box.turn) for box in self.obstacle)
        return Surroundings(self.floor, boxes, clearance=self.clearance)

    @property
    def watched_tool(self) -> Tool:
        """The point whose speed is watched."""
        return Tool(self.tool.frame, self.tool.offset)


def _without_signs_of_zeros(said: Any) -> Any:
    """The same with 0.0 in place of -0.0, which stands for the same place."""
    if isinstance(said, dict):
        return {key: _without_signs_of_zeros(value) for key, value in said.items()}
    if isinstance(said, list | tuple):
        return [_without_signs_of_zeros(value) for value in said]
    return said + 0.0 if isinstance(said, float) else said


def read_cell(path: Path) -> CellFile:
    """Read a cell file.

    Raises:
        CellFileError: one line with file, line, key and what is allowed.
    """
    return read_toml(path, CellFile, CellFileError, kind="a cell file (cell.toml)")
