"""Frames in and out of an open bus at the least cost: what the cyclic process uses in place of messages.

python-can makes an object of every frame. At 500 cycles of 13 frames a second that costs more than all the
rest of the loop, so for the two kinds of bus that matter the frames are read from and written to the bus's
own sockets; every other interface is used through python-can.
"""

from __future__ import annotations

import select
import socket
import struct
import sys
from collections.abc import Callable, Sequence
from typing import Protocol

import can
import msgpack
from can.interfaces.socketcan import SocketcanBus
from can.interfaces.udp_multicast.utils import pack_message

from drivers.bus.adapters import pcan_report
from drivers.bus.batch import DatagramBatch
from drivers.bus.error_frames import BUS_OFF, CONTROLLER, ERROR_FLAG
from drivers.bus.multicast import LocalMulticastBus

Frame = tuple[int, bytes]
"""COB-ID and payload; an id with ERROR_FLAG is the controller's report, with REMOTE_FLAG a remote frame."""

_EXTENDED, REMOTE_FLAG = 0x8000_0000, 0x4000_0000
_CAN_FRAME = struct.Struct("=IB3x8s")
_HEADER = 8
_MOST_FRAMES = 4096
"""Taken in at once; a bus that floods must not keep the loop from its deadline for good."""
# Linux numbers that Python's socket module does not carry.
_SO_MEMINFO = 55
_MEMINFO = struct.Struct("=9I")
_DROPS = 8


class FramePort(Protocol):
    """An open bus, frame by frame. Nothing here blocks except :meth:`wait`."""

    def send(self, cob_id: int, data: bytes) -> bool:
        """Put a frame on the bus; False where the system refuses it."""

    def prepare(self, cob_ids: Sequence[int], size: int) -> Callable[[Sequence[bytes]], int]:
        """What sends a payload of this size on each of these ids, and tells how many the system refused."""

    def drain(self) -> list[Frame]:
        """All frames that have come."""

    def wait(self, seconds: float) -> None:
        """Until a frame is there, or the time is over."""

    def overflows(self) -> int:
        """Frames that the system has dropped since the port was opened: nobody fetched them in time."""


def frame_port(bus: can.BusABC) -> FramePort:
    """The fastest port for an open bus; the bus stays open and is closed by its owner."""
    if isinstance(bus, LocalMulticastBus):
        return _MulticastPort(bus)
    if isinstance(bus, SocketcanBus):
        return _SocketCanPort(bus.socket)
    return _MessagePort(bus)


def dropped_frames(sock: socket.socket) -> int:
    """The kernel's count of frames that found no room in a socket's receive buffer.

    It is the counter that SO_RXQ_OVFL attaches to received frames, read without one (SO_MEMINFO). 0 where
    the system does not tell.
    """
    if sys.platform != "linux":
        return 0
    try:
        words = _MEMINFO.unpack(sock.getsockopt(socket.SOL_SOCKET, _SO_MEMINFO, _MEMINFO.size))
    except (OSError, struct.error):
        return 0
    return int(words[_DROPS])


class _MulticastPort:
    """python-can's ``udp_multicast`` datagrams, made from a template and read field by field."""

    def __init__(self, bus: LocalMulticastBus) -> None:
        self._receiver, self._sender, self._address = bus.sockets
        self._bus = bus
        self._accepted = bus.accepted_ids
        self._known: dict[bytes, int] = {}
        """COB-ID by all that comes before eight bytes of payload: a datagram like one that was decoded."""
        self._templates: dict[tuple[int, int], tuple[bytes, bytes]] = {}
        self._sent = 0
        self._base = dropped_frames(self._receiver)

    def send(self, cob_id: int, data: bytes) -> bool:
        template = self._templates.get((cob_id, len(data)))
        if template is None:
            template = self._templates[cob_id, len(data)] = _template(cob_id, len(data))
        try:
            self._sender.sendto(template[0] + data + template[1], self._address)
        except OSError:
            return False
        self._sent += 1
        return True

    def prepare(self, cob_ids: Sequence[int], size: int) -> Callable[[Sequence[bytes]], int]:
        self._sender.connect(self._address)
        batch = DatagramBatch(self._sender, [_template(cob_id, size) for cob_id in cob_ids], size)

        def send(payloads: Sequence[bytes]) -> int:
            refused = batch.send(payloads)
            self._sent += len(payloads) - refused
            return refused

        return send

    def drain(self) -> list[Frame]:
        frames: list[Frame] = []
        receive, accepted, known = self._receiver.recv, self._accepted, self._known
        try:
            while len(frames) < _MOST_FRAMES:
                datagram = receive(512)
                head = datagram[:-_TAIL_AND_EIGHT]
                if (cob_id := known.get(head)) is not None and datagram.endswith(_TAIL):
                    frames.append((cob_id, datagram[-_TAIL_AND_EIGHT : -len(_TAIL)]))
                    continue
                if (frame := _decoded(datagram)) is None:
                    continue
                if accepted is None or frame[0] & ~REMOTE_FLAG in accepted or frame[0] & ERROR_FLAG:
                    frames.append(frame)
                    if len(frame[1]) == 8 and not frame[0] & ERROR_FLAG and datagram.endswith(_TAIL):
                        known[head] = frame[0]
        except BlockingIOError:
            pass
        except OSError as error:
            raise can.CanOperationError(f"failed to receive: {error}") from error
        return frames

    def wait(self, seconds: float) -> None:
        select.select([self._receiver], [], [], max(0.0, seconds))

    def overflows(self) -> int:
        # The socket's filter drops this bus's own echoes, and the kernel counts them with the others.
        return max(0, dropped_frames(self._receiver) - self._base - self._sent)


def _template(cob_id: int, size: int) -> tuple[bytes, bytes]:
    """A datagram with so many payload bytes, cut in two where they belong."""
    mark = bytes(range(0xA0, 0xA0 + size))
    datagram = bytes(pack_message(can.Message(arbitration_id=cob_id, data=mark, is_extended_id=False)))
    if not size:
        return datagram, b""
    before, _, after = datagram.partition(mark)
    return before, after


_TAIL = _template(0x181, 8)[1]
"""What follows the payload in a datagram of python-can."""
_TAIL_AND_EIGHT = len(_TAIL) + 8


def _decoded(datagram: bytes) -> Frame | None:
    """The classical data or error frame in a datagram; None for anything else."""
    try:
        fields = msgpack.unpackb(datagram)
        cob_id, data = fields["arbitration_id"], fields["data"]
        if fields["is_error_frame"]:
            return cob_id | ERROR_FLAG, bytes(data)
        if fields["is_extended_id"] or fields["is_fd"]:
            return None
        if fields["is_remote_frame"]:
            return cob_id | REMOTE_FLAG, b""
    except (ValueError, TypeError, KeyError, msgpack.UnpackException):
        return None
    return (cob_id, bytes(data)) if isinstance(cob_id, int) else None


class _SocketCanPort:
    """Classical frames of a SocketCAN socket, 16 bytes each (``struct can_frame``)."""

    def __init__(self, sock: socket.socket) -> None:
        self._socket = sock
        self._base = dropped_frames(sock)

    def send(self, cob_id: int, data: bytes) -> bool:
        try:
            self._socket.send(_CAN_FRAME.pack(cob_id, len(data), data), socket.MSG_DONTWAIT)
        except OSError:
            return False
        return True

    def prepare(self, cob_ids: Sequence[int], size: int) -> Callable[[Sequence[bytes]], int]:
        frames = [
            (_CAN_FRAME.pack(cob_id, size, b"")[:_HEADER], bytes(_CAN_FRAME.size - _HEADER - size))
            for cob_id in cob_ids
        ]
        return DatagramBatch(self._socket, frames, size).send

    def drain(self) -> list[Frame]:
        frames: list[Frame] = []
        receive, unpack, size = self._socket.recv, _CAN_FRAME.unpack_from, _CAN_FRAME.size
        try:
            while len(frames) < _MOST_FRAMES:
                raw = receive(72, socket.MSG_DONTWAIT)
                if len(raw) != size:
                    continue
                can_id, length, data = unpack(raw)
                if not can_id & _EXTENDED or can_id & ERROR_FLAG:
                    frames.append((can_id, b"" if can_id & REMOTE_FLAG else data[:length]))
        except BlockingIOError:
            pass
        except OSError as error:
            raise can.CanOperationError(f"failed to receive: {error}") from error
        return frames

    def wait(self, seconds: float) -> None:
        select.select([self._socket], [], [], max(0.0, seconds))

    def overflows(self) -> int:
        return dropped_frames(self._socket) - self._base


class _MessagePort:
    """Any python-can bus. Its controller's state is asked for at times, since many send no error frames."""

    STATE_EVERY = 25
    """Drains between two looks at the state: some makers' libraries take their time to answer."""

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus
        self._messages: dict[tuple[int, int], can.Message] = {}
        self._waited: can.Message | None = None
        self._drains = 0
        self._pcan = type(bus).__module__.startswith("can.interfaces.pcan")

    def send(self, cob_id: int, data: bytes) -> bool:
        message = self._messages.get((cob_id, len(data)))
        if message is None:
            message = can.Message(arbitration_id=cob_id, data=data, is_extended_id=False)
            self._messages[cob_id, len(data)] = message
        message.data[:] = data
        try:
            self._bus.send(message)
        except can.CanError:
            return False
        return True

    def prepare(self, cob_ids: Sequence[int], size: int) -> Callable[[Sequence[bytes]], int]:
        def send(payloads: Sequence[bytes]) -> int:
            return sum(not self.send(i, payload) for i, payload in zip(cob_ids, payloads, strict=True))

        return send

    def drain(self) -> list[Frame]:
        frames: list[Frame] = []
        message, self._waited = self._waited, None
        if message is None:
            message = self._bus.recv(timeout=0)
        while message is not None and len(frames) < _MOST_FRAMES:
            if message.is_error_frame and self._pcan:
                frames.append(pcan_report(bytes(message.data)))
            elif message.is_error_frame:
                frames.append((message.arbitration_id | ERROR_FLAG, bytes(message.data)))
            # Adapters such as gs_usb hand back what was sent: no second master.
            elif message.is_rx and not (message.is_extended_id or message.is_fd):
                flag = REMOTE_FLAG if message.is_remote_frame else 0
                frames.append((message.arbitration_id | flag, bytes(message.data)))
            message = self._bus.recv(timeout=0)
        self._drains += 1
        if self._drains % self.STATE_EVERY == 0:
            frames += self._state()
        return frames

    def _state(self) -> list[Frame]:
        state = self._bus.state
        if state is can.BusState.ERROR:
            return [(ERROR_FLAG | BUS_OFF, bytes(8))]
        if state is can.BusState.PASSIVE:
            return [(ERROR_FLAG | CONTROLLER, bytes([0, 0x30, 0, 0, 0, 0, 0, 0]))]
        return []

    def wait(self, seconds: float) -> None:
        if self._waited is None:
            self._waited = self._bus.recv(timeout=max(0.0, seconds))

    def overflows(self) -> int:
        return 0
