"""What a user of the drivers can meet: each message is one line that says what and where."""

from __future__ import annotations

from robots.errors import UserError


class BusError(UserError):
    """A bus cannot be opened or is in use; the message names the channel and the reason."""


class BusOccupied(BusError):
    """Somebody else uses the bus."""


class DriveError(UserError):
    """A drive or a reference is refused; the message names the drive or joint and the reason."""
