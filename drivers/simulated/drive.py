"""One simulated CiA 402 drive as its node on the bus: NMT, SDO, PDO, heartbeat, EMCY and power states.

It holds no physics: :mod:`drivers.simulated.group` couples it to the bench. Times are seconds of a monotonic
clock, given by the caller.
"""

from __future__ import annotations

from collections.abc import Callable

from drivers.simulated.axis_command import AxisCommand
from drivers.simulated.bench import is_multiple
from drivers.simulated.communication import Communication
from drivers.simulated.delivery import Delivery
from drivers.simulated.device import Device, PositionScale
from drivers.simulated.emergency import Emergency, record_error
from drivers.simulated.heartbeats import Nmt
from drivers.simulated.homing import Homing
from drivers.simulated.modes import Modes
from drivers.simulated.process_data import ProcessData
from drivers.simulated.readings import Encoder, FollowingErrorWatch
from drivers.simulated.set_points import AxisMode
from drivers.simulated.state_machine import State, StateMachine, StopOptions, statusword
from drivers.simulated.stop import STANDSTILL_SPEED, StopEnd, stop_options
from drivers.simulated.thermal import MotorTemperature
from robots import Robot


class Drive:
    """The node of one axis.

    Args:
        robot: the arm's description.
        axis: index of the drive from 0.
        serial: serial number, object 1018:04.
        send: puts a frame on the bus: COB-ID and payload.
        device: what the drive is built of; the one that the description means where None.
    """

    def __init__(
        self,
        robot: Robot,
        axis: int,
        serial: int,
        send: Callable[[int, bytes], None],
        device: Device | None = None,
    ) -> None:
        self.node_id = robot.drive[axis].node_id
        self._robot, self._axis = robot, axis
        self._send = send
        signal = robot.drive[axis].control_signal
        self._control_key = signal.index, signal.subindex
        self._device = device or Device.described(robot, axis)
        self._scale = PositionScale(self._device)
        revolute = robot.joint[axis].kind == "revolute"
        increments = abs(self._device.increments_per_output_unit(revolute))
        self._encoder = Encoder(robot.drive[axis], increments, self._scale)
        saturation = robot.controller.saturation[axis] / signal.per_count
        self._current_share = 1.0 / saturation
        self.temperature = MotorTemperature()
        self.delivery = Delivery(robot, axis, serial, self._device, self._encoder.velocity_units)
        self._start()

    def _start(self) -> None:
        self.nmt = Nmt.INITIALISING
        brake = self._robot.drive[self._axis].brake
        self.machine = StateMachine(brake_opens_slowly=brake.release > 0)
        quirks = self._device.quirks
        self.dictionary = dictionary = self.delivery.dictionary()
        self.delivery.attach(dictionary, self._has_torque)
        dictionary.listeners[0x6040] = lambda subindex, value: self._obey()
        self._modes = Modes(dictionary, self._has_torque, quirks)
        self._start_communication()
        self.homing = Homing(dictionary, self._device.increments, self._scale, quirks)
        self._asked = AxisCommand(dictionary, self.machine, self.homing, self._device)
        self._following = FollowingErrorWatch(dictionary)
        self._stop_end = StopEnd(self.machine, brake)
        self.sync_period, self.tpdo_delay = self.period, quirks.tpdo_delay

    def _start_communication(self) -> None:
        self.talk = Communication(self.dictionary, self.node_id, self._has_torque, self._device.quirks)

    # -- network management ---------------------------------------------------------------------

    def boot(self, now: float) -> None:
        """Boot-up message, then pre-operational."""
        self._start()
        self._announce(now)

    def _announce(self, now: float) -> None:
        self._send(0x700 + self.node_id, bytes([Nmt.INITIALISING]))
        self.nmt = Nmt.PRE_OPERATIONAL
        self.talk.heartbeats.boot(now)

    def command_nmt(self, command: int, now: float) -> None:
        """Obeys an NMT command that is addressed to this node."""
        if command == 0x81:
            self.boot(now)
        elif command == 0x82:
            self._reset_communication(now)
        elif command in (0x01, 0x02, 0x80):
            target = {0x01: Nmt.OPERATIONAL, 0x02: Nmt.STOPPED, 0x80: Nmt.PRE_OPERATIONAL}[command]
            if target is not Nmt.OPERATIONAL and self._has_torque():
                self._abort_connection(Emergency.COMMUNICATION)
            self.nmt = target
            self.talk.change_state()

    def _reset_communication(self, now: float) -> None:
        """Objects 1000h to 1FFFh as after a reset, but for the errors; the rest goes on (7.3.2.2.1)."""
        if self._has_torque():
            self._abort_connection(Emergency.COMMUNICATION)
        self.delivery.reset_communication(self.dictionary)
        self._start_communication()
        self._announce(now)

    def next_event(self) -> float:
        """When :meth:`tick` has something to do next, s."""
        return self.talk.next_event(self.nmt)

    def tick(self, now: float, heard_all: bool) -> None:
        """Sends what is due, and misses the master where all frames so far have been heard."""
        for frame in self.talk.due(self.nmt, now):
            self._send(*frame)
        if heard_all and self.talk.misses_master(now):
            self._abort_connection(Emergency.HEARTBEAT)
            if self.nmt is Nmt.OPERATIONAL and self.dictionary.integer(0x1029, 1) != 1:
                behaviour = self.dictionary.integer(0x1029, 1)
                self.nmt = Nmt.STOPPED if behaviour == 2 else Nmt.PRE_OPERATIONAL

    # -- process data ----------------------------------------------------------------------------

    @property
    def process_data(self) -> ProcessData:
        """Its PDOs."""
        return self.talk.process_data

    def receive_rpdo(self, data: bytes) -> None:
        """An RPDO: kept for the next SYNC where it is synchronous, else taken at once."""
        if self.nmt is Nmt.OPERATIONAL and self.process_data.rpdo.valid:
            self._take(self.process_data.receive(data))

    def latch(self, sync_period: float) -> None:
        """A SYNC: takes the RPDO that came before it and obeys its controlword.

        Args:
            sync_period: the period that this SYNC stands for, s.
        """
        self.sync_period = sync_period
        if self.nmt is not Nmt.OPERATIONAL:
            return
        self._take(self.process_data.latch(sync_period))
        if self.process_data.overdue and self._has_torque():
            self.fail(Emergency.RPDO_TIMEOUT)

    def _take(self, data: bytes | None) -> None:
        if data is None:
            return
        if not self.process_data.unpack(data):
            self._report(Emergency.RPDO_LENGTH)  # not processed, and no fault (CiA 301, table 26)
            return
        if self.dictionary.integer(0x603F) == Emergency.RPDO_LENGTH:
            self._report(Emergency.NO_ERROR)
        if self.process_data.sets_target:
            self._asked.note_target()
        if self.process_data.commands:
            self._obey()

    def observe(self, position: int, set_point: int, control_signal: int) -> None:
        """Values at the start of a SYNC period.

        Args:
            position, set_point: counts of the encoder.
            control_signal: counts of its object.
        """
        self._encoder.read(position, self.homing.watch(position), self.sync_period)
        error = self._encoder.tell(self.dictionary, set_point)
        self.dictionary.set(*self._control_key, control_signal)
        if self._following.judge(error, self.mode is AxisMode.TRACKING, self.sync_period):
            self.fail(Emergency.FOLLOWING_ERROR)
        self._watch_temperature(control_signal)
        self.refresh_statusword()

    def tpdo_frames(self) -> list[tuple[int, bytes]]:
        """The TPDOs that belong to a SYNC: COB-ID and payload."""
        self.process_data.count_sync()
        return self.process_data.frames() if self.nmt is Nmt.OPERATIONAL else []

    def refresh_statusword(self) -> None:
        """Brings 6041 up to date."""
        # Bit 13 means what the mode makes of it, and nothing outside Operation enabled.
        error = self.homing.failed if self._asked.homes else self._following.exceeded
        word = statusword(
            self.machine.state,
            remote=self.nmt is Nmt.OPERATIONAL,
            following=self.homing.attained if self._asked.homes else self.mode is AxisMode.TRACKING,
            limited=self._asked.limited,
            error=error and self.machine.state is State.OPERATION_ENABLED,
            warning=self.temperature.warns,
            reached=not self.homing.active if self._asked.homes else self._asked.halted and self._stands,
        )
        self.dictionary.set(0x6041, 0, word)
        self._modes.follow()

    # -- power -----------------------------------------------------------------------------------

    @property
    def period(self) -> float:
        """Interpolation time period of object 60C2, s."""
        mantissa = self.dictionary.integer(0x60C2, 1)
        return float(mantissa * 10.0 ** self.dictionary.integer(0x60C2, 2))

    def target(self, position: int) -> int:
        """Target in counts of the encoder, within 607D; the present position while no target is known."""
        return self._asked.target(position, self._encoder.zero, self.sync_period)

    @property
    def mode(self) -> AxisMode:
        """What the axis does now."""
        return self._asked.mode

    def deceleration(self) -> float:
        """Ramp of the present stop, increments/s²."""
        return self._asked.deceleration()

    def fail(self, code: int) -> None:
        """A fault: EMCY, error objects, and the fault reaction of 605E."""
        if self.machine.state in (State.FAULT, State.FAULT_REACTION_ACTIVE):
            return
        self.machine.fault(self._options())
        self._report(code)

    def follow_stop(self, set_point_stands: bool) -> None:
        """End of a SYNC period: finishes a stop when set-point and axis stand still."""
        self._stop_end.follow(set_point_stands, self._stands, self.sync_period)

    @property
    def _stands(self) -> bool:
        return self._encoder.output_speed < STANDSTILL_SPEED

    def _has_torque(self) -> bool:
        return self.machine.mode is not AxisMode.BRAKED

    def _options(self) -> StopOptions:
        return stop_options(self.dictionary)

    def _obey(self) -> None:
        was = self.machine.state
        may_enable = self.nmt is Nmt.OPERATIONAL
        self.machine.command(self.dictionary.integer(0x6040), self._options(), may_enable)
        self._asked.command_homing(self._encoder.zero)
        if self.machine.state is was:
            return
        if was is State.FAULT:
            self._report(Emergency.NO_ERROR)
        if self.machine.state is not State.OPERATION_ENABLED:
            self._asked.forget_target()
        else:
            self._following.restart()
            self.process_data.restart()
            if (code := self._device.quirks.warning) != 0:
                self._send(0x080 + self.node_id, code.to_bytes(2, "little") + bytes(6))
            if not self._parameters_fit():
                self.machine.cut(State.SWITCHED_ON)
                self.fail(Emergency.PARAMETER)
        self.refresh_statusword()

    def _parameters_fit(self) -> bool:
        same_period = abs(self.period - self.sync_period) < 1e-9
        whole_steps = is_multiple(self.period, self._robot.controller.sample_time)
        return self._asked.follows_targets and same_period and whole_steps

    def _abort_connection(self, code: int) -> None:
        """The master is gone: what 6007 says where there is torque, and an EMCY in any case."""
        option = self.dictionary.integer(0x6007)
        if not self._has_torque():
            self._report(code)
        elif option == 1:
            self.fail(code)
        elif option == 2:
            self._report(code)
            self.machine.cut(State.SWITCH_ON_DISABLED)
        elif option == 3:
            self._report(code)
            self.machine.quick_stop(self._options())

    def _watch_temperature(self, control_signal: int) -> None:
        if self._has_torque() or self.temperature.extra_rate:
            self.temperature.advance(control_signal * self._current_share, self.sync_period)
            self.dictionary.set(0x2200, 0, round(10 * min(self.temperature.celsius, 3000.0)))
        if self.temperature.too_hot and self._has_torque():
            self.fail(Emergency.MOTOR_TEMPERATURE)

    def _report(self, code: int) -> None:
        payload = record_error(self.dictionary, code)
        self.refresh_statusword()
        if self.nmt is not Nmt.STOPPED:
            self._send(0x080 + self.node_id, payload)
