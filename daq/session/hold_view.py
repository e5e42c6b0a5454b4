"""The picture of an arm that is moved by keys that are held: joints, speed, what the keys do."""

from __future__ import annotations

from types import TracebackType
from typing import Self

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from daq.session.joints import shown
from daq.session.live_view import REFRESH
from daq.session.states import Conduct, SessionState
from drivers import Samples, StreamResult
from robots import Robot
from robots.arrays import FloatArray
from trajectories import Trajectory

KEYS = "hold ← → or - + move   1-{joints} joint   ↑ ↓ speed   t keep posture   q leave"

_STATES = {
    SessionState.IDLE: "at rest, no torque",
    SessionState.RUNNING: "moves while the key is held",
    SessionState.ABORTING: "comes to rest",
}


class HoldView:
    """Watches the streams, and shows joint, speed and the last message between them.

    Args:
        console: a terminal.
        robot: the arm.
    """

    def __init__(self, console: Console, robot: Robot) -> None:
        self._robot = robot
        self._conduct: Conduct | None = None
        self.axis = 0
        """The joint that the keys move."""
        self.speed = 0.0
        """Share of its speed."""
        self.position: FloatArray = np.full(robot.n, np.nan)
        """(n,) where the arm stands, rad or m."""
        self.message = ""
        self._live = Live(console=console, get_renderable=self.picture, refresh_per_second=REFRESH)

    def __enter__(self) -> Self:
        self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._live.stop()

    def begin(self, title: str, trajectory: Trajectory, conduct: Conduct) -> None:
        """A joint is about to move."""
        self._conduct, self.message = conduct, ""

    def samples(self, samples: Samples) -> None:
        """Take the last position."""
        if len(samples):
            self.position = samples.position[-1]

    def end(self, result: StreamResult | None) -> None:
        """It is at rest again."""
        self._conduct = None

    def picture(self) -> RenderableType:
        """The arm as it is now."""
        robot, conduct = self._robot, self._conduct
        state = SessionState.IDLE if conduct is None else conduct.state
        table = Table(box=None, padding=(0, 1), pad_edge=False)
        for heading in ("", "joint", "position", "limits"):
            table.add_column(heading, no_wrap=True)
        for axis, joint in enumerate(robot.joint):
            chosen = axis == self.axis
            limits = f"{robot.lower[axis]:.3g} to {robot.upper[axis]:.3g}"
            table.add_row(
                "▶" if chosen else str(axis + 1),
                joint.name,
                shown(robot, axis, float(self.position[axis])),
                limits,
                style="bold" if chosen else "",
            )
        words = _STATES.get(state, state.value)
        head = Text(f"{words}; {100 * self.speed:g} % of the joint's speed", style="bold")
        parts: list[RenderableType] = [head, table]
        if self.message:
            parts.append(Text(self.message, style="yellow"))
        parts.append(Text(KEYS.format(joints=robot.n), style="dim"))
        return Panel(Group(*parts), title=f"Jog {robot.name}")
