"""What goes wrong in a session and is the user's to know."""

from __future__ import annotations

from robots.errors import UserError


class SessionError(UserError):
    """A session cannot be held as it was asked for; one line for the user."""


class RunInterrupted(Exception):
    """The run was stopped on request; the arm is at rest and the capture so far is readable."""


class RunFailed(UserError):
    """The arm ended the run itself; the capture so far is readable."""


class NotMoved(UserError):
    """Somebody said no before anything moved."""
