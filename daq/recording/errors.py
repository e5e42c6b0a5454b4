"""What a user can cause with a capture or a log; alone here, so that a reader's process starts quickly."""

from __future__ import annotations

from robots.errors import UserError

CAPTURE_SUFFIX = ".mcap"
"""Of a capture's file."""


class CaptureError(UserError, ValueError):
    """A capture or a recording that cannot be read or written; the text is one line for the user."""
