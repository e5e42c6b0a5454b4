"""A PostgreSQL server for the tests: Debian's packages, a temporary directory, no password, no TCP port."""

from __future__ import annotations

import os
import pwd
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import mkdtemp

DEBIAN = Path("/usr/lib/postgresql")
USER = "postgres"
"""Whom Debian's package makes: a server refuses to run as root."""


class NoPostgres(Exception):
    """Why no server can be started here."""


def binaries() -> Path:
    """The directory of initdb and pg_ctl, of the newest version that is installed.

    Raises:
        NoPostgres: none is.
    """
    found = sorted(DEBIAN.glob("*/bin/initdb"), key=lambda path: int(path.parts[-3]))
    if found:
        return found[-1].parent
    named = shutil.which("initdb")
    if named is None:
        raise NoPostgres("PostgreSQL is not installed (Debian: apt-get install postgresql)")
    return Path(named).parent


@dataclass(frozen=True)
class Server:
    """A server that can die and be started again.

    Attributes:
        url: with a database ``{}`` to fill in.
    """

    url: str
    _control: Callable[..., None]

    def start(self) -> None:
        """Wait until it answers."""
        self._control("-w", "start")

    def die(self) -> None:
        """At once, whatever it was doing: connections are cut and nothing is written any more."""
        self._control("-m", "immediate", "-w", "stop")


@contextmanager
def mortal_server() -> Iterator[Server]:
    """A server of its own that runs; it may have died when the block ends.

    Raises:
        NoPostgres: it cannot be had here.
    """
    programs, owner = binaries(), _owner()
    # Short, because the path of a socket has at most 107 bytes.
    folder = Path(mkdtemp(prefix="armhil-pg-", dir="/tmp"))
    try:
        if owner is not None:
            shutil.chown(folder, owner, None)
        data = folder / "data"
        _run(owner, programs / "initdb", "-D", data, "-U", "armhil", "-A", "trust", "-E", "UTF8", "--no-sync")
        options = f"-c listen_addresses='' -c fsync=off -c unix_socket_directories={folder}"
        control = (programs / "pg_ctl", "-D", data, "-o", options, "-l", folder / "log")
        found = Server(f"postgresql://armhil@/{{}}?host={folder}", partial(_run, owner, *control))
        found.start()
        try:
            yield found
        finally:
            if (data / "postmaster.pid").exists():
                found.die()
    finally:
        shutil.rmtree(folder)


@contextmanager
def server() -> Iterator[str]:
    """A server of its own; its URL, with a database ``{}`` to fill in.

    Raises:
        NoPostgres: it cannot be had here.
    """
    with mortal_server() as found:
        yield found.url


def _owner() -> str | None:
    """As whom the server runs; None for the user of the tests."""
    if os.geteuid() != 0:
        return None
    try:
        pwd.getpwnam(USER)
    except KeyError:
        raise NoPostgres(f"as root, a server needs the user {USER}") from None
    return USER


def _run(owner: str | None, *command: object) -> None:
    done = subprocess.run(
        [str(part) for part in command],
        user=owner,
        cwd="/",
        stdout=subprocess.DEVNULL,  # the server keeps it open, so a pipe would never end
        stderr=subprocess.DEVNULL,
        check=False,
    )
    if done.returncode:
        raise NoPostgres(f"{Path(str(command[0])).name} ended with {done.returncode}")
