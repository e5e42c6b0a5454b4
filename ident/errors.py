"""The one exception a user of the identification can cause."""

from __future__ import annotations


class IdentificationError(ValueError):
    """The recordings cannot be identified; the message is one line that says what and why."""
