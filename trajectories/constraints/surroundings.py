"""What stands around an arm, and how near the arm may come to it and to itself."""

from __future__ import annotations

from dataclasses import dataclass

from trajectories.errors import TrajectoryError


@dataclass(frozen=True)
class Obstacle:
    """A box at rest in the base frame of the arm.

    Attributes:
        name: as reports call it.
        centre: x, y, z, m.
        size: length of the edges along x, y, z before it is turned, m.
        turn: about the z axis through its centre, rad.
    """

    name: str
    centre: tuple[float, float, float]
    size: tuple[float, float, float]
    turn: float = 0.0

    def __post_init__(self) -> None:
        if min(self.size) <= 0.0:
            raise TrajectoryError(
                f"obstacle {self.name} has size {self.size}; allowed: edges above 0 m", constraint=self.name
            )


@dataclass(frozen=True)
class Surroundings:
    """What an arm may not touch.

    Attributes:
        floor: height of the floor in the base frame, m; None for no floor.
        obstacles: boxes.
        itself: whether its own links count.
        clearance: smallest distance allowed, m.
    """

    floor: float | None = None
    obstacles: tuple[Obstacle, ...] = ()
    itself: bool = True
    clearance: float = 0.01

    def __post_init__(self) -> None:
        if not 0.0 < self.clearance < float("inf"):
            raise TrajectoryError(
                f"clearance is {self.clearance} m; allowed: above 0", constraint="clearance"
            )
        if self.floor is not None and not -float("inf") < self.floor < float("inf"):
            raise TrajectoryError(
                f"floor is at {self.floor} m; allowed: a height in the base frame", constraint="floor"
            )
