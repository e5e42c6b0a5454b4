"""SIGKILL to the processes of a stream at random moments: does anything move before somebody has looked?

    python benchmarks/killed_streams.py [--moments 50] [--seed 0] [--page benchmarks/killed_streams.md]

A program drives a simulated arm as if it were a real one, and records it. At a random moment of that the
program (the parent, in which recorder and listener are threads), the cyclic process, both, or both and the
drives are killed. In half of the cases the drives lose their power afterwards: they start anew and know of
nothing. Then another user (other HOME, TMPDIR, XDG_STATE_HOME) tries to drive the same arm. Counted are
motions without an acknowledgement, refusals that do not name it, and what of the recording is lost.

Ends with 2 where there is any, or where more than 0.3 s are lost.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import robots
from daq.recording.capture import CaptureError
from daq.recording.listener import listening
from daq.recording.reader import read_capture
from daq.recording.recorder import Recorder
from daq.recording.run_facts import outcome_facts
from drivers import ArmSession, Channel, DriveError, Samples, open_bus
from drivers.bus import lockout, state_folder
from drivers.frames.layout import tpdo_cob_id
from drivers.simulated import SimulatedArm
from robots.arrays import FloatArray
from tests.daq.captures import facts

ROOT = Path(__file__).resolve().parent.parent
NAME = "emps"
SECONDS = 2.0
SUBSETS = ("parent", "cyclic", "parent and cyclic", "all and the drives")
MOST_LOST = 0.3
_PLACE = "ARMHIL_KILLED_MACHINE"
_STARTUP = f"""
import os
from pathlib import Path
from drivers.bus import lockout, state_folder
lockout.keeps_notes = lambda channel: True
state_folder.MACHINE = (Path(os.environ[{_PLACE!r}]),)
"""
"""Every process takes the simulated drives for real ones, and the folder for that of the machine."""


@dataclass
class Found:
    """What came of one kill."""

    subset: str
    cycled: bool
    torque: bool = False
    """Whether the drive had torque when it was killed."""
    refused: bool = False
    named: bool = False
    moved: bool = False
    lost: float = 0.0
    """s."""

    @property
    def problem(self) -> str:
        """What is wrong; empty where nothing is."""
        if self.torque and (self.moved or not self.refused):
            return "moved without an acknowledgement"
        if self.refused and not self.named:
            return "the refusal names no command"
        return f"{self.lost:.2f} s lost" if self.lost > MOST_LOST else ""


class TorqueWatch:
    """Hears whether the drive says that it has torque."""

    def __init__(self, channel: Channel) -> None:
        self.seen = self.now = False
        """Whether it has said so, and whether it did in its latest TPDO."""
        self._bus = open_bus(channel, [tpdo_cob_id(drive.node_id) for drive in robots.load(NAME).drive])
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._ended.is_set():
            message = self._bus.recv(0.1)
            if message is not None:
                self.now = message.data[0] & 0x6F == 0x27
                self.seen = self.seen or self.now

    def close(self) -> None:
        self._ended.set()
        self._thread.join()
        self._bus.shutdown()


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument(
        "--moments", type=int, default=50, help="of each subset, with and without power cycle"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--page", type=Path, help="Markdown with the results")
    parser.add_argument("--drive", nargs=2, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.drive:
        drive(Channel.parse(given.drive[0]), Path(given.drive[1]))
        return 0
    found: list[Found] = []
    with tempfile.TemporaryDirectory() as folder, place(Path(folder)) as bench:
        for one in bench.all_kills(given.moments, given.seed):
            found.append(one)
            if one.problem:
                print(f"{one.subset}, power cycle {one.cycled}: {one.problem}", flush=True)
    page = summary(found, given.seed)
    print(page)
    if given.page is not None:
        given.page.write_text(f"# {page}", encoding="utf-8")
    return 2 if any(one.problem for one in found) else 0


def summary(found: list[Found], seed: int) -> str:
    """A table, one row per subset."""
    lines = [
        f"Streams whose processes were killed (seed {seed})",
        "",
        "| killed | power cycle | kills | under torque | moved without acknowledgement | most lost, s |",
        "|---|---|---|---|---|---|",
    ]
    for subset in SUBSETS:
        for cycled in (False, True):
            some = [one for one in found if (one.subset, one.cycled) == (subset, cycled)]
            if some:
                moved = sum(one.problem.startswith("moved") for one in some)
                torque = sum(one.torque for one in some)
                lost = max(one.lost for one in some)
                word = "yes" if cycled else "no"
                lines.append(f"| {subset} | {word} | {len(some)} | {torque} | {moved} | {lost:.2f} |")
    return "\n".join(lines) + "\n"


@dataclass
class Bench:
    """A simulated arm, two users, and a machine that they share."""

    folder: Path
    channel: Channel
    environment: dict[str, str]
    arm: SimulatedArm
    whole: float = 4.0
    """s from the opening to the end of a stream that nobody kills."""

    def all_kills(self, moments: int, seed: int) -> Iterator[Found]:
        """Every subset, with and without a power cycle, at random moments."""
        rng = np.random.default_rng(seed)
        for number in range(moments):
            for subset in SUBSETS:
                for cycled in (False, True):
                    yield self.kill(subset, cycled, float(rng.uniform(0.0, self.whole)), f"{seed}-{number}")

    def kill(self, subset: str, cycled: bool, moment: float, name: str) -> Found:
        """One stream, killed ``moment`` s after its session was open."""
        found = Found(subset, cycled)
        out = self.folder / f"{name}-{subset.replace(' ', '-')}-{cycled}.mcap"
        watch = TorqueWatch(self.channel)
        try:
            lines: list[tuple[str, int]] = []
            process = self._start(out, lines)
            time.sleep(moment)
            killed_at, found.torque = time.time_ns(), watch.now
            self._kill(subset, process.pid)
            process.wait()
        finally:
            watch.close()
        if cycled or subset == SUBSETS[3]:
            self.power_cycle()
        _await_rest(self.channel)
        found.lost = lost_seconds(out, killed_at, lines)
        self._try(found)
        return found

    def _start(self, out: Path, lines: list[tuple[str, int]]) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, __file__, "--drive", str(self.channel), str(out)],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env=self.environment,
        )
        opened = threading.Event()

        def read() -> None:
            assert process.stdout is not None
            for line in process.stdout:
                lines.append((line.strip(), time.time_ns()))
                opened.set()
            opened.set()

        threading.Thread(target=read, daemon=True).start()
        opened.wait(120.0)
        return process

    def _kill(self, subset: str, parent: int) -> None:
        cyclic = children_of(parent)
        for number in ([] if subset == "parent" else cyclic) + ([] if subset == "cyclic" else [parent]):
            with _gone_already():
                os.kill(number, signal.SIGKILL)
        if subset == SUBSETS[3]:
            for number in children_of(os.getpid(), "drivers.simulated"):
                with _gone_already():
                    os.kill(number, signal.SIGKILL)

    def power_cycle(self) -> None:
        """New drives on the same bus: nothing is left of what the old ones knew."""
        self.arm.close()
        self.arm = SimulatedArm(NAME, self.channel, 3)

    def _try(self, found: Found) -> None:
        """The other user drives the arm, then looks at it and acknowledges."""
        watch = TorqueWatch(self.channel)
        try:
            with other_user(self.folder), ArmSession(robots.load(NAME), self.channel) as session:
                try:
                    session.stream(motion(session, 0.4), lambda samples: None)
                except DriveError as error:
                    found.refused, found.named = True, "armhil acknowledge" in str(error)
                found.moved = watch.seen
                session.acknowledge_faults()
                assert session.unacknowledged is None
        finally:
            watch.close()


@contextmanager
def _gone_already() -> Iterator[None]:
    try:
        yield
    except ProcessLookupError:
        return


@contextmanager
def place(folder: Path) -> Iterator[Bench]:
    """The bench, with this process one of the machine's."""
    (folder / "sitecustomize.py").write_text(_STARTUP)
    machine = folder / "machine"
    environment = {k: v for k, v in os.environ.items() if k != state_folder.VARIABLE}
    environment |= {_PLACE: str(machine), "PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)])}
    environment |= {"XDG_STATE_HOME": str(folder / "first"), "OMP_NUM_THREADS": "1"}
    os.environ.pop(state_folder.VARIABLE, None)
    before = lockout.keeps_notes, state_folder.MACHINE
    lockout.keeps_notes, state_folder.MACHINE = (lambda channel: True), (machine,)
    port = 20000 + os.getpid() % 12000
    channel = Channel("udp_multicast", f"239.74.201.1:{port}")
    bench = Bench(folder, channel, environment, SimulatedArm(NAME, channel, 3))
    try:
        bench.whole = _whole(bench)
        yield bench
    finally:
        bench.arm.close()
        lockout.keeps_notes, state_folder.MACHINE = before


def _whole(bench: Bench) -> float:
    """s from the opening to the end of a stream that is left alone."""
    lines: list[tuple[str, int]] = []
    bench._start(bench.folder / "whole.mcap", lines).wait(120.0)
    assert lines[-1][0] == "clean", lines
    return (lines[-1][1] - lines[0][1]) * 1e-9


@contextmanager
def other_user(folder: Path) -> Iterator[None]:
    """Another environment; what stays the same is the machine."""
    names = ("HOME", "TMPDIR", "XDG_STATE_HOME", "XDG_RUNTIME_DIR")
    before = {name: os.environ.get(name) for name in names}
    for name in names:
        (folder / "other" / name).mkdir(parents=True, exist_ok=True)
        os.environ[name] = str(folder / "other" / name)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def children_of(parent: int, word: str = "") -> list[int]:
    """Processes that a process has started, with a word in their command line."""
    found = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            started_by = int(status.read_text().rpartition(")")[2].split()[1])
            command = (status.parent / "cmdline").read_bytes().replace(b"\0", b" ").decode()
        except OSError:
            continue
        if started_by == parent and word in command:
            found.append(int(status.parent.name))
    return found


def _await_rest(channel: Channel, seconds: float = 10.0) -> None:
    """Until nobody hears a TPDO any more: cyclic process and drives have come to their end."""
    with open_bus(channel, [tpdo_cob_id(1)]) as bus:
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline and bus.recv(0.5) is not None:
            pass


def lost_seconds(out: Path, killed_at: int, lines: list[tuple[str, int]]) -> float:
    """s of the recording that were over when it was killed, and are not in the file."""
    begun = [when for word, when in lines if word == "samples"]
    if not begun or any(word == "clean" for word, _ in lines):
        return 0.0
    try:
        samples = read_capture(out).samples
    except CaptureError:
        return (killed_at - begun[0]) * 1e-9
    # The first samples were written as soon as they had come.
    over = min((killed_at - begun[0]) * 1e-9, SECONDS)
    return max(0.0, over - float(samples.time[-1]))


def motion(session: ArmSession, seconds: float) -> FloatArray:
    """A little out and back, from where the arm stands."""
    t = np.linspace(0.0, 1.0, round(seconds / session.robot.bus.cycle_time))
    bell = 64 * (t * (1 - t)) ** 3
    return np.asarray(session.actual_position() + 0.01 * bell[:, None])


def drive(channel: Channel, out: Path) -> None:
    """The program that is killed."""
    robot = robots.load(NAME)
    with ArmSession(robot, channel) as session:
        print("open", flush=True)
        with (
            listening(channel) as listener,
            Recorder(out, robot, facts(robot, robot.bus.cycle_time), listener=listener) as recorder,
        ):
            told = threading.Event()

            def keep(samples: Samples) -> None:
                recorder.write(samples)
                if not told.is_set():
                    told.set()
                    print("samples", flush=True)

            result = session.stream(motion(session, SECONDS), keep)
            recorder.finish(outcome_facts(result))
    print("clean" if result.outcome == "completed" else result.outcome, flush=True)


if __name__ == "__main__":
    sys.exit(main())
