"""The place of :mod:`benchmarks.killed_streams`: an arm, a program that drives it, one kill, another user."""

from __future__ import annotations

import multiprocessing
import os
import shutil
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path

import robots
from benchmarks.killed_wire import SECONDS, Wire, lost_seconds, path
from daq.recording.listener import listening
from daq.recording.recorder import Recorder
from daq.recording.run_facts import outcome_facts
from drivers import ArmSession, BusError, Channel, DriveError, open_bus
from drivers.bus import lockout, state_folder
from drivers.frames.layout import tpdo_cob_id
from drivers.simulated import SimulatedArm
from robots import Robot
from tests.daq.captures import facts

ROOT = Path(__file__).resolve().parent.parent
PARENT, CYCLIC, DRIVES = "parent", "cyclic process", "drives"
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


@dataclass(frozen=True)
class Plan:
    """One kill to come; ``share`` of the time from the opening to the end of a stream."""

    key: str
    subset: tuple[str, ...]
    cycled: bool
    share: float


@dataclass
class Found:
    """What came of one kill."""

    subset: tuple[str, ...]
    cycled: bool
    moment: float = 0.0
    """s after the session was open."""
    torque: bool = False
    """Whether the drive had torque when it was killed."""
    refused: bool = False
    named: bool = False
    moved: bool = False
    lost: float | None = None
    """s; None where nothing was being recorded."""

    @property
    def problem(self) -> str:
        """What is wrong; empty where nothing is."""
        if self.torque and (self.moved or not self.refused):
            return "moved without an acknowledgement"
        if self.refused and (self.moved or not self.named):
            return "the refusal moved something, or names no command"
        return f"{self.lost:.2f} s lost" if (self.lost or 0.0) > MOST_LOST else ""


@dataclass
class Program:
    """The program that is killed, and what it has said and when (s since the epoch)."""

    process: multiprocessing.process.BaseProcess
    lines: list[tuple[str, float]] = field(default_factory=list)


@dataclass
class Bench:
    """A simulated arm on a bus of its own; the machine and its two users are those of all benches."""

    folder: Path
    channel: Channel
    source: Path
    seed: int
    arm: SimulatedArm
    whole: float = 4.0
    """s from the opening to the end of a stream that nobody kills."""

    @property
    def robot(self) -> Robot:
        return robots.load(self.source)

    def kills(self, plans: list[Plan], keep: Callable[[str, Found], None], until: float) -> None:
        """One after the other, as long as there is time (s on the monotonic clock)."""
        for plan in plans:
            if time.monotonic() > until:
                return
            keep(plan.key, self.kill(plan))

    def kill(self, plan: Plan) -> Found:
        """One stream, killed in its course."""
        found, robot = Found(plan.subset, plan.cycled, plan.share * self.whole), self.robot
        out = self.folder / f"{plan.key}.mcap"
        wire = Wire(self.channel, self.robot)
        try:
            program = self.start(out)
            time.sleep(found.moment)
            before, after = self._kill(plan.subset, program.process.pid)
            program.process.join()
            _await_rest(self.channel)
        finally:
            wire.close()
        found.torque = wire.torque_at(before) and wire.torque_at(after)
        if plan.cycled:
            self.power_cycle()
        found.lost = lost_seconds(out, wire.rows_at(before, robot), robot)
        self._try(found)
        out.unlink(missing_ok=True)
        return found

    def start(self, out: Path) -> Program:
        """Start the program; returns when its session is open."""
        here, there = _FORKED.Pipe(duplex=False)
        program = Program(_FORKED.Process(target=drive, args=(self.channel, self.source, out, there)))
        program.process.start()
        there.close()
        opened = threading.Event()

        def read() -> None:
            try:
                while True:
                    program.lines.append((here.recv(), time.time()))
                    opened.set()
            except EOFError:
                opened.set()

        threading.Thread(target=read, daemon=True).start()
        opened.wait(120.0)
        assert program.lines, "the program did not open the arm"
        return program

    def _kill(self, subset: tuple[str, ...], parent: int | None) -> tuple[float, float]:
        """Between these two times, s since the epoch."""
        assert parent is not None
        chosen = [*(children_of(parent) if CYCLIC in subset else []), *([parent] if PARENT in subset else [])]
        chosen += [self.arm.pid] if DRIVES in subset else []
        before = time.time()
        for number in chosen:
            with _gone_already():
                os.kill(number, signal.SIGKILL)
        return before, time.time()

    def power_cycle(self) -> None:
        """New drives on the same bus: nothing is left of what the old ones knew."""
        self.arm.close()
        self.arm = SimulatedArm(self.source, self.channel, self.seed)

    def _try(self, found: Found) -> None:
        """The other user drives the arm, then looks at it and acknowledges."""
        wire = Wire(self.channel, self.robot)
        try:
            with closing(patiently_opened(self.channel, self.source)) as session:
                try:
                    session.stream(path(session.actual_position(), 0.4, session.robot), lambda samples: None)
                except DriveError as error:
                    found.refused, found.named = True, "armhil acknowledge" in str(error)
                found.moved = wire.torque
                session.acknowledge_faults()
                assert session.unacknowledged is None
        finally:
            wire.close()


@contextmanager
def _gone_already() -> Iterator[None]:
    try:
        yield
    except ProcessLookupError:
        return


_FORKED = multiprocessing.get_context("forkserver")
"""Programs are forked from a process that has imported what they need."""


@contextmanager
def place(folder: Path, arms: int) -> Iterator[list[Bench]]:
    """Benches on one machine: what they start is one user's, and this process is the other's."""
    (folder / "sitecustomize.py").write_text(_STARTUP)
    source, machine = slower(folder / "arm"), folder / "machine"
    os.environ.pop(state_folder.VARIABLE, None)
    os.environ |= {_PLACE: str(machine), "PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)])}
    user(folder, "first")
    _FORKED.set_forkserver_preload([__name__])
    warm = _FORKED.Process(target=time.sleep, args=(0.0,))
    warm.start()
    warm.join()
    user(folder, "second")
    before = lockout.keeps_notes, state_folder.MACHINE
    lockout.keeps_notes, state_folder.MACHINE = (lambda channel: True), (machine,)
    try:
        with ExitStack() as stack:
            benches = []
            for number in range(arms):
                channel = Channel("udp_multicast", f"239.74.201.{number + 1}:{20000 + os.getpid() % 12000}")
                bench = Bench(folder, channel, source, 3 + number, SimulatedArm(source, channel, 3 + number))
                stack.callback(lambda bench=bench: bench.arm.close())
                benches.append(bench)
            for bench in benches:
                bench.whole = _whole(bench)
            yield benches
    finally:
        lockout.keeps_notes, state_folder.MACHINE = before


def slower(folder: Path) -> Path:
    """The one-axis arm with SYNCs of 4 ms, as other arms have them: so that a machine can carry several."""
    shutil.copytree(robots.load("emps").folder, folder)
    text = (folder / "robot.toml").read_text("utf-8")
    assert "cycle_time = 0.001" in text
    (folder / "robot.toml").write_text(text.replace("cycle_time = 0.001", "cycle_time = 0.004"), "utf-8")
    return folder / "robot.toml"


def _whole(bench: Bench) -> float:
    """s from the opening to the end of a stream that is left alone."""
    program = bench.start(bench.folder / f"whole-{bench.seed}.mcap")
    program.process.join(120.0)
    time.sleep(0.1)
    assert program.lines[-1][0] == "clean", program.lines
    return program.lines[-1][1] - program.lines[0][1]


def user(folder: Path, name: str) -> None:
    """Another environment; what stays the same is the machine."""
    for variable in ("HOME", "TMPDIR", "XDG_STATE_HOME", "XDG_RUNTIME_DIR"):
        place = folder / name / variable
        place.mkdir(parents=True, exist_ok=True)
        os.environ[variable] = str(place)


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


def patiently_opened(channel: Channel, source: Path, tries: int = 5) -> ArmSession:
    """A session; on a busy machine simulated drives may take longer to answer than real ones would.

    And what was killed may still be on its way to its end: then the bus is occupied, and nothing moves.
    """
    for left in reversed(range(tries)):
        session = ArmSession(robots.load(source), channel)
        try:
            session.open()
        except (DriveError, BusError):
            if not left:
                raise
        else:
            break
    return session


def drive(channel: Channel, source: Path, out: Path, said: Connection) -> None:
    """The program that is killed."""
    with closing(patiently_opened(channel, source)) as session:
        robot = session.robot
        said.send("open")
        with (
            listening(channel) as listener,
            Recorder(out, robot, facts(robot, robot.bus.cycle_time), listener=listener) as recorder,
        ):
            result = session.stream(path(session.actual_position(), SECONDS, robot), recorder.write)
            recorder.finish(outcome_facts(result))
    said.send("clean" if result.outcome == "completed" else result.outcome)
