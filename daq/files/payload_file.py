"""``payload.toml``: a body of known mass that is screwed to the arm (docs/reference/payload-toml.md)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from daq.files.toml_file import read_toml
from robots.errors import UserError
from robots.payload import Payload

Coordinate = Annotated[float, Field(ge=-10, le=10, allow_inf_nan=False)]
Moment = Annotated[float, Field(ge=-1e5, le=1e5, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)]


class PayloadFileError(UserError, ValueError):
    """A payload file that cannot be read; the text is one line for the user."""


class PayloadFile(BaseModel):
    """A rigid body in a frame of the arm."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)

    format: Literal[1]
    mass: float = Field(ge=1e-4, le=1e4, description="kg")
    center: tuple[Coordinate, Coordinate, Coordinate] | None = Field(
        default=None, description="centre of mass in the frame, m"
    )
    inertia: tuple[Moment, Moment, Moment, Moment, Moment, Moment] | None = Field(
        default=None,
        description="ixx ixy iyy ixz iyz izz about the centre of mass, along the frame's axes, kg·m²",
    )
    frame: str | None = Field(default=None, min_length=1, description="link of the URDF; the last one")
    relative_uncertainty: Share = Field(default=0.0, description="standard uncertainty of the mass / mass")

    @model_validator(mode="after")
    def _inertia_about_a_centre(self) -> Self:
        if self.center is None and self.inertia is not None:
            raise ValueError("inertia is about the centre of mass, so it needs center")
        return self

    def payload(self) -> Payload:
        return Payload(self.mass, self.center, self.inertia, self.frame or "", self.relative_uncertainty)


def read_payload(path: Path) -> Payload:
    """Read a payload.

    Raises:
        PayloadFileError: one line with file, line, key and what is allowed.
    """
    return read_toml(path, PayloadFile, PayloadFileError, kind="a payload file (payload.toml)").payload()
