"""How the simulated drives' frames get onto the bus, those of one SYNC together."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import can

from drivers.bus.error_frames import ERROR_FLAG
from drivers.bus.ports import Frame, FramePort, frame_port


class FrameSender:
    """Puts frames on an open bus.

    Args:
        bus: used, not closed.
    """

    def __init__(self, bus: can.BusABC) -> None:
        self.port: FramePort = frame_port(bus)
        """The same bus for whoever listens."""
        self._bus = bus
        self._batches: dict[tuple[tuple[int, ...], int], Callable[[Sequence[bytes]], int]] = {}

    def __call__(self, cob_id: int, data: bytes) -> None:
        """One frame; an id with ERROR_FLAG is a report of the controller."""
        if cob_id & ERROR_FLAG:
            kind = cob_id & ~ERROR_FLAG
            self._bus.send(can.Message(arbitration_id=kind, data=data, is_error_frame=True, check=False))
        else:
            self.port.send(cob_id, data)

    def together(self, frames: Sequence[Frame]) -> None:
        """Several data frames in their order, in one system call where their payloads are of one size.

        One call instead of six spares the master as many wake-ups.
        """
        sizes = {len(data) for _, data in frames}
        if len(frames) < 2 or len(sizes) > 1:
            for cob_id, data in frames:
                self(cob_id, data)
            return
        key = tuple(cob_id for cob_id, _ in frames), sizes.pop()
        send = self._batches.get(key)
        if send is None:
            send = self._batches[key] = self.port.prepare(*key)
        send([data for _, data in frames])
