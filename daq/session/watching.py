"""Who watches a stream: a terminal, a web page, nobody."""

from __future__ import annotations

from typing import Protocol

from daq.session.states import Conduct
from drivers import Samples, StreamResult
from trajectories import Trajectory


class Watcher(Protocol):
    """Sees a stream: a terminal, a web page, nobody."""

    def begin(self, title: str, trajectory: Trajectory, conduct: Conduct) -> None:
        """A stream is about to start."""

    def samples(self, samples: Samples) -> None:
        """Samples have come; called often, so it has to be quick."""

    def end(self, result: StreamResult | None) -> None:
        """It is over; None where it did not start or ended with an error."""


class Nobody:
    """Nobody watches."""

    def begin(self, title: str, trajectory: Trajectory, conduct: Conduct) -> None:
        """Nobody watches."""

    def samples(self, samples: Samples) -> None:
        """Nobody watches."""

    def end(self, result: StreamResult | None) -> None:
        """Nobody watches."""
