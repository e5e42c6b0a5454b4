"""Where the drives say that an arm stands, on the terminal."""

from __future__ import annotations

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from daq.session.joints import shown
from robots import Robot
from robots.arrays import FloatArray


def print_posture(console: Console, robot: Robot, posture: FloatArray) -> None:
    """Joint by joint: what the drives say (n,), rad or m; limits, and where the arm rests."""
    table = Table(box=SIMPLE_HEAD, padding=(0, 1))
    for heading in ("joint", "drives say", "limits", "rests at", "supply off"):
        table.add_column(heading, no_wrap=True)
    for axis, (joint, drive) in enumerate(zip(robot.joint, robot.drive, strict=True)):
        table.add_row(
            joint.name,
            shown(robot, axis, float(posture[axis])),
            f"{joint.position[0]:.3g} to {joint.position[1]:.3g}",
            f"{robot.home[axis]:.4g}",
            "keeps" if drive.position_reference == "absolute" else "[yellow]forgets[/]",
        )
    console.print(table)
