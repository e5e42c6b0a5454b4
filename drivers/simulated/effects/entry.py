"""What all entries of a scenario have in common."""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Share = Annotated[float, Field(ge=-0.95, le=20.0)]
"""A relative change; −1 would leave nothing."""
Axis = Annotated[int, Field(ge=1, le=64)]


class Entry(BaseModel):
    """A frozen value with one line of meaning."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    sentence: ClassVar[str] = ""
    """What it is, for the reference page."""
    repeats: ClassVar[bool] = False
    """Whether one axis may have several."""
    outside_vocabulary: ClassVar[bool] = False
    """Whether no model of the arm has a name for it."""

    def axes(self) -> tuple[int, ...]:
        """The joints or drives that it sits on, from 1; empty where it is of the whole arm."""
        return ()


class DriveEntry(Entry):
    """An effect in one drive or its gear."""

    drive: Axis = Field(description="number of the drive, from 1")

    def fill(self, drive: np.void) -> None:
        """Sets its figures in the record of its drive; effects on several records are assembled elsewhere."""

    def axes(self) -> tuple[int, ...]:
        return (self.drive,)


class JointEntry(Entry):
    """An effect at one joint."""

    joint: Axis = Field(description="number of the joint, from 1")

    def fill(self, joint: np.void) -> None:
        """Sets its figures in the record of its joint; what draws random numbers acts elsewhere."""

    def axes(self) -> tuple[int, ...]:
        return (self.joint,)
