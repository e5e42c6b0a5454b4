"""What a foreign master meets at the simulated drives: clauses of CiA 301 that drives are caught out by."""

from __future__ import annotations

from collections.abc import Callable

import can
import pytest

from drivers import Channel, open_bus
from drivers.bus.ports import REMOTE_FLAG, frame_port
from drivers.simulated.drive import Drive
from drivers.simulated.heartbeats import Nmt
from drivers.simulated.object_dictionary import SdoAbort
from drivers.simulated.state_machine import State
from robots import Robot

SAVE, LOAD = (int.from_bytes(word, "little") for word in (b"save", b"load"))


def next_word(statusword: int) -> int:
    """The controlword that leads up."""
    return {0x40: 0x06, 0x21: 0x07, 0x23: 0x0F}.get(statusword & 0x6F, 0x0F)


class Wire:
    """One node that has booted, and what it has sent."""

    def __init__(self, robot: Robot) -> None:
        self.sent: list[tuple[int, bytes]] = []
        self.drive = Drive(robot, 0, 1, lambda cob_id, data: self.sent.append((cob_id, data)))
        self.drive.boot(10.0)
        self.sent.clear()

    def write(self, index: int, subindex: int, value: int) -> None:
        """As an SDO download does."""
        entry = self.drive.dictionary.entry(index, subindex)
        self.drive.dictionary.write(index, subindex, value.to_bytes(entry.bits // 8, "little"))

    def read(self, index: int, subindex: int = 0) -> int:
        return int.from_bytes(self.drive.dictionary.read(index, subindex), "little")

    def map_tpdo(self, kind: int, *words: int) -> None:
        """The second TPDO, with a transmission type and objects."""
        self.write(0x1801, 1, 0x80000281)
        self.write(0x1801, 2, kind)
        self.write(0x1A01, 0, 0)
        for number, word in enumerate(words, start=1):
            self.write(0x1A01, number, word)
        self.write(0x1A01, 0, len(words))
        self.write(0x1801, 1, 0x281)

    def sync(self) -> None:
        """A SYNC, with what it is answered by."""
        self.drive.latch(0.004)
        for frame in self.drive.tpdo_frames():
            self.sent.append(frame)

    def ticks(self, begin: float, seconds: float) -> None:
        """Time alone, in milliseconds."""
        for millisecond in range(round(1000 * seconds)):
            self.drive.tick(begin + millisecond / 1000, heard_all=True)

    def remote(self, cob_id: int, now: float = 10.0) -> None:
        self.sent += self.drive.talk.answer_remote(cob_id, self.drive.nmt, now)

    def of(self, cob_id: int) -> list[bytes]:
        """Payloads sent on an id; they are taken away."""
        found = [data for sent, data in self.sent if sent == cob_id]
        self.sent = [frame for frame in self.sent if frame[0] != cob_id]
        return found

    def enable(self) -> None:
        """Operation enabled, in csp."""
        self.drive.command_nmt(0x01, 10.0)
        self.write(0x6060, 0, 8)
        for _ in range(500):
            word = next_word(self.drive.dictionary.integer(0x6041))
            self.drive.receive_rpdo(word.to_bytes(2, "little") + bytes(4))
            self.sync()
            self.drive.observe(0, 0, 0)
            if self.drive.machine.state is State.OPERATION_ENABLED:
                return
        raise AssertionError("not enabled")

    def emergencies(self) -> list[int]:
        return [int.from_bytes(data[:2], "little") for cob_id, data in self.sent if cob_id == 0x081]


@pytest.fixture
def wire(tx40: Robot) -> Wire:
    return Wire(tx40)


def test_a_short_rpdo_is_an_emergency_and_no_fault(wire: Wire) -> None:
    drive = wire.drive
    drive.command_nmt(0x01, 10.0)
    drive.receive_rpdo(bytes(4))
    drive.latch(0.004)
    assert wire.emergencies() == [0x8210]
    assert drive.dictionary.integer(0x1001) == 0x11 and drive.dictionary.integer(0x603F) == 0x8210
    drive.receive_rpdo(bytes(6))
    drive.latch(0.004)
    assert wire.emergencies() == [0x8210, 0x0000]
    assert drive.dictionary.integer(0x1001) == 0, "the error has passed"


@pytest.mark.parametrize("cob_id", [0x000, 0x07F, 0x101, 0x180, 0x581, 0x601, 0x6E0, 0x701, 0x7FF])
def test_a_restricted_cob_id_is_refused(wire: Wire, cob_id: int) -> None:
    with pytest.raises(SdoAbort, match="0x06090030"):
        wire.drive.dictionary.write(0x1800, 1, (cob_id | 1 << 31).to_bytes(4, "little"))


def test_a_changed_heartbeat_time_acts_at_once(wire: Wire) -> None:
    dictionary = wire.drive.dictionary
    dictionary.write(0x1017, 0, (5000).to_bytes(2, "little"))
    wire.drive.tick(10.0, heard_all=True)
    wire.sent.clear()
    dictionary.write(0x1017, 0, (20).to_bytes(2, "little"))
    for millisecond in range(100):
        wire.drive.tick(10.001 + millisecond / 1000, heard_all=True)
    assert len([cob_id for cob_id, _ in wire.sent if cob_id == 0x701]) == 5


def test_the_history_has_no_entry_beyond_its_count(wire: Wire) -> None:
    dictionary = wire.drive.dictionary
    with pytest.raises(SdoAbort, match="0x08000024"):
        dictionary.read(0x1003, 1)
    wire.drive.fail(0x4310)
    assert int.from_bytes(dictionary.read(0x1003, 1), "little") == 0x4310
    with pytest.raises(SdoAbort, match="0x08000024"):
        dictionary.read(0x1003, 2)


def test_a_changed_value_goes_out_at_the_next_sync_alone(wire: Wire) -> None:
    """Transmission type 0 (CiA 301, 7.5.2.37)."""
    wire.map_tpdo(0, 0x603F_0010)
    wire.drive.command_nmt(0x01, 10.0)
    for code, count in ((0, 1), (0, 0), (0x2310, 1), (0x2310, 0)):
        wire.drive.dictionary.set(0x603F, 0, code)
        wire.ticks(11.0, 0.01)
        assert wire.of(0x281) == [], "never by itself"
        wire.sync()
        assert wire.of(0x281) == [code.to_bytes(2, "little")] * count


@pytest.mark.parametrize(("kind", "told"), [(252, 0x1111), (253, 0x2222)])
def test_a_tpdo_that_is_asked_for(wire: Wire, kind: int, told: int) -> None:
    """252 is sampled at the SYNC, 253 when the remote frame comes; bit 30 forbids both."""
    wire.map_tpdo(kind, 0x603F_0010)
    wire.drive.command_nmt(0x01, 10.0)
    wire.drive.dictionary.set(0x603F, 0, 0x1111)
    wire.sync()
    wire.drive.dictionary.set(0x603F, 0, 0x2222)
    wire.ticks(11.0, 0.01)
    assert wire.of(0x281) == []
    wire.remote(0x281)
    assert wire.of(0x281) == [told.to_bytes(2, "little")]
    wire.write(0x1801, 1, 0xC0000281)
    wire.write(0x1801, 1, 0x40000281)
    wire.remote(0x281)
    assert wire.of(0x281) == []


@pytest.mark.parametrize("kind", [254, 255])
def test_event_timer_and_inhibit_time(wire: Wire, kind: int) -> None:
    """1800:05 and 1800:03 (CiA 301, 7.5.2.37): no later than the one, no sooner than the other."""
    wire.map_tpdo(kind, 0x603F_0010)
    with pytest.raises(SdoAbort, match="0x08000022"):
        wire.write(0x1801, 3, 200)
    wire.write(0x1801, 1, 0x80000281)
    wire.write(0x1801, 3, 200)  # 20 ms
    wire.write(0x1801, 5, 50)
    wire.write(0x1801, 1, 0x281)
    wire.drive.command_nmt(0x01, 10.0)
    wire.ticks(11.0, 0.2)
    assert len(wire.of(0x281)) == 4, "at once, then each 50 ms"
    times = []
    for millisecond in range(100):
        wire.drive.dictionary.set(0x603F, 0, millisecond)
        wire.drive.tick(12.0 + millisecond / 1000, heard_all=True)
        if wire.of(0x281):
            times.append(millisecond)
    assert times == [0, 20, 40, 60, 80]
    wire.sync()
    assert wire.of(0x281) == [], "a SYNC is nothing to it"


def test_types_that_there_are_not(wire: Wire) -> None:
    for index, kind in ((0x1800, 241), (0x1800, 251), (0x1400, 241), (0x1400, 252), (0x1400, 253)):
        with pytest.raises(SdoAbort, match="0x06090030"):
            wire.write(index, 2, kind)


def test_an_rpdo_may_map_to_nothing(wire: Wire) -> None:
    """Dummy mapping (CiA 301, 7.5.1.3): the controlword stands behind two bytes that nobody wants."""
    wire.write(0x1400, 1, 0x80000201)
    wire.write(0x1600, 0, 0)
    wire.write(0x1600, 1, 0x0006_0010)
    wire.write(0x1600, 2, 0x6040_0010)
    wire.write(0x1600, 0, 2)
    wire.write(0x1400, 1, 0x201)
    wire.drive.command_nmt(0x01, 10.0)
    wire.drive.receive_rpdo(bytes([0xFF, 0xFF, 0x06, 0x00]))
    wire.sync()
    assert wire.read(0x6040) == 0x06
    wire.write(0x1A01, 0, 0)
    with pytest.raises(SdoAbort, match="0x06040041"):
        wire.write(0x1A01, 1, 0x0006_0010)  # a TPDO has nothing to send there


def test_node_guarding(wire: Wire) -> None:
    """The toggle bit, the life time, and that heartbeats exclude it (CiA 301, 7.2.8.2.1)."""
    wire.remote(0x701)
    assert wire.of(0x701) == [], "it sends heartbeats"
    for index, value in ((0x1017, 0), (0x100C, 50), (0x100D, 2)):
        wire.write(index, 0, value)
    wire.ticks(10.0, 1.0)
    assert wire.emergencies() == [], "not guarded yet"
    for now, word in ((11.0, 0x7F), (11.09, 0xFF), (11.18, 0x7F)):
        wire.remote(0x701, now)
        assert wire.of(0x701) == [bytes([word])]
        wire.ticks(now, 0.09)
    assert wire.emergencies() == []
    wire.ticks(11.27, 0.1)
    assert wire.emergencies() == [0x8130]
    wire.drive.command_nmt(0x82, 12.0)
    wire.write(0x1017, 0, 0)
    wire.of(0x701)
    wire.remote(0x701, 12.0)
    assert wire.of(0x701) == [bytes([0x7F])], "the toggle bit begins anew"


def test_a_lost_guard_stops_an_enabled_drive(wire: Wire) -> None:
    for index, value in ((0x1017, 0), (0x100C, 50), (0x100D, 2)):
        wire.write(index, 0, value)
    wire.enable()
    wire.remote(0x701, 11.0)
    wire.ticks(11.0, 0.11)
    assert wire.drive.machine.state in (State.FAULT_REACTION_ACTIVE, State.FAULT)
    assert wire.emergencies()[-1] == 0x8130


def test_parameters_are_stored_and_restored(wire: Wire) -> None:
    """1010 and 1011 (CiA 301, 7.5.2.13 and 7.5.2.14): with their signatures, and only without torque."""
    assert wire.read(0x1010, 1) == wire.read(0x1011, 1) == 1, "on command, not by itself"
    window = wire.read(0x6065)
    with pytest.raises(SdoAbort, match="0x08000020"):
        wire.write(0x1010, 1, LOAD)
    wire.write(0x6065, 0, 777)
    wire.drive.boot(11.0)
    assert wire.read(0x6065) == window, "nothing was stored"
    wire.write(0x6065, 0, 777)
    wire.write(0x1017, 0, 250)
    wire.write(0x1010, 1, SAVE)
    assert wire.read(0x1010, 1) == 1
    wire.drive.boot(12.0)
    assert (wire.read(0x6065), wire.read(0x1017)) == (777, 250)
    wire.write(0x1011, 1, LOAD)
    assert wire.read(0x6065) == 777, "until the next reset"
    wire.drive.boot(13.0)
    assert wire.read(0x6065) == window
    wire.enable()
    with pytest.raises(SdoAbort, match="0x08000022"):
        wire.write(0x1010, 1, SAVE)


def test_a_reset_of_the_communication_leaves_the_rest(wire: Wire) -> None:
    """NMT 130 (CiA 301, 7.3.2.2.1): objects 1000h to 1FFFh, a boot-up message, pre-operational."""
    wire.write(0x6065, 0, 777)
    wire.write(0x1017, 0, 250)
    wire.map_tpdo(254, 0x603F_0010)
    wire.drive.command_nmt(0x01, 10.0)
    wire.drive.fail(0x4310)
    wire.sent.clear()
    wire.drive.command_nmt(0x82, 11.0)
    assert wire.of(0x701) == [b"\x00"] and wire.drive.nmt is Nmt.PRE_OPERATIONAL
    assert wire.read(0x6065) == 777 and wire.drive.machine.state is not State.SWITCH_ON_DISABLED
    assert wire.read(0x1017) == 100 and wire.read(0x1801, 1) >> 31 == 1
    assert wire.read(0x1003, 1) == 0x4310, "errors are no parameters"
    wire.drive.command_nmt(0x81, 12.0)
    assert wire.read(0x6065) != 777 and wire.drive.machine.state is State.SWITCH_ON_DISABLED


def test_the_history_can_be_cleared_and_nothing_else(wire: Wire) -> None:
    wire.drive.fail(0x4310)
    with pytest.raises(SdoAbort, match="0x06090030"):
        wire.write(0x1003, 0, 1)
    assert wire.read(0x1003) == 1
    wire.write(0x1003, 0, 0)
    assert wire.read(0x1003) == 0


def test_bit_13_leaves_with_operation_enabled(wire: Wire) -> None:
    """A following error is one of the mode, and the mode is none outside Operation enabled (CiA 402-2)."""
    wire.enable()
    wire.write(0x6065, 0, 10)
    wire.drive.dictionary.set(0x6066, 0, 0)
    wire.drive.observe(0, 5000, 0)
    assert wire.emergencies()[-1] == 0x8611
    assert wire.read(0x6041) & 0x0F in (0x0F, 0x08), "a fault, or its reaction"
    assert not wire.read(0x6041) & 0x2000


def test_remote_frames_come_through_a_port(new_channel: Callable[[], Channel]) -> None:
    channel = new_channel()
    with open_bus(channel, [0x701]) as bus, open_bus(channel) as other:
        port = frame_port(bus)
        for cob_id in (0x702, 0x701):
            other.send(can.Message(arbitration_id=cob_id, is_remote_frame=True, is_extended_id=False))
        port.wait(1.0)
        assert port.drain() == [(0x701 | REMOTE_FLAG, b"")]


def test_sync_counts_of_a_tpdo(wire: Wire) -> None:
    wire.map_tpdo(3, 0x603F_0010)
    wire.drive.command_nmt(0x01, 10.0)
    answered = []
    for _ in range(7):
        wire.sync()
        answered.append(len(wire.of(0x281)))
    assert answered == [0, 0, 1, 0, 0, 1, 0]
