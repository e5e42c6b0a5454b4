"""What outlives a session: why nothing may move, and where the arm last stood."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence

from drivers.bus.last_rest import LastRest
from drivers.bus.lockout import Lockout
from drivers.cyclic.stream import BusNotOpened
from drivers.errors import DriveError
from drivers.frames.channel import Channel
from drivers.frames.samples import ENDED_BY_ITSELF, StreamResult
from drivers.setup.connection import Connection
from drivers.setup.drive import DriveReport
from robots.description import Robot
from robots.errors import one_line

log = logging.getLogger(__name__)


class Memory:
    """The notes of one arm on one bus; simulated drives have none.

    Args:
        robot: the arm.
        channel: its bus.
        connection: to its drives.
    """

    def __init__(self, robot: Robot, channel: Channel, connection: Connection) -> None:
        self._robot, self._channel, self._connection = robot, channel, connection
        self._lockout = Lockout(channel)
        self._rest: LastRest | None = None
        self.doubt: str | None = None
        """Why the drives' positions cannot be believed before somebody has looked; None where they can."""

    def opened(self, drives: Sequence[DriveReport]) -> None:
        """The drives are known now.

        Raises:
            DriveError: a drive does not answer.
        """
        serials = tuple(f"{d.vendor:08X}-{d.product or 0:08X}-{d.serial}" for d in drives if d.serial)
        self._lockout = self._lockout.of_drives(self._robot.name, serials)
        self._rest = LastRest(self._channel, [joint.name for joint in self._robot.joint], serials)
        connection = self._connection
        if self._rest.active:
            self.doubt = self._rest.doubt(connection.home_offsets(), connection.actual_position())

    @property
    def reason(self) -> str | None:
        """Why nothing may move before somebody has acknowledged it."""
        return self._lockout.reason

    def acknowledged(self) -> None:
        """Somebody has looked at the arm."""
        self._lockout.lift()
        self.keep_rest()

    def attested(self) -> None:
        """Somebody has said that the arm stands where its drives say."""
        self.doubt = None
        self.keep_rest()

    def keep_rest(self) -> None:
        """Keep where the arm stands now, unless what its drives say is in doubt."""
        if not self._keeps():
            return
        assert self._rest is not None
        try:
            self._rest.keep(self._connection.home_offsets(), self._connection.actual_position())
        except DriveError as error:
            log.warning("where the arm stands is not kept: %s", error)

    def _keeps(self) -> bool:
        """A record that is in doubt stays as it is until somebody has looked."""
        return self._rest is not None and self._rest.active and self.doubt is None

    def guard(self, stream: Callable[[], StreamResult]) -> StreamResult:
        """Stream with a note of it that is taken away only after an end that somebody asked for.

        The drives have to have been seen at rest and without torque: else somebody has to look.

        Raises:
            DriveError: no note can be kept, so nothing has moved.
        """
        if self._rest is not None and self._keeps():
            self._rest.keep(self._connection.home_offsets(), None)
        self._connection.release()
        self._lockout.begin()
        try:
            result = stream()
        except BusNotOpened:
            self._lockout.lift()  # nothing has moved
            raise
        except BaseException as error:
            why = one_line(str(error)) or type(error).__name__
            self._lockout.keep(f"the program that drove it failed: {why}")
            raise
        if result.outcome in ENDED_BY_ITSELF:
            self._lockout.keep(result.reason)
        elif result.torque_unconfirmed or result.rest_unconfirmed:
            self._lockout.keep(result.ending)
        else:
            self._lockout.lift()
            self.keep_rest()
        return result
