"""Masters of another library (canopen) at our simulated drives: NMT, EMCY, and its CiA 402 profile."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import canopen
import pytest
from canopen.profiles.p402 import BaseNode402

from drivers import Channel, open_bus
from drivers.simulated.object_dictionary import EDS_PATH

NODE = 2


@pytest.fixture
def network(serve_drives: Callable[..., Channel]) -> Iterator[canopen.Network]:
    network = canopen.Network(open_bus(serve_drives()))
    network.NOTIFIER_CYCLE = 0.02
    network.connect()
    yield network
    network.sync.stop()
    network.disconnect()


def test_an_nmt_client_resets_starts_and_stops_a_node(network: canopen.Network) -> None:
    node = network.add_node(canopen.RemoteNode(NODE, str(EDS_PATH)))
    assert node.nmt.wait_for_heartbeat(5.0) == "PRE-OPERATIONAL"
    node.sdo[0x1017].raw = 20
    for command, state in (("OPERATIONAL", "OPERATIONAL"), ("STOPPED", "STOPPED"), ("PRE-OPERATIONAL",) * 2):
        node.nmt.state = command
        deadline = time.monotonic() + 5.0
        while (heard := node.nmt.wait_for_heartbeat(5.0)) != state:
            assert time.monotonic() < deadline, heard
    node.nmt.send_command(0x81)
    node.nmt.wait_for_bootup(5.0)
    assert node.sdo[0x1017].raw == 100, "its default again"


@pytest.fixture
def profile(network: canopen.Network) -> BaseNode402:
    """A drive under canopen's profile, which sends no controlword on a synchronous RPDO."""
    node = network.add_node(BaseNode402(NODE, str(EDS_PATH)))
    assert node.nmt.wait_for_heartbeat(5.0) == "PRE-OPERATIONAL"
    sdo = node.sdo
    sdo[0x1400][1].raw = 0x200 + NODE | 1 << 31
    sdo[0x1400][2].raw = 255
    sdo[0x1400][1].raw = 0x200 + NODE
    # Its default for the SYNC period of this test.
    sdo[0x60C2][1].raw, sdo[0x60C2][2].raw = 10, -3
    for other in range(1, 7):
        if other != NODE:
            peer = network.add_node(canopen.RemoteNode(other, str(EDS_PATH)))
            peer.sdo[0x60C2][1].raw, peer.sdo[0x60C2][2].raw = 10, -3
    node.setup_402_state_machine()
    network.sync.start(0.01)
    node.nmt.state = "OPERATIONAL"
    # Until the first TPDO this library takes the statusword for 0.
    deadline = time.monotonic() + 5.0
    while node.state != "SWITCH ON DISABLED":
        assert time.monotonic() < deadline, node.state
        time.sleep(0.01)
    return node


def test_the_profile_of_another_library_enables_moves_and_disables_a_drive(profile: BaseNode402) -> None:
    node = profile
    assert node.op_mode == "CYCLIC SYNCHRONOUS POSITION"
    node.rpdo[1]["Target position"].raw = start = node.sdo["Position actual value"].raw
    node.state = "OPERATION ENABLED"
    assert node.state == "OPERATION ENABLED"
    for k in range(1, 41):
        node.rpdo[1]["Target position"].raw = start + 100 * k
        node.rpdo[1].transmit()
        time.sleep(0.01)
    deadline = time.monotonic() + 5.0
    while abs(node.sdo["Position actual value"].raw - (start + 4000)) > 200:
        assert time.monotonic() < deadline
        time.sleep(0.02)
    node.state = "QUICK STOP ACTIVE"
    deadline = time.monotonic() + 5.0
    while node.state != "SWITCH ON DISABLED":
        assert time.monotonic() < deadline, node.state
        time.sleep(0.02)


@pytest.mark.slow
def test_the_profile_of_another_library_homes_a_drive(profile: BaseNode402) -> None:
    node = profile
    node.HOMING_TIMEOUT_DEFAULT = 20.0
    node.sdo["Homing method"].raw = 34
    node.sdo["Home offset"].raw = 777
    assert abs(node.sdo["Position actual value"].raw) < 10
    assert node.homing(timeout=20.0)
    # It went to the next index above and a little farther to stop: from that index it counts now.
    assert 770 < node.sdo["Position actual value"].raw < 777 + 40_000
    node.state = "SWITCH ON DISABLED"
    assert node.state == "SWITCH ON DISABLED"


def test_a_fault_is_heard_and_reset_by_the_profile_of_another_library(
    network: canopen.Network, profile: BaseNode402
) -> None:
    node = profile
    node.rpdo[1]["Target position"].raw = node.sdo["Position actual value"].raw
    node.state = "OPERATION ENABLED"
    network.sync.stop()
    error = node.emcy.wait(timeout=5.0)
    assert error is not None and error.code == 0x8250, "SYNC that stays away"
    network.sync.start(0.01)
    deadline = time.monotonic() + 5.0
    while not node.is_faulted():
        assert time.monotonic() < deadline, node.state
        time.sleep(0.02)
    # It resets the fault and, on its own accord, enables the drive again.
    node.reset_from_fault()
    assert node.state == "OPERATION ENABLED"
