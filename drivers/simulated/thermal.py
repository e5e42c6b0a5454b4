"""How warm a motor gets from its current: a first-order model, with warning and fault thresholds."""

from __future__ import annotations

import math

AMBIENT = 25.0
"""°C."""
TIME_CONSTANT = 600.0
"""s; of a small servo motor's winding and housing."""
CONTINUOUS_SHARE = 0.5
"""Share of the largest current that may flow for ever."""
RISE = 80.0
"""K above ambient that the continuous current leads to."""
WARNING, LIMIT = 105.0, 115.0
"""°C at which the drive warns (statusword bit 7) and at which it goes to fault (EMCY 4310h)."""


class MotorTemperature:
    """Temperature of one motor."""

    def __init__(self) -> None:
        self.celsius = AMBIENT
        self.extra_rate = 0.0
        """K/s beside what the current does: a fault that was asked for."""

    def advance(self, current_share: float, seconds: float) -> None:
        """Let time pass.

        Args:
            current_share: current over the largest one.
            seconds: s.
        """
        end = AMBIENT + RISE * (current_share / CONTINUOUS_SHARE) ** 2
        self.celsius = end + (self.celsius - end) * math.exp(-seconds / TIME_CONSTANT)
        self.celsius += self.extra_rate * seconds

    @property
    def warns(self) -> bool:
        """Whether the motor is warmer than it should be."""
        return self.celsius > WARNING

    @property
    def too_hot(self) -> bool:
        """Whether the drive must stop."""
        return self.celsius > LIMIT
