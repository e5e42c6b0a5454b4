"""Records at 1 kHz until it is killed or the disk is full: ``recording_process.py FILE [BYTES]``.

It prints the number of cycles it has handed to the recorder after each batch; with BYTES, no file of
its may grow beyond them.
"""

from __future__ import annotations

import resource
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[3]))

import robots
from daq.recording.capture import CaptureError
from daq.recording.recorder import Recorder
from tests.daq.captures import BATCH, PERIOD, facts, samples, traffic


def main() -> None:
    robot = robots.load("tx40")
    if len(sys.argv) > 2:
        limit = int(sys.argv[2])
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
    cycle = 0
    try:
        with Recorder(Path(sys.argv[1]), robot, facts(robot)) as recorder:
            while True:
                recorder.write(samples(cycle, BATCH))
                recorder.write_frames(traffic(robot, BATCH, time.time_ns()))
                cycle += BATCH
                say(str(cycle))
                time.sleep(BATCH * PERIOD)
    except CaptureError as error:
        say(f"refused: {error}")


def say(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


main()
