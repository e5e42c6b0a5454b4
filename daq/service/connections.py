"""Connections that hold nobody up: a request comes in time, an answer is read in time, or the line is cut."""

from __future__ import annotations

import asyncio
import os
import socket
from typing import Any

import h11
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

from daq.service.settings import ServiceError

REQUEST_TIME = 10.0
"""s from the connection, or from the first byte of a further request, to the end of the request."""
READING_TIME = 30.0
"""s that a client may leave an answer unread before the connection is cut."""
LINGER = 5.0
"""s that a connection which is being closed is given to read what was sent."""
GRACE = 3
"""s that open connections are given at the end of the service."""
_LARGEST_HEAD = 32_768
_UNREAD = 65_536
"""Bytes that the kernel takes for a client (Linux: twice as many), as many as asyncio keeps before it waits.

Left to itself it takes 4 MB on the loopback interface: hundreds of pages made for a client that reads none,
and the time to read them begins when that is full.
"""


class PatientProtocol(H11Protocol):
    """uvicorn's own with limits that it has not: an idle, a slow and a deaf client cost a socket for seconds.

    Its keep-alive limit begins with the first answer, so a client that never asks, or asks a byte a minute
    (slowloris), would stay for ever; so would one that never reads (RFC 9112, 9.5: a server may close then).
    """

    def __init__(self, *args: Any, **named: Any) -> None:
        super().__init__(*args, **named)
        self._asking: asyncio.TimerHandle | None = None
        self._unread: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._wait_for_request()

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        if self.conn.their_state in (h11.IDLE, h11.SEND_BODY):
            self._wait_for_request()
        else:
            self._asked()

    def pause_writing(self) -> None:
        self.flow.pause_writing()
        if self._unread is None:
            self._unread = self.loop.call_later(READING_TIME, self.transport.abort)

    def resume_writing(self) -> None:
        if self._unread is not None:
            self._unread.cancel()
            self._unread = None
        self.flow.resume_writing()

    def timeout_keep_alive_handler(self) -> None:
        super().timeout_keep_alive_handler()
        self.loop.call_later(LINGER, self.transport.abort)

    def connection_lost(self, exc: Exception | None) -> None:
        self._asked()
        if self._unread is not None:
            self._unread.cancel()
        super().connection_lost(exc)

    def _wait_for_request(self) -> None:
        if self._asking is None:
            self._asking = self.loop.call_later(REQUEST_TIME, self.transport.abort)

    def _asked(self) -> None:
        if self._asking is not None:
            self._asking.cancel()
            self._asking = None


def server_config(app: Any) -> uvicorn.Config:
    """How the service is run, whatever address it listens on."""
    return uvicorn.Config(
        app,
        http=PatientProtocol,
        ws="none",
        log_level="warning",
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=GRACE,
        h11_max_incomplete_event_size=_LARGEST_HEAD,
    )


def listening(host: str, port: int, backlog: int = 2048) -> socket.socket:
    """A socket that listens; whoever reads the address may call at once.

    Raises:
        ServiceError: the address is taken, or is none of this machine.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        made = socket.create_server((host, port), family=family, backlog=backlog)
    except OverflowError as error:
        raise ServiceError(f"port {port}: {error}") from None
    except OSError as error:
        allowed = "another --port, or 0 for a free one" if port else "an address of this machine"
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise ServiceError(f"{host}:{port}: cannot be listened on: {reason}; allowed: {allowed}") from None
    made.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _UNREAD)  # each connection inherits it
    return made
