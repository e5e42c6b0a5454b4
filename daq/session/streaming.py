"""One motion of an arm, streamed and recorded, whoever watches it and however it ends."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from daq.recording.capture import Facts
from daq.recording.fault_ring import FaultRing
from daq.recording.listener import listening
from daq.recording.recorder import Recorder
from daq.recording.run_facts import outcome_facts, run_facts
from daq.recording.temperatures import drive_temperatures
from daq.session.spool import Spooling
from daq.session.states import Conduct
from daq.session.watching import Nobody, Watcher
from drivers import ArmSession, Samples, StreamResult
from trajectories import Repeat, Trajectory

__all__ = ["Nobody", "StreamOrder", "Watcher", "period_ends", "slower", "stream_recorded"]


@dataclass(frozen=True)
class StreamOrder:
    """What to stream.

    Attributes:
        title: for whoever watches.
        trajectory: begins where the arm stands.
        path: of the new capture.
        run: what is recorded of the run besides, such as kind, seed and note.
        arrive: whether it is a slow move to a place, which ends only when the arm has arrived there.
    """

    title: str
    trajectory: Trajectory
    path: Path
    run: Facts
    arrive: bool = False


def stream_recorded(
    session: ArmSession, order: StreamOrder, watcher: Watcher, conduct: Conduct
) -> StreamResult:
    """Stream a motion, record it, and let it be watched and conducted.

    What surrounds a fault is kept as a capture of its own, and other processes can look on.

    Args:
        session: open.
        order: what to stream.
        watcher: sees the samples.
        conduct: takes wishes while it runs; one of its own for every stream.

    Raises:
        DriveError, BusError: it cannot start.
        CaptureError: the recording cannot be written; the arm has come to rest.
    """
    robot, trajectory = session.robot, order.trajectory
    run = {"channel": str(session.channel), **order.run}
    facts = run_facts(robot, run, trajectory, session.drives)
    result = None
    watcher = Spooling(watcher, robot, order.path)
    watcher.begin(order.title, trajectory, conduct)
    try:
        with (
            listening(session.channel, robot.bus.bitrate) as listener,
            Recorder(order.path, robot, facts, listener=listener) as recorder,
            FaultRing(order.path.parent, robot, facts, listener) as ring,
        ):

            def keep(samples: Samples) -> None:
                recorder.write(samples)
                ring.write(samples)
                conduct.on_samples(samples)
                watcher.samples(samples)

            recorder.write_temperatures(drive_temperatures(session, recorder.clock))
            conduct.begin()
            result = session.stream(
                trajectory.position,
                keep,
                control=conduct.control,
                period_ends=period_ends(trajectory),
                arrive=order.arrive,
            )
            ring.ended(result)
            recorder.write_temperatures(drive_temperatures(session, recorder.clock))
            recorder.finish(outcome_facts(result))
    finally:
        conduct.end()
        watcher.end(result)
    return result


def period_ends(trajectory: Trajectory) -> tuple[int, ...]:
    """Rows at which a period of a motion is over and the next begins: where it may pause or stop.

    A motion without repeats has none, so that it pauses or stops where it ends.
    """
    repeat = trajectory.repeat
    if repeat is None:
        return ()
    times = [repeat.start + k * repeat.period for k in range(repeat.count + 1)]
    rows = {round(time / trajectory.cycle_time) for time in times}
    return tuple(sorted(row for row in rows if 1 <= row < len(trajectory.time)))


def slower(repeat: Repeat | None, speed: float) -> Repeat | None:
    """The repeats of a motion that is driven in 1/speed of its time."""
    return None if repeat is None else Repeat(repeat.start / speed, repeat.period / speed, repeat.count)
