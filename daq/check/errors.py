"""What a check refuses; quick to import."""

from __future__ import annotations

from robots.errors import UserError


class CheckError(UserError):
    """A check that cannot be made as it was asked for; one line for the user."""
