"""One process at a time in one role at one bus of this machine, whoever's it is."""

from __future__ import annotations

import contextlib
import fcntl
import os
from types import TracebackType
from typing import Self

from drivers.bus import state_folder
from drivers.bus.lockout import channel_name
from drivers.bus.state_folder import StateFolder
from drivers.errors import BusError, BusOccupied
from drivers.frames.channel import Channel


class BusLock:
    """A lease on one role at one channel of this machine; the system drops it when the process dies.

    The file is beside the lock-outs, in the first state folder that can be written. Who cannot write in one
    finds the locks of others there all the same.

    Args:
        channel: which bus.
        role: what only one process may be there, such as ``master``.

    Raises:
        BusOccupied: another process holds it.
        BusError: the file cannot be made.
    """

    def __init__(self, channel: Channel, role: str = "master") -> None:
        self._name = f"{role}-{channel_name(channel)}.lock"
        self._what = (
            f"{channel} is occupied: another armhil run holds it as {role};"
            " end that one (Ctrl-C), or give another --channel"
        )
        self._folder = state_folder.writable()
        self.path = self._folder.path / self._name
        self._held: list[int] = []
        try:
            self._acquire(self._folder, create=True)
            # Simulated drives harm nobody: who may not see the locks of real arms may have them all the same.
            for folder in state_folder.existing(hidden=channel.only_simulated):
                if folder.path != self._folder.path:
                    self._acquire(folder, create=False)
        except OSError as error:
            self.release()
            raise BusError(f"cannot lock {channel}: {self.path}: {error.strerror or error}") from error
        except BusError:
            self.release()
            raise

    def _acquire(self, folder: StateFolder, *, create: bool) -> None:
        while True:
            try:
                # To lock a file it need not be written: another user's will do.
                descriptor = folder.open_file(self._name, os.O_RDONLY, create=create)
            except FileNotFoundError:
                return
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                os.close(descriptor)
                raise BusOccupied(self._what) from None
            if self._is_named(folder, descriptor):
                self._held.append(descriptor)
                return
            os.close(descriptor)

    def _is_named(self, folder: StateFolder, descriptor: int) -> bool:
        """Whether the locked file is still the one of that name: its last holder removes it."""
        try:
            named = os.stat(self._name, dir_fd=folder.descriptor, follow_symlinks=False)
        except FileNotFoundError:
            return False
        return os.path.samestat(os.fstat(descriptor), named)

    def release(self) -> None:
        """Give the lease back."""
        held, self._held = self._held, []
        if held:
            # Removed while it is held: who opened it before will find that it has no name any more.
            with contextlib.suppress(FileNotFoundError, PermissionError):
                os.unlink(self._name, dir_fd=self._folder.descriptor)
        for descriptor in held:
            os.close(descriptor)
        self._folder.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.release()
