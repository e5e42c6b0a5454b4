"""Checks that were started over HTTP: each in a process of its own, at most one per arm."""

from __future__ import annotations

import signal
import subprocess
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from daq.check.fleet import FleetArm, read_fleet


class NotDrivenError(Exception):
    """A check that cannot be started or stopped; one line."""


@dataclass
class Job:
    """One check under way or ended."""

    number: int
    place: int
    robot: str
    started: datetime
    process: subprocess.Popen[bytes]

    def as_dict(self) -> dict[str, object]:
        """For JSON."""
        return {
            "job": self.number,
            "arm": self.place,
            "robot": self.robot,
            "started": self.started.isoformat(),
            "exit_code": self.process.poll(),
        }


class Driving:
    """Starts and stops checks of the fleet's arms.

    Args:
        fleet: its file; the user's where None.
        folder: that the results go below.
    """

    def __init__(self, fleet: Path | None, folder: Path) -> None:
        self._fleet = fleet
        self._folder = folder
        self._jobs: list[Job] = []

    def start(self, place: int) -> Job:
        """Start the check of the fleet's arm of that place, from 1.

        Raises:
            NotDrivenError: there is no such arm, or its check is under way.
            FleetFileError, CheckError: the fleet cannot be read.
        """
        arms = read_fleet(self._fleet).arm
        if not 1 <= place <= len(arms):
            raise NotDrivenError(f"arm {place} of the fleet; allowed: 1 to {len(arms)}")
        if any(job.place == place and job.process.poll() is None for job in self._jobs):
            raise NotDrivenError(f"arm {place} of the fleet is being checked already")
        stamp = datetime.now(tz=UTC)
        number = len(self._jobs) + 1
        out = self._folder / f"{stamp:%Y%m%d-%H%M%S}-http-{number}"
        command = [
            sys.executable,
            "-m",
            "daq",
            "check",
            *options_of(arms[place - 1]),
            "--quiet",
            "--out",
            str(out),
        ]
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        job = Job(number, place, arms[place - 1].robot, stamp, process)
        self._jobs.append(job)
        return job

    def stop(self, number: int) -> Job:
        """Ask a check to come to rest, as Ctrl-C does.

        Raises:
            NotDrivenError: there is no such check under way.
        """
        for job in self._jobs:
            if job.number == number and job.process.poll() is None:
                job.process.send_signal(signal.SIGINT)
                return job
        raise NotDrivenError(f"job {number} is not under way")

    def every(self) -> tuple[Job, ...]:
        """All checks that were started, newest first."""
        return tuple(reversed(self._jobs))

    def close(self) -> None:
        """Bring what moves to rest; called when the service ends."""
        for job in self._jobs:
            if job.process.poll() is None:
                job.process.send_signal(signal.SIGINT)
        for job in self._jobs:
            job.process.wait()


def options_of(arm: FleetArm) -> list[str]:
    """What ``armhil check`` is given for an arm of the fleet."""
    options = [arm.robot]
    for name, value in (
        ("--interface", arm.interface),
        ("--channel", arm.channel),
        ("--trajectory", arm.trajectory),
        ("--cell", arm.cell),
    ):
        if value is not None:
            options += [name, value]
    if arm.simulated:
        hidden = [] if arm.scenario is None else ["--scenario", arm.scenario]
        options += ["--simulated", "--seed", str(arm.seed), *hidden]
    return options
