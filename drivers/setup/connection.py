"""The drives of one arm from opening their bus to giving it back: configured, watching, asked over SDO."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from pathlib import Path

import numpy as np

import robots
from drivers.bus.access import describe_cob_id, listen_for_traffic
from drivers.bus.budget import BusBudget
from drivers.bus.bus_lock import BusLock
from drivers.cia402 import objects
from drivers.cia402.states import State, state_of
from drivers.errors import BusError, DriveError
from drivers.frames.channel import Channel
from drivers.frames.job import Budgets
from drivers.frames.layout import DriveLink, master_cob_ids
from drivers.frames.units import Units
from drivers.setup.drive import DriveReport, configure, refuse
from drivers.setup.guarding import acknowledge_fault, arm, prove
from drivers.setup.mapping import refuse_shared_cob_ids, transmitted_cob_ids
from drivers.setup.restarts import Settings, lasting_settings, lost_setting
from drivers.setup.sdo import SdoAccess, SdoNetwork
from robots.arrays import FloatArray
from robots.description import Robot

log = logging.getLogger(__name__)


def acknowledge_command(robot: Robot, channel: Channel) -> str:
    """What to type to go on after a fault of this arm on this bus."""
    shipped = robot.folder.resolve().parent == Path(robots.__file__).resolve().parent
    words = ["armhil acknowledge", robot.folder.name if shipped else str(robot.folder)]
    if channel.interface != robot.bus.interface:
        words.append(f"--interface {channel.interface}")
    if str(channel) != f"{robot.bus.interface}:{robot.bus.channel}":
        words.append(f"--channel {channel.name}")
    return " ".join(words)


class Connection:
    """This process as the master of an arm's drives; none of them carries torque by anything in here.

    Args:
        robot: the arm's description.
        channel: where its drives are.
        budgets: how long the drives may hear nothing of their master.
    """

    def __init__(self, robot: Robot, channel: Channel, budgets: Budgets) -> None:
        self.reports: tuple[DriveReport, ...] = ()
        """What the set-up found, in the order of the axes."""
        self._robot, self._channel, self._budgets = robot, channel, budgets
        self.way_on = f"look at the arm, then `{acknowledge_command(robot, channel)}`"
        """What a refusal ends with where somebody has to look."""
        self._units = Units.of(robot)
        self._nodes = tuple(drive.node_id for drive in robot.drive)
        self._names = tuple(
            f"drive of joint {joint.name} (node {drive.node_id})"
            for joint, drive in zip(robot.joint, robot.drive, strict=True)
        )
        self._proved: frozenset[int] = frozenset()
        self._settings: tuple[Settings, ...] = ()
        self._restarted: set[str] = set()
        """Drives that have started anew since they were configured."""
        self._lock: BusLock | None = None
        self._network: SdoNetwork | None = None

    def open(self) -> None:
        """Take the bus and configure every drive; torque stays off.

        Raises:
            BusError: the bus cannot be opened or has another master.
            DriveError: a drive does not answer or refuses a setting.
        """
        self._lock = BusLock(self._channel)
        try:
            self._refuse_other_master()
            self._configure()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Leave the drives in NMT pre-operational and give the bus back."""
        try:
            self.release(last=True)
        finally:
            if self._lock is not None:
                self._lock.release()
                self._lock = None

    def release(self, last: bool = False) -> None:
        """Let go of the bus, to the cyclic process or, with ``last``, for good; :meth:`network` takes it."""
        network, self._network = self._network, None
        if network is not None:
            try:
                if last:
                    network.nmt("PRE-OPERATIONAL")
                self._note_boot_ups(network)
            finally:
                network.close()

    def network(self) -> SdoNetwork:
        """The open bus; it is opened anew where it was let go of.

        Raises:
            DriveError: not opened, or closed.
        """
        if self._lock is None:
            raise DriveError("the session is not open")
        if self._network is None:
            self._network = SdoNetwork(self._channel, self._nodes, self._names, self._robot.bus.bitrate)
        return self._network

    @property
    def drives(self) -> tuple[SdoAccess, ...]:
        """SDO access to each drive, in the order of the axes."""
        return tuple(self.network().drives)

    # Set-up -------------------------------------------------------------------------------------

    def _refuse_other_master(self) -> None:
        heard = listen_for_traffic(self._channel, cob_ids=master_cob_ids(self._nodes))
        if heard:
            frames = ", ".join(describe_cob_id(cob_id) for cob_id in sorted(heard))
            raise BusError(
                f"{self._channel} is occupied: another master is on it, heard {frames};"
                " take it off the bus first"
            )

    def _configure(self) -> None:
        network = self.network()
        network.nmt("PRE-OPERATIONAL")
        self.reports = tuple(
            configure(sdo, self._robot, axis, self._budgets.watch_seconds)
            for axis, sdo in enumerate(network.drives)
        )
        for report, name in zip(self.reports, self._names, strict=True):
            log.info("%s: vendor 0x%08X, state %s", name, report.vendor, report.state.value)
            for finding in report.findings:
                log.info("%s: %s: %s", name, finding.severity, finding)
        refuse(self.reports, self._names)
        refuse_shared_cob_ids({sdo.drive: transmitted_cob_ids(sdo) for sdo in network.drives})
        self.bus_budget().check()
        self._settings = tuple(lasting_settings(sdo) for sdo in network.drives)
        network.booted.clear()
        self._restarted.clear()
        self._prove_watch()

    def _prove_watch(self) -> None:
        """Every drive that has not done so yet shows that it notices a lost master."""
        watching = [
            sdo
            for sdo, report in zip(self.drives, self.reports, strict=True)
            if report.watches and report.node_id not in self._proved
        ]
        if watching:
            master, seconds = self._robot.bus.master_node_id, self._budgets.watch_seconds
            self._proved |= prove(self.network(), watching, master, seconds)

    def links(self) -> tuple[DriveLink, ...]:
        """How each drive is spoken to in the cycle."""
        return tuple(report.link(name) for report, name in zip(self.reports, self._names, strict=True))

    def bus_budget(self) -> BusBudget:
        """The worst-case load of the bus with the drives as they are mapped."""
        return BusBudget.of(self._robot, self.links(), self._budgets)

    # Between streams ----------------------------------------------------------------------------

    def arm(self) -> None:
        """The drives watch this master from the first heartbeat on that the cyclic process sends."""
        pairs = zip(self.drives, self.reports, strict=True)
        watching = [sdo for sdo, report in pairs if report.watches]
        arm(watching, self._robot.bus.master_node_id, self._budgets.watch_seconds)
        self.network().nmt("OPERATIONAL")

    def acknowledge_faults(self) -> bool:
        """Reset the faults of all drives; where one has started anew, configure all of them once more.

        Every drive has proved then that it watches the master.

        Returns:
            Whether a drive has started anew.

        Raises:
            DriveError: a fault stays, or a drive does not notice a lost master or refuses a setting.
        """
        for sdo in self.drives:
            acknowledge_fault(sdo)
        if restarted := self._has_restarted():
            self._proved = frozenset()
            self._configure()
        self._prove_watch()
        return restarted

    def note_restarts(self, names: Iterable[str]) -> None:
        """The cyclic process has heard boot-up messages of these drives."""
        self._restarted.update(names)

    def refuse_restarted(self) -> None:
        """Refuse to go on with a drive that has started anew since it was configured.

        Raises:
            DriveError: names the first one.
        """
        self._note_boot_ups(self.network())
        for name in self._names:
            if name in self._restarted:
                raise DriveError(f"{name} has started anew since it was configured; {self.way_on}")
        for sdo, settings, report in zip(self.drives, self._settings, self.reports, strict=True):
            if (lost := lost_setting(sdo, settings, report)) is not None:
                self._restarted.add(sdo.drive)
                raise DriveError(f"{sdo.drive} has lost its configuration ({lost}); {self.way_on}")

    def _has_restarted(self) -> bool:
        try:
            self.refuse_restarted()
        except DriveError:
            return bool(self._restarted)
        return False

    def _note_boot_ups(self, network: SdoNetwork) -> None:
        pairs = zip(self._nodes, self._names, strict=True)
        self._restarted.update(name for node, name in pairs if node in network.booted)

    def refuse_faults(self) -> None:
        """Refuse to go on with a drive in fault.

        Raises:
            DriveError: names the first one.
        """
        for sdo, name in zip(self.drives, self._names, strict=True):
            state = state_of(sdo.read_int(objects.STATUSWORD))
            if state in (State.FAULT, State.FAULT_REACTION):
                raise DriveError(f"{name} is in state {state.value!r}; {self.way_on}")

    def actual_position(self) -> FloatArray:
        """(n,) joint positions, rad or m (6064h).

        Raises:
            DriveError: a drive does not answer.
        """
        return self._units.position(
            [sdo.read_int(objects.ACTUAL_POSITION, signed=True) for sdo in self.drives]
        )

    def home_offsets(self) -> tuple[int | None, ...]:
        """Home offset (607Ch) of each drive, in its units of position; None where it has none.

        Raises:
            DriveError: a drive does not answer.
        """
        return tuple(sdo.read_optional(objects.HOME_OFFSET, signed=True) for sdo in self.drives)

    def temperatures(self) -> FloatArray:
        """(n,) °C; NaN where the description names no object.

        Raises:
            DriveError: a drive does not answer, or has no such object.
        """
        found = np.full(self._robot.n, np.nan)
        for axis, (sdo, drive) in enumerate(zip(self.drives, self._robot.drive, strict=True)):
            if (where := drive.temperature) is not None:
                found[axis] = where.per_count * sdo.read_int(where.index, where.subindex, signed=True)
        return found
