"""What a foreign master meets at the simulated drives: clauses of CiA 301 that drives are caught out by."""

from __future__ import annotations

import pytest

from drivers.simulated.drive import Drive
from drivers.simulated.object_dictionary import SdoAbort
from robots import Robot


class Wire:
    """One node that has booted, and what it has sent."""

    def __init__(self, robot: Robot) -> None:
        self.sent: list[tuple[int, bytes]] = []
        self.drive = Drive(robot, 0, 1, lambda cob_id, data: self.sent.append((cob_id, data)))
        self.drive.boot(10.0)
        self.sent.clear()

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
