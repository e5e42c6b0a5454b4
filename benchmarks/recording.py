"""What a recording survives: kill -9, cut-off files, wrong bits, a disk that fills or goes read-only.

    python benchmarks/recording.py kill --runs 50
    python benchmarks/recording.py damage --trials 100
    python benchmarks/recording.py disk

``kill``: a recorder at 1 kHz with six joints and raw frames is killed at random times; what was handed to it
and is not in the file is lost. ``damage``: random truncations and random single-bit flips of one capture;
every cycle that comes back must be as recorded, every one that does not must be named, and what lies in
chunks that the damage did not touch must be there. ``disk``: the disk fills, or turns read-only, while a
simulated arm moves. Seeds are fixed.
"""

from __future__ import annotations

import argparse
import errno
import json
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

import robots
from daq.recording.capture import Capture, CaptureError
from daq.recording.listener import FrameListener
from daq.recording.mcap_file import MAGIC
from daq.recording.reader import read_capture
from daq.recording.recorder import Recorder
from daq.recording.recovery import recover
from drivers import ArmSession, Channel, DriveError, Samples
from drivers.session.jog import jog_path
from drivers.simulated import SimulatedArm
from tests.daq.captures import BATCH, PERIOD, FailingFile, facts, outcome, samples, traffic

PROCESS = Path(__file__).parents[1] / "tests" / "daq" / "recording" / "recording_process.py"


def kill(runs: int) -> None:
    """Kill a recorder at random times and count what is lost."""
    generator = random.Random(20)
    losses = []
    for _ in range(runs):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "run.mcap"
            process = subprocess.Popen(
                [sys.executable, str(PROCESS), str(path)], stdout=subprocess.PIPE, text=True
            )
            assert process.stdout is not None
            first = process.stdout.readline()
            time.sleep(generator.uniform(0.05, 3.0))
            process.kill()
            written = int((first + process.stdout.read()).split()[-1])
            process.wait()
            found = recover(path, Path(folder) / "out.mcap").capture
            kept = len(found.samples)
            check(found, kept)
            assert not found.damage.gaps
            assert not found.damage.closed
            losses.append((written - kept) * PERIOD)
    report("kill", runs=runs, worst_loss_s=max(losses), median_loss_s=float(np.median(losses)))


def check(capture: Capture, cycles: int) -> None:
    """Every cycle of it is as recorded."""
    expected = samples(0, cycles)
    rows = capture.samples.cycle
    for field in fields(Samples):
        np.testing.assert_array_equal(
            getattr(capture.samples, field.name), getattr(expected, field.name)[rows], strict=True
        )


def damage(trials: int, seconds: float = 20.0) -> None:
    """Cut and flip one capture of twenty seconds at 1 kHz with raw frames."""
    robot = robots.load("tx40")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "whole.mcap"
        cycles = round(seconds / PERIOD)
        with Recorder(path, robot, facts(robot), start_ns=1_700_000_000_000_000_000) as recorder:
            for begin in range(0, cycles, BATCH):
                recorder.write(samples(begin, BATCH))
                recorder.write_frames(traffic(robot, BATCH, 1_700_000_000_000_000_000 + begin * 1_000_000))
                if begin % (2 * BATCH):
                    recorder._flush()  # as a clock of a run does each 0.1 s
            recorder.finish(outcome(cycles))
        whole = path.read_bytes()
        generator = random.Random(21)

        def cut(data: bytearray) -> int:
            at = generator.randrange(len(MAGIC), len(data))
            del data[at:]
            return at

        def flip(data: bytearray) -> int:
            at = generator.randrange(len(MAGIC), len(data))
            data[at] ^= 1 << generator.randrange(8)
            return at

        for name, change in (("truncations", cut), ("bit flips", flip)):
            there, intact, refused = [], [], 0
            for _ in range(trials):
                data = bytearray(whole)
                at = change(data)
                cut_at = at if name == "truncations" else None
                found = one_trial(Path(folder), bytes(data), whole, cut_at, cycles)
                if found is None:
                    refused += 1
                    continue
                there.append(found)
                # The cycles that were in the file before the cut, by their share of its bytes.
                intact.append(cycles if cut_at is None else cycles * cut_at / len(whole))
            report(
                name,
                trials=trials,
                refused_with_one_line=refused,
                silently_wrong=0,
                share_recovered=sum(there) / sum(intact),
                worst_loss_s=max(b - a for a, b in zip(there, intact, strict=True)) * PERIOD,
            )


def one_trial(folder: Path, data: bytes, whole: bytes, cut_at: int | None, cycles: int) -> int | None:
    """The cycles that come back, all as recorded and all others named; None where the file is refused."""
    source, out = folder / "damaged.mcap", folder / "out.mcap"
    source.write_bytes(data)
    out.unlink(missing_ok=True)
    try:
        capture = recover(source, out).capture
    except CaptureError as error:
        one_line = "\n" not in str(error)
        # Nothing but the head of the file is left.
        assert one_line
        assert cut_at is not None
        assert cut_at < whole.index(b"zstd", whole.index(b"armhil.trajectory"))
        return None
    check(capture, cycles)
    found = capture.samples.cycle
    told = sum(gap.cycles for gap in capture.damage.gaps)
    end = cycles if capture.outcome is not None else (int(found[-1]) + 1 if len(found) else 0)
    assert told == end - len(found)
    if len(found) < cycles:
        assert capture.damage
    return len(found)


def disk() -> None:
    """The disk fails while the simulated arm moves: it comes to rest on its ramp, and the line says so."""
    for number in (errno.ENOSPC, errno.EROFS):
        with tempfile.TemporaryDirectory() as folder:
            report(errno.errorcode[number], **failing_run(Path(folder), number))


def failing_run(folder: Path, number: int) -> dict[str, object]:
    robot = robots.load("tx40")
    channel = Channel("udp_multicast", "239.74.251.3:23461")
    path = folder / "run.mcap"
    seen: list[Samples] = []
    with (
        SimulatedArm("tx40", channel, 1),
        ArmSession(robot, channel) as session,
        FrameListener(channel) as listener,
        Recorder(path, robot, facts(robot, robot.bus.cycle_time), listener=listener) as recorder,
    ):
        way = jog_path(robot, session.actual_position(), "joint_2", 0.2, 0.1)
        recorder._writer._file = FailingFile(recorder._file, 60_000, number)  # type: ignore[assignment]

        def keep(batch: Samples) -> None:
            seen.append(batch)
            recorder.write(batch)

        try:
            session.stream(way, keep)
            message = "the run was not ended"
        except (CaptureError, DriveError) as error:
            message = str(error)
        states = [sdo.read_int(0x6041) & 0x6F for sdo in session._connection.drives]
    kept = read_capture(path, allow_empty=True)
    return {
        "message": message,
        "drives_disabled": all(state & 0x4F == 0x40 for state in states),
        "cycles_streamed": sum(len(batch) for batch in seen),
        "cycles_kept": len(kept.samples),
        "damage": list(kept.damage.sentences(kept.period)),
    }


def report(name: str, **figures: object) -> None:
    print(json.dumps({"test": name, **figures}), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("what", choices=("kill", "damage", "disk"))
    parser.add_argument("--runs", type=int, default=50)
    parser.add_argument("--trials", type=int, default=100)
    options = parser.parse_args()
    tests: dict[str, Callable[[], None]] = {
        "kill": lambda: kill(options.runs),
        "damage": lambda: damage(options.trials),
        "disk": disk,
    }
    tests[options.what]()


if __name__ == "__main__":
    main()
