"""A UDP multicast CAN bus that never leaves this machine.

It speaks python-can's ``udp_multicast`` datagrams, with the socket set up otherwise: joined and sent on
the loopback interface with hop limit 0, bound to its own group so that groups do not mix, and its
own frames are not received.
"""

from __future__ import annotations

import ctypes
import logging
import select
import socket
import struct
import sys
import time
from typing import Any

import can
from can import CanProtocol
from can.interfaces.udp_multicast.bus import (
    GeneralPurposeUdpMulticastBus,
    UdpMulticastBus,
)
from can.interfaces.udp_multicast.utils import unpack_message

log = logging.getLogger(__name__)

LOOPBACK = "127.0.0.1"
RECEIVE_BUFFER = 4 << 20
"""Bytes. Each small datagram is booked with about 1 kB, so this holds some 4000 frames."""

# Linux numbers that Python's socket module does not carry.
_SO_ATTACH_FILTER = 26
_IP_MULTICAST_ALL = 49
_SO_RCVBUFFORCE = 33


def enlarge_receive_buffer(sock: socket.socket, size: int = RECEIVE_BUFFER) -> None:
    """Ask for a receive buffer of so many bytes: an overflow drops frames without notice."""
    if sys.platform == "linux":
        try:
            sock.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, size)
            return
        except PermissionError:
            log.debug("SO_RCVBUFFORCE is not permitted; the system's limit applies")
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, size)


def _drop_source_port(sock: socket.socket, port: int) -> None:
    """Let the kernel drop datagrams from a UDP source port: own echoes then cost no wake-up.

    A classic BPF program of three instructions; offset 0 is the UDP header, whose first 16 bits are
    the source port.
    """
    instructions = (
        (0x28, 0, 0, 0),  # load half word at offset 0
        (0x15, 0, 1, port),  # equal: next one; else: skip one
        (0x06, 0, 0, 0),  # keep 0 bytes: drop
        (0x06, 0, 0, 0xFFFFFFFF),  # keep all
    )
    program = ctypes.create_string_buffer(b"".join(struct.pack("HBBI", *i) for i in instructions))
    header = struct.pack("HP", len(instructions), ctypes.addressof(program))
    sock.setsockopt(socket.SOL_SOCKET, _SO_ATTACH_FILTER, header)


class _LocalMulticast(GeneralPurposeUdpMulticastBus):
    """Two sockets: one receives the group; one sends, so that its port tells own frames from others'."""

    def __init__(self, group: str, port: int) -> None:
        self._sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(LOOPBACK))
            self._sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
            self._sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)
            self._sender.bind((LOOPBACK, 0))
            self.own_port: int = self._sender.getsockname()[1]
            super().__init__(group, port, hop_limit=0)
        except BaseException:
            self._sender.close()
            raise

    @property
    def receiver(self) -> socket.socket:
        """Where the group's datagrams arrive."""
        return self._socket

    @property
    def sender(self) -> socket.socket:
        """Where datagrams are sent from."""
        return self._sender

    def _create_socket(self, address_family: socket.AddressFamily) -> socket.socket:
        sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if hasattr(socket, "SO_REUSEPORT"):
                sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
            enlarge_receive_buffer(sock)
            if sys.platform == "linux":
                sock.setsockopt(socket.IPPROTO_IP, _IP_MULTICAST_ALL, 0)
                _drop_source_port(sock, self.own_port)
            # Bound to the group itself: no datagram of another group or to another address comes in.
            sock.bind((self.group, self.port))
            request = socket.inet_aton(self.group) + socket.inet_aton(LOOPBACK)
            sock.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, request)
            sock.setblocking(False)
        except BaseException:
            sock.close()
            raise
        return sock

    def recv(self, timeout: float | None = None) -> tuple[bytes, tuple[str, int], float] | None:
        """The next datagram of another sender: data, sender, time of arrival (s since the epoch)."""
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            try:
                data, sender = self._socket.recvfrom(self.max_buffer)
            except BlockingIOError:
                left = None if deadline is None else deadline - time.monotonic()
                if (left is not None and left <= 0) or not self._wait(left):
                    return None
                continue
            except OSError as error:
                raise can.CanOperationError(f"failed to receive: {error}") from error
            if sender[1] != self.own_port:
                return data, sender, time.time()

    def _wait(self, timeout: float | None) -> bool:
        # A blocking read with SO_RCVTIMEO would round to jiffies; select keeps microseconds.
        ready, _, _ = select.select([self._socket], [], [], timeout)
        return bool(ready)

    def send(self, data: bytes, timeout: float | None = None) -> None:
        try:
            self._sender.sendto(data, (self.group, self.port))
        except OSError as error:
            raise can.CanOperationError(f"failed to send: {error}") from error

    def shutdown(self) -> None:
        self._sender.close()
        super().shutdown()


class LocalMulticastBus(UdpMulticastBus):
    """python-can's udp_multicast bus, kept on this machine and without own echoes.

    Args:
        group: IPv4 multicast group.
        port: UDP port.
        can_filters: as for every python-can bus.

    Raises:
        OSError: the sockets cannot be made or joined.
    """

    def __init__(
        self,
        group: str,
        port: int,
        can_filters: can.typechecking.CanFilters | None = None,
    ) -> None:
        # Not UdpMulticastBus.__init__: it would open the socket that this class is there to avoid.
        self._can_protocol = CanProtocol.CAN_20
        self._local = self._multicast = _LocalMulticast(group, port)
        can.BusABC.__init__(self, group, can_filters=can_filters)
        self.channel_info = f"udp_multicast {group}:{port} on {LOOPBACK}"

    @property
    def sockets(self) -> tuple[socket.socket, socket.socket, tuple[str, int]]:
        """Receiving socket, sending socket, and where frames are sent to: for whoever reads raw datagrams."""
        port = self._local
        return port.receiver, port.sender, (port.group, port.port)

    @property
    def accepted_ids(self) -> frozenset[int] | None:
        """11-bit ids that the filters let through; None where they let through all."""
        if not self.filters:
            return None
        return frozenset(f["can_id"] for f in self.filters)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        # Filtered here in a loop: BusABC.recv(0) gives up at the first frame that does not match.
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            left = None if deadline is None else max(0.0, deadline - time.monotonic())
            received = self._multicast.recv(left)
            if received is None:
                return None, True
            message = _message(received[0], received[2])
            if message is not None and self._matches_filters(message):
                return message, True


def _message(data: bytes, timestamp: float) -> can.Message | None:
    """The classical CAN frame in a datagram; anything else in the group is passed over."""
    replace: dict[str, Any] = {"timestamp": timestamp}
    try:
        message = unpack_message(data, replace=replace, check=True)
    except (ValueError, TypeError, AttributeError) as error:
        # msgpack's own exceptions are ValueErrors; a payload that is not a mapping has no update().
        log.warning("a datagram in the group is not a CAN frame: %s", error)
        return None
    return None if message.is_fd else message
