"""What a user of the identification can cause."""

from __future__ import annotations

from robots.errors import UserError


class IdentificationError(UserError, ValueError):
    """The recordings cannot be identified; the message is one line that says what and why."""


class SimulationError(IdentificationError):
    """The arm with the estimated parameters cannot be simulated: it is not the arm that was recorded."""


class SimulationDivergedError(SimulationError):
    """The simulated loop ran away, which the real one did not."""


class MassMatrixError(SimulationError):
    """The estimated mass matrix is not positive definite, as that of every arm is."""
