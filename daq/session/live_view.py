"""A stream on the terminal while it goes on: each joint, the cycle, and what may be pressed."""

from __future__ import annotations

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from daq.session.keyboard import DOING, help_lines
from daq.session.live_figures import Figures, LiveFigures
from daq.session.states import Conduct, SessionState
from daq.text.wrapped import write
from drivers import Samples, StreamResult
from robots import Robot
from trajectories import Trajectory

REFRESH = 5.0
"""Pictures a second: an eye reads numbers no faster, and each costs a few milliseconds of a core."""

_BAR, _SHORT_BAR = 16, 8
_FRAME = 4
"""Columns that the frame around the picture takes."""
_NARROW = 96
"""Columns of a terminal below which the table is set closer."""
_COLOURS = {
    SessionState.RUNNING: "green",
    SessionState.PAUSING: "cyan",
    SessionState.PAUSING_AFTER: "cyan",
    SessionState.PAUSED: "cyan",
    SessionState.STOPPING: "yellow",
    SessionState.ABORTING: "yellow",
    SessionState.HALTING: "red",
    SessionState.IDLE: "dim",
}


class LiveView:
    """Watches streams of one arm; on a terminal a picture, in a pipe one line at the start and the end.

    Args:
        console: where to.
        robot: the arm.
    """

    def __init__(self, console: Console, robot: Robot) -> None:
        self._console = console
        self._robot = robot
        self._live: Live | None = None

    def begin(self, title: str, trajectory: Trajectory, conduct: Conduct) -> None:
        """Show a stream from now on."""
        self._title, self._trajectory, self._conduct = title, trajectory, conduct
        self._figures = LiveFigures(self._robot)
        if not self._console.is_terminal:
            self._console.print(f"{title}: {trajectory.duration:.1f} s …", highlight=False)
            return
        self._live = Live(console=self._console, get_renderable=self.picture, refresh_per_second=REFRESH)
        self._live.start()

    def samples(self, samples: Samples) -> None:
        """Take samples in."""
        self._figures.add(samples)

    def end(self, result: StreamResult | None) -> None:
        """Leave the last picture standing, and say how it ended."""
        if self._live is not None:
            self._live.stop()
            self._live = None
        if result is not None:
            write(
                self._console,
                f"{self._title}: {result.outcome} ({result.reason}); {result.cycles_words}; {result.ending}",
            )

    def picture(self) -> RenderableType:
        """The stream as it is now."""
        figures, state = self._figures.now(), self._conduct.state
        parts: list[RenderableType] = [
            self._heading(figures, state),
            _joints(self._robot, figures, self._console.width < _NARROW),
        ]
        if state in DOING:
            parts.append(Text(DOING[state], style=_COLOURS[state]))
        keys = help_lines(state, self._console.width - _FRAME)
        if keys:
            parts.append(Text("\n".join(keys), style="dim"))
        return Panel(Group(*parts), title=self._title, border_style=_COLOURS[state])

    def _heading(self, figures: Figures, state: SessionState) -> RenderableType:
        total = len(self._trajectory.time)
        done = max(figures.cycle + 1, 0)
        left = (total - done) * self._robot.bus.cycle_time
        grid = Table.grid(padding=(0, 2))
        grid.add_row(
            Text(state.value, style=f"bold {_COLOURS[state]}"),
            ProgressBar(total=total, completed=done, width=30),
            f"{100 * done / total:.0f} %",
            f"{left:.0f} s left",
        )
        period = 1e3 * self._robot.bus.cycle_time
        measured = "–" if figures.cycle < 1 else f"{1e3 * figures.cycle_time:.2f}"
        longest = "–" if figures.cycle < 1 else f"{1e3 * figures.longest_cycle:.2f}"
        missed = Text(f"{figures.missed} missed", style="bold red" if figures.missed else "")
        late = Text(f"{figures.incomplete} late answers", style="yellow" if figures.incomplete else "")
        cycle = Text.assemble(
            f"cycle {max(figures.cycle, 0)}: {measured} ms of {period:g} ms, longest {longest} ms, ",
            missed,
            ", ",
            late,
        )
        return Group(grid, cycle)


def _joints(robot: Robot, figures: Figures, narrow: bool) -> Table:
    table = Table(box=None, padding=(0, 1), pad_edge=False)
    table.add_column("joint", no_wrap=True)
    table.add_column("position", justify="right", no_wrap=True)
    table.add_column("error" if narrow else "following error", justify="right", no_wrap=True)
    table.add_column("of limit", justify="right", no_wrap=True)
    table.add_column("torque", justify="right", no_wrap=True)
    table.add_column("peak, of limit", no_wrap=True)
    for axis, joint in enumerate(robot.joint):
        error = float(figures.following_error[axis])
        error_share = float(figures.following_error_share[axis])
        share = float(figures.torque_peak[axis] / figures.torque_limit[axis])
        table.add_row(
            joint.name,
            f"{float(figures.position[axis]):+.4f} {joint.unit}",
            f"{1e3 * error:+.3f} m{joint.unit}",
            Text(f"{100 * error_share:.0f} %", style=_warmth(error_share)),
            f"{float(figures.torque[axis]):+.2f} {joint.torque_unit}",
            _bar(share, _SHORT_BAR if narrow else _BAR),
        )
    return table


def _bar(share: float, length: int) -> Text:
    filled = round(length * min(share, 1.0))
    text = Text("█" * filled, style=_warmth(share))
    text.append("░" * (length - filled), style="dim")
    text.append(f" {100 * share:3.0f} %")
    return text


def _warmth(share: float) -> str:
    """Colour of a share of a limit; the number stands beside it for those who do not see colours."""
    return "bold red" if share > 0.9 else "yellow" if share > 0.7 else "green"
