"""Six foreign drives on a CAN device under our master, as a program: device and slave are its arguments.

It is started by test_foreign_slave.py, inside a user-mode kernel where this one has no CAN. The answer is one
JSON line.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

import robots
from daq.doctor.check import worst
from daq.doctor.doctor import bus_checks
from drivers import ArmSession, Channel, DriveError, Samples, StreamControl
from drivers.setup.scan import scan
from robots import Robot

UNITS = {"encoder_counts": 4096, "gear": 100.0, "counts_per_output_turn": 360_000.0}
"""608F, 6091 and 6092 of the slaves: thousandths of a degree at the output."""


def arm(**changes: Any) -> Robot:
    """The TX40 with these drives."""
    robot = robots.load("tx40")
    changed = tuple(drive.model_copy(update=UNITS | changes) for drive in robot.drive)
    return robot.model_copy(update={"drive": changed})


@contextmanager
def slaves(program: str, device: str, nodes: range, *more: str) -> Iterator[list[subprocess.Popen[bytes]]]:
    """The slaves, each a process of its own."""
    running = [subprocess.Popen([program, device, str(node), *more]) for node in nodes]
    try:
        yield running
    finally:
        for each in running:
            each.kill()
            each.wait()


def wait_for(channel: Channel, count: int) -> list[dict[str, Any]]:
    """What a scan finds, as soon as all are there."""
    deadline = time.monotonic() + 20.0
    while len(found := scan(channel)) < count and time.monotonic() < deadline:
        pass
    return [
        {"node": drive.node, "units": drive.units, "watches": drive.watches, "modes": drive.modes}
        for drive in found
    ]


def main(device: str, program: str) -> None:
    """Scan, refuse a wrong description, jog, stream, and lose a drive."""
    channel, answer = Channel("socketcan", device), dict[str, Any]()
    robot = arm()
    nodes = range(1, robot.n + 1)
    with slaves(program, device, nodes) as running:
        answer["found"] = wait_for(channel, robot.n)
        answer["doctor"] = worst(tuple(bus_checks(channel)[:1]))
        try:
            ArmSession(arm(counts_per_output_turn=None), channel).open()
        except DriveError as error:
            answer["wrong"] = str(error)
        with ArmSession(robot, channel, allow_jog=True) as session:
            answer["findings"] = [str(finding) for finding in session.drives[0].findings]
            answer["jogs"] = []
            for joint in robot.joint:
                began = session.actual_position()
                result = session.jog(joint.name, np.deg2rad(2.0))
                moved = np.rad2deg(session.actual_position() - began)
                answer["jogs"].append([result.outcome, result.reason, np.round(moved, 4).tolist()])
            answer["run"] = stream(session, lambda samples: None)

            def kill(samples: Samples) -> None:
                if samples.cycle[-1] > 200:
                    running[3].kill()

            answer["killed"] = stream(session, kill)
    sys.stdout.write(json.dumps(answer) + "\n")


def stream(session: ArmSession, on_samples: Any) -> dict[str, Any]:
    """Two seconds there and back with all joints."""
    t = np.linspace(0.0, 1.0, 500)
    bell = 64 * (t * (1 - t)) ** 3
    batches = [Samples.empty(session.robot.n)]

    def keep(samples: Samples) -> None:
        batches.append(samples)
        on_samples(samples)

    result = session.stream(
        session.actual_position() + 0.1 * bell[:, None], keep, control=StreamControl(None)
    )
    samples = Samples.concatenate(batches)
    error = np.abs(samples.position - samples.reference)[samples.complete.all(axis=1)]
    return {
        "outcome": result.outcome,
        "reason": result.reason,
        "ending": result.ending,
        "cycles": len(samples),
        "incomplete": result.incomplete_cycles,
        "largest_error": float(error.max(initial=0.0)),
    }


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
