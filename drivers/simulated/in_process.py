"""Master and simulated drives in one process and in virtual time: no bus, no clock, every run the same.

The cyclic loop and the drives are the ones that run over a real bus. Only the wire is missing: a frame that
the master sends reaches the drives at once, and theirs wait until the master takes them. Time advances by
waiting alone.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import can
import numpy as np
from numpy.typing import NDArray

from drivers.bus.error_frames import ERROR_FLAG
from drivers.cia402 import objects
from drivers.cyclic.loop import Loop
from drivers.frames.channel import Channel
from drivers.frames.job import Budgets, HomingJob, Job, following_error_window, torque_limits
from drivers.frames.layout import DriveLink, second_tpdo_cob_id
from drivers.frames.ring import Request, Ring
from drivers.frames.samples import StreamResult
from drivers.frames.units import Units
from drivers.setup.guarding import consumer_word
from drivers.simulated.device import Device
from drivers.simulated.faults import NO_FAULTS, Faults
from drivers.simulated.group import DriveGroup
from drivers.simulated.parameters import control_signal_bits
from drivers.simulated.set_points import AxisMode
from drivers.simulated.truth import PlantTruth
from robots import Robot
from robots.arrays import FloatArray

CHANNEL = Channel("virtual", "in-process")
_NMT_START = bytes([0x01, 0x00])
_RING_ROWS = 1 << 16
_VELOCITY_BITS = 32


class MasterKilled(Exception):
    """The loop was cut off in the middle of its work, as kill −9 does."""


class InProcessBus(can.BusABC):
    """The drives as a bus whose time advances by waiting.

    Args:
        robot: the description.
        truth: the arm that is driven.
        faults: what goes wrong.
        devices: what the drives are built of; as described where None.
    """

    def __init__(
        self,
        robot: Robot,
        truth: PlantTruth,
        faults: Faults = NO_FAULTS,
        devices: Sequence[Device] | None = None,
    ) -> None:
        self.now = 100.0
        self._waiting: deque[can.Message] = deque()
        self.group = DriveGroup(robot, truth, self._from_drive, faults, devices=devices)
        self.syncs = 0
        self.on_sync: Callable[[int], None] = lambda number: None
        """Called with the number of each SYNC before the drives hear it."""
        self.group.boot(self.now)
        self._waiting.clear()
        self.channel_info = "in process"
        super().__init__("in process")

    def clock(self) -> float:
        """Virtual time, s."""
        return self.now

    def sleep(self, seconds: float) -> None:
        """Let time pass; the drives do what time alone brings."""
        end = self.now + max(0.0, seconds)
        while (due := self.group.next_event(self.now)) <= end:
            self.now = max(self.now, due)
            self.group.tick(self.now, heard_all=True)
        self.now = end

    def _from_drive(self, cob_id: int, data: bytes) -> None:
        error = bool(cob_id & ERROR_FLAG)
        self._waiting.append(
            can.Message(
                arbitration_id=cob_id & ~ERROR_FLAG,
                data=data,
                is_extended_id=False,
                is_error_frame=error,
                check=False,
            )
        )

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        if msg.arbitration_id == 0x080:
            self.on_sync(self.syncs)
            self.syncs += 1
        self.group.receive(msg.arbitration_id, bytes(msg.data), self.now)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        # Not _recv_internal: BusABC.recv repeats it until the timeout has passed on the real clock.
        if not self._waiting and timeout:
            end = self.now + timeout
            while not self._waiting and self.now < end:
                self.sleep(min(end, max(self.group.next_event(self.now), self.now + 1e-6)) - self.now)
        return self._waiting.popleft() if self._waiting else None

    def start(self, master: int, watch_seconds: float) -> None:
        """What the set-up does over SDO: the drives watch the master and become operational."""
        for drive in self.group.drives:
            word = consumer_word(master, watch_seconds)
            drive.dictionary.write(objects.HEARTBEAT_CONSUMER, 1, word.to_bytes(4, "little"))
            deadline = round(1000 * watch_seconds).to_bytes(2, "little")
            drive.dictionary.write(objects.RPDO_COMMUNICATION, 5, deadline)
            drive.dictionary.write(objects.ABORT_OPTION, 0, (1).to_bytes(2, "little"))
            if drive.dictionary.integer(objects.TPDO_MAPPING + 1, 0):
                cob_id = second_tpdo_cob_id(drive.node_id)
                drive.dictionary.write(objects.TPDO_COMMUNICATION + 1, 1, cob_id.to_bytes(4, "little"))
        self.group.receive(0x000, _NMT_START, self.now)

    @property
    def powered(self) -> bool:
        """Whether any axis has torque or an open brake."""
        return any(drive.mode is not AxisMode.BRAKED for drive in self.group.drives)


@dataclass(frozen=True)
class InProcessRun:
    """What came of a stream.

    Attributes:
        result: of the loop; None where the master was killed.
        rows: as the ring carries them.
        bus: with the drives as they were left.
        cycles_to_rest: SYNC periods from the given moment to the one after which no axis has torque.
    """

    result: StreamResult | None
    rows: NDArray[Any]
    bus: InProcessBus
    cycles_to_rest: float | None


def stream_in_process(
    robot: Robot,
    truth: PlantTruth,
    reference: FloatArray,
    faults: Faults = NO_FAULTS,
    *,
    budgets: Budgets | None = None,
    requests: dict[int, Request] | None = None,
    kill_at: int | None = None,
    measure_from: int | None = None,
    period_ends: tuple[int, ...] = (),
    patience: float = 5.0,
    homing: HomingJob | None = None,
    setup: Callable[[InProcessBus], None] = lambda bus: None,
    devices: Sequence[Device] | None = None,
) -> InProcessRun:
    """Stream a reference to simulated drives, in this process and as fast as it goes.

    Args:
        robot: the description.
        truth: the arm.
        reference: N × n joint positions, begins where the arm stands (robot.home).
        faults: cycles count from the SYNC that enabled the first axis.
        budgets: of the master; of a real arm where None.
        requests: by number of the drives' cycle, what is asked then.
        kill_at: cycle in which the master is killed.
        measure_from: cycle from which the time to rest is measured.
        period_ends: rows at which periods end.
        patience: s that the drives have to come to rest after the master has gone.
        homing: a search in place of the reference.
        setup: what else the drives are told before they become operational.
        devices: what the drives are built of; as described where None.
    """
    bus = InProcessBus(robot, truth, faults, devices)
    ring = Ring.create(robot.n, _RING_ROWS)
    job = replace(
        _job(robot, reference, budgets or Budgets()), period_ends=period_ends, ring_capacity=_RING_ROWS
    )
    job = replace(job, homing=homing)
    setup(bus)
    bus.start(job.master_node, job.budgets.watch_seconds)
    asked = dict(requests or {})
    marked: list[float] = []
    rested: list[float] = []

    def observe(number: int) -> None:
        cycle = bus.group.cycle
        if measure_from is not None and cycle >= measure_from and not marked:
            marked.append(bus.now)
        if marked and not rested and not bus.powered:
            rested.append(bus.now)
        for when in [when for when in asked if cycle >= when]:
            ring.request(asked.pop(when))
        if kill_at is not None and cycle >= kill_at:
            raise MasterKilled

    bus.on_sync = observe
    result: StreamResult | None = None
    try:
        result = Loop(job, bus, ring, clock=bus.clock, sleep=bus.sleep).run()
    except MasterKilled:
        bus.on_sync = lambda number: None
        end = bus.now + patience
        while bus.powered and bus.now < end:
            bus.sleep(robot.bus.cycle_time)
    finally:
        rows = ring.read()
        ring.close()
        bus.shutdown()
    if marked and not rested and not bus.powered:
        rested.append(bus.now)
    cycles = (rested[0] - marked[0]) / robot.bus.cycle_time if rested else None
    return InProcessRun(result, rows, bus, cycles)


def _job(robot: Robot, reference: FloatArray, budgets: Budgets) -> Job:
    units = Units.of(robot)
    window = following_error_window(robot, robot.bus.cycle_time)
    return Job(
        channel=CHANNEL,
        bitrate=robot.bus.bitrate,
        links=tuple(
            DriveLink(
                drive.node_id,
                f"drive of joint {joint.name}",
                control_signal_bits=control_signal_bits(robot, axis),
                velocity_bits=0 if drive.velocity is None else _VELOCITY_BITS,
                heartbeat=0.1,
                watches=True,
            )
            for axis, (joint, drive) in enumerate(zip(robot.joint, robot.drive, strict=True))
        ),
        cycle_time=robot.bus.cycle_time,
        units=units,
        reference=units.counts(reference),
        velocity=robot.velocity_limits,
        acceleration=robot.acceleration_limits,
        following_error=np.ceil(window * np.abs(robot.counts_per_output_unit)).astype(np.int64),
        start_tolerance=np.full(robot.n, 0.02),
        budgets=budgets,
        parent=os.getpid(),
        ring_capacity=_RING_ROWS,
        master_node=robot.bus.master_node_id,
        torque_limits=torque_limits(robot),
        position_limits=(robot.lower, robot.upper),
    )
