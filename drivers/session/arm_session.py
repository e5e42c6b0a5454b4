"""A session with an arm: configure its drives, ask where it stands, stream a reference."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import replace
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from drivers.bus.budget import BusBudget
from drivers.cyclic.stream import OnSamples, run_stream
from drivers.errors import BusError, DriveError
from drivers.frames.channel import Channel
from drivers.frames.job import Budgets, Job
from drivers.frames.requests import StreamControl
from drivers.frames.samples import ENDED_BY_ITSELF, StreamResult
from drivers.frames.units import Units
from drivers.session.envelope import check_drive_limits, check_envelope, check_start, checked_period_ends
from drivers.session.following_windows import (
    check_following_windows,
    homing_job,
    homing_speed,
    narrowed,
    output_speed,
)
from drivers.session.jog import JOG_SHARE, ignore_samples, jog_path
from drivers.session.memory import Memory
from drivers.session.stream_job import START_TOLERANCE, stream_job
from drivers.setup.attestation import attest, refuse_unattested
from drivers.setup.connection import Connection
from drivers.setup.drive import DriveReport
from drivers.setup.homing import Homing, end_homing, prepare_homing
from robots.arrays import FloatArray
from robots.description import Robot


class ArmSession:
    """The one master of an arm, from opening to closing; the drives carry torque only inside ``stream``.

    Args:
        robot: the arm's description.
        channel: where its drives are; the description's own bus where None.
        budgets: how much may go wrong in a stream; those that fit the channel where None.
        start_tolerance: rad or m.
        allow_jog: whether :meth:`jog` and :meth:`home` may move the arm.
    """

    def __init__(
        self,
        robot: Robot,
        channel: Channel | None = None,
        budgets: Budgets | None = None,
        start_tolerance: float = START_TOLERANCE,
        *,
        allow_jog: bool = False,
    ) -> None:
        self.robot = robot
        self.channel = channel or Channel(robot.bus.interface, robot.bus.channel)
        self.units = Units.of(robot)
        self._budgets = budgets or Budgets.on(self.channel, robot.bus.cycle_time)
        self._start_tolerance = start_tolerance
        self._connection = Connection(robot, self.channel, self._budgets)
        self._allow_jog = allow_jog
        self._attested = False
        self._memory = Memory(robot, self.channel, self._connection)
        self._unacknowledged: str | None = None

    def open(self) -> None:
        """Take the bus and configure every drive; torque stays off.

        Raises:
            BusError: the bus cannot be opened or has another master.
            DriveError: a drive does not answer or refuses a setting.
        """
        self._connection.open()
        try:
            self._memory.opened(self.drives)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Leave the drives in NMT pre-operational and give the bus back."""
        self._connection.close()

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def drives(self) -> tuple[DriveReport, ...]:
        """What the set-up found, in the order of the axes."""
        return self._connection.reports

    def bus_budget(self) -> BusBudget:
        """The worst-case load of the bus with the drives as they are mapped."""
        return self._connection.bus_budget()

    @property
    def unacknowledged(self) -> str | None:
        """Why the last stream ended, where it ended by itself and nobody has acknowledged that yet.

        On a bus of real drives that holds for later sessions, too: see :mod:`drivers.bus.lockout`.
        """
        return self._unacknowledged or self._memory.reason

    @property
    def position_doubt(self) -> str | None:
        """What speaks against the drives' positions since the last rest, until they are attested."""
        return self._memory.doubt

    def acknowledge_faults(self) -> None:
        """Reset the faults of all drives, and take note that a stream ended by itself.

        A stream refuses to enable a drive whose fault is not reset, and nothing resets one but this. A bus
        that failed is opened anew. Where a drive has started anew since the set-up, all are configured once
        more, and a position that was attested has to be attested again.

        Raises:
            DriveError: a fault stays, or a drive does not notice a lost master.
        """
        if self._connection.acknowledge_faults():
            self._attested = False
        self._memory.acknowledged()
        self._unacknowledged = None

    def actual_position(self) -> FloatArray:
        """Where the arm stands: (n,) joint positions, rad or m, read over SDO (6064h).

        Raises:
            DriveError: a drive does not answer.
        """
        return self._connection.actual_position()

    def temperatures(self) -> FloatArray:
        """How warm the drives are: (n,) °C, read over SDO; NaN where the description names no object.

        Raises:
            DriveError: a drive does not answer, or has no such object.
        """
        return self._connection.temperatures()

    def stream(
        self,
        reference: ArrayLike,
        on_samples: OnSamples,
        stop: threading.Event | None = None,
        *,
        control: StreamControl | None = None,
        period_ends: Sequence[int] = (),
        arrive: bool = False,
    ) -> StreamResult:
        """Enable all axes, follow a reference, disable; in a process of its own.

        Args:
            reference: N × n joint positions, rad or m, one row per SYNC; begins and ends at rest,
                begins where the arm stands.
            on_samples: gets batches, in this thread, while it runs.
            stop: set it from elsewhere for a controlled ramp to rest; Ctrl-C does the same.
            control: for the other ways to end or pause it; see :class:`drivers.StreamControl`.
            period_ends: rows (1 to N − 1) at which a period is over and the next begins: where a pause or
                a stop takes effect.
            arrive: of a slow motion to a place: each joint has to follow within a tenth of its way, at most
                1°, beyond what its speed explains, and to arrive there; else it ends with the reason.

        Raises:
            DriveError: the reference is outside the limits or begins elsewhere; a drive is in fault or has
                started anew; the last stream ended by itself and was not acknowledged; a position was not
                attested.
            BusError: the bus cannot be opened, or is inside this process only.
        """
        return self._stream(reference, on_samples, control or StreamControl(stop), period_ends, arrive)

    def _stream(
        self,
        reference: ArrayLike,
        on_samples: OnSamples,
        control: StreamControl,
        period_ends: Sequence[int],
        arrive: bool,
    ) -> StreamResult:
        targets = np.asarray(reference, dtype=np.float64)
        check_envelope(self.robot, targets, self.robot.bus.cycle_time)
        self._refuse_stream()
        refuse_unattested(self.robot, self._attested, self.position_doubt)
        check_drive_limits(self.robot, self.units.counts(targets), self.drives)
        check_following_windows(self.robot, output_speed(self.robot, targets), self.drives)
        check_start(self.robot, self.actual_position(), targets[0], self._start_tolerance)
        self._connection.refuse_faults()
        self._connection.refuse_restarted()
        job = self._job(targets, checked_period_ends(period_ends, len(targets)))
        if arrive:
            job = narrowed(job, self.robot, targets)
        return self._run(job, on_samples, control)

    def _refuse_stream(self) -> None:
        if self.channel.interface == "virtual":
            raise BusError(f"{self.channel} lives inside one process; a stream needs a bus between processes")
        self._refuse_unacknowledged()

    def _refuse_unacknowledged(self) -> None:
        if (reason := self.unacknowledged) is not None:
            raise DriveError(f"the last stream ended by itself ({reason}); {self._connection.way_on}")

    def _run(self, job: Job, on_samples: OnSamples, control: StreamControl) -> StreamResult:
        """Hand the bus to the cyclic process until the drives are disabled."""
        self._connection.arm()
        result = self._memory.guard(lambda: run_stream(job, on_samples, control))
        self._connection.note_restarts(result.restarted)
        if result.outcome in ENDED_BY_ITSELF:
            self._unacknowledged = result.reason
        return result

    def jog(
        self,
        joint: str,
        distance: float,
        on_samples: OnSamples = ignore_samples,
        *,
        share: float = JOG_SHARE,
        control: StreamControl | None = None,
    ) -> StreamResult:
        """Move one joint by a distance at limited speed, for commissioning; refused unless it was allowed.

        Args:
            joint: its name.
            distance: rad or m, signed.
            on_samples: as in :meth:`stream`.
            share: of the joint's velocity and acceleration limits, at most JOG_SHARE.
            control: as in :meth:`stream`.

        Raises:
            DriveError: jogging is not allowed, the joint does not exist, or the way leaves its limits.
        """
        if not self._allow_jog:
            raise DriveError("jogging is not allowed in this session; open it with allow_jog=True")
        path = jog_path(self.robot, self.actual_position(), joint, distance, share)
        return self._stream(path, on_samples, control or StreamControl(), (), arrive=True)

    def home(self, homing: Homing, control: StreamControl | None = None) -> StreamResult:
        """Have one drive search its home, by itself and slowly; the others hold. For commissioning.

        The position has to be attested afterwards as after every opening, see :meth:`attest_position`.

        Args:
            homing: which drive, how, and within what bounds.
            control: as in :meth:`stream`.

        Raises:
            DriveError: moving for commissioning is not allowed, a value is not, the drive has no homing mode
                or refuses a setting, or a drive is in fault.
            BusError: as in :meth:`stream`.
        """
        if not self._allow_jog:
            raise DriveError("homing is not allowed in this session; open it with allow_jog=True")
        axis = homing.axis(self.robot)
        self._refuse_stream()
        check_following_windows(self.robot, homing_speed(self.robot, homing), self.drives)
        self._connection.refuse_restarted()
        self._attested = False
        report = self.drives[axis]
        prepare_homing(self._connection.drives[axis], self.robot, homing, report.settings, report.profile)
        try:
            self._connection.refuse_faults()
            here = self.actual_position()[None, :]
            job = replace(self._job(here, ()), homing=homing_job(self.robot, homing))
            return self._run(job, ignore_samples, control or StreamControl())
        finally:
            end_homing(self._connection.drives[axis], report.mode, report.profile)

    def attest_position(self, posture: ArrayLike, tolerance: float = START_TOLERANCE) -> None:
        """Somebody who looks at the arm says where it stands; the drives' positions must say the same.

        Needed once after every opening where a drive's ``position_reference`` is "homing".

        Args:
            posture: (n,) joint positions as the marks on the arm show them, rad or m.
            tolerance: rad or m.

        Raises:
            DriveError: a joint reads otherwise.
        """
        attest(self.robot, self.actual_position(), np.asarray(posture, dtype=np.float64), tolerance)
        self._attested = True
        self._memory.attested()

    def _job(self, targets: FloatArray, period_ends: tuple[int, ...]) -> Job:
        job = stream_job(self.robot, self.channel, self._connection.links(), targets, period_ends)
        tolerance = np.full(self.robot.n, self._start_tolerance)
        return replace(job, budgets=self._budgets, start_tolerance=tolerance)
