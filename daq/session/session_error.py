"""What goes wrong in a session and is the user's to know."""

from __future__ import annotations


class SessionError(Exception):
    """A session cannot be held as it was asked for; one line for the user."""


class RunInterrupted(Exception):
    """The run was stopped on request; the arm is at rest and the capture so far is readable."""


class RunFailed(Exception):
    """The arm ended the run itself; the capture so far is readable."""


class NotMoved(Exception):
    """Somebody said no before anything moved."""
