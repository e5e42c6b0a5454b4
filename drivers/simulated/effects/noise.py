"""Noise other than that of the drawn arm."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from drivers.simulated.effects.entry import Entry, NonNegative


class Noise(Entry):
    sentence: ClassVar[str] = "process torque and encoders: louder, softer, or coloured"
    torque: NonNegative = Field(default=1.0, description="factor on the process torque")
    time_constant: NonNegative | None = Field(
        default=None,
        description="of first-order coloured process torque, s; 0 white; the arm's own where absent",
    )
    encoder: NonNegative = Field(default=1.0, description="factor on the encoders' noise")
