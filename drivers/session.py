"""A session with an arm: configure its drives, ask where it stands, stream a reference."""

from __future__ import annotations

import logging
import os
import threading
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from drivers.bus import BusLock, describe_cob_id, listen_for_traffic
from drivers.channel import Channel
from drivers.cia402 import objects
from drivers.cia402.states import State, state_of
from drivers.envelope import check_envelope
from drivers.errors import BusError, DriveError
from drivers.job import Budgets, Job, following_error_window
from drivers.layout import master_cob_ids
from drivers.samples import StreamResult
from drivers.sdo import SdoNetwork
from drivers.setup import DriveReport, acknowledge_fault, configure
from drivers.stream import OnSamples, run_stream
from drivers.units import Units
from robots.arrays import FloatArray
from robots.description import Robot

log = logging.getLogger(__name__)

START_TOLERANCE = 0.02
"""rad or m: how far the arm may stand from a reference's first point."""
MIN_RING_ROWS = 2048
MAX_RING_ROWS = 1 << 16


class ArmSession:
    """The one master of an arm, from opening to closing; the drives carry torque only inside ``stream``.

    Args:
        robot: the arm's description.
        channel: where its drives are; the description's own bus where None.
        budgets: how much may go wrong in a stream; those that fit the channel where None.
        start_tolerance: rad or m.
    """

    def __init__(
        self,
        robot: Robot,
        channel: Channel | None = None,
        budgets: Budgets | None = None,
        start_tolerance: float = START_TOLERANCE,
    ) -> None:
        self.robot = robot
        self.channel = channel or Channel(robot.bus.interface, robot.bus.channel)
        self.units = Units.of(robot)
        self.drives: tuple[DriveReport, ...] = ()
        """What the set-up found, in the order of the axes."""
        self._budgets = budgets or Budgets.on(self.channel, robot.bus.cycle_time)
        self._start_tolerance = start_tolerance
        self._nodes = tuple(drive.node_id for drive in robot.drive)
        self._names = tuple(
            f"drive of joint {joint.name} (node {drive.node_id})"
            for joint, drive in zip(robot.joint, robot.drive, strict=True)
        )
        self._lock: BusLock | None = None
        self._network: SdoNetwork | None = None

    def open(self) -> None:
        """Take the bus and configure every drive; torque stays off.

        Raises:
            BusError: the bus cannot be opened or has another master.
            DriveError: a drive does not answer or refuses a setting.
        """
        self._lock = BusLock(self.channel)
        try:
            self._refuse_other_master()
            self._connect()
            self._configure()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Leave the drives in NMT pre-operational and give the bus back."""
        try:
            self._disconnect(last=True)
        finally:
            if self._lock is not None:
                self._lock.release()
                self._lock = None

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _refuse_other_master(self) -> None:
        heard = listen_for_traffic(self.channel, cob_ids=master_cob_ids(self._nodes))
        if heard:
            frames = ", ".join(describe_cob_id(cob_id) for cob_id in sorted(heard))
            raise BusError(f"{self.channel} is occupied: another master is on it, heard {frames}")

    def _connect(self) -> SdoNetwork:
        if self._lock is None:
            raise DriveError("the session is not open")
        if self._network is None:
            self._network = SdoNetwork(self.channel, self._nodes, self._names, self.robot.bus.bitrate)
        return self._network

    def _disconnect(self, last: bool = False) -> None:
        network, self._network = self._network, None
        if network is not None:
            try:
                if last:
                    network.nmt("PRE-OPERATIONAL")
            finally:
                network.close()

    def _configure(self) -> None:
        network = self._connect()
        network.nmt("PRE-OPERATIONAL")
        self.drives = tuple(
            configure(sdo, drive, joint.name, self.robot.bus.cycle_time)
            for sdo, drive, joint in zip(network.drives, self.robot.drive, self.robot.joint, strict=True)
        )
        network.nmt("OPERATIONAL")
        for report, name in zip(self.drives, self._names, strict=True):
            log.info("%s: vendor 0x%08X, state %s", name, report.vendor, report.state.value)
            for note in report.notes:
                log.info("%s: %s", name, note)

    def acknowledge_faults(self) -> None:
        """Reset the faults of all drives; a stream refuses to enable a drive whose fault is not reset.

        Raises:
            DriveError: a fault stays.
        """
        for sdo in self._connect().drives:
            acknowledge_fault(sdo)

    def actual_position(self) -> FloatArray:
        """Where the arm stands: (n,) joint positions, rad or m, read over SDO (6064h).

        Raises:
            DriveError: a drive does not answer.
        """
        drives = self._connect().drives
        return self.units.position([sdo.read_int(objects.ACTUAL_POSITION, signed=True) for sdo in drives])

    def stream(
        self, reference: ArrayLike, on_samples: OnSamples, stop: threading.Event | None = None
    ) -> StreamResult:
        """Enable all axes, follow a reference, disable; in a process of its own.

        Args:
            reference: N × n joint positions, rad or m, one row per SYNC; begins and ends at rest,
                begins where the arm stands.
            on_samples: gets batches, in this thread, while it runs.
            stop: set it from elsewhere for a controlled stop; Ctrl-C does the same.

        Raises:
            DriveError: the reference is outside the limits or begins elsewhere; a drive is in fault.
            BusError: the bus cannot be opened, or is inside this process only.
        """
        targets = np.asarray(reference, dtype=np.float64)
        check_envelope(self.robot, targets, self.robot.bus.cycle_time)
        if self.channel.interface == "virtual":
            raise BusError(f"{self.channel} lives inside one process; a stream needs a bus between processes")
        self._refuse_elsewhere(targets[0])
        self._refuse_faults()
        job = self._job(targets)
        self._disconnect()
        return run_stream(job, on_samples, stop)

    def _refuse_elsewhere(self, first: FloatArray) -> None:
        actual = self.actual_position()
        distance = np.abs(actual - first)
        if (distance > self._start_tolerance).any():
            axis = int(np.argmax(distance))
            raise DriveError(
                f"joint {self.robot.joint[axis].name} stands at {actual[axis]:.6g} but the reference begins "
                f"at {first[axis]:.6g}; allowed: {self._start_tolerance:g} apart"
            )

    def _refuse_faults(self) -> None:
        for sdo, name in zip(self._connect().drives, self._names, strict=True):
            state = state_of(sdo.read_int(objects.STATUSWORD))
            if state in (State.FAULT, State.FAULT_REACTION):
                raise DriveError(f"{name} is in state {state.value!r}; acknowledge it before enabling")

    def _job(self, targets: FloatArray) -> Job:
        robot = self.robot
        window = following_error_window(robot, robot.bus.cycle_time)
        return Job(
            channel=self.channel,
            bitrate=robot.bus.bitrate,
            nodes=self._nodes,
            drives=self._names,
            control_signal_bits=tuple(report.control_signal_bits for report in self.drives),
            cycle_time=robot.bus.cycle_time,
            units=self.units,
            reference=self.units.counts(targets),
            velocity=robot.velocity_limits,
            acceleration=robot.acceleration_limits,
            following_error=np.ceil(window * np.abs(robot.counts_per_output_unit)).astype(np.int64),
            start_tolerance=np.full(robot.n, self._start_tolerance),
            budgets=self._budgets,
            parent=os.getpid(),
            ring_capacity=int(np.clip(2 * len(targets), MIN_RING_ROWS, MAX_RING_ROWS)),
        )
