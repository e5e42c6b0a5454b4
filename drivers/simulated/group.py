"""All drives of one simulated arm and the bench they share: frames in, frames out, time from SYNC."""

from __future__ import annotations

import logging
import zlib
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from drivers.bus.error_frames import BUS_OFF, ERROR_FLAG
from drivers.bus.ports import REMOTE_FLAG, Frame
from drivers.simulated.bench import Bench, Snapshot, is_multiple
from drivers.simulated.device import Device, described_devices, increments_per_output_unit
from drivers.simulated.drive import Drive
from drivers.simulated.emergency import Emergency
from drivers.simulated.faults import NO_FAULTS, Faults
from drivers.simulated.late_frames import LateFrames
from drivers.simulated.offline import control_signal_counts
from drivers.simulated.scenario import EMPTY, Scenario
from drivers.simulated.set_points import AxisMode
from drivers.simulated.state_machine import State
from drivers.simulated.truth import PlantTruth
from robots import Robot
from robots.arrays import IntArray

log = logging.getLogger(__name__)

NMT, SYNC, RSDO, HEARTBEAT = 0x000, 0x080, 0x600, 0x700
SYNC_PATIENCE = 2.5
"""SYNC periods without SYNC after which an enabled drive calls it lost."""
SHORTEST_PATIENCE = 0.2
"""But never sooner than this, s: a busy machine that stalls master and drives together loses no SYNC."""


class DriveGroup:
    """The nodes of one arm.

    Args:
        robot: the description.
        truth: the arm that is driven.
        send: puts a frame on the bus: COB-ID and payload.
        faults: what goes wrong.
        scenario: what the arm has besides.
        noise_seed: of its noise; the truth's own where None. The drives stay the same ones.
        send_together: puts the TPDOs of one SYNC on the bus; ``send``, one after the other, where None.
        devices: what the drives are built of, one for each axis; those that the description means where None.
    """

    def __init__(
        self,
        robot: Robot,
        truth: PlantTruth,
        send: Callable[[int, bytes], None],
        faults: Faults = NO_FAULTS,
        scenario: Scenario = EMPTY,
        *,
        noise_seed: int | None = None,
        send_together: Callable[[Sequence[Frame]], None] | None = None,
        devices: Sequence[Device] | None = None,
    ) -> None:
        noisy = truth if noise_seed is None else replace(truth, seed=noise_seed)
        built = tuple(devices) if devices is not None else described_devices(robot)
        self._increments = increments_per_output_unit(robot, built)
        self._directions = np.array([device.direction for device in built])
        self.bench = Bench(robot, noisy, scenario, self._increments)
        self.bench.compile_ahead()
        self._robot = robot
        self._faults = faults
        self.drives = tuple(
            Drive(robot, axis, serial_number(robot, truth.seed, axis), self._put, device)
            for axis, device in enumerate(built)
        )
        self._by_node = {drive.node_id: drive for drive in self.drives}
        for wrong in faults.identities:
            if wrong.node in self._by_node:
                self._by_node[wrong.node].delivery.changed_values[0x1018, 2] = wrong.product
        self._send = send
        self._send_together = send_together
        self._late: list[tuple[int, bytes]] = []
        self._slow = LateFrames()
        self._off_bus = False
        self._dead: set[int] = set()
        self._last_sync = 0.0
        self.cycle = -1
        """SYNC periods since the one that enabled the first axis; −1 while none is enabled."""

    def boot(self, now: float) -> None:
        """Every node's boot-up message."""
        for drive in self._alive():
            drive.boot(now)
        self._show_position()

    def receive(self, cob_id: int, data: bytes, now: float) -> None:
        """One frame from the bus at a time of the monotonic clock, s."""
        if self._off_bus:
            return
        if cob_id == SYNC:
            self._last_sync = now
            self.run_period(on_sync=True)
        elif cob_id == NMT:
            self._command_nmt(data, now)
        else:
            self._hand_on(cob_id, data, now)

    def _hand_on(self, cob_id: int, data: bytes, now: float) -> None:
        """A frame that concerns single drives."""
        if cob_id & REMOTE_FLAG:
            self._answer_remote(cob_id & ~REMOTE_FLAG, now)
        elif HEARTBEAT < cob_id <= HEARTBEAT + 127:
            for drive in self._alive():
                drive.talk.heartbeats.hear(cob_id - HEARTBEAT, now)
        elif RSDO < cob_id <= RSDO + 127:
            node = self._by_node.get(cob_id - RSDO)
            if node is not None and node.node_id not in self._dead:
                for frame in node.talk.answer_sdo(data, node.nmt):
                    self._put(*frame)
        else:
            for drive in self._alive():
                if drive.process_data.rpdo.cob_id == cob_id:
                    drive.receive_rpdo(data)

    def _answer_remote(self, cob_id: int, now: float) -> None:
        for drive in self._alive():
            for frame in drive.talk.answer_remote(cob_id, drive.nmt, now):
                self._put(*frame)

    def next_event(self, now: float) -> float:
        """When :meth:`tick` has something to do next, s."""
        due = min((drive.next_event() for drive in self._alive()), default=now + 1.0)
        due = min(due, self._slow.next_event())
        return due if self._idle() else min(due, self._sync_due())

    def tick(self, now: float, heard_all: bool) -> None:
        """What time alone brings: heartbeats, and a SYNC that stays away while the arm is not at rest.

        Args:
            now: time of the monotonic clock, s.
            heard_all: no frame waits to be received; else nothing is called lost yet.
        """
        for frame in self._slow.due(now):
            self._put(*frame)
        for drive in self._alive():
            drive.tick(now, heard_all)
        if self._idle() or not heard_all or now < self._sync_due():
            return
        for drive in self._alive():
            if drive.machine.mode is not AxisMode.BRAKED:
                drive.fail(Emergency.RPDO_TIMEOUT)
        # From here on the clock drives the ramp down, one period at a time.
        self._last_sync += self.bench.period
        self.run_period(on_sync=False)

    def run_period(self, on_sync: bool) -> None:
        """One SYNC period of drives and plant; without ``on_sync`` nothing is latched and nothing sent."""
        self._choose_period()
        if on_sync:
            late = self._inject()
            for drive in self._alive():
                drive.latch(self.bench.period)
            for drive, data in late:
                drive.receive_rpdo(data)
        snapshot = self.bench.begin_cycle(self._modes(), self._targets())
        self._count_cycle()
        self._observe(snapshot)
        if on_sync:
            self._publish()
        self.bench.finish_cycle()
        stopped = self.bench.set_points.stopped()
        for axis, drive in enumerate(self.drives):
            drive.follow_stop(bool(stopped[axis]))

    def _alive(self) -> tuple[Drive, ...]:
        if not self._dead:
            return self.drives
        return tuple(drive for drive in self.drives if drive.node_id not in self._dead)

    def _idle(self) -> bool:
        return self.bench.at_rest and all(d.machine.mode is AxisMode.BRAKED for d in self._alive())

    def _sync_due(self) -> float:
        return self._last_sync + max(SYNC_PATIENCE * self.bench.period, SHORTEST_PATIENCE)

    def _command_nmt(self, data: bytes, now: float) -> None:
        if len(data) < 2:
            return
        for drive in self._alive():
            if data[1] in (0, drive.node_id):
                drive.command_nmt(data[0], now)
        if self._idle():
            self._show_position()

    def _show_position(self) -> None:
        """Where the arm rests: a drive knows its encoder and its state before the first SYNC."""
        here = np.rint(self.bench.plant.drive_position() * self._increments)
        for axis, drive in enumerate(self.drives):
            drive.observe(int(here[axis]), int(here[axis]), 0)

    def _choose_period(self) -> None:
        """At rest the bench takes the SYNC period that all drives agree on (60C2)."""
        if not self.bench.at_rest:
            return
        periods = {drive.period for drive in self._alive()}
        if len(periods) == 1 and self.bench.period not in periods:
            period = periods.pop()
            if is_multiple(period, self._robot.controller.sample_time):
                self.bench.set_period(period)

    def _modes(self) -> IntArray:
        modes = [AxisMode.BRAKED if drive.node_id in self._dead else drive.mode for drive in self.drives]
        set_points = self.bench.set_points
        for axis, mode in enumerate(modes):
            if mode is AxisMode.STOPPING:
                ramp = self.drives[axis].deceleration()
                set_points.deceleration[axis] = ramp / abs(self._increments[axis])
        return np.array(modes, dtype=np.int64)

    def _targets(self) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        here = np.rint(self.bench.plant.drive_position() * self._increments)
        return np.array([float(drive.target(int(here[axis]))) for axis, drive in enumerate(self.drives)])

    def _count_cycle(self) -> None:
        if all(drive.machine.mode is AxisMode.BRAKED for drive in self._alive()):
            self.cycle = -1
        else:
            self.cycle += 1

    def _observe(self, snapshot: Snapshot) -> None:
        position = snapshot.position.astype(np.int64).tolist()
        set_point = np.rint(snapshot.set_point).astype(np.int64).tolist()
        counts = self._directions * control_signal_counts(self._robot, snapshot.control_signal)
        control = counts.astype(np.int64).tolist()
        for axis, drive in enumerate(self.drives):
            drive.observe(position[axis], set_point[axis], control[axis])

    def _put(self, cob_id: int, data: bytes) -> None:
        """A frame of a drive, which no longer reaches a master that is off the bus."""
        if not self._off_bus:
            self._send(cob_id, data)

    def _publish(self) -> None:
        frames, self._late = self._late, []
        for drive in self._alive():
            if self._faults.loses_tpdo(drive.node_id, self.cycle):
                continue
            if drive.tpdo_delay:
                self._slow.put(drive.tpdo_frames(), self._last_sync + drive.tpdo_delay)
                continue
            late = self._faults.delays_tpdo(drive.node_id, self.cycle)
            (self._late if late else frames).extend(drive.tpdo_frames())
        if self._send_together is not None and not self._off_bus:
            self._send_together(frames)
            return
        for cob_id, data in frames:
            self._put(cob_id, data)

    def _inject(self) -> list[tuple[Drive, bytes]]:
        """Faults due at the cycle that this SYNC begins; RPDOs that are to come only after it."""
        late: list[tuple[Drive, bytes]] = []
        if self.cycle < 0:
            return late
        cycle = self.cycle + 1
        for drive in self._alive():
            if self._faults.loses_rpdo(drive.node_id, cycle):
                drive.process_data.drop()
            if (
                self._faults.delays_rpdo(drive.node_id, cycle)
                and (data := drive.process_data.delay()) is not None
            ):
                late.append((drive, data))
        for emergency in self._faults.emergencies:
            if emergency.cycle == cycle and emergency.node in self._by_node:
                self._by_node[emergency.node].fail(emergency.code)
        for dead in self._faults.dead:
            if dead.cycle == cycle and dead.node in self._by_node:
                log.info("node %d goes silent", dead.node)
                self._dead.add(dead.node)
                self._by_node[dead.node].machine.cut(State.SWITCH_ON_DISABLED)
        self._inject_into_hardware(cycle)
        return late

    def _inject_into_hardware(self, cycle: int) -> None:
        frozen = {fault.node for fault in self._faults.frozen_encoders if fault.cycle <= cycle}
        if frozen:
            self.bench.freeze_encoders(np.array([drive.node_id in frozen for drive in self.drives]))
        for drive in self.drives:
            for hot in self._faults.hot_motors:
                if (hot.node, hot.cycle) == (drive.node_id, cycle):
                    drive.temperature.extra_rate = hot.rate
        if any(off.cycle == cycle for off in self._faults.bus_off):
            self._put(ERROR_FLAG | BUS_OFF, bytes(8))
            self._off_bus = True


def serial_number(robot: Robot, seed: int, axis: int) -> int:
    """A serial number that stays the same for one drive of one simulated arm, not 0."""
    text = f"{robot.name}:{seed}:{robot.drive[axis].node_id}"
    return zlib.crc32(text.encode()) or 1
