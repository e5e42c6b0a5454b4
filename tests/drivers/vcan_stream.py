"""One stream over a CAN device, as a program: the device is its argument, the answer one JSON line.

It is started by test_vcan.py, inside a user-mode kernel where this one has no CAN.
"""

from __future__ import annotations

import hashlib
import json
import sys

import numpy as np

import robots
from drivers import ArmSession, Channel, Samples
from drivers.simulated import SimulatedArm


def main(device: str) -> None:
    """Stream two seconds with the simulated arm and say what came of it."""
    robot = robots.load("tx40")
    channel = Channel("socketcan", device)
    batches = [Samples.empty(robot.n)]
    with SimulatedArm("tx40", channel, seed=4), ArmSession(robot, channel) as session:
        t = np.linspace(0.0, 1.0, 500)
        bell = 64 * (t * (1 - t)) ** 3
        reference = session.actual_position() + 0.1 * bell[:, None]
        result = session.stream(reference, batches.append)
    samples = Samples.concatenate(batches)
    content = b"".join(
        column.tobytes()
        for column in (samples.reference, samples.position, samples.control_signal, samples.statusword)
    )
    answer = {
        "outcome": result.outcome,
        "reason": result.reason,
        "cycles": len(samples),
        "missed": result.missed_cycles,
        "late": result.late_cycles,
        "incomplete": int(np.count_nonzero(~samples.complete)),
        "largest_lateness": float(samples.lateness.max(initial=0.0)),
        "largest_error": float(np.abs(samples.position - samples.reference).max(initial=0.0)),
        "content": hashlib.sha256(content).hexdigest(),
    }
    sys.stdout.write(json.dumps(answer) + "\n")


if __name__ == "__main__":
    main(sys.argv[1])
