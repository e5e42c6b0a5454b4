"""Where this machine keeps what outlives a process, the same for every user: lock-outs, locks, positions.

Places, in this order; what is kept goes into the first that can be written, and is looked for in all of them:

1. ``$ARMHIL_STATE``, where it is set;
2. ``/var/lib/armhil``;
3. ``/var/tmp/armhil``, which any user can make, and which outlives a restart;
4. ``$XDG_STATE_HOME/armhil``, else ``~/.local/state/armhil``: of one user, where the machine has no other.

A folder is for everybody (mode 1777, as /tmp) or for the group of those who may drive arms (2770), and a
file in it may be written by the same people. Nothing less would do: the next user has to note his own motion,
and to take away what he has acknowledged. Nothing more is given away by 1777: on Linux every local user may
open a CAN device, and who is to be kept from the notes has to be kept from the bus.

Others may write in some of these, so nothing is followed that a name points to: a folder or file that is a
symbolic link, no regular file, or one with a second name is refused.
"""

from __future__ import annotations

import contextlib
import logging
import os
import stat
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Self

from drivers.errors import BusError

log = logging.getLogger(__name__)

VARIABLE = "ARMHIL_STATE"
MACHINE = (Path("/var/lib/armhil"), Path("/var/tmp/armhil"))  # noqa: S108 (never followed, see below)
_FOLDER = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
_FILE = os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
_SHARED, _OWN = 0o1777, 0o700
_LARGEST = 1 << 16


def places() -> tuple[Path, ...]:
    """All places, the first choice first.

    Raises:
        BusError: the one that is named depends on the folder in which the program was started.
    """
    home = os.environ.get("XDG_STATE_HOME", "")
    # One that is relative has to be ignored (XDG base directories).
    user = Path(home if home.startswith("/") else "~/.local/state").expanduser() / "armhil"
    named = os.environ.get(VARIABLE)
    if named and not named.startswith("/"):
        raise BusError(
            f"{VARIABLE} is {named}; allowed: a path that begins with /, so that every program finds what"
            " others have noted"
        )
    return (*([Path(named)] if named else []), *MACHINE, user)


class StateFolder:
    """One such folder, open; use as a context manager.

    Args:
        path: of the folder.
        create: whether to make it where it is not there.

    Raises:
        OSError: it is not there, is a symbolic link or no folder, or cannot be made.
    """

    def __init__(self, path: Path, *, create: bool = False) -> None:
        self.path = path
        if create and not path.is_symlink():
            _make(path)
        self.descriptor = os.open(path, _FOLDER)

    @property
    def trusted(self) -> bool:
        """Whether nobody else can take away what is kept here: no folder that all may write without a sticky
        bit, and none of another user who is not root."""
        found = os.fstat(self.descriptor)
        loose = found.st_mode & stat.S_IWOTH and not found.st_mode & stat.S_ISVTX
        return not loose and (found.st_uid in (0, os.geteuid()) or bool(found.st_mode & stat.S_ISVTX))

    def names(self) -> list[str]:
        """Of all files, sorted."""
        return sorted(os.listdir(self.descriptor))  # noqa: PTH208 (of a descriptor)

    def open_file(self, name: str, flags: int, *, create: bool = False) -> int:
        """A descriptor of a regular file with this one name.

        One that is made here may be written by whoever may write in the folder, and by nobody else: whoever
        may drive the arm after us has to note it, too, and may acknowledge what stands.

        Raises:
            OSError: it is not there, or something else is.
        """
        try:
            descriptor = os.open(name, flags | _FILE, dir_fd=self.descriptor)
        except FileNotFoundError:
            if not create:
                raise
            mode = os.fstat(self.descriptor).st_mode & 0o666
            descriptor = os.open(name, flags | _FILE | os.O_CREAT | os.O_EXCL, mode, dir_fd=self.descriptor)
            os.fchmod(descriptor, mode)
        found = os.fstat(descriptor)
        if not stat.S_ISREG(found.st_mode) or found.st_nlink > 1:
            os.close(descriptor)
            raise OSError(0, "is no regular file of one name")
        return descriptor

    def read(self, name: str) -> str:
        """The text of a file.

        Raises:
            OSError: as for :meth:`open_file`.
        """
        with os.fdopen(self.open_file(name, os.O_RDONLY), "rb") as file:
            return file.read(_LARGEST).decode(errors="replace")

    def write(self, name: str, text: str) -> None:
        """Replace the text of a file; when this returns, the disk has it. It is never empty in between.

        Raises:
            OSError: it cannot be written.
        """
        data = text.encode()
        descriptor = self.open_file(name, os.O_WRONLY, create=True)
        try:
            written = 0
            while written < len(data):
                written += os.pwrite(descriptor, data[written:], written)
            os.ftruncate(descriptor, len(data))
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
        os.fsync(self.descriptor)

    def remove(self, name: str) -> None:
        """Take a file away; where it is another user's, it is emptied. An empty file counts as none.

        Raises:
            OSError: neither is permitted.
        """
        with contextlib.suppress(FileNotFoundError):
            try:
                os.unlink(name, dir_fd=self.descriptor)
            except PermissionError:
                descriptor = self.open_file(name, os.O_WRONLY)
                os.ftruncate(descriptor, 0)
                os.fsync(descriptor)
                os.close(descriptor)
        os.fsync(self.descriptor)

    def close(self) -> None:
        os.close(self.descriptor)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _make(path: Path) -> None:
    """Make a folder where it is not there; a shared one for everybody, as /tmp is."""
    shared = path in places()[:-1]
    try:
        if not shared:
            path.parent.mkdir(parents=True, exist_ok=True)
        path.mkdir(mode=_OWN)
    except FileExistsError:
        return
    if shared:
        path.chmod(_SHARED)


def existing(*, hidden: bool = False) -> Iterator[StateFolder]:
    """Every state folder that is there, open inside the loop; one that is a symbolic link is left out.

    Args:
        hidden: whether to pass over one that may not be looked into.

    Raises:
        BusError: a shared one may not be looked into: what stands there against a motion would not be seen.
    """
    *shared, own = places()
    for path in (*shared, own):
        try:
            folder = StateFolder(path)
        except PermissionError as error:
            if hidden or path == own:
                continue
            raise BusError(
                f"{path} may not be looked into, and what is noted there may stand against a motion: join the"
                " group that it belongs to, or let its owner or root open or remove it"
            ) from error
        except OSError:
            continue
        with folder:
            yield folder


def _may_write(folder: StateFolder) -> bool:
    return os.access(".", os.W_OK | os.X_OK, dir_fd=folder.descriptor, effective_ids=True)


def writable() -> StateFolder:
    """The first place that can be written.

    Raises:
        BusError: none can; one line with what to do.
    """
    for path in places():
        try:
            folder = StateFolder(path, create=True)
        except OSError as error:
            log.debug("%s: %s", path, error.strerror)
            continue
        if folder.trusted and _may_write(folder):
            return folder
        log.debug("%s: cannot be written, or others could take away what is kept there", path)
        folder.close()
    listed = ", ".join(map(str, places()))
    raise BusError(
        f"no folder for what has to outlive this process can be written; tried {listed}; make one with"
        f" `install -d -m 1777 /var/lib/armhil` as root, or name one in {VARIABLE}"
    )
