"""Who watches a stream: a terminal, a web page, nobody."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from daq.session.states import Conduct
from daq.text.progress import Update
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


@dataclass
class StepBar:
    """Shows a stream as one step of a longer piece of work."""

    update: Update
    total: int = 1

    def begin(self, title: str, trajectory: Trajectory, conduct: Conduct) -> None:
        """The way to go is known."""
        self.total = len(trajectory.time)

    def samples(self, samples: Samples) -> None:
        """How far it is, and what has gone missing."""
        if len(samples):
            cycle = int(samples.cycle[-1])
            missing = int((~samples.complete).sum())
            word = f"cycle {cycle}, {missing} late TPDOs" if missing else f"cycle {cycle}"
            self.update(cycle / self.total, word)

    def end(self, result: StreamResult | None) -> None:
        """The step ends by itself."""
