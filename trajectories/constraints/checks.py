"""Conditions that a motion must keep, asked for in three ways by the search and by the last word."""

from __future__ import annotations

from typing import Protocol

from trajectories.motions.motion import Motion


class Check(Protocol):
    """One condition on a motion."""

    def allows(self, motion: Motion) -> bool:
        """Whether a motion keeps it; quick, and never true of a motion that does not."""
        ...

    def excess(self, motion: Motion) -> float:
        """How far a motion is from keeping it, from a quick look; 0 where nothing was seen."""
        ...

    def require(self, motion: Motion) -> None:
        """Raise where a motion breaks it.

        Raises:
            TrajectoryError: names constraint, joint and time.
        """
        ...
